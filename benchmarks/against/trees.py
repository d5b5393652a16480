"""Another revision's files in a temporary folder of their own, and the variables under which its programs run."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from autopoly_env.errors import ConfigError
from autopoly_env.shown import short

ROOT = Path(__file__).resolve().parents[2]
# What both would share, or what would make them differ.
_OURS = ("NUMBA_CACHE_DIR", "PYTHONDONTWRITEBYTECODE", "AUTOPOLY_THREADS", "PYTHONSTARTUP")
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def commit_of(revision: str, root: Path = ROOT) -> str:
    """The commit that a revision names, 40 hexadecimal digits. Raises ConfigError where there is none."""
    expected = "expected a commit, branch or tag of this repository, such as HEAD~1"
    try:
        found = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    except OSError:
        raise ConfigError("git is not to be found; install it: it takes the other revision's files") from None
    if found.returncode:
        is_checkout = _git(root, "rev-parse", "--git-dir").returncode == 0
        where = "" if is_checkout else f"; {root} is no checkout of it: clone the repository"
        raise ConfigError(f"revision {short(revision)} is unknown; {expected}{where}")
    return found.stdout.decode().strip()


@contextmanager
def tree_of(commit: str, root: Path = ROOT) -> Iterator[Path]:
    """The commit's files in a folder that is removed in the end, with all that was compiled there."""
    with tempfile.TemporaryDirectory(prefix="against-", ignore_cleanup_errors=True) as folder:
        tree = Path(folder).resolve() / "tree"
        tree.mkdir()
        packed = _git(root, "archive", "--format=tar", commit)
        if packed.returncode:
            raise ConfigError(f"git archive {commit[:12]}: {packed.stderr.decode(errors='replace').strip()[:200]}")
        subprocess.run([shutil.which("tar") or "tar", "-x", "-C", tree], input=packed.stdout, check=True)
        yield tree


def variables_for(tree: Path) -> Mapping[str, str]:
    """The environment in which a tree's programs run: its own modules first, its own cache of kernels beside them."""
    kept = {name: value for name, value in os.environ.items() if name not in _OURS}
    return {**kept, **dict.fromkeys(_ONE_THREAD, "1"), "PYTHONPATH": str(tree)}


def warm(tree: Path) -> None:
    """Have the tree's kernels compiled beforehand, by its own command; what has none compiles when it first calls."""
    subprocess.run(
        [sys.executable, "-m", "autopoly_env.warm"],
        cwd=tree,
        env=variables_for(tree),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    )


def _git(root: Path, *words: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(["git", *words], cwd=root, capture_output=True, check=False)
