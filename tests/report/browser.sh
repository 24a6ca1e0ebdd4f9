#!/bin/sh
# Opens a report in headless Chromium. Usage: tests/report/browser.sh DIR   (a directory that hilt report has written)
# PYTHON names a Python 3.10 or newer; without it python3. Playwright goes to target/report, once. Chromium is that of the machine; where there is
# none, Playwright's own is downloaded, or root installs it by apt-get. The screenshots go to target/report.
set -eu
[ $# -eq 1 ] || { echo "usage: $0 DIR" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$here/../../target/report"
home=$(cd "$here/../../target/report" && pwd)
python=${PYTHON:-python3}

if ! [ -x "$home/venv/bin/playwright" ]; then
    echo "installing playwright into $home (once)"
    "$python" -m venv --clear "$home/venv"
    "$home/venv/bin/pip" install --quiet --disable-pip-version-check 'playwright>=1.49'
fi
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$chromium" ] && ! "$home/venv/bin/playwright" install chromium > "$home/chromium.log" 2>&1; then
    { [ "$(id -u)" = 0 ] && apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends chromium; } \
        >> "$home/chromium.log" 2>&1 || { echo "chromium is missing and could not be installed: $home/chromium.log" >&2; exit 2; }
    chromium=$(command -v chromium)
fi
CHROMIUM=$chromium exec "$home/venv/bin/python" "$here/browser.py" "$1" "$home"
