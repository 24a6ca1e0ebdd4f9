"""hilt's wire from Python: the Gymnasium environment, served policies, and openpi's packing to the letter.

Usage: wire.py HILT RUNS, where RUNS/pick-up holds what `make all TASK=pick-up` leaves. It installs python/hilt_gym of this checkout with pip into
the running Python. Exits 1 at the first thing that is not as promised.
"""

import functools
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parent.parent / "python" / "hilt_gym"
TASK = "pick-up"
EPISODES = 4


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def install():
    # pip builds beside what it installs: not in the checkout.
    with tempfile.TemporaryDirectory() as copy:
        subprocess.run(["cp", "-r", str(PACKAGE), copy], check=True)
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"{copy}/hilt_gym"]
        subprocess.run(command, check=True)


def evaluate(hilt, directory, policy, horizon):
    """Summary and rows of the episodes of `hilt evaluate`."""
    import pyarrow.parquet as pq

    out = Path(directory) / "evaluation.json"
    fixed = ["evaluate", "--task", TASK, "--episodes", str(EPISODES), "--seed", "3", "--quiet", "--out", str(out)]
    subprocess.run([hilt, *fixed, "--set", f"evaluate.horizon_steps={horizon}", "--policy", policy], check=True, stdout=subprocess.DEVNULL)
    rows = pq.read_table(out.with_suffix(".episodes.parquet")).to_pylist()
    summary = json.loads(out.read_text())
    for said in ("hilt", "differs_from_training"):  # Not of the episodes.
        summary.pop(said, None)
    return summary, rows


def check_environment(hilt, policy_file, directory):
    import numpy as np
    from gymnasium.utils.env_checker import check_env
    from hilt_gym import HiltEnv, PolicyClient

    for flat in (False, True):
        with HiltEnv(TASK, binary=hilt, flat=flat) as env:
            check_env(env, skip_render_check=True)
    print("check_env passes, with a Dict and flat")

    horizon = 60
    _, native = evaluate(hilt, directory, policy_file, horizon)
    with PolicyClient(policy_file, binary=hilt) as policy, HiltEnv(TASK, seed=3, horizon_steps=horizon, binary=hilt) as env:
        for row in native:
            observation, info = env.reset()
            over, steps, earned = False, 0, 0.0
            while not over:
                answer = policy.infer(observation)
                action = answer.get("unlimited_actions", answer["actions"])[0]
                observation, reward, terminated, truncated, info = env.step(action)
                over, steps, earned = terminated or truncated, steps + 1, earned + reward
            found = (info["episode"], info["success"], info["failure"] or "", steps, info["return"])
            check(found == tuple(row[k] for k in ("episode", "success", "failure", "steps", "reward")), f"episode {found}, natively {row}")
            check(abs(earned - info["return"]) < 1e-9, f"rewards add up to {earned}, not {info['return']}")
        first, _ = env.reset(seed=3)
        again, _ = env.reset(seed=3, options={"episode": 0})
        other, _ = env.reset(seed=3, options={"episodes": "training"})
        same = [all(np.array_equal(first[key], seen[key]) for key in first) for seen in (again, other)]
        check(same == [True, False], f"the same episode, another for training: {same}")
    print(f"{EPISODES} episodes through Gymnasium are those of hilt evaluate")


def check_policy_server(hilt, policy_file, directory):
    from hilt_gym import PolicyClient, PolicyServer

    summary, rows = evaluate(hilt, directory, policy_file, 40)
    began = []
    with PolicyClient(policy_file, binary=hilt) as inner:

        def make():
            began.append(0)

            def act(observation):
                began[-1] += 1
                answer = inner.infer({key: observation[key] for key in inner.about["keys"]})
                return answer.get("unlimited_actions", answer["actions"])

            return act

        with PolicyServer(make=make) as server:
            check(evaluate(hilt, directory, server.address, 40) == (summary, rows), "a policy served from Python has other episodes")
    check(len(began) == EPISODES, f"{len(began)} conversations for {EPISODES} episodes")
    print("a policy that Python serves has the same episodes")


def check_openpi(hilt, policy_file):
    """The packing of openpi-client's msgpack_numpy, written out: what a client of openpi's sends and reads."""
    import msgpack
    import numpy as np
    from hilt_gym import HiltProcess
    from websockets.sync.client import connect

    def pack_array(value):
        if isinstance(value, np.ndarray):
            return {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
        if isinstance(value, np.generic):
            return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
        return value

    def unpack_array(value):
        if b"__ndarray__" in value:
            return np.ndarray(buffer=value[b"data"], dtype=np.dtype(value[b"dtype"]), shape=value[b"shape"])
        if b"__npgeneric__" in value:
            return np.dtype(value[b"dtype"]).type(value[b"data"])
        return value

    pack = msgpack.Packer(default=pack_array).pack
    unpack = functools.partial(msgpack.unpackb, object_hook=unpack_array)
    with HiltProcess("serve", policy_file, binary=hilt) as server:
        with connect(server.address, compression=None, max_size=None) as socket:
            about = unpack(socket.recv())
            check(about["task"] == TASK and about["period_s"] == 0.05, f"metadata {about}")
            observation = {key: np.zeros(len(names)) for key, names in about["keys"].items()}
            observation |= {"prompt": "do it", "image": np.zeros((224, 224, 3), np.uint8), "gripper": np.float32(0.5)}
            socket.send(pack(observation))
            first = unpack(socket.recv())
            check(first["actions"].shape == (1, len(about["actions"])) and first["actions"].dtype == np.float32, f"answer {first}")
            check(first["server_timing"]["infer_ms"] >= 0.0, f"timing {first}")
            socket.send(pack({"image": observation["image"]}))
            refusal = socket.recv()
            check(isinstance(refusal, str) and "observation.state" in refusal, f"refusal {refusal}")
            pickled = {b"__ndarray__": True, b"data": b"\x80\x04.", b"dtype": "|O", b"shape": (1,)}
            socket.send(msgpack.packb({"observation.state": pickled}))
            check("|O" in socket.recv(), "an array of objects is not refused")
            times = []
            for _ in range(2000):
                began = time.perf_counter()
                socket.send(pack(observation))
                again = unpack(socket.recv())
                times.append(1e3 * (time.perf_counter() - began))
            check(np.array_equal(again["actions"], first["actions"]), "the same observation has another action")
    p50, p99 = np.percentile(times, [50, 99])
    print(f"openpi's packing is spoken; with a picture aboard p50 {p50:.3f} ms, p99 {p99:.3f} ms")


def main():
    hilt, runs = sys.argv[1:]
    install()
    policy_file = str(Path(runs) / TASK / "policy.safetensors")
    with tempfile.TemporaryDirectory() as directory:
        check_environment(hilt, policy_file, directory)
        check_policy_server(hilt, policy_file, directory)
    check_openpi(hilt, policy_file)


if __name__ == "__main__":
    main()
