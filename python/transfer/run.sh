#!/bin/sh
# A policy on DeepMind's Jaco in MuJoCo. Usage: python/transfer/run.sh HILT POLICY.safetensors STARTS.episodes.parquet OUT [EPISODES [NAME]]
# Needs Python 3.11 or newer (python/venv.sh). The packages (0.6 GB) go to target/transfer, once.
set -eu
[ $# -ge 4 ] || { echo "usage: $0 HILT POLICY.safetensors STARTS.episodes.parquet OUT [EPISODES [NAME]]" >&2; exit 2; }
hilt=$1 policy=$2 starts=$3 out=$4 episodes=${5:-500} name=${6:-policy}
here=$(cd "$(dirname "$0")" && pwd)
home=$here/../../target/transfer
"$here/../venv.sh" "$home" "$here/requirements.txt" 3.11 3.99
mkdir -p "$out"
"$hilt" export onnx "$policy" --out "$out/policy.onnx"
"$home/venv/bin/python" "$here/curves.py" run "$out/policy.onnx" --starts "$starts" \
    --robot "$here/../../pipelines/robots/jaco.toml" --episodes "$episodes" --name "$name" --out "$out/transfer.json"
"$home/venv/bin/python" "$here/curves.py" plot "$out/transfer.json" --out "$out/transfer.svg"
echo "$out/transfer.svg"
