"""What is refused, what is not run again, what is drawn: pytest test_transfer.py (needs requirements.txt and pytest)."""

import json
from types import SimpleNamespace

import checks
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

curves = pytest.importorskip("curves", reason="dm_control is missing", exc_type=ImportError)
BLOCK = [f"block.{entry}" for entry in checks.POSE]


def about(task="pick-up", joints=checks.JOINTS, robot=None, more=()):
    settings = {"robot": {"name": robot}} if robot else {}
    state = [*(f"{j}.q_rad" for j in joints), *(f"{j}.dq_rad_s" for j in joints), *BLOCK, *more]
    action = [f"{j}.velocity_rad_s" for j in joints]
    said = {"hilt": {"settings": settings}, "state_entries": state, "action_entries": action, "horizon_steps": 9}
    return {"task": task} | {key: json.dumps(value) for key, value in said.items()}


def starts(path, task, columns, rows=3):
    table = pa.table({name: [0.4] * rows for name in columns})
    pq.write_table(table.replace_schema_metadata({"hilt": json.dumps({"task": task})}), path)
    return path


def test_policies_of_other_tasks_and_robots_are_refused():
    checks.check_policy("p", about())
    checks.check_policy("p", about(robot="jaco"))
    checks.check_policy("p", about("stack", more=checks.TASKS["stack"][0]))
    panda = [f"panda_joint{i}" for i in range(1, 10)]
    for odd, said in [
        (about("tower"), "is a policy of task tower; this world has pick-up, pick-and-place, stack"),
        (about(joints=panda, robot="panda"), "is a policy of robot panda"),
        (about(joints=panda), "has panda_joint1.q_rad in its state where this world has joint_1.q_rad"),
        (about("stack"), "has 25 entries in its state, this world has 32"),
    ]:
        with pytest.raises(SystemExit, match=said):
            checks.check_policy("p", odd)


def test_what_else_is_given_is_refused_in_words(tmp_path):
    (tmp_path / "no.onnx").write_bytes(b"no model")
    (tmp_path / "panda.toml").write_text("ready = [0, 0, 0, 0, 0, 0, 0]\n[hand]\nopened = [0.04, 0.04]\n")
    of_stack = starts(tmp_path / "stack.parquet", "stack", ["block.x_m", "block.y_m", "base.x_m", "base.y_m"])
    assert len(checks.read_starts(of_stack, "stack")) == 3
    for call, said in [
        (lambda: checks.read_policy(str(tmp_path / "no.onnx")), "cannot be read as ONNX"),
        (lambda: checks.read_policy(str(tmp_path / "none.onnx")), "cannot be read as ONNX"),
        (lambda: checks.read_starts(of_stack, "pick-up"), "has starts of task stack, the policy is of pick-up"),
        (lambda: checks.read_starts(starts(tmp_path / "a", "stack", ["block.x_m", "block.y_m"]), "stack"), "has no column base.x_m"),
        (lambda: checks.read_starts(starts(tmp_path / "b", "pick-up", ["block.x_m", "block.y_m"], 0), "pick-up"), "has no episode"),
        (lambda: checks.read_starts(tmp_path / "none", "pick-up"), "cannot be read"),
        (lambda: checks.read_ready(tmp_path / "panda.toml"), "7 arm joints and 2 fingers"),
        (lambda: checks.read_ready(tmp_path / "none.toml"), "cannot be read as a robot"),
        (lambda: checks.read_condition(["mass=heavy"], ["mass"]), 'mass is "heavy"'),
        (lambda: checks.read_condition(["mass=[1]"], ["mass"]), "a number or .low, high. is needed"),
        (lambda: checks.read_condition(["weight=1"], ["mass"]), "there is no weight; there are mass"),
    ]:
        with pytest.raises(SystemExit, match=said):
            call()
    assert checks.read_condition(["mass=[0.1,2]", "delay=1"], ["mass", "delay"]) == {"mass": [0.1, 2], "delay": 1}


def test_what_has_run_is_not_run_again_and_is_drawn(tmp_path, monkeypatch):
    runs = []

    def evaluate(policy, starts, robot, condition, episodes, seed, jobs):
        runs.append((condition, episodes))
        return [{"success": True}] * min(episodes, 3)

    monkeypatch.setattr(curves.jaco_mujoco, "evaluate", evaluate)
    monkeypatch.setattr(curves, "read_policy", lambda path: about())
    (tmp_path / "policy.onnx").touch()
    asked = {"policy": tmp_path / "policy.onnx", "starts": starts(tmp_path / "s", "pick-up", ["block.x_m", "block.y_m"]), "robot": "jaco.toml"}
    asked |= {"name": "x", "out": tmp_path / "t.json", "seed": 0, "jobs": 1}
    draw = SimpleNamespace(results=[tmp_path / "t.json"], out=tmp_path / "t.svg")
    with pytest.raises(SystemExit, match="cannot be read as results"):
        curves.plot(draw)
    for _ in range(2):
        curves.run(SimpleNamespace(**asked, episodes=500, curve_episodes=0))
    assert runs == [({}, 3)], "there are 3 starts, and all have run"
    curves.plot(draw)
    assert "pick-up" in draw.out.read_text(), "the nominal arm alone is a picture too"
    for _ in range(2):
        curves.run(SimpleNamespace(**asked, episodes=500, curve_episodes=50))
    assert len(runs) == len(curves.conditions())
    curves.plot(draw)
    (tmp_path / "t.json").write_text("[]")
    with pytest.raises(SystemExit, match="holds no results of curves.py run"):
        curves.plot(draw)
