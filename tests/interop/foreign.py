"""Datasets that `hilt dataset` writes, opened by LeRobot: from those of other programs (fixtures/foreign) and from hilt's own.

Usage: foreign.py HILT FIXTURES OWN, where OWN is a dataset of hilt (a root). Exits 1 at the first thing that is not as promised.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

HILT, FIXTURES, OWN = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def hilt(*words):
    done = subprocess.run([HILT, *map(str, words)], capture_output=True, text=True)
    check(done.returncode == 0, f"hilt {' '.join(map(str, words))}: {done.stderr}")


def opened(root, episodes):
    """Opens it as LeRobot does, reads every frame, and checks statistics against the numbers."""
    dataset = LeRobotDataset(f"local/{root.name}", root=root)
    check(dataset.num_episodes == episodes, f"{root}: {dataset.num_episodes} episodes, expected {episodes}")
    actions = np.stack([dataset[i]["action"].numpy().reshape(-1) for i in range(len(dataset))])
    stats = json.loads((root / "meta/stats.json").read_text())["action"]
    for name, found in [("min", actions.min(0)), ("max", actions.max(0)), ("mean", actions.mean(0)), ("std", actions.std(0))]:
        check(np.allclose(stats[name], found, atol=1e-4), f"{root}: {name} of action {stats[name]}, LeRobot reads {found}")
    check(all(dataset[i]["task"] for i in (0, len(dataset) - 1)), f"{root}: tasks")
    hilt("dataset", "validate", root)
    return dataset


def main():
    with tempfile.TemporaryDirectory() as made:
        made = Path(made)
        point = FIXTURES / "lerobot"
        hilt("dataset", "drop", point, "--columns", "observation.images.top", "--out", made / "numbers")
        numbers = opened(made / "numbers", 12)
        theirs = LeRobotDataset("local/point", root=point)
        same = all(np.array_equal(numbers[i]["observation.state"], theirs[i]["observation.state"]) for i in range(len(theirs)))
        check(same, "the numbers are not those of the dataset that they come from")
        hilt("dataset", "filter", made / "numbers", "--episodes", "0-3,7", "--out", made / "some")
        opened(made / "some", 5)
        hilt("dataset", "filter", made / "numbers", "--episodes", "4", "--out", made / "one")
        hilt("dataset", "merge", made / "some", made / "one", "--out", made / "merged")
        opened(made / "merged", 6)
        hilt("dataset", "split", made / "merged", "--ratio", 2, "--out", made / "split")
        check(len(opened(made / "split/train", 4)) + len(opened(made / "split/validation", 2)) == len(LeRobotDataset("local/m", root=made / "merged")), "split")
        hilt("dataset", "filter", OWN, "--min-length", 1, "--out", made / "own")
        opened(made / "own", LeRobotDataset("local/own", root=OWN).num_episodes)
        hilt("dataset", "drop", FIXTURES / "edited", "--episodes", "0", "--out", made / "edited")
        opened(made / "edited", 3)
        # pandas' fps is 2.5, which LeRobot takes for a number all the same; its rows come back as float32.
        hilt("dataset", "convert", FIXTURES / "pandas", "--out", made / "pandas")
        info = json.loads((made / "pandas/meta/info.json").read_text())
        check(info["features"]["action"]["dtype"] == "float32", "convert to float32")
    print("foreign: LeRobot reads what hilt dataset writes")


if __name__ == "__main__":
    main()
