"""Demonstrations of robomimic (https://robomimic.github.io, *.hdf5) as a LeRobotDataset v3.0.

    python robomimic_hdf5.py low_dim.hdf5 OUT [--fps 20] [--observations robot0_eef_pos,robot0_eef_quat,...] [--task WORDS]

The file has data/demo_N with actions, obs/NAME, rewards and dones. State: the observations that are named, in that order, or all of one number
list a row (pictures are left out), by name; action: actions. Needs h5py, numpy and pyarrow.
"""

import argparse
import json

import h5py
import numpy as np
from lerobot_v3 import Refused, run, write


def number_of(name):
    digits = name.rpartition("_")[2]
    return (0, int(digits), name) if digits.isdigit() else (1, 0, name)


def chosen(demo, wanted):
    """Names of the observations that make a state."""
    there = demo.get("obs", {})
    if wanted:
        missing = [name for name in wanted if name not in there]
        if missing:
            raise Refused(f"{demo.name} has no observation {missing[0]}; it has {', '.join(there)}")
        return wanted
    return [name for name, values in there.items() if getattr(values, "ndim", 0) <= 2 and np.issubdtype(values.dtype, np.number)]


def entries(demo, names):
    for name in names:
        width = int(np.prod(demo["obs"][name].shape[1:], dtype=int))
        yield from [name] if width == 1 else (f"{name}.{i}" for i in range(width))


def episodes(file, names, task):
    for key in sorted(file["data"], key=number_of):
        demo = file["data"][key]
        parts = [np.asarray(demo["obs"][name]) for name in chosen(demo, names)]
        columns = {"observation.state": np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1).astype(np.float32)}
        columns["action"] = np.asarray(demo["actions"], np.float32)
        if "rewards" in demo:
            columns["next.reward"] = np.asarray(demo["rewards"], np.float32)
        if "dones" in demo:
            columns["next.done"] = np.asarray(demo["dones"]).astype(bool)
        yield task, columns


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("hdf5")
    parser.add_argument("out")
    parser.add_argument("--fps", type=float, help="control rate [Hz] [default: the file's own control_freq, or 20]")
    parser.add_argument("--observations", type=lambda text: text.split(","), default=[])
    parser.add_argument("--task", help="in words [default: the name of the file's environment]")
    args = parser.parse_args()
    with h5py.File(args.hdf5) as file:
        if "data" not in file or not len(file["data"]):
            raise Refused(f"{args.hdf5} has no demonstrations below data/")
        first = file["data"][min(file["data"], key=number_of)]
        if "actions" not in first or not chosen(first, args.observations):
            raise Refused(f"{first.name} has no actions, or no observations of numbers; it has {', '.join(first)}")
        made_in = json.loads(file["data"].attrs.get("env_args", "{}"))
        fps = args.fps or made_in.get("env_kwargs", {}).get("control_freq", 20)
        task = args.task or made_in.get("env_name") or "demonstration"
        names = {"observation.state": list(entries(first, chosen(first, args.observations)))}
        write(args.out, episodes(file, args.observations, task), fps, robot_type="robomimic", names=names)


if __name__ == "__main__":
    run(main)
