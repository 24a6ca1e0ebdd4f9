"""hilt's wire from Python: the Gymnasium environment, served policies, the demonstrator, and the examples that need no more than these.

Usage: wire.py HILT RUNS, where RUNS/policies/pick-up-bc-rl is what tests/interop/policies.sh leaves. It installs python/hilt_gym of this checkout and
openpi's client with pip into the running Python. Exits 1 at the first thing that is not as promised.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PYTHON = Path(__file__).resolve().parents[2] / "python"
TASK = "pick-up"
EPISODES, SEED = 6, 3
HORIZON = 300


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def install():
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    # pip builds beside what it installs: not in the checkout, and without an earlier build, whose old files it would take for new ones.
    with tempfile.TemporaryDirectory() as place:
        copy = shutil.copytree(PYTHON / "hilt_gym", Path(place) / "hilt_gym", ignore=shutil.ignore_patterns("build", "*.egg-info"))
        subprocess.run([*pip, str(copy)], check=True)
    # It asks for NumPy before 2, of which it needs nothing; LeRobot needs 2.
    subprocess.run([*pip, "--no-deps", "openpi-client==0.1.2"], check=True)


def evaluate(hilt, directory, policy, horizon, *more, task=TASK):
    """Summary and rows of the episodes of `hilt evaluate`, some of which are solved."""
    import pyarrow.parquet as pq

    out = Path(directory) / "evaluation.json"
    fixed = ["evaluate", "--task", task, "--episodes", str(EPISODES), "--seed", str(SEED), "--quiet", "--out", str(out)]
    settings = ["--set", f"evaluate.horizon_steps={horizon}", "--policy", policy, *more]
    subprocess.run([hilt, *fixed, *settings], check=True, stdout=subprocess.DEVNULL)
    rows = pq.read_table(out.with_suffix(".episodes.parquet")).to_pylist()
    check(any(row["success"] for row in rows), f"{policy}: no episode is solved; that those of others are the same says little then")
    summary = json.loads(out.read_text())
    for said in ("hilt", "differs_from_training"):  # Not of the episodes.
        summary.pop(said, None)
    return summary, rows


def solved(rows):
    return f"{sum(row['success'] for row in rows)} of {len(rows)} solved"


def play(env, act, row):
    """Acts in an episode of the environment, by what is seen and the step's number; it must end as this one of `hilt evaluate`."""
    observation, _ = env.reset()
    over, steps, earned = False, 0, 0.0
    while not over:
        observation, reward, terminated, truncated, info = env.step(act(observation, steps))
        over, steps, earned = terminated or truncated, steps + 1, earned + reward
    found = (info["episode"], info["success"], info["failure"] or "", steps, info["return"])
    check(found == tuple(row[k] for k in ("episode", "success", "failure", "steps", "reward")), f"episode {found}, natively {row}")
    check(abs(earned - info["return"]) < 1e-9, f"rewards add up to {earned}, not {info['return']}")


def check_environment(hilt, policy_file, directory):
    import numpy as np
    from gymnasium.utils.env_checker import check_env
    from hilt_gym import HiltEnv, PolicyClient

    for flat in (False, True):
        with HiltEnv(TASK, binary=hilt, flat=flat) as env:
            check_env(env, skip_render_check=True)
    print("check_env passes, with a Dict and flat")

    _, native = evaluate(hilt, directory, policy_file, HORIZON)
    with PolicyClient(policy_file, binary=hilt) as policy, HiltEnv(TASK, seed=SEED, horizon_steps=HORIZON, binary=hilt) as env:

        def act(observation, _):
            answer = policy.infer(observation)
            return answer.get("unlimited_actions", answer["actions"])[0]

        for row in native:
            play(env, act, row)
        first, _ = env.reset(seed=SEED)
        again, _ = env.reset(seed=SEED, options={"episode": 0})
        other, _ = env.reset(seed=SEED, options={"episodes": "training"})
        same = [all(np.array_equal(first[key], seen[key]) for key in first) for seen in (again, other)]
        check(same == [True, False], f"the same episode, another for training: {same}")
    print(f"{EPISODES} episodes through Gymnasium are those of hilt evaluate, {solved(native)}")


