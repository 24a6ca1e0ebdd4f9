"""BC, HIL and two rivals on Meta-World's 50 tasks: a study that can be stopped and goes on.

    python study.py --hilt target/release/hilt --out runs/meta-world [--tasks door-open-v3,...] [--demos 1,5,10,25] [--seeds 101-103] [--jobs 2]
    python study.py --out runs/meta-world --dry-run
    python report.py runs/meta-world --out docs/results/meta-world

For each task and seed scripted experts, written by others, give 25 demonstrations; each method learns from the first 1, 5, 10 and 25 of them for
the same processor time and acts in 50 episodes from other starts, the same for all, through `hilt serve`. Success is Meta-World's own flag. What is
finished is never done again: a run is a file OUT/TASK/SEED/DEMOS-METHOD.json, and appears whole.
"""

import argparse
import math
import multiprocessing
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "convert"), str(HERE.parent / "hilt_gym" / "src")]

from guard import made_with, same_study, whole  # noqa: E402
from hilt_gym import PolicyClient  # noqa: E402
from labels import Dynamics, corrective  # noqa: E402
from lerobot_v3 import write  # noqa: E402
from world import ACTION, RATE_HZ, STATE, TASKS, World, columns, demonstrations  # noqa: E402

METHODS = ("bc", "hil", "bc-ensemble", "ccil")
MOST_DEMOS = 25
JUDGED_ON = 3  # demonstrations beyond those, for the losses in the logs; no method chooses anything by them
# A seed's demonstrations and its evaluation begin from starts of their own.
DEMOS_SEED, EVALUATION_SEED = 1_000, 2_000_000
# What a policy may take: twice the longest demonstration, within Meta-World's own limit.
SLACK, LEAST_STEPS, MOST_STEPS = 2, 150, 500

# What HIL learns with; the others get the same processor time. An update of behavior cloning is the unit.
BATCH = 512  # rows of it
WARM_START, HIL_UPDATES, DEMOS_PER_UPDATE = 4000, 300, 8
PRETRAINING, PRETRAINING_BATCH = 1500, 256
# Measured on one core, over 1 to 25 demonstrations: an update of HIL costs 4 updates of behavior cloning a row, one of pretraining half of one.
HIL_ROW_COST, PRETRAINING_COST = 4.0, 0.5
MEMBERS = 5  # of the ensemble
SETTINGS = {name: value for name, value in globals().items() if name.isupper() and isinstance(value, (int, float))}


class Hilt:
    """Runs the binary and adds up the processor time of what it ran."""

    def __init__(self, binary):
        self.binary, self.seconds = binary, 0.0

    def __call__(self, *arguments, sets=()):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [self.binary, "--threads", "1", *map(str, arguments)]
        command += [part for key, value in dict(sets).items() for part in ("--set", f"{key}={value}")]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()[-2000:]}")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.seconds += after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def cloning(updates):
    return {"train.epochs": 0, "train.warm_start_updates": max(1, round(updates)), "train.bc_batch": BATCH}


