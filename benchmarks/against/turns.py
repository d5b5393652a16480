"""Two revisions that take turns: a process of each, which measures when it is told to."""

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from benchmarks.against.trees import variables_for

HERE = Path(__file__).resolve().parent
Numbers = dict[str, float]
Pair = tuple[Numbers, Numbers]  # of the other revision, of this one; what one of them cannot measure is missing


class Refused(Exception):  # noqa: N818 (it is an answer, and no fault of ours)
    """A revision cannot measure this; the text says why in one line."""


class Player:
    """A probe that waits in a process of one revision."""

    def __init__(self, tree: Path, probe: str, settings: Mapping[str, Any]) -> None:
        """Returns once the probe is ready; raises Refused where it is not to be had."""
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(HERE / "driver.py"), str(HERE / "probes" / f"{probe}.py"), json.dumps(settings)],
            cwd=tree,
            env=variables_for(tree),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        try:
            self._answer()
        except BaseException:
            self.close()
            raise

    def measure(self, turn: int) -> Numbers:
        """What the probe measures in this turn. Raises Refused."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{turn}\n")
            self._process.stdin.flush()
        except OSError:
            raise Refused("the process has ended") from None
        return self._answer()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    def _answer(self) -> Numbers:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise Refused("the process has ended")
        values: dict[str, Any] = json.loads(line)
        if "error" in values:
            raise Refused(values["error"])
        return values


@contextmanager
def player(tree: Path, probe: str, settings: Mapping[str, Any]) -> Iterator[Player]:
    """A player that is closed in the end."""
    one = Player(tree, probe, settings)
    try:
        yield one
    finally:
        one.close()


def take_turns(
    trees: Sequence[Path], probe: str, settings: Sequence[Mapping[str, Any]], rounds: int, *, afresh: bool = False
) -> Iterator[tuple[Pair, tuple[str, str]]]:
    """What both trees measure in each round, and why one of them cannot; which comes first changes with the round.

    `afresh`: each measurement in a process of its own.
    """
    with ExitStack() as stack:
        players: list[Player | None] = [None, None]
        why = ["", ""]
        for k in () if afresh else (0, 1):
            try:
                players[k] = stack.enter_context(player(trees[k], probe, settings[k]))
            except Refused as reason:
                why[k] = str(reason)
        for turn in range(rounds):
            found: list[Numbers] = [{}, {}]
            for k in (0, 1) if turn % 2 == 0 else (1, 0):
                if why[k]:
                    continue
                try:
                    one = players[k]
                    found[k] = _afresh(trees[k], probe, settings[k], turn) if one is None else one.measure(turn)
                except Refused as reason:
                    why[k] = str(reason)
            yield (found[0], found[1]), (why[0], why[1])
            if all(why):
                return


def _afresh(tree: Path, probe: str, settings: Mapping[str, Any], turn: int) -> Numbers:
    with player(tree, probe, settings) as one:
        return one.measure(turn)
