"""Corrective labels lead where they should: PYTHONPATH=../convert pytest test_labels.py (needs requirements.txt, pytest; HILT names the binary)."""

import os
import subprocess

import numpy as np
import pyarrow.parquet as pq
import pytest
from labels import CONVERGED, Dynamics, corrective
from lerobot_v3 import write


class Linear:
    """s' = s - .1 s + a, of two entries and what they were a step before."""

    names = ["x", "y", "before.x", "before.y"]
    state, action, step = (np.zeros(4), np.ones(4)), (np.zeros(2), np.ones(2)), (np.zeros(4), 0.1 * np.ones(4))

    def __call__(self, states, actions):
        now = states[:, :2]
        return np.hstack([actions - 0.1 * now, now - states[:, 2:]])


def demonstration(f, steps, rng):
    states, actions = [np.zeros(4)], 0.1 * rng.standard_normal((steps, 2))
    for action in actions:
        states.append(states[-1] + f(states[-1][None], action[None])[0])
    return np.array(states), actions


def test_labels_end_on_the_demonstration():
    f, rng = Linear(), np.random.default_rng(0)
    states, actions = demonstration(f, 30, rng)
    found, given, ends = corrective(f, states, actions, rng)
    assert 15 <= len(found) <= 31, "half of the 60 that could be made"
    assert np.abs(given).max() <= 1.0
    there = np.abs(ends[:, None, :2] - states[None, :, :2]).max(axis=2).min(axis=1)
    assert (there < CONVERGED * 0.1 * 1.01).all(), "each ends in a state of the demonstration"
    away = np.abs(found[:, None, :2] - states[None, :, :2]).max(axis=2).min(axis=1)
    assert (away > 1e-3).mean() > 0.8, "and begins beside it"
    assert np.allclose(ends[:, 2:], found[:, :2]), "what is shown of the step before is where it began"


def test_a_network_without_slope_makes_no_labels_that_do_not_converge():
    class Steep(Linear):
        def __call__(self, states, actions):
            return 5.0 * super().__call__(states, actions) + np.sin(1e3 * states)

    states, actions = demonstration(Linear(), 20, np.random.default_rng(1))
    found, _, _ = corrective(Steep(), states, actions, np.random.default_rng(2))
    assert len(found) < 10


@pytest.mark.skipif("HILT" not in os.environ, reason="HILT names no binary")
def test_the_network_is_that_of_hilt(tmp_path):
    """Its one-step error on validation episodes is the one that hilt reports."""
    f, rng = Linear(), np.random.default_rng(0)
    parts = {"train": [demonstration(f, 40, rng) for _ in range(4)], "validation": [demonstration(f, 40, rng) for _ in range(2)]}
    for part, demos in parts.items():
        episodes = ({"observation.state": s[:-1], "next.observation.state": s[1:], "action": a} for s, a in demos)
        write(tmp_path / "data" / part, (("", episode) for episode in episodes), 10, names={"observation.state": f.names})
    out = tmp_path / "dynamics.safetensors"
    subprocess.run([os.environ["HILT"], "pretrain", "--dataset", tmp_path / "data", "--out", out, "--set", "pretrain.epochs=3"], check=True)
    network = Dynamics(out)
    errors = [s[1:] - s[:-1] - network(s[:-1], a) for s, a in ((s.astype(np.float32), a.astype(np.float32)) for s, a in parts["validation"])]
    said = pq.read_table(tmp_path / "dynamics.errors.parquet").to_pylist()[0]["network_1_step"]
    assert np.sqrt(np.mean(np.square(np.concatenate(errors)))) == pytest.approx(said, rel=1e-4)
