"""Success of a policy in MuJoCo over what may be another than in training, and a picture of it.

`run` evaluates a policy on the nominal arm and along every curve; what is in its output already is not run again. `plot` draws what
several runs have found, a line a run.
"""

import argparse
import hashlib
import json
import os
from pathlib import Path

import jaco_mujoco
import matplotlib.pyplot as plt
from checks import at_least, read_policy, read_starts, refuse

# By key of jaco_mujoco.NOMINAL: what it is called, and its values.
CURVES = {
    "delay": ("delay [control steps]", [0, 1, 2, 3, 4, 5]),
    "observation_noise": ("observation noise [mm, mrad]", [0, 0.001, 0.002, 0.005, 0.01]),
    "action_noise": ("action noise [x the paper's]", [0, 1, 2, 3, 5, 7]),
    "friction": ("friction of the block", [0.2, 0.3, 0.4, 0.6, 0.8, 1, 1.2]),
    "mass": ("mass of the block [kg]", [0.05, 0.1, 0.2, 0.3, 0.5]),
    "armature": ("armature [x dm_control's]", [0.25, 0.5, 1, 2]),
    "gravity_compensation": ("gravity compensated", [0, 0.5, 0.9, 1]),
}
# All at once, drawn for every episode.
HARD = {"delay": [0, 3], "action_noise": 3, "friction": [0.3, 1.2], "mass": [0.05, 0.3]}
SCALE = {"observation_noise": 1000}  # to mm and mrad
# Told apart in grey too.
LINES = [
    {"color": "#1b5e8c", "linestyle": "-", "marker": "o"},
    {"color": "#d9731a", "linestyle": "--", "marker": "s"},
    {"color": "#4d4d4d", "linestyle": ":", "marker": "^"},
]


def conditions():
    """Every condition of the curves once, the nominal one first."""
    along = [{key: value} for key, (_, values) in CURVES.items() for value in values if value != jaco_mujoco.NOMINAL[key]]
    return [{}, HARD, *along]


def run(args):
    out, task = Path(args.out), read_policy(args.policy)["task"]
    most = len(read_starts(args.starts, task))
    if most < args.episodes:
        print(f"{args.starts} has {most} starts: no more episodes are run under a condition", flush=True)
    about = {"task": task, "policy": hashlib.sha256(Path(args.policy).read_bytes()).hexdigest(), "seed": args.seed}
    found = read_found(out) if out.exists() else {**about, "results": []}
    if any(found[key] != value for key, value in about.items()):
        raise SystemExit(f"error: {out} is of another policy or seed: remove it, or give another --out")
    found["name"] = args.name
    for condition in conditions():
        # No more than there are starts: what ran them all is complete.
        episodes = min(most, args.episodes, args.curve_episodes if condition else args.episodes)
        if episodes == 0 or any(r["condition"] == condition and r["episodes"] >= episodes for r in found["results"]):
            continue
        rows = jaco_mujoco.evaluate(args.policy, args.starts, args.robot, condition, episodes, args.seed, args.jobs)
        failed = [i for i, row in enumerate(rows) if not row["success"]]
        found["results"] = [r for r in found["results"] if r["condition"] != condition]
        result = {"condition": condition, "episodes": len(rows), "successes": len(rows) - len(failed), "failed": failed}
        found["results"].append(result)
        print(f"{task}, {args.name}: {result['successes']} of {len(rows)}, {condition or 'nominal'}", flush=True)
        fresh = out.with_suffix(".new")
        fresh.write_text(json.dumps(found, indent=1))
        fresh.replace(out)


def read_found(path):
    """What `run` has left."""
    try:
        found = json.loads(Path(path).read_text())
    except (OSError, ValueError) as why:
        refuse(path, f"cannot be read as results: {why}; curves.py run --out {path} makes them")
    if not isinstance(found, dict) or not found.keys() >= {"task", "policy", "seed", "name", "results"}:
        refuse(path, "holds no results of curves.py run; give a file that its --out has named")
    return found


def points(found, key):
    """The values along a curve that were run, each with the share of the episodes solved [%]; the nominal value's is that of the nominal arm."""
    at = [(value, {} if value == jaco_mujoco.NOMINAL[key] else {key: value}) for value in CURVES[key][1]]
    return [(value, 100 * r["successes"] / r["episodes"]) for value, condition in at for r in found["results"] if r["condition"] == condition]


def plot(args):
    runs = [read_found(path) for path in args.results]
    tasks = list(dict.fromkeys(found["task"] for found in runs))
    names = list(dict.fromkeys(found["name"] for found in runs))
    plt.rcParams.update({"svg.hashsalt": "hilt", "svg.fonttype": "none", "font.size": 8, "font.family": "sans-serif"})
    size = (2.0 * len(CURVES), 1.9 * len(tasks) + 0.4)
    figure, axes = plt.subplots(len(tasks), len(CURVES), figsize=size, sharey=True, layout="constrained", squeeze=False)
    for row, task in zip(axes, tasks):
        row[0].set_ylabel(f"{task}\nsolved [%]")
        for axis, (key, (label, _)) in zip(row, CURVES.items()):
            axis.axvline(jaco_mujoco.NOMINAL[key] * SCALE.get(key, 1), color="0.85", linewidth=1, zorder=0)
            for found in (found for found in runs if found["task"] == task):
                run_at = points(found, key)
                style = LINES[names.index(found["name"]) % len(LINES)]
                axis.plot([v * SCALE.get(key, 1) for v, _ in run_at], [share for _, share in run_at], markersize=3, label=found["name"], **style)
            axis.set(ylim=(-4, 104), xlabel=label if task == tasks[-1] else None)
    lines = {text: line for axis in axes.flat for line, text in zip(*axis.get_legend_handles_labels())}
    figure.legend(lines.values(), lines.keys(), loc="outside upper center", ncols=4, frameon=False)
    figure.savefig(args.out, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("run", help="evaluate a policy, which takes tens of minutes; stopped, it goes on")
    one.add_argument("policy", help="as for jaco_mujoco.py, and so are --starts and --robot")
    one.add_argument("--starts", required=True)
    one.add_argument("--robot", required=True)
    one.add_argument("--name", required=True, help="what the line is called in the picture")
    one.add_argument("--episodes", type=at_least(0), default=500, help="on the nominal arm")
    one.add_argument("--curve-episodes", type=at_least(0), default=50, help="for each point of a curve, and with everything drawn at once; 0: none")
    one.add_argument("--seed", type=at_least(0), default=0)
    one.add_argument("--jobs", type=at_least(1), default=os.cpu_count())
    one.add_argument("--out", required=True, help="FILE.json")
    one.set_defaults(run=run)
    picture = commands.add_parser("plot", help="draw what runs have found")
    picture.add_argument("results", nargs="+", help="FILE.json of run")
    picture.add_argument("--out", required=True, help="FILE.svg")
    picture.set_defaults(run=plot)
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
