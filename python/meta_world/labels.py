"""Corrective labels from a dynamics network: a rival of hybrid imitation learning that uses the same network in another way.

After CCIL (Ke et al., Continuity-based Data Augmentation for Corrective Imitation Learning, arXiv 2310.12972): states beside the demonstrations
from which an action, by the network, leads back onto them. Two kinds: the expert's own action that ends where the expert was (BackTrack), and the
expert's action with noise that ends where the expert went (DisturbedAction). Each state is the root of s + f(s, a) = s*, found by iteration
(backward Euler), and counts if the iteration converges and the label's error, bounded by the local Lipschitz constant of f times the distance
to the demonstration, is among the smaller ones. Weights come as `hilt pretrain` writes them: another dynamics network than theirs, which
bounds the constant while it learns.
"""

import json

import numpy as np
from safetensors import safe_open

ACTION_NOISE = 0.3  # of DisturbedAction, in standard deviations of the demonstrations' actions
ITERATIONS = 20
CONVERGED = 1e-3  # residual of the root, in standard deviations of a step's change
KEPT = 0.5  # share of the labels with the smallest bound of the error that is kept
NUDGE = 1e-3  # of the finite differences, in standard deviations of the state
LAST = "before."  # entries that repeat what the step before showed


class Dynamics:
    """f of `dynamics.safetensors`: how much each entry of a state changes in a step. Raw features only."""

    def __init__(self, path):
        with safe_open(path, framework="np") as file:
            meta = json.loads(file.metadata()["hilt"])["meta"]
            t = {name.removeprefix("dynamics."): file.get_tensor(name).astype(np.float64) for name in file.keys()}
        if meta["features"] != "raw" or meta["activation"] != "tanh":
            raise ValueError(f"{path}: features {meta['features']} with {meta['activation']}; raw with tanh are read here")
        self.names = [entry for span in meta["layout"]["state"] for entry in span["entries"]]
        self._layers = [(t[f"layer_{i}.weight"], t[f"layer_{i}.bias"]) for i in range(1, len(meta["hidden"]) + 2)]
        self.state, self.action, self.step = ((t[f"{of}.mean"], t[f"{of}.std"]) for of in ("state", "action", "residual"))

    def __call__(self, states, actions):
        x = np.hstack([(v - mean) / std for v, (mean, std) in ((states, self.state), (actions, self.action))])
        for weight, bias in self._layers[:-1]:
            x = np.tanh(x @ weight + bias)
        weight, bias = self._layers[-1]
        return self.step[0] + self.step[1] * (x @ weight + bias)


def corrective(f, states, actions, rng):
    """Pairs beside one demonstration of T + 1 states and T actions: states, actions and the states after them."""
    now = np.array([i for i, name in enumerate(f.names) if not name.startswith(LAST)])
    shown = {name: i for i, name in enumerate(f.names)}
    before = [(i, shown[name.removeprefix(LAST)]) for i, name in enumerate(f.names) if name.startswith(LAST)]
    states, actions = states.astype(np.float64), actions.astype(np.float64)
    noise = ACTION_NOISE * f.action[1] * rng.standard_normal(actions.shape)
    # BackTrack from its own state; DisturbedAction to the state that followed.
    starts = np.vstack([states[:-1], states[:-1]])
    ends = np.vstack([states[:-1], states[1:]])
    given = np.clip(np.vstack([actions, actions + noise]), -1.0, 1.0)
    found = starts.copy()
    for _ in range(ITERATIONS):
        found[:, now] = (ends - f(found, given))[:, now]
        for entry, of in before:  # what was shown a step ago is as far away as it was there
            found[:, entry] = found[:, of] + starts[:, entry] - starts[:, of]
    off = np.abs((found + f(found, given) - ends)[:, now] / f.step[1][now]).max(axis=1)
    away = np.linalg.norm(((found - starts) / f.state[1])[:, now], axis=1)
    bound = away * steepness(f, starts, given, now)
    good = np.isfinite(off) & (off < CONVERGED) & (away > 0)
    if good.any():
        good &= bound <= np.quantile(bound[good], KEPT)
    return found[good], given[good], (found + f(found, given))[good]


def steepness(f, states, actions, now):
    """The local Lipschitz constant of f in the state: the largest singular value of its Jacobian by finite differences, scaled by spreads."""
    here, columns = f(states, actions), []
    for i in now:
        nudged = states.copy()
        nudged[:, i] += NUDGE * f.state[1][i]
        columns.append((f(nudged, actions) - here)[:, now] / f.state[1][now] / NUDGE)
    return np.linalg.norm(np.stack(columns, axis=2), ord=2, axis=(1, 2))
