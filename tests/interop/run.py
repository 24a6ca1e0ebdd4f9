"""Reads every artefact of finished runs with programs that are not hilt: mcap, pyarrow, DuckDB, pandas, LeRobot, safetensors.

Usage: run.py RUNS, where RUNS/TASK holds what `make all TASK=...` leaves. Exits 1 at the first thing that is not as promised.
"""

import json
import logging
import sys
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from safetensors import safe_open

FPS = 20
JOINTS = 9
# Instruction, entries of the environment state.
TASKS = {
    "pick-up": ("Pick up the block and hold it 20 cm above the table.", 7),
    "pick-and-place": ("Pick up the block and place it at the goal position.", 10),
    "stack": ("Pick up the block and stack it on the base block.", 14),
}
PROVENANCE = {"hilt_version", "schema_version", "stage", "task", "settings", "seed", "inputs"}


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def check_provenance(text, task, where):
    found = json.loads(text)
    check(set(found) == PROVENANCE and found["task"] == task, f"{where}: provenance {found}")


def recording(path, task):
    """Decodes every message; returns the episode's number, its steps and whether it succeeded."""
    counts, steps, outcome, links = {}, [], None, set()
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        # The description is of ROS 2: viewers.py reads it.
        topics = [channel.topic for channel in reader.get_summary().channels.values() if channel.message_encoding == "protobuf"]
        for _, channel, message, decoded in reader.iter_decoded_messages(topics=topics):
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if channel.topic == "/hilt/step":
                check(message.log_time == decoded.step * 10**9 // FPS, f"{path}: time of step {decoded.step}")
                steps.append(decoded)
            elif channel.topic == "/hilt/outcome":
                outcome = decoded
            elif channel.topic == "/tf":
                links |= {transform.child_frame_id for transform in decoded.transforms}
            elif channel.topic == "/joint_states":
                check(len(decoded.joints) == JOINTS, f"{path}: joints")
        attachments = [a.name for a in reader.iter_attachments()]
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    frames = outcome.steps + 1
    expected = {"/tf": frames, "/joint_states": frames, "/scene": 1, "/hilt/scene": 1, "/hilt/step": frames, "/hilt/outcome": 1}
    check(counts == expected, f"{path}: messages {counts}, expected {expected}")
    check(attachments == ["robot.urdf", "robot.json", "task.json"], f"{path}: attachments {attachments}")
    check({"j2n6s300_link_base", "j2n6s300_link_6", "object/block"} <= links, f"{path}: frames {links}")
    check_provenance(metadata["hilt"]["provenance"], task, path)
    return outcome.episode, steps, outcome.success


def dataset(root, task, recordings):
    """Opens one dataset root with four programs; returns its number of episodes."""
    instruction, environment = TASKS[task]
    info = json.loads((root / "meta/info.json").read_text())
    check_provenance(json.dumps(info["hilt"]["provenance"]), task, root)
    data = sorted(root.glob("data/*/*.parquet"))

    arrow = pq.read_table(data[0])
    check(arrow.schema.field("action").metadata.get(b"doc"), f"{root}: description of a column in pyarrow")
    check_provenance(arrow.schema.metadata[b"hilt"], task, root)

    rows, episodes, worst = duckdb.sql(
        f"select count(*), count(distinct episode_index), max(abs(timestamp - frame_index / {FPS}.0))"
        f" from read_parquet('{root}/data/*/*.parquet')"
    ).fetchall()[0]
    check((rows, episodes) == (info["total_frames"], info["total_episodes"]), f"{root}: DuckDB counts {rows}, {episodes}")
    check(worst < 1e-4, f"{root}: timestamps are {worst} s off")

    frame = pd.concat(pd.read_parquet(path) for path in data)
    check(frame["index"].tolist() == list(range(rows)), f"{root}: index in pandas")
    tasks = pd.read_parquet(root / "meta/tasks.parquet")
    check(tasks.loc[instruction, "task_index"] == 0, f"{root}: tasks in pandas\n{tasks}")

    found = LeRobotDataset("local/hilt", root=root)
    check((found.num_episodes, found.num_frames, found.fps) == (episodes, rows, FPS), f"{root}: counts in LeRobot")
    for at in {0, rows // 2, rows - 1}:
        sample, row = found[at], frame.iloc[at]
        check(sample["task"] == instruction, f"{root}: task {sample['task']!r} in LeRobot")
        for name in ("observation.state", "observation.environment_state", "action", "next.observation.state"):
            check(np.array_equal(sample[name].numpy(), row[name]), f"{root}: {name} of frame {at} in LeRobot")
        check(sample["observation.state"].shape == (2 * JOINTS,), f"{root}: shape of the state")
        check(sample["observation.environment_state"].shape == (environment,), f"{root}: shape of the environment state")
        step = recordings[int(row["source_episode"])][int(row["frame_index"])]
        check(np.array_equal(np.float32(step.commanded_rad_s), row["action"]), f"{root}: action of frame {at} against the recording")
        check(np.array_equal(np.float32([*step.q_rad, *step.dq_rad_s]), row["observation.state"]), f"{root}: state against the recording")

    states = np.stack(frame["observation.state"].to_numpy()).astype(np.float64)
    stats = found.meta.stats["observation.state"]
    for name, value in (("mean", states.mean(0)), ("std", states.std(0)), ("q10", np.quantile(states, 0.1, axis=0))):
        check(np.allclose(stats[name], value, atol=1e-6), f"{root}: {name} of the state")
    windows = LeRobotDataset("local/hilt", root=root, episodes=[episodes - 1], delta_timestamps={"action": [0.0, 1 / FPS]})
    check(windows[0]["action"].shape == (2, JOINTS), f"{root}: action windows in LeRobot")
    return episodes


def weights(path, kind, task):
    with safe_open(path, framework="np") as file:
        header = json.loads(file.metadata()["hilt"])
        check(header["kind"] == kind and set(header["order"]) == set(file.keys()), f"{path}: header")
        check_provenance(json.dumps(header["provenance"]), task, path)
        numbers = [file.get_tensor(name) for name in file.keys()]
    check(all(n.dtype == np.float32 and np.isfinite(n).all() for n in numbers), f"{path}: numbers")
    return sum(n.size for n in numbers)


def run(directory):
    task = directory.name
    print(task)
    recordings, solved = {}, 0
    for path in sorted((directory / "recordings").glob("*.mcap")):
        number, steps, success = recording(path, task)
        recordings[number] = steps
        solved += success
    check(recordings, f"{directory}: no recordings")
    print(f"  recordings: {len(recordings)} decoded by mcap-protobuf, {solved} successes")
    for split in ("train", "validation"):
        count = dataset(directory / "dataset" / split, task, recordings)
        print(f"  dataset/{split}: {count} episodes by pyarrow, DuckDB, pandas and LeRobotDataset")
    for kind in ("dynamics", "policy"):
        print(f"  {kind}.safetensors: {weights(directory / f'{kind}.safetensors', kind, task)} parameters")
    for name in ("plans", "policy.training", "evaluation.episodes"):
        path = directory / f"{name}.parquet"
        table = pq.read_table(path)
        check_provenance(table.schema.metadata[b"hilt"], task, path)
        check(all(field.metadata.get(b"doc") for field in table.schema), f"{path}: descriptions of the columns")
        rows = duckdb.sql(f"select count(*) from '{path}'").fetchall()[0][0]
        check(rows == table.num_rows == len(pd.read_parquet(path)), f"{path}: rows")
        print(f"  {name}.parquet: {rows} rows")
    summary = json.loads((directory / "evaluation.json").read_text())
    check(summary["task"] == task, f"{directory}: evaluation.json")


def main():
    logging.disable(logging.WARNING)
    found = [path for path in sorted(Path(sys.argv[1]).iterdir()) if path.name in TASKS]
    check(found, f"no run in {sys.argv[1]}; expected one of {', '.join(TASKS)}")
    for directory in found:
        run(directory)
    print("all readable")


if __name__ == "__main__":
    main()
