"""A Minari dataset (https://minari.farama.org) as a LeRobotDataset v3.0.

    python minari_dataset.py D4RL/door/human-v2 OUT --fps 100 [--task WORDS]

The dataset is one of this machine (`minari list local`; `minari download NAME` fetches it). An episode has T actions and T + 1 observations: the last
one goes into next.observation.state. Observations may be a dict of numbers, which are put side by side in the order of their names; actions are
numbers. --fps is the control rate of its environment, which Minari does not say. Needs minari[hdf5], numpy and pyarrow.
"""

import argparse

import minari
import numpy as np
from lerobot_v3 import Refused, run, write


def flat(value):
    """Rows of numbers, whatever the observations are."""
    if isinstance(value, dict):
        return np.concatenate([flat(value[key]) for key in sorted(value)], axis=1)
    if isinstance(value, (tuple, list)):
        return np.concatenate([flat(part) for part in value], axis=1)
    value = np.asarray(value)
    if not (np.issubdtype(value.dtype, np.number) or value.dtype == bool):
        raise Refused(f"observations or actions of {value.dtype}; numbers are needed")
    return value.reshape(len(value), -1).astype(np.float32)


def episodes(dataset, task):
    for episode in dataset.iterate_episodes():
        states, actions = flat(episode.observations), flat(episode.actions)
        if len(states) != len(actions) + 1:
            raise Refused(f"episode {episode.id} has {len(actions)} actions and {len(states)} observations; one more is needed")
        yield task, {
            "observation.state": states[:-1],
            "action": actions,
            "next.observation.state": states[1:],
            "next.reward": np.asarray(episode.rewards, np.float32),
            "next.done": np.asarray(episode.terminations) | np.asarray(episode.truncations),
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", help="its name in Minari")
    parser.add_argument("out")
    parser.add_argument("--fps", type=float, required=True, help="control rate of its environment [Hz], which Minari does not say")
    parser.add_argument("--task", help="in words [default: the dataset's name]")
    args = parser.parse_args()
    try:
        dataset = minari.load_dataset(args.dataset)
    except FileNotFoundError:
        raise Refused(f"there is no dataset {args.dataset} on this machine; fetch it: minari download {args.dataset}") from None
    write(args.out, episodes(dataset, args.task or args.dataset), args.fps, robot_type=None)


if __name__ == "__main__":
    run(main)
