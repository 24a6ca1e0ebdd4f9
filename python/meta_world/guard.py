"""What decides the results of a study, kept beside them: runs that were made with something else are not mixed with them."""

import hashlib
import importlib.metadata
import json
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
# Their text decides results; study.py's constants are kept by name.
FILES = ("labels.py", "world.py")
PACKAGES = ("metaworld", "mujoco")
UNKNOWN = "not_known_when_begun"


def sha256(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def built(binary):
    """Which hilt it is: its version and commit; where the commit does not say all, the hash of the file."""
    try:
        said = subprocess.run([binary, "--version"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as why:
        sys.exit(f"error: --hilt {binary} does not run: {why}; give the binary, as target/release/hilt after make build")
    lines = dict(line.partition(": ")[::2] for line in said.splitlines()[1:])
    commit = lines.get("commit")
    if commit and commit.startswith("unknown"):  # built outside of a repository
        commit = None
    found = {"hilt": " ".join(said.split("\n")[0].split()[:2]), "commit": commit}
    return found if commit and not commit.endswith("-dirty") else found | {"binary_sha256": sha256(binary)}


def made_with(binary, methods):
    """What decides the results beside the study's constants."""
    packages = {f"package {name}": importlib.metadata.version(name) for name in PACKAGES}
    return built(binary) | {"METHODS": list(methods)} | {f"sha256 {name}": sha256(HERE / name) for name in FILES} | packages


def whole(path, value):
    """Written beside its place and renamed."""
    beside = path.with_suffix(".new")
    beside.write_text(json.dumps(value) + "\n")
    os.replace(beside, path)


def same_study(out, said):
    """Refuses to go on where something is known to differ. What an older study.py did not keep is kept from now on, and marked."""
    path = out / "study.json"
    if not path.exists():
        out.mkdir(parents=True, exist_ok=True)
        whole(path, said)
        return
    try:
        before = dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError) as why:
        sys.exit(f"error: {path} cannot be read: {why}; choose another --out")
    short = lambda key, value: value[:12] if "sha256" in key else value
    known = sorted(before.keys() & said.keys())
    if odd := [f"{key} {short(key, before[key])} then, {short(key, said[key])} now" for key in known if before[key] != said[key]]:
        what = "; ".join(odd)
        sys.exit(f"error: {out} was begun with something else ({what}); go on with what it was begun with, or choose another --out")
    if new := said.keys() - before.keys():
        print(f"{out} does not say with which {', '.join(sorted(new))} it was begun: from now on it is held to what there is now", flush=True)
        whole(path, before | said | {UNKNOWN: sorted(new | set(before.get(UNKNOWN, [])))})