def pretrain(hilt, dataset, out, rows, seed):
    batch = min(PRETRAINING_BATCH, rows)
    sets = {"pretrain.patience": 0, "pretrain.batch_rows": batch, "pretrain.epochs": math.ceil(PRETRAINING / (rows // batch))}
    hilt("pretrain", "--dataset", dataset, "--seed", seed, "--out", out, sets=sets)


def learn(method, hilt, dataset, dynamics, episodes, seed, out):
    """The files of the policies whose mean action counts. `dynamics` is there already where the method needs it."""
    rows = sum(len(actions) for _, actions, _, _ in episodes)
    hil_rows = rows * min(DEMOS_PER_UPDATE, len(episodes)) / len(episodes)
    of_hil = HIL_UPDATES * HIL_ROW_COST * hil_rows / min(BATCH, rows)
    of_pretraining = PRETRAINING * PRETRAINING_COST
    budget = of_pretraining + WARM_START + of_hil
    if method == "hil":
        sets = cloning(WARM_START) | {"train.epochs": 1, "train.min_updates": HIL_UPDATES, "train.batch": DEMOS_PER_UPDATE}
        return [policy(hilt, out / "hil", dataset, seed, sets, "--method", "hil", "--dynamics", dynamics)]
    if method == "bc":
        return [policy(hilt, out / "bc", dataset, seed, cloning(budget), "--method", "bc")]
    if method == "bc-ensemble":
        each = cloning(budget / MEMBERS)
        return [policy(hilt, out / f"member-{i}", dataset, MEMBERS * seed + i, each, "--method", "bc") for i in range(MEMBERS)]
    f, rng = Dynamics(dynamics), np.random.default_rng(seed)
    pairs = [corrective(f, states, actions, rng) for states, actions, _, _ in episodes]
    blank = lambda actions: (np.zeros(len(actions), np.float32), np.zeros(len(actions), bool))
    beside = [{"observation.state": s, "next.observation.state": n, "action": a} for s, a, n in pairs if len(s)]
    for episode in beside:
        episode["next.reward"], episode["next.success"] = blank(episode["action"])
    with tempfile.TemporaryDirectory(dir=out) as room:
        save(Path(room) / "both" / "train", [columns(episode) for episode in episodes] + beside)
        (Path(room) / "both" / "validation").symlink_to((dataset / "validation").resolve())
        return [policy(hilt, out / "ccil", Path(room) / "both", seed, cloning(budget - of_pretraining), "--method", "bc")]


def policy(hilt, stem, dataset, seed, sets, *arguments):
    out = stem.with_suffix(".safetensors")
    hilt("train", *arguments, "--dataset", dataset, "--seed", seed, "--out", out, sets=sets)
    return out


def save(root, episodes):
    write(root, (("", episode) for episode in episodes), RATE_HZ, robot_type="sawyer", names={"observation.state": STATE, "action": ACTION})


def evaluate(binary, policies, world, episodes, most_steps):
    """Which episodes succeed, control steps of all of them, and wall-clock seconds: of all, and of these waiting for the served policies."""
    solved, steps, waited = [], 0, 0.0

    def act(state):
        nonlocal waited
        asked = time.perf_counter()
        action = np.mean([client({"observation.state": state}) for client in clients], axis=0)
        waited += time.perf_counter() - asked
        return action

    with ExitStack() as stack:
        clients = [stack.enter_context(PolicyClient(policy, binary=binary, arguments=("--quiet",))) for policy in policies]
        began = time.perf_counter()
        for episode in range(episodes):
            for client in clients:
                client.reset(episode)
            _, actions, _, flags = world.run(episode % len(world.starts), act, most_steps)
            solved.append(bool(flags.any()))
            steps += len(actions)
        return solved, steps, time.perf_counter() - began, waited


def missing(out, task, seed, demos, methods):
    return [(count, method) for count in demos for method in methods if not (out / task / str(seed) / f"{count}-{method}.json").exists()]


def one(job):
    """All that is missing of one task and seed; says what each run came to."""
    args, task, seed = job
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    home = args.out / task / str(seed)
    home.mkdir(parents=True, exist_ok=True)
    todo = missing(args.out, task, seed, args.demos, args.methods)
    if not todo:
        return
    episodes, tried = demonstrations(task, DEMOS_SEED * seed, MOST_DEMOS + JUDGED_ON)
    longest = max(len(actions) for _, actions, _, _ in episodes[:MOST_DEMOS])
    most_steps = min(MOST_STEPS, max(LEAST_STEPS, SLACK * longest))
    world = World(task, EVALUATION_SEED + seed)
    for count in sorted({count for count, _ in todo}):
        with tempfile.TemporaryDirectory(dir=home, prefix=".work-") as work:
            work = Path(work)
            dataset, dynamics, shared = work / "data", work / "dynamics.safetensors", Hilt(args.hilt)
            save(dataset / "train", map(columns, episodes[:count]))
            save(dataset / "validation", map(columns, episodes[MOST_DEMOS:]))
            for method in (method for at, method in todo if at == count):
                hilt = Hilt(args.hilt)
                if method in ("hil", "ccil") and not dynamics.exists():
                    pretrain(shared, dataset, dynamics, sum(len(e[1]) for e in episodes[:count]), seed)
                policies = learn(method, hilt, dataset, dynamics, episodes[:count], seed, work)
                solved, steps, acting_s, waited_s = evaluate(args.hilt, policies, world, args.episodes, most_steps)
                seconds = hilt.seconds + (shared.seconds if method in ("hil", "ccil") else 0.0)
                run = {"task": task, "seed": seed, "demos": count, "method": method, "episodes": args.episodes, "successes": sum(solved)}
                run |= {"solved": "".join("01"[flag] for flag in solved), "learning_s": round(seconds, 2), "steps": steps}
                run |= {"most_steps": most_steps, "expert": f"{len(episodes)} of {tried}"}
                run |= {"acting_s": round(acting_s, 2), "policy_s": round(waited_s, 2)}
                whole(home / f"{count}-{method}.json", run)
                print(f"{task} seed {seed}, {count} demos, {method}: {sum(solved)} of {args.episodes}, learned in {seconds:.1f} s", flush=True)


def main():
    words = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    several = lambda kind: lambda text: [kind(part) for part in text.split(",") if part]
    seeds = lambda text: [seed for part in text.split(",") for low, _, high in [part.partition("-")] for seed in range(int(low), int(high or low) + 1)]
    words.add_argument("--hilt", help="the binary")
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--tasks", type=several(str), default=TASKS)
    words.add_argument("--demos", type=several(int), default=[1, 5, 10, 25])
    words.add_argument("--methods", type=several(str), default=list(METHODS))
    words.add_argument("--seeds", type=seeds, default=[101, 102, 103])
    words.add_argument("--episodes", type=int, default=50)
    words.add_argument("--jobs", type=int, default=os.cpu_count())
    words.add_argument("--dry-run", action="store_true", help="say what there is to do")
    args = words.parse_args()
    for name, asked, known in (("task", args.tasks, TASKS), ("method", args.methods, METHODS)):
        for odd in [value for value in asked if value not in known]:
            words.error(f"unknown {name} {odd}; known: {', '.join(known)}")
    if not args.demos or not all(1 <= count <= MOST_DEMOS for count in args.demos) or args.episodes < 1 or args.jobs < 1:
        words.error(f"--demos must be from 1 to {MOST_DEMOS}, --episodes and --jobs at least 1")
    # Seed by seed, tasks in an order of chance: what is done when it is stopped is a fair sample of all.
    order = sorted(args.tasks)
    random.Random(0).shuffle(order)
    jobs = [(args, task, seed) for seed in args.seeds for task in order]
    left = sum(len(missing(args.out, task, seed, args.demos, args.methods)) for _, task, seed in jobs)
    print(f"{left} of {len(jobs) * len(args.demos) * len(args.methods)} runs to do", flush=True)
    if args.dry_run or not left:
        return
    if not args.hilt:
        words.error("--hilt must name the binary")
    args.hilt = str(Path(args.hilt).resolve())
    same_study(args.out, SETTINGS | {"episodes": args.episodes} | made_with(args.hilt, METHODS))
    with multiprocessing.get_context("spawn").Pool(args.jobs, maxtasksperchild=1) as pool:
        try:
            for _ in pool.imap_unordered(one, jobs):
                pass
        except KeyboardInterrupt:
            pool.terminate()
            sys.exit("stopped; the same command goes on")


if __name__ == "__main__":
    main()
