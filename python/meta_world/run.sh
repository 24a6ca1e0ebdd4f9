#!/bin/sh
# The study of study.py, then its report. Usage: python/meta_world/run.sh HILT OUT REPORT [ARGUMENTS OF study.py]
# Needs Python 3.11 or newer (python/venv.sh). The packages (0.5 GB) go to target/meta-world, once.
set -eu
[ $# -ge 3 ] || { echo "usage: $0 HILT OUT REPORT [ARGUMENTS OF study.py]" >&2; exit 2; }
hilt=$1 out=$2 report=$3
shift 3
here=$(cd "$(dirname "$0")" && pwd)
home=$here/../../target/meta-world
"$here/../venv.sh" "$home" "$here/requirements.txt" 3.11 3.99
"$home/venv/bin/python" "$here/study.py" --hilt "$hilt" --out "$out" "$@"
"$home/venv/bin/python" "$here/report.py" "$out" --out "$report"
