#!/bin/sh
# Runs the tests under python, then reads finished runs with other people's programs, and runs their policies. Usage: tests/interop/run.sh RUNS HILT
# RUNS holds TASK/recordings, TASK/dataset, ..., and what tests/interop/policies.sh leaves; HILT is the binary.
# Needs Python 3.12 (python/venv.sh). The packages (6 GB, most of it torch) go to target/interop, once.
set -eu
[ $# -eq 2 ] || { echo "usage: $0 RUNS HILT" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
home=$here/../../target/interop python=$here/../../python
"$python/venv.sh" "$home" "$here/requirements.txt" 3.12 3.12
HILT=$2 PYTHONPATH=$python/convert:$python/hilt_gym/src "$home/venv/bin/python" -m pytest -q -rs -p no:cacheprovider "$python"
HF_HUB_OFFLINE=1 HF_HOME="$home/huggingface" "$home/venv/bin/python" "$here/run.py" "$1"
"$home/venv/bin/python" "$here/viewers.py" "$1"/*/recordings/episode-00000.mcap
"$home/venv/bin/python" "$here/policies.py" "$1" "$2"
"$home/venv/bin/python" "$here/wire.py" "$2" "$1"
"$home/venv/bin/python" "$here/openpi.py" "$2" "$1"
"$home/venv/bin/python" "$here/board.py" "$2" "$1"/pick-up/policy.training.parquet "$1"/pick-up/dynamics.pretraining.parquet
HF_HUB_OFFLINE=1 HF_HOME="$home/huggingface" exec "$home/venv/bin/python" "$here/foreign.py" "$2" "$here/../../fixtures/foreign" "$1/pick-up/dataset/train"
