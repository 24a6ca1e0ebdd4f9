#!/bin/sh
# Reads a finished run with other people's programs. Usage: tests/interop/run.sh RUNS   (RUNS holds TASK/recordings, TASK/dataset, ...)
# PYTHON names a Python 3.12 (default: python3.12). The packages (1 to 2 GB with torch) go to target/interop, once.
set -eu
[ $# -eq 1 ] || { echo "usage: $0 RUNS" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
home=$here/../../target/interop
python=${PYTHON:-python3.12}
command -v "$python" > /dev/null || { echo "$python not found; set PYTHON to a Python 3.12" >&2; exit 2; }
mkdir -p "$home"
if ! cmp -s "$here/requirements.txt" "$home/installed.txt"; then
    "$python" -m venv "$home/venv"
    "$home/venv/bin/pip" install --quiet --requirement "$here/requirements.txt"
    cp "$here/requirements.txt" "$home/installed.txt"
fi
HF_HUB_OFFLINE=1 HF_HOME="$home/huggingface" exec "$home/venv/bin/python" "$here/run.py" "$1"
