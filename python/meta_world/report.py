"""What the runs of study.py come to: report.md, runs.csv and summary.svg.

    python report.py runs/meta-world --out docs/results/meta-world

Counts only tasks and seeds of which all methods are finished with all numbers of demonstrations. Intervals are 95 %, by the bootstrap over tasks, and
over seeds within them: what another choice of tasks would have given. The interquartile mean is that of rliable (Agarwal et al., NeurIPS 2021), over
all tasks and seeds. What runs of an older study.py do not say is a dash.
"""

import argparse
import csv
import json
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib
import numpy as np
from guard import UNKNOWN

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

DRAWS = 4000
EVEN = 0.05  # difference in success below which a task counts as even, for one seed of 50 episodes about one standard error
DASH = "–"
COLUMNS = ["task", "seed", "demos", "method", "successes", "episodes", "learning_s", "steps", "most_steps", "acting_s", "policy_s"]
LINES = {
    "hil": {"color": "black", "marker": "o", "linestyle": "-"},
    "bc": {"color": "0.45", "marker": "s", "linestyle": "--"},
    "bc-ensemble": {"color": "#0072b2", "marker": "^", "linestyle": "-."},
    "ccil": {"color": "#d55e00", "marker": "D", "linestyle": ":"},
}


def read(home):
    """Runs by task, seed, demonstrations and method."""
    return {
        (run["task"], run["seed"], run["demos"], run["method"]): run
        for run in (json.loads(path.read_text()) for path in sorted(home.glob("*/*/*-*.json")))
    }


def study(path):
    """What the study was begun with, where it is known."""
    try:
        said = dict(json.loads(path.read_text()))
        return {key: value for key, value in said.items() if key not in said.get(UNKNOWN, ())}
    except (OSError, ValueError, TypeError) as why:
        sys.exit(f"error: {path} cannot be read: {why}; give the --out of study.py")


def finished(runs):
    """Success by method and number of demonstrations: a dict of tasks to rows of seeds; only of what is whole."""
    counts = sorted({demos for _, _, demos, _ in runs})
    methods = [method for method in LINES if any(key[3] == method for key in runs)]
    seeds = defaultdict(list)
    for task, seed in sorted({key[:2] for key in runs}):
        if all((task, seed, demos, method) in runs for demos in counts for method in methods):
            seeds[task].append(seed)
    rate = lambda run: run["successes"] / run["episodes"]
    table = {
        (demos, method): {task: np.array([rate(runs[task, seed, demos, method]) for seed in seeds[task]]) for task in seeds}
        for demos in counts
        for method in methods
    }
    return counts, methods, dict(seeds), table


def interquartile_mean(values):
    values = np.sort(np.concatenate(list(values)))
    quarter = len(values) // 4
    return values[quarter : len(values) - quarter].mean()


def draws(seeds, rng):
    """Choices of tasks, and of seeds of each: the same for all methods, so that differences are paired."""
    tasks = list(seeds)
    for _ in range(DRAWS):
        chosen = rng.integers(len(tasks), size=len(tasks))
        yield [(tasks[i], rng.integers(len(seeds[tasks[i]]), size=len(seeds[tasks[i]]))) for i in chosen]


def intervals(seeds, statistic):
    """95 % of `statistic`, a function of a list of tasks and seeds, over choices of them."""
    values = [statistic(choice) for choice in draws(seeds, np.random.default_rng(0))]
    return np.percentile(values, [2.5, 97.5])


