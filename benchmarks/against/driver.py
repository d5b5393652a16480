"""Run by path in a process of a revision's own: loads a probe and measures once for every line that it is sent.

`python -P driver.py PROBE SETTINGS`, the settings as JSON. Each answer is a line of JSON: numbers by name, or
`{"error": ...}`. Nothing of `benchmarks` is imported, for that would be this revision's.
"""

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any


def answer(values: dict[str, Any], to: Any) -> None:
    to.write(json.dumps(values) + "\n")
    to.flush()


def main() -> None:
    answers, sys.stdout = sys.stdout, sys.stderr  # whatever the project prints is no answer
    try:
        import autopoly_env

        where = Path(autopoly_env.__file__).resolve().parents[1]
        if where != Path.cwd().resolve():
            raise RuntimeError(f"autopoly_env was imported from {where}: expected it from {Path.cwd()}")
        spec = importlib.util.spec_from_file_location("probe", sys.argv[1])
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        probe = module.Probe(json.loads(sys.argv[2]))
        answer({}, answers)
        for line in sys.stdin:
            answer(probe.measure(int(line)), answers)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        text = " ".join(str(error).split())
        answer({"error": f"{type(error).__name__}: {text}"[:200]}, answers)


if __name__ == "__main__":
    main()
