"""What is not mixed, and what the report says of old and new runs: pytest test_study.py (needs requirements.txt and pytest)."""

import json
import subprocess
import sys
from pathlib import Path

import guard
import pytest
import report

OLD = {"EPISODES": 2, "hilt": "hilt 0.1.0"}
NOW = OLD | {"commit": "abc", "METHODS": ["bc", "hil"], "sha256 labels.py": "1" * 64}


def binary(path, commit, more=""):
    lines = "hilt 0.1.0\n" + (f"commit: {commit}\n" if commit else "") + "kernel: avx2 (in a trial)\n"
    path.write_text(f"#!/bin/sh\n{more}\ncat <<END\n{lines}END\n")
    path.chmod(0o755)
    return str(path)


def test_which_hilt_it_is(tmp_path):
    assert guard.built(binary(tmp_path / "a", "abc")) == {"hilt": "hilt 0.1.0", "commit": "abc"}
    for said, commit in ((None, None), ("abc-dirty", "abc-dirty"), ("unknown: not built from its repository", None)):
        first, other = [guard.built(binary(tmp_path / name, said, more)) for name, more in (("b", ""), ("c", ": more"))]
        assert first["commit"] == commit and first["binary_sha256"] != other["binary_sha256"], "the commit does not say all"
    with pytest.raises(SystemExit, match="does not run"):
        guard.built(str(tmp_path / "none"))


def test_a_study_goes_on_with_what_it_was_begun_with(tmp_path):
    out = tmp_path / "study"
    for _ in range(2):
        guard.same_study(out, NOW)
    for odd, said in [
        ({"commit": "def"}, "commit abc then, def now"),
        ({"METHODS": ["bc"]}, "METHODS"),
        ({"sha256 labels.py": "2" * 64}, "sha256 labels.py 111111111111 then, 222222222222 now"),
        ({"EPISODES": 3}, "EPISODES 2 then, 3 now"),
    ]:
        with pytest.raises(SystemExit, match=said):
            guard.same_study(out, NOW | odd)
    assert json.loads((out / "study.json").read_text()) == NOW


def test_a_study_of_the_older_guard_goes_on(tmp_path):
    guard.whole(tmp_path / "study.json", OLD)
    with pytest.raises(SystemExit, match="EPISODES"):
        guard.same_study(tmp_path, NOW | {"EPISODES": 3})
    assert json.loads((tmp_path / "study.json").read_text()) == OLD, "refused, it stays as it is"
    for _ in range(2):
        guard.same_study(tmp_path, NOW)
    assert json.loads((tmp_path / "study.json").read_text()) == NOW | {guard.UNKNOWN: ["METHODS", "commit", "sha256 labels.py"]}
    with pytest.raises(SystemExit, match="commit abc then, def now"):
        guard.same_study(tmp_path, NOW | {"commit": "def"})
    (tmp_path / "study.json").write_text("no JSON")
    with pytest.raises(SystemExit, match="cannot be read"):
        guard.same_study(tmp_path, NOW)


def runs(home, more):
    for task, solved in (("a", 2), ("b", 1), ("c", 0)):
        for method, lost in (("hil", 0), ("bc", 1)):
            run = {"task": task, "seed": 1, "demos": 5, "method": method, "episodes": 2, "successes": max(0, solved - lost), "learning_s": 1800.0}
            (home / task / "1").mkdir(parents=True, exist_ok=True)
            guard.whole(home / task / "1" / f"5-{method}.json", run | {"steps": 3600, "most_steps": 9} | more)


@pytest.mark.parametrize("new", [False, True])
def test_the_report_reads_old_and_new_runs(tmp_path, new):
    runs(tmp_path / "runs", {"acting_s": 1800.0, "policy_s": 120.0} if new else {})
    guard.whole(tmp_path / "runs" / "study.json", NOW | {"episodes": 2} | ({} if new else {guard.UNKNOWN: ["commit"]}))
    command = [sys.executable, Path(report.__file__), tmp_path / "runs", "--out", tmp_path / "report"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    text, rows = (tmp_path / "report" / "report.md").read_text(), (tmp_path / "report" / "runs.csv").read_text().splitlines()
    dash = report.DASH
    assert "| hours of processor time to learn | 1.50 | 1.50 | 3.00 |" in text
    acted = ["1.50", "1.50", "3.00"] if new else [dash] * 3
    assert f"| hours to act, by the clock | {' | '.join(acted)} |" in text
    assert f"| answers a second of the served policies alone | {' | '.join(['30'] * 3 if new else [dash] * 3)} |" in text
    assert ("hilt 0.1.0, commit abc" if new else f"hilt 0.1.0, commit {dash}") in text
    assert rows[1].endswith("1800.0,120.0" if new else f"{dash},{dash}")


def test_the_chance_to_be_better_has_an_interval(tmp_path):
    runs(tmp_path, {})
    counts, methods, seeds, table = report.finished(report.read(tmp_path))
    _, (better, low, high), counts = report.paired(seeds, table[5, "hil"], table[5, "bc"])
    assert better == pytest.approx(2.5 / 3) and low == 0.5 and high == 1.0 and counts == [2, 1, 0]
