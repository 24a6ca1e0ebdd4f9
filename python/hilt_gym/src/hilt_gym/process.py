"""A `hilt` that runs as long as this program needs it."""

import os
import shutil
import subprocess


def find_hilt(binary=None):
    """The binary: the given one, that of the variable HILT, or the one on the PATH."""
    for candidate in (binary, os.environ.get("HILT"), shutil.which("hilt")):
        if candidate:
            return os.fspath(candidate)
    raise FileNotFoundError("no hilt on the PATH; give its path as binary=..., or in the variable HILT")


class HiltProcess:
    """`hilt ARGUMENTS` that listens on a free port; ``address`` says where. It ends with this program, whatever happens to it."""

    def __init__(self, *arguments, binary=None):
        command = [find_hilt(binary), *arguments, "--port", "0", "--end-with-stdin"]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.address = self._process.stdout.readline().strip()
        if not self.address:
            code = self._process.wait()
            self.close()
            raise RuntimeError(f"{' '.join(command)} has ended with exit code {code}; its words are on stderr")

    def close(self, patience=10.0):
        """Ends the process and waits for it."""
        process = self._process
        if process.stdin and not process.stdin.closed:
            process.stdin.close()
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
