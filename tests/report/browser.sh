#!/bin/sh
# Opens a page in headless Chromium. Usage: tests/report/browser.sh DIR   (a directory that hilt report has written)
#                                       tests/report/browser.sh PAGE RECORDING...   (a page of hilt view, and what it shows)
# PYTHON names a Python 3.10 or newer; without it python3. Playwright goes to target/report, once. Chromium is that of the machine; where there is
# none, Playwright's own is downloaded, or root installs it by apt-get. The screenshots go to target/report.
set -eu
[ $# -ge 1 ] || { echo "usage: $0 DIR | PAGE RECORDING..." >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$here/../../target/report"
home=$(cd "$here/../../target/report" && pwd)
python=${PYTHON:-python3}

if ! [ -x "$home/venv/bin/playwright" ] || ! "$home/venv/bin/python" -c 'import mcap_protobuf' 2> "$home/venv.log"; then
    echo "installing playwright and mcap into $home (once)"
    "$python" -m venv --clear "$home/venv"
    "$home/venv/bin/pip" install --quiet --disable-pip-version-check 'playwright>=1.49' 'mcap-protobuf-support>=0.5'
fi
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$chromium" ] && ! "$home/venv/bin/playwright" install chromium > "$home/chromium.log" 2>&1; then
    { [ "$(id -u)" = 0 ] && apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends chromium; } \
        >> "$home/chromium.log" 2>&1 || { echo "chromium is missing and could not be installed: $home/chromium.log" >&2; exit 2; }
    chromium=$(command -v chromium)
fi
page=$1
shift
[ -d "$page" ] && script=browser.py || script=viewer.py
CHROMIUM=$chromium exec "$home/venv/bin/python" "$here/$script" "$page" "$home" "$@"
