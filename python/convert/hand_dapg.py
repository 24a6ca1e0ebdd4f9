"""The demonstrations of hand_dapg (https://github.com/aravindr93/hand_dapg, dapg/demonstrations/*.pickle) as a LeRobotDataset v3.0.

    python hand_dapg.py door-v0_demos.pickle OUT [--fps 100] [--task "open the door"]

A pickle can run any program when it is read. This one reads numpy arrays, numbers, texts, lists and dicts, and refuses everything else by
its name. State: the observations of the environment; action: its normalised actions. Needs numpy and pyarrow.
"""

import argparse
import pickle

import numpy as np
from lerobot_v3 import Refused, run, write
from numpy._core.multiarray import _reconstruct

# All that the files need.
ALLOWED = {
    ("numpy", "dtype"): np.dtype,
    ("numpy", "ndarray"): np.ndarray,
    ("numpy.core.multiarray", "_reconstruct"): _reconstruct,
    ("numpy._core.multiarray", "_reconstruct"): _reconstruct,
}


class Arrays(pickle.Unpickler):
    """Reads arrays and plain data only."""

    def find_class(self, module, name):
        if (module, name) not in ALLOWED:
            raise Refused(f"the file asks for {module}.{name}, and numpy arrays are all that is read")
        return ALLOWED[module, name]


def episodes(path, task):
    with open(path, "rb") as file:
        try:
            demos = Arrays(file).load()
        except Refused:
            raise
        except Exception as why:  # a damaged pickle fails in any way
            raise Refused(f"{path} cannot be read as a pickle of demonstrations: {why}") from None
    if not isinstance(demos, list) or not all(isinstance(demo, dict) for demo in demos):
        raise Refused(f"{path} holds no list of demonstrations")
    for number, demo in enumerate(demos):
        missing = [key for key in ("observations", "actions") if key not in demo]
        if missing:
            raise Refused(f"demonstration {number} has no {missing[0]}; it has {', '.join(map(str, demo))}")
        columns = {"observation.state": demo["observations"], "action": demo["actions"]}
        if "rewards" in demo:
            columns["next.reward"] = np.asarray(demo["rewards"], np.float32)
        yield task, columns


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pickle")
    parser.add_argument("out")
    parser.add_argument("--fps", type=float, default=100, help="control rate of the environments [Hz] (5 steps of 2 ms)")
    parser.add_argument("--task", default="open the door")
    args = parser.parse_args()
    write(args.out, episodes(args.pickle, args.task), args.fps, robot_type="adroit")


if __name__ == "__main__":
    run(main)
