"""Runs a policy of hilt with NumPy and safetensors alone; docs/run-a-policy.md explains each step.

    python run_policy.py POLICY.safetensors STATES.npy ACTIONS.npy

STATES holds a state row of the policy's layout in each row, ACTIONS gets the policy's mean action for each. Policies that have learned from a
dataset of another program (spans of `numbers` and `commands`) run too.
"""

import json
import sys

import numpy as np
from safetensors import safe_open

NEAR_M = np.float32(0.015)  # range of the near features [m]


def sin_cos(angle):
    """As hilt computes them: NumPy's differ by 2e-7, of which a network may make 2e-4 rad/s."""
    turns = np.round(angle * np.float32(2 / np.pi))
    rest = (angle - turns * np.float32(1.5703125)) - turns * np.float32(4.838268e-4)
    square = rest * rest
    sin, cos = square / np.float32(362880), square / np.float32(40320)
    for of_sin, of_cos in np.float32([(-1 / 5040, -1 / 720), (1 / 120, 1 / 24), (-1 / 6, -1 / 2)]):
        sin, cos = square * (sin + of_sin), square * (cos + of_cos)
    sin, cos, quarter = rest * (sin + np.float32(1)), cos + np.float32(1), turns.astype(int) % 4
    return np.choose(quarter, [sin, cos, -sin, -cos]), np.choose(quarter, [cos, -sin, -cos, sin])


def turned(columns, vector):
    """R v for a batch of rotations, given by their three columns."""
    return sum(column * np.float32(part) for column, part in zip(columns, vector))


class Policy:
    def __init__(self, path):
        with safe_open(path, framework="np") as file:
            header = json.loads(file.metadata()["hilt"])
            self.tensors = {name.removeprefix("policy."): file.get_tensor(name) for name in file.keys()}
        if header["kind"] != "policy":
            sys.exit(f"{path} holds weights of a {header['kind']}, a policy is needed")
        self.meta, self.layout = header["meta"], header["meta"]["layout"]
        self.entries = [entry for span in self.layout["state"] for entry in span["entries"]]
        self.kept = [i for i, entry in enumerate(self.entries) if entry in self.meta["inputs"]]
        first = {span["name"]: self.entries.index(span["entries"][0]) for span in self.layout["state"]}
        self.position = {name: slice(at, at + 3) for name, at in first.items()}

    def hand(self, states):
        """Tool point and the columns of the hand's rotation, in the world."""
        point, columns = np.float32(0), [np.tile(axis, (len(states), 1)) for axis in np.eye(3, dtype=np.float32)]
        for i, frame in enumerate(self.layout["arm"]["joints"]):
            point = point + turned(columns, frame["origin_m"])
            x, y, z = (turned(columns, column) for column in frame["columns"])
            sin, cos = sin_cos(states[:, [i]])
            columns = [x * cos + y * sin, y * cos - x * sin, z]
        return point + turned(columns, self.layout["arm"]["tool_m"]), columns

    def inputs(self, states):
        t, at = self.tensors, lambda name: states[:, self.position[name]]
        seen = [(states[:, self.kept] - t["state.mean"][self.kept]) / t["state.std"][self.kept]]
        if self.meta["features"] != "raw":
            tool, columns = self.hand(states)
            from_tool = [at(span["name"]) - tool for span in self.layout["state"] if span["holds"] == "pose"]
            ways = [np.stack([np.sum(column * v, axis=1) for column in columns], axis=1) for v in from_tool]
            ways += [at(aim["target"]) + np.float32(aim["offset_m"]) - at(aim["object"]) for aim in self.layout["aims"]]
            seen.append((np.hstack([tool, *columns[:2], *ways]) - t["derived.mean"]) / t["derived.std"])
            if self.meta["features"] == "fk-near":
                seen.append(np.tanh(np.hstack(ways) / NEAR_M))
        return np.hstack(seen)

    def act(self, states):
        """The mean action for each state row, in the layout's units."""
        t, x, hidden = self.tensors, self.inputs(np.asarray(states, np.float32)), len(self.meta["hidden"])
        activation = np.tanh if self.meta["activation"] == "tanh" else lambda v: np.maximum(v, 0)
        for i in range(1, hidden + 2):
            x = x @ t[f"layer_{i}.weight"] + t[f"layer_{i}.bias"]
            x = activation(x) if i <= hidden else x
        return t["action.mean"] + t["action.std"] * x


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    np.save(sys.argv[3], Policy(sys.argv[1]).act(np.load(sys.argv[2])))
