#!/bin/sh
# A policy on DeepMind's Jaco in MuJoCo. Usage: python/transfer/run.sh HILT POLICY.safetensors STARTS.episodes.parquet OUT [EPISODES [NAME]]
# PYTHON names a Python 3.11 or newer. The packages (0.6 GB) go to target/transfer, once.
set -eu
[ $# -ge 4 ] || { echo "usage: $0 HILT POLICY.safetensors STARTS.episodes.parquet OUT [EPISODES [NAME]]" >&2; exit 2; }
hilt=$1 policy=$2 starts=$3 out=$4 episodes=${5:-500} name=${6:-policy}
here=$(cd "$(dirname "$0")" && pwd)
home=$here/../../target/transfer

is_new() {
    "$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2> /dev/null
}
python=
for candidate in ${PYTHON:+"$PYTHON"} python3 python3.13 python3.12 python3.11 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.1[1-9]*/bin/python3; do
    if is_new "$candidate"; then python=$candidate; break; fi
done
[ -n "$python" ] || { echo "Python 3.11 or newer with venv is missing: install it (apt install python3-venv, pyenv install 3.12) or set PYTHON" >&2; exit 2; }

mkdir -p "$home"
if ! cmp -s "$here/requirements.txt" "$home/installed.txt"; then
    echo "installing MuJoCo and dm_control into $home (once)"
    "$python" -m venv --clear "$home/venv"
    "$home/venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$here/requirements.txt"
    cp "$here/requirements.txt" "$home/installed.txt"
fi
mkdir -p "$out"
"$hilt" export onnx "$policy" --out "$out/policy.onnx"
"$home/venv/bin/python" "$here/curves.py" run "$out/policy.onnx" --starts "$starts" \
    --robot "$here/../../pipelines/robots/jaco.toml" --episodes "$episodes" --name "$name" --out "$out/transfer.json"
"$home/venv/bin/python" "$here/curves.py" plot "$out/transfer.json" --out "$out/transfer.svg"
echo "$out/transfer.svg"
