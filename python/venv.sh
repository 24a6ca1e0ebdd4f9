#!/bin/sh
# A virtual environment in DIR/venv with what REQUIREMENTS names, made once. Usage: python/venv.sh DIR REQUIREMENTS LEAST MOST
# LEAST and MOST are versions of Python, as 3.11. PYTHON names one to take; without it those on the PATH, then pyenv's.
set -eu
[ $# -eq 4 ] || { echo "usage: $0 DIR REQUIREMENTS LEAST MOST" >&2; exit 2; }
home=$1 requirements=$2 least=$3 most=$4

fits() {
    "$1" - "$least" "$most" 2> /dev/null <<'END'
import ensurepip, sys, venv
version = lambda text: tuple(map(int, text.split(".")))
sys.exit(not version(sys.argv[1]) <= sys.version_info[:2] <= version(sys.argv[2]))
END
}
mkdir -p "$home"
if cmp -s "$requirements" "$home/installed.txt"; then exit 0; fi
python=
for candidate in ${PYTHON:+"$PYTHON"} python3 python3.13 python3.12 python3.11 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.1[1-9]*/bin/python3; do
    if fits "$candidate"; then python=$candidate; break; fi
done
[ -n "$python" ] || {
    echo "Python $least to $most with venv is missing: install it (apt install python3-venv, pyenv install $least) or set PYTHON" >&2
    exit 2
}
echo "installing what $requirements names into $home (once)"
rm -f "$home/installed.txt"
"$python" -m venv --clear "$home/venv"
"$home/venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$requirements"
cp "$requirements" "$home/installed.txt"
