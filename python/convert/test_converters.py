"""Each converter on a file that its own package made: pytest test_converters.py (needs requirements.txt, pytest and minari[create])."""

import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from stats import QUANTILES, SKETCH_ROWS, Running, statistics

HERE = Path(__file__).parent


def run(script, *words, cwd):
    return subprocess.run([sys.executable, HERE / script, *map(str, words)], cwd=cwd, capture_output=True, text=True)


def converted(script, *words, cwd):
    done = run(script, *words, cwd=cwd)
    assert done.returncode == 0, done.stderr
    info = json.loads((cwd / "out/meta/info.json").read_text())
    rows = pq.read_table(cwd / "out/data/chunk-000/file-000.parquet").to_pandas()
    assert list(rows["index"]) == list(range(info["total_frames"]))
    assert np.allclose(rows["timestamp"], rows["frame_index"] / info["fps"], atol=1e-5)
    episodes = pq.read_table(cwd / "out/meta/episodes/chunk-000/file-000.parquet").to_pandas()
    assert list(rows.groupby("episode_index").size()) == list(episodes["length"])
    return info, rows


def refused(script, *words, cwd, said):
    done = run(script, *words, cwd=cwd)
    assert done.returncode == 1 and said in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert not (cwd / "out").exists() and not list(cwd.glob(".out*")), "nothing is left"


def parts_and_whole(rows, seed):
    """Rows far from 0 and rows with outliers, in parts of many lengths."""
    rng = np.random.default_rng(seed)
    whole = np.stack([1e6 + rng.standard_normal(rows), rng.standard_cauchy(rows), np.arange(rows)], axis=1)
    return np.split(whole, np.sort(rng.integers(1, rows, 9)) if rows > 9 else []), whole


@pytest.mark.parametrize("rows", [1, 2, 500, 2 * SKETCH_ROWS - 1])
def test_statistics_in_parts_are_those_of_all(rows):
    parts, whole = parts_and_whole(rows, rows)
    running = Running(3)
    for part in parts:
        if len(part):
            running.add(part)
    found, known = running.found(), statistics(whole)
    assert list(found) == list(known) and found["count"] == known["count"]
    for name in known:
        assert np.allclose(found[name], known[name], rtol=1e-9, atol=1e-9), name


def test_quantiles_of_many_rows_are_near_in_rank_and_memory_is_bounded():
    rows = 40 * SKETCH_ROWS + 77
    parts, whole = parts_and_whole(rows, 0)
    running = Running(3)
    for part in parts:
        running.add(part)
    found, whole = running.found(), np.sort(whole, axis=0)
    assert np.allclose(found["std"], whole.std(0), rtol=1e-9)
    bound = (1 + np.log2(rows / SKETCH_ROWS)) / (2 * SKETCH_ROWS)
    for name, share in QUANTILES.items():
        for entry, value in enumerate(found[name]):
            assert abs(np.searchsorted(whole[:, entry], value) / rows - share) <= bound + 1 / rows, (name, entry)
    assert len(running.loose) == SKETCH_ROWS and [len(block) for block in running.blocks if block is not None] == [SKETCH_ROWS] * 2, "40 is 8 + 32"


def test_hand_dapg(tmp_path):
    demo = lambda n: {"observations": np.random.rand(n, 5), "actions": np.random.rand(n, 2), "rewards": np.ones(n)}
    demos = [demo(4), demo(6)]
    (tmp_path / "demos.pickle").write_bytes(pickle.dumps(demos, 3))
    info, rows = converted("hand_dapg.py", "demos.pickle", "out", cwd=tmp_path)
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, 10, 100)
    assert np.allclose(rows["observation.state"][4], demos[1]["observations"][0])


class Harmful:
    def __reduce__(self):
        return (Path.touch, (Path("harm"),))


def test_a_pickle_that_would_run_something_is_refused(tmp_path):
    (tmp_path / "bad.pickle").write_bytes(pickle.dumps([Harmful()]))
    refused("hand_dapg.py", "bad.pickle", "out", cwd=tmp_path, said="numpy arrays are all that is read")
    assert not (tmp_path / "harm").exists()
    (tmp_path / "cut.pickle").write_bytes(pickle.dumps([{"observations": np.zeros((3, 2))}])[:-20])
    refused("hand_dapg.py", "cut.pickle", "out", cwd=tmp_path, said="cannot be read as a pickle")
    (tmp_path / "less.pickle").write_bytes(pickle.dumps([{"observations": np.zeros((3, 2))}]))
    refused("hand_dapg.py", "less.pickle", "out", cwd=tmp_path, said="has no actions")


