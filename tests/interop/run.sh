#!/bin/sh
# Reads finished runs with other people's programs, and runs their policies. Usage: tests/interop/run.sh RUNS HILT
# RUNS holds TASK/recordings, TASK/dataset, ..., and what tests/interop/policies.sh leaves; HILT is the binary.
# PYTHON names a Python 3.12; without it python3.12 on the PATH, then pyenv's. The packages (6 GB, most of it torch) go to
# target/interop, once.
set -eu
[ $# -eq 2 ] || { echo "usage: $0 RUNS HILT" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
home=$here/../../target/interop

is_3_12() {
    [ "$("$1" -c 'import sys, venv, ensurepip; print("%d.%d" % sys.version_info[:2])' 2> /dev/null)" = 3.12 ]
}
python=
for candidate in ${PYTHON:+"$PYTHON"} python3.12 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.12*/bin/python3.12 python3; do
    if is_3_12 "$candidate"; then python=$candidate; break; fi
done
[ -n "$python" ] || { echo "Python 3.12 with venv is missing: install it (apt install python3.12-venv, pyenv install 3.12) or set PYTHON" >&2; exit 2; }

mkdir -p "$home"
if ! cmp -s "$here/requirements.txt" "$home/installed.txt"; then
    echo "installing the readers into $home (once)"
    "$python" -m venv --clear "$home/venv"
    "$home/venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$here/requirements.txt"
    cp "$here/requirements.txt" "$home/installed.txt"
fi
HF_HUB_OFFLINE=1 HF_HOME="$home/huggingface" "$home/venv/bin/python" "$here/run.py" "$1"
"$home/venv/bin/python" "$here/policies.py" "$1" "$2"
"$home/venv/bin/python" "$here/wire.py" "$2" "$1"
"$home/venv/bin/python" "$here/board.py" "$2" "$1"/pick-up/policy.training.parquet "$1"/pick-up/dynamics.pretraining.parquet
HF_HUB_OFFLINE=1 HF_HOME="$home/huggingface" exec "$home/venv/bin/python" "$here/foreign.py" "$2" "$here/../../fixtures/foreign" "$1/pick-up/dataset/train"