def paired(seeds, ours, theirs):
    """Mean difference, and the probability that we do better on a task, each with its interval; tasks better, even and worse."""
    difference = lambda choice: np.mean([(ours[task][rows] - theirs[task][rows]).mean() for task, rows in choice])
    low, high = intervals(seeds, difference)
    every = {task: (ours[task] - theirs[task]).mean() for task in seeds}
    # Every seed of ours against every one of theirs; a draw is half a win.
    wins = {task: (ours[task][:, None] > theirs[task]) + 0.5 * (ours[task][:, None] == theirs[task]) for task in seeds}
    better = np.mean([wins[task].mean() for task in seeds])
    least, most = intervals(seeds, lambda choice: np.mean([wins[task][np.ix_(rows, rows)].mean() for task, rows in choice]))
    counts = [sum(d > EVEN for d in every.values()), sum(abs(d) <= EVEN for d in every.values()), sum(d < -EVEN for d in every.values())]
    return (np.mean(list(every.values())), low, high), (better, least, most), counts


def percent(value):
    return f"{100 * value:.1f}"


def summary(counts, methods, seeds, table):
    all_rows = [(task, np.arange(len(seeds[task]))) for task in seeds]
    iqm = lambda key: lambda choice: interquartile_mean([table[key][task][rows] for task, rows in choice])
    mean = lambda key: np.mean([table[key][task].mean() for task in seeds])
    found = {key: (iqm(key)(all_rows), *intervals(seeds, iqm(key)), mean(key)) for key in table}
    lines = ["| demonstrations | " + " | ".join(methods) + " |", "|---:|" + "---:|" * len(methods)]
    for demos in counts:
        cells = [found[demos, method] for method in methods]
        lines.append(f"| {demos} | " + " | ".join(f"{percent(i)} [{percent(low)}, {percent(high)}], mean {percent(m)}" for i, low, high, m in cells) + " |")
    return found, lines


def rivals(counts, methods, seeds, table):
    lines = ["| demonstrations | hil against | mean difference, points | P(hil better) | tasks better, even, worse |", "|---:|---|---:|---:|---:|"]
    for demos in counts:
        for method in (method for method in methods if method != "hil"):
            difference, better, split = paired(seeds, table[demos, "hil"], table[demos, method])
            points, chance = "{:+.1f} [{:+.1f}, {:+.1f}]".format(*(100 * value for value in difference)), "{:.2f} [{:.2f}, {:.2f}]".format(*better)
            lines.append(f"| {demos} | {method} | {points} | {chance} | {split[0]}, {split[1]}, {split[2]} |")
    return lines


def by_task(counts, methods, seeds, table):
    lines = ["| task | seeds | " + " | ".join(f"{demos}: {', '.join(methods)}" for demos in counts) + " |", "|---|---:|" + "---|" * len(counts)]
    for task in sorted(seeds):
        cells = [" ".join(f"{100 * table[demos, method][task].mean():.0f}" for method in methods) for demos in counts]
        lines.append(f"| {task} | {len(seeds[task])} | " + " | ".join(cells) + " |")
    return lines


def times(counts, methods, runs, seeds):
    lines = ["| demonstrations | " + " | ".join(methods) + " |", "|---:|" + "---:|" * len(methods)]
    whole = [(task, seed) for task in seeds for seed in seeds[task]]
    for demos in counts:
        cells = [np.mean([runs[task, seed, demos, method]["learning_s"] for task, seed in whole]) for method in methods]
        lines.append(f"| {demos} | " + " | ".join(f"{cell:.1f} s" for cell in cells) + " |")
    return lines


def hours(methods, runs):
    """What the runs took in all, and how fast the served policies were; a dash where not all of the runs say it."""
    lines = ["| | " + " | ".join(methods) + " | all |", "|---|" + "---:|" * (len(methods) + 1)]
    groups = [[run for run in runs if method in (run["method"], None)] for method in [*methods, None]]
    total = lambda key, of: sum(run[key] for run in of) if all(run.get(key) is not None for run in of) else None
    rate = lambda key, of: total("steps", of) / total(key, of) if total(key, of) else None
    for words, value in (
        ("hours of processor time to learn", lambda of: total("learning_s", of) / 3600),
        ("hours to act, by the clock", lambda of: None if total("acting_s", of) is None else total("acting_s", of) / 3600),
        ("control steps a second while acting", lambda of: rate("acting_s", of)),
        ("answers a second of the served policies alone", lambda of: rate("policy_s", of)),
    ):
        cells = [DASH if found is None else f"{found:.2f}" if found < 10 else f"{found:.0f}" for found in map(value, groups)]
        lines.append(f"| {words} | " + " | ".join(cells) + " |")
    return lines


