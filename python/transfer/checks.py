"""What jaco_mujoco.py and curves.py are given: read here, and refused in one line where it is not what they can run."""

import argparse
import json
import tomllib
from pathlib import Path

import onnxruntime
import pyarrow as pa
import pyarrow.parquet as pq

JOINTS = [*(f"joint_{i}" for i in range(1, 7)), *(f"finger_{i}" for i in range(1, 4))]
POINT = ["x_m", "y_m", "z_m"]
POSE = [*POINT, "qx", "qy", "qz", "qw"]
# By task: the entries of a state behind joints and block, and what of a start is needed.
TASKS = {
    "pick-up": ([], ["block.x_m", "block.y_m"]),
    "pick-and-place": ([f"goal.{entry}" for entry in POINT], ["block.x_m", "block.y_m", "goal.x_m", "goal.y_m"]),
    "stack": ([f"base.{entry}" for entry in POSE], ["block.x_m", "block.y_m", "base.x_m", "base.y_m"]),
}


def refuse(path, why):
    raise SystemExit(f"error: {path}: {why}")


def read_policy(path):
    """The metadata of a policy (ONNX) that acts on a Jaco in one of the tasks."""
    try:
        about = onnxruntime.InferenceSession(path).get_modelmeta().custom_metadata_map
    except Exception as why:  # onnxruntime has an exception for each way of being no model
        words = " ".join(str(why).split())
        refuse(path, f"cannot be read as ONNX: {words}; hilt export onnx POLICY.safetensors --out policy.onnx makes it")
    if missing := [key for key in ("hilt", "task", "horizon_steps", "state_entries", "action_entries") if key not in about]:
        refuse(path, f"is no policy of hilt's: its metadata has no {missing[0]}; export one with hilt export onnx")
    check_policy(path, about)
    return about


def check_policy(path, about):
    """Refuses a policy of another task or of another robot: nine joints has the Panda too."""
    if about["task"] not in TASKS:
        refuse(path, f"is a policy of task {about['task']}; this world has {', '.join(TASKS)}")
    robot = json.loads(about["hilt"])["settings"].get("robot", {}).get("name", "jaco")  # left out, it is the Jaco
    if robot != "jaco":
        refuse(path, f"is a policy of robot {robot}; this world has a jaco: give a policy that was trained on it")
    block = [f"block.{entry}" for entry in POSE]
    state = [*(f"{joint}.q_rad" for joint in JOINTS), *(f"{joint}.dq_rad_s" for joint in JOINTS), *block, *TASKS[about["task"]][0]]
    for row, known in (("state", state), ("action", [f"{joint}.velocity_rad_s" for joint in JOINTS])):
        entries = json.loads(about[f"{row}_entries"])
        if odd := [pair for pair in zip(entries, known) if pair[0] != pair[1]]:
            refuse(path, f"has {odd[0][0]} in its {row} where this world has {odd[0][1]}: give a policy of the task and the robot of hilt")
        if len(entries) != len(known):
            refuse(path, f"has {len(entries)} entries in its {row}, this world has {len(known)}: give a policy of the task and the robot of hilt")


def read_starts(path, task):
    """A dict for each episode of an evaluation in the task."""
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as why:
        refuse(path, f"cannot be read: {why}; NAME.episodes.parquet of hilt evaluate --out NAME.json is needed")
    of = json.loads((table.schema.metadata or {}).get(b"hilt", b"{}")).get("task", task)
    if of != task:
        refuse(path, f"has starts of task {of}, the policy is of {task}: give those of an evaluation in {task}")
    if missing := [name for name in TASKS[task][1] if name not in table.column_names]:
        refuse(path, f"has no column {missing[0]}, which starts of {task} have; NAME.episodes.parquet of hilt evaluate is needed")
    if not table.num_rows:
        refuse(path, "has no episode; at least 1 is needed")
    return table.to_pylist()


def read_ready(path):
    """The pose of the nine joints in which episodes begin."""
    try:
        robot = tomllib.loads(Path(path).read_text())
        ready, opened = [[float(angle) for angle in angles] for angles in (robot["ready"], robot["hand"]["opened"])]
    except (OSError, ValueError, TypeError, KeyError) as why:
        refuse(path, f"cannot be read as a robot: {why!r}; pipelines/robots/jaco.toml is needed")
    if (len(ready), len(opened)) != (6, 3):
        refuse(path, f"is a robot of {len(ready)} arm joints and {len(opened)} fingers; pipelines/robots/jaco.toml, with 6 and 3, is needed")
    return ready + opened


def read_condition(texts, known):
    """What KEY=VALUE says: a number, or [low, high] to draw from."""
    condition = {}
    for text in texts:
        key, _, value = text.partition("=")
        if key not in known:
            refuse("--set", f"there is no {key}; there are {', '.join(known)}")
        try:
            condition[key] = json.loads(value)
        except ValueError:
            condition[key] = None
        numbers = condition[key] if isinstance(condition[key], list) else [condition[key]] * 2
        if not all(type(number) in (int, float) for number in numbers) or len(numbers) != 2 or not numbers[0] <= numbers[1]:
            refuse("--set", f'{key} is "{value}"; a number or [low, high] is needed')
    return condition


def at_least(least):
    """A whole number of a command line that is not below `least`."""

    def read(text):
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f'"{text}" is no whole number of at least {least}')
        return int(text)

    return read
