#!/usr/bin/env bash
# Ray 2.60.0: once `ray.init()` has run in a home, `ray start --head` there starts a head that refuses its own home.
#
# Input: a fresh home; `ray.init("local")` and its shutdown; `ray start --head`; `ray.init(address)`, all without options
# about tokens.
# Guess: the head serves whoever has the same home, as it does where `ray.init()` never ran.
# Seen: `ray.init()` leaves ~/.ray/auth_token behind, the head then asks for a token, and the client sends none
# (InvalidAuthToken; its mode is 'disabled'), retries for 20 seconds and says "Failed to connect to Ray cluster". With
# RAY_AUTH_MODE=token on both sides it connects.
set -euo pipefail

folder=$(mktemp -d)
trap 'kill -9 $(pgrep -f "$folder") 2>/dev/null || true; rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check ray==2.60.0
export HOME="$folder" RAY_USAGE_STATS_ENABLED=0
unset RAY_AUTH_MODE RAY_AUTH_TOKEN RAY_ADDRESS
cat > client.py <<'PYTHON'
import sys

import ray

try:
    ray.init(sys.argv[1], num_cpus=1 if sys.argv[1] == "local" else None, include_dashboard=False if sys.argv[1] == "local" else None, logging_level="ERROR")
except ConnectionError:
    print("refused")
else:
    print("connected")
PYTHON
venv/bin/python client.py local >/dev/null 2>&1
mode() { # the mode of head and client, if any -> what the client says
    env ${1:+RAY_AUTH_MODE=$1} venv/bin/ray start --head --port="$2" --num-cpus=1 --include-dashboard=false --temp-dir="$folder/r$2" >/dev/null 2>&1
    env ${1:+RAY_AUTH_MODE=$1} venv/bin/python client.py "127.0.0.1:$2" 2>client.log
}
plain=$(mode "" 6397)
reason=$(grep -o InvalidAuthToken client.log | head -1 || true)
token=$(mode token 6398)
echo "after ray.init(): token left: $(test -f .ray/auth_token && echo yes); plain head: $plain ($reason); RAY_AUTH_MODE=token: $token"
[ "$plain $reason $token" = "refused InvalidAuthToken connected" ]