def draw(path, counts, methods, found):
    plt.rcParams.update({"svg.hashsalt": "hilt", "svg.fonttype": "none", "font.size": 9, "font.family": "sans-serif"})
    figure, axis = plt.subplots(figsize=(5.2, 3.2), layout="constrained")
    places = np.arange(len(counts))
    for i, method in enumerate(methods):
        middle, low, high, _ = (100 * np.array(values) for values in zip(*(found[demos, method] for demos in counts)))
        at = places + 0.06 * (i - (len(methods) - 1) / 2)
        axis.errorbar(at, middle, yerr=[middle - low, high - middle], label=method, markersize=4, linewidth=1.2, capsize=2, **LINES[method])
    axis.set(xticks=places, xticklabels=counts, xlabel="demonstrations", ylabel="solved, interquartile mean [%]", ylim=(-3, 103))
    axis.legend(frameon=False, loc="lower right")
    figure.savefig(path, metadata={"Date": None})


def main():
    words = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    words.add_argument("runs", type=Path)
    words.add_argument("--out", type=Path, required=True)
    args = words.parse_args()
    runs = read(args.runs)
    counts, methods, seeds, table = finished(runs)
    if not seeds:
        sys.exit(f"error: {args.runs}: no task is finished with all methods; run study.py first")
    said, trained = study(args.runs / "study.json"), sum(map(len, seeds.values()))
    whole = [run for key, run in runs.items() if key[1] in seeds.get(key[0], ())]
    found, lines = summary(counts, methods, seeds, table)
    against = rivals(counts, methods, seeds, table)
    args.out.mkdir(parents=True, exist_ok=True)
    draw(args.out / "summary.svg", counts, methods, found)
    numbers = sorted({seed for of in seeds.values() for seed in of})
    text = [
        "# Meta-World: HIL against its rivals",
        "",
        f"{len(seeds)} of Meta-World's 50 tasks, {trained} pairs of task and training seed (seeds {', '.join(map(str, numbers))}), {len(whole)} runs of "
        f"{said.get('episodes', DASH)} episodes each ({said.get('hilt', 'hilt ' + DASH)}, commit {said.get('commit') or DASH}). Tasks are done in an order of chance. Experts, success and simulator are Meta-World's own; "
        "[how](../../meta-world.md).",
        "",
        "![Success over the number of demonstrations](summary.svg)",
        "",
        "*Solved, interquartile mean over tasks and seeds with its 95 % interval over tasks [%]; then the plain mean.*",
        "",
        *lines,
        "",
        "*The same tasks, seeds and episodes side by side. A task is even within 5 points.*",
        "",
        *against,
        "",
        "*Processor time to learn, mean: pretraining of the dynamics network counts for both that use it.*",
        "",
        *times(counts, methods, runs, seeds),
        "",
        f"*All of these runs together. Pretraining counts for both that use it; the ensemble asks five policies for each step. {DASH}: not all runs say it.*",
        "",
        *hours(methods, whole),
        "",
        f"*Solved of each task, mean over seeds [%], by the number of demonstrations; in each cell {', '.join(methods)}.*",
        "",
        *by_task(counts, methods, seeds, table),
        "",
    ]
    (args.out / "report.md").write_text("\n".join(text))
    with open(args.out / "runs.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        rows.writerows([run.get(key, DASH) for key in COLUMNS] for run in whole)
    print("\n".join(lines + [""] + against))
    print(args.out / "report.md")


if __name__ == "__main__":
    main()