def check_policy_server(hilt, policy_file, directory):
    from hilt_gym import PolicyClient, PolicyServer

    summary, rows = evaluate(hilt, directory, policy_file, HORIZON)
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
            check(evaluate(hilt, directory, server.address, HORIZON) == (summary, rows), "a policy served from Python has other episodes")
    check(len(began) == EPISODES, f"{len(began)} conversations for {EPISODES} episodes")
    print(f"a policy that Python serves has the same episodes, {solved(rows)}")


def recorded(path):
    """States of the joints and commands of a recording, step by step."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        steps = [step for _, _, _, step in reader.iter_decoded_messages(topics=["/hilt/step"]) if not step.final_state]
    return [[*step.q_rad, *step.dq_rad_s] for step in steps], [step.commanded_rad_s for step in steps]


def check_planner(hilt, task, settings, directory):
    """No observation tells the demonstrator enough. What it commanded, given again step by step over the wire, must have its episodes."""
    import numpy as np
    from hilt_gym import HiltEnv, PolicyServer

    settings = [word for setting in settings for word in ("--set", setting)]
    record = Path(directory) / "recordings"
    summary, rows = evaluate(hilt, directory, "planner", HORIZON, *settings, "--record", str(record), task=task)
    native = [recorded(record / f"episode-{row['episode']:05d}.mcap") for row in rows]
    with HiltEnv(task, seed=SEED, horizon_steps=HORIZON, binary=hilt, arguments=settings) as env:
        for row, (states, commands) in zip(rows, native):

            def act(observation, step):
                where = f"{task}, episode {row['episode']}, step {step}"
                check(step < len(commands), f"{where}: natively it is over")
                check(np.array_equal(observation["observation.state"], np.float32(states[step])), f"{where}: another state")
                return np.float32(commands[step])

            play(env, act, row)
    with PolicyServer(lambda seen: native[seen["episode_index"]][1][seen["frame_index"]]) as server:
        served = evaluate(hilt, directory, server.address, HORIZON, *settings, task=task)
    check(served == (summary, rows), f"{task}: the demonstrator's commands, served from Python, have other episodes")
    print(f"{task}: the demonstrator's commands have its episodes over the wire, {solved(rows)}")


def check_examples(hilt, policy_file, directory):
    # Networks so small are no faster on several threads, and much slower beside other programs.
    one_thread = {**os.environ, "OMP_NUM_THREADS": "1"}

    def example(name, *words):
        command = [sys.executable, str(PYTHON / "examples" / name), *words, "--hilt", hilt]
        done = subprocess.run(command, env=one_thread, capture_output=True, text=True)
        check(done.returncode == 0, f"{name}: {done.stderr}")
        return done.stdout

    # Without a horizon it is the policy's own.
    _, rows = evaluate(hilt, directory, policy_file, 0)
    said = example("evaluate_policy.py", TASK, policy_file, "--episodes", str(EPISODES), "--seed", str(SEED)).splitlines()
    lines = [f"episode {row['episode']}: {'success' if row['success'] else row['failure']} in {row['steps']} steps" for row in rows]
    check(said == [*lines, f"{TASK}: success {sum(row['success'] for row in rows)} of {EPISODES}"], f"evaluate_policy.py: {said}")
    # One rollout of PPO and what it learns from it: that it runs is all that is asked.
    said = example("train_sb3.py", TASK, "--steps", "1024", "--episodes", "2")
    check(re.search(rf"^{TASK}: success [0-2] of 2, mean return [\d.]+$", said, re.MULTILINE), f"train_sb3.py: {said}")
    print("evaluate_policy.py says what hilt evaluate says; train_sb3.py trains")


def main():
    hilt, runs = sys.argv[1:]
    install()
    policy_file = str(Path(runs) / "policies" / f"{TASK}-bc-rl" / "policy.safetensors")
    # So much that the demonstrator fails in some.
    noise = ["simulate.noise_variance=0.05", "simulate.pulses.probability=0.1", "evaluate.pulses=true"]
    checks = [
        lambda directory: check_environment(hilt, policy_file, directory),
        lambda directory: check_policy_server(hilt, policy_file, directory),
        lambda directory: check_planner(hilt, TASK, noise, directory),
        lambda directory: check_planner(hilt, "stack", [], directory),
        lambda directory: check_examples(hilt, policy_file, directory),
    ]
    for one in checks:
        with tempfile.TemporaryDirectory() as directory:
            one(directory)


if __name__ == "__main__":
    main()
