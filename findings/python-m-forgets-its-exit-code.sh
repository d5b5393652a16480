#!/usr/bin/env bash
# CPython 3.11 to 3.13: `python -m` ends by SIGINT, whatever the exit code, where a KeyboardInterrupt came up in exec(text).
#
# Input: a module that catches the KeyboardInterrupt of one SIGINT, goes on, and ends with sys.exit(7). The signal comes
# while exec() runs a text, as it does within @dataclass and namedtuple, so at any time that modules are imported.
# Guess: the exception was caught, so exit code 7, as a file (`python module.py`) and as a module (`python -m module`).
# Seen: 7 as a file; as a module the process prints all that it has to, and then kills itself by SIGINT (-2 in subprocess).
# The flag `unhandled_keyboard_interrupt`, set when exec of a text ends by KeyboardInterrupt, is never taken back. With
# exec() of compiled code the exit code is 7.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat > caught.py <<'PYTHON'
import os
import signal
import sys

text = "os.kill(os.getpid(), signal.SIGINT)\nfor _ in range(10**6): pass"
try:
    exec(compile(text, "text", "exec") if sys.argv[1:] == ["compiled"] else text)
except KeyboardInterrupt:
    print("caught", flush=True)
sys.exit(7)
PYTHON
python3 - <<'PYTHON'
import platform
import subprocess
import sys

ways = {"file": ["caught.py"], "module": ["-m", "caught"], "module, compiled": ["-m", "caught", "compiled"]}
seen = {}
for way, words in ways.items():
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True)
    seen[way] = done.stdout, done.returncode
    print(f"Python {platform.python_version()}, as a {way}: said {done.stdout!r}, exit code {done.returncode}")
sys.exit(seen != {"file": ("caught\n", 7), "module": ("caught\n", -2), "module, compiled": ("caught\n", 7)})
PYTHON