def test_robomimic(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "demos.hdf5", "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "env_kwargs": {"control_freq": 25}})
        for number, n in enumerate([3, 5, 4] + [2] * 8):
            demo = data.create_group(f"demo_{number}")
            demo["actions"], demo["rewards"], demo["dones"] = np.full((n, 7), number), np.zeros(n), np.arange(n) == n - 1
            demo["obs/eef_pos"], demo["obs/gripper"] = np.random.rand(n, 3), np.random.rand(n)
            demo["obs/image"] = np.zeros((n, 8, 8, 3), np.uint8)
    info, rows = converted("robomimic_hdf5.py", "demos.hdf5", "out", cwd=tmp_path)
    assert (info["fps"], info["total_episodes"]) == (25, 11)
    assert info["features"]["observation.state"]["names"] == ["eef_pos.0", "eef_pos.1", "eef_pos.2", "gripper"]
    # demo_10 comes after demo_9, not after demo_1.
    assert [rows["action"][i][0] for i in (0, 3, 8, len(rows) - 1)] == [0, 1, 2, 10]
    done = run("robomimic_hdf5.py", "demos.hdf5", "other", "--observations", "eef_pos,nose", cwd=tmp_path)
    assert "has no observation nose; it has eef_pos" in done.stderr
    again = run("robomimic_hdf5.py", "demos.hdf5", "out", cwd=tmp_path)
    assert again.returncode == 1 and "out exists; choose another place" in again.stderr


def test_minari(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    gymnasium = pytest.importorskip("gymnasium")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    env = minari.DataCollector(gymnasium.make("Pendulum-v1", max_episode_steps=7))
    for seed in range(3):
        env.reset(seed=seed)
        while True:
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                break
    env.create_dataset("pendulum/test-v0", algorithm_name="random", author="test", author_email="a@b.c", code_permalink="none")
    info, rows = converted("minari_dataset.py", "pendulum/test-v0", "out", "--fps", 20, cwd=tmp_path)
    assert (info["total_episodes"], info["total_frames"]) == (3, 21)
    assert np.allclose(rows["next.observation.state"][0], rows["observation.state"][1])
    assert list(rows["next.done"][:7]) == [False] * 6 + [True]
    done = run("minari_dataset.py", "pendulum/test-v0", "other", cwd=tmp_path)
    assert done.returncode == 2 and "--fps" in done.stderr and "OUT --fps 100 [" in (HERE / "minari_dataset.py").read_text()


def test_rosbag2(tmp_path):
    pytest.importorskip("mcap_ros2")
    from mcap_ros2.writer import Writer

    definition = "float64[] position\nfloat64[] velocity\n"
    for bag in range(2):
        with (tmp_path / f"bag{bag}.mcap").open("wb") as stream:
            writer = Writer(stream)
            joints = writer.register_msgdef("test_msgs/msg/Joints", definition)
            command = writer.register_msgdef("test_msgs/msg/Command", "float64[] data\n")
            for i in range(20 + bag):  # joints at 100 Hz, commands at 50 Hz, from 20 ms on
                at = i * 10_000_000
                writer.write_message("/joints", joints, {"position": [i, bag], "velocity": [0.5, 0.25]}, at, at)
                if i >= 2 and i % 2 == 0:
                    writer.write_message("/commands", command, {"data": [float(i)]}, at, at)
            writer.finish()
    words = ["out", "bag0.mcap", "bag1.mcap", "--fps", 20, "--state", "/joints:position,velocity", "--action", "/commands:data"]
    info, rows = converted("rosbag2_mcap.py", *words, cwd=tmp_path)
    assert (info["total_episodes"], info["features"]["observation.state"]["shape"]) == (2, [4])
    assert [rows["observation.state"][i][0] for i in range(4)] == [2, 7, 12, 17], "the last that was said every 50 ms from 20 ms on"
    assert [rows["action"][i] for i in range(4)] == [2, 6, 12, 16]
    for word, said in [("/joints:effort", "have no effort"), ("/nobody:position", "has no message of /nobody")]:
        done = run("rosbag2_mcap.py", "other", "bag0.mcap", "--fps", 20, "--state", word, "--action", "/commands:data", cwd=tmp_path)
        assert done.returncode == 1 and said in done.stderr, done.stderr
    (tmp_path / "no.mcap").write_bytes(b"no bag")
    done = run("rosbag2_mcap.py", "other", "no.mcap", "--fps", 20, "--state", "/joints:position", "--action", "/commands:data", cwd=tmp_path)
    assert done.returncode == 1 and "cannot be read as MCAP" in done.stderr and not (tmp_path / "other").exists()
