"""What the runs of study.py come to: report.md, runs.csv and summary.svg.

    python report.py runs/meta-world --out docs/results/meta-world

Counts only tasks and seeds of which all methods are finished with all numbers of demonstrations. Intervals are 95 %, by the bootstrap over tasks, and
over seeds within them: what another choice of tasks would have given. The interquartile mean is that of rliable (Agarwal et al., NeurIPS 2021), over
all tasks and seeds.
"""

import argparse
import csv
import json
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

DRAWS = 4000
EVEN = 0.05  # difference in success below which a task counts as even, for one seed of 50 episodes about one standard error
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
    """Mean difference with its interval; the probability that we do better on a task; tasks better, even and worse."""
    difference = lambda choice: np.mean([(ours[task][rows] - theirs[task][rows]).mean() for task, rows in choice])
    low, high = intervals(seeds, difference)
    every = {task: (ours[task] - theirs[task]).mean() for task in seeds}
    better = np.mean([np.mean((ours[task][:, None] > theirs[task]) + 0.5 * (ours[task][:, None] == theirs[task])) for task in seeds])
    counts = [sum(d > EVEN for d in every.values()), sum(abs(d) <= EVEN for d in every.values()), sum(d < -EVEN for d in every.values())]
    return np.mean(list(every.values())), low, high, better, counts


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
            d, low, high, better, split = paired(seeds, table[demos, "hil"], table[demos, method])
            lines.append(f"| {demos} | {method} | {100 * d:+.1f} [{100 * low:+.1f}, {100 * high:+.1f}] | {better:.2f} | {split[0]}, {split[1]}, {split[2]} |")
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
    said, trained = json.loads((args.runs / "study.json").read_text()), sum(map(len, seeds.values()))
    whole = [run for key, run in runs.items() if key[1] in seeds.get(key[0], ())]
    found, lines = summary(counts, methods, seeds, table)
    args.out.mkdir(parents=True, exist_ok=True)
    draw(args.out / "summary.svg", counts, methods, found)
    numbers = sorted({seed for of in seeds.values() for seed in of})
    text = [
        "# Meta-World: HIL against its rivals",
        "",
        f"{len(seeds)} of Meta-World's 50 tasks, {trained} pairs of task and training seed (seeds {', '.join(map(str, numbers))}), {len(whole)} runs of "
        f"{said['episodes']} episodes each. Tasks are done in an order of chance. Experts, success and simulator are Meta-World's own; "
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
        *rivals(counts, methods, seeds, table),
        "",
        "*Processor time to learn, mean: pretraining of the dynamics network counts for both that use it.*",
        "",
        *times(counts, methods, runs, seeds),
        "",
        f"*Solved of each task, mean over seeds [%], by the number of demonstrations; in each cell {', '.join(methods)}.*",
        "",
        *by_task(counts, methods, seeds, table),
        "",
    ]
    (args.out / "report.md").write_text("\n".join(text))
    with open(args.out / "runs.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["task", "seed", "demos", "method", "successes", "episodes", "learning_s", "steps", "most_steps"])
        rows.writerows([run[key] for key in ("task", "seed", "demos", "method", "successes", "episodes", "learning_s", "steps", "most_steps")] for run in whole)
    print("\n".join(lines + [""] + rivals(counts, methods, seeds, table)))
    print(args.out / "report.md")


if __name__ == "__main__":
    main()
