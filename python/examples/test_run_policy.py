"""A policy of a dataset of another program, by the page and by the example: pytest test_run_policy.py (needs numpy, safetensors and pytest)."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from run_policy import Policy
from safetensors.numpy import save_file

HERE = Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "docs/run-a-policy.md"


def foreign(path):
    """A file as `hilt train --dataset` writes it: numbers in, commands out, no limits, no arm."""
    state, action, hidden = ["x", "y", "goal"], ["fx", "fy"], [4]
    span = lambda name, holds, entries: {"name": name, "holds": holds, "entries": entries}
    layout = {"name": "point", "period_s": 0.1, "action": [span("action", "commands", action)], "action_limits": [], "aims": [], "arm": None}
    layout["state"] = [span("observation.state", "numbers", state[:2]), span("observation.goal", "numbers", state[2:])]
    meta = {"layout": layout, "features": "raw", "mask_dq": False, "inputs": state, "activation": "tanh", "hidden": hidden, "task": "point"}
    rng = np.random.default_rng(0)
    shapes = {"state.mean": [3], "derived.mean": [0], "action.mean": [2], "layer_1.weight": [3, 4], "layer_1.bias": [4]}
    shapes |= {"layer_2.weight": [4, 2], "layer_2.bias": [2], "log_std": [2]}
    tensors = {f"policy.{name}": rng.standard_normal(shape).astype(np.float32) for name, shape in shapes.items()}
    tensors |= {f"policy.{row}.std": np.full(count, 0.5, np.float32) for row, count in (("state", 3), ("derived", 0), ("action", 2))}
    save_file(tensors, path, metadata={"hilt": json.dumps({"kind": "policy", "meta": meta})})
    return {name.removeprefix("policy."): tensor for name, tensor in tensors.items()}


def test_a_policy_of_numbers_runs(tmp_path, monkeypatch):
    t = foreign(tmp_path / "policy.safetensors")
    states = np.random.default_rng(1).standard_normal((5, 3)).astype(np.float32)
    inner = np.tanh((states - t["state.mean"]) / t["state.std"] @ t["layer_1.weight"] + t["layer_1.bias"])
    known = t["action.mean"] + t["action.std"] * (inner @ t["layer_2.weight"] + t["layer_2.bias"])
    assert np.allclose(Policy(tmp_path / "policy.safetensors").act(states), known, rtol=0, atol=1e-6)

    monkeypatch.chdir(tmp_path)
    np.save("states.npy", states)
    subprocess.run([sys.executable, HERE / "run_policy.py", "policy.safetensors", "states.npy", "actions.npy"], check=True)
    assert np.allclose(np.load("actions.npy"), known, rtol=0, atol=1e-6)

    # What the page's first block, which needs onnxruntime and the exported file, would have left.
    names = {"state": states, "action": known}
    for code in re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)[1:]:
        exec(compile(code, str(PAGE), "exec"), names)
    assert np.array_equal(names["command"], names["act"](states)), "nothing is limited where no limit is known"
