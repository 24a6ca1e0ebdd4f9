"""A task of hilt's as a Gymnasium environment."""

import gymnasium
import numpy as np
from gymnasium import spaces

from .attached import Attached

STATE = "observation.state"
ENVIRONMENT = "observation.environment_state"
# No number of a state is larger: such a simulation has broken down.
MOST = 1e6


class HiltEnv(gymnasium.Env):
    """The simulated world of a hilt task: joint velocities in, LeRobot's observation keys out.

    Episode N of seed S is episode N of ``hilt evaluate --seed S``: the same scene and the same noise. ``episodes="training"`` draws others,
    of which no evaluation has any. ``reset()`` goes on to the next episode, ``reset(seed=S)`` to episode 0 of seed S (its first call without a
    seed to that of the constructor), ``reset(options={"episode": N})`` to that one.

    ``address`` is that of a running ``hilt serve-env``; without one, it is started here with ``task`` and the further ``arguments`` of its
    command line, and ended by ``close()``. ``flat=True`` makes an observation one row, the state as hilt's files have it.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        task=None,
        *,
        seed=0,
        episodes="evaluation",
        horizon_steps=None,
        flat=False,
        address=None,
        token=None,
        binary=None,
        arguments=(),
    ):
        if (address is None) == (task is None):
            raise ValueError("give a task, whose server is started here, or the address of a server")
        self._server = Attached("serve-env", "--task", str(task), *arguments, address=address, token=token, binary=binary)
        self.about = about = self._server.metadata
        if about.get("kind") != "environment":
            self.close()
            raise ValueError(f"{self._server.address} serves no environment of hilt's")
        self._first, self._horizon, self._episodes, self._flat = int(seed), horizon_steps, episodes, flat
        widths = {key: len(names) for key, names in about["keys"].items() if names}
        box = lambda width: spaces.Box(-MOST, MOST, (width,), np.float32)
        self.observation_space = (
            box(sum(widths.values())) if flat else spaces.Dict({key: box(width) for key, width in widths.items()})
        )
        limits = np.asarray(about["action_limits"], np.float32)
        self.action_space = spaces.Box(-limits, limits, dtype=np.float32)

    def _seen(self, answer):
        observation = answer["observation"]
        if not self._flat:
            return observation
        return np.concatenate([observation[key] for key in (STATE, ENVIRONMENT) if key in observation])

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        asked = {"episodes": self._episodes, **(options or {})}
        if self._horizon is not None:
            asked.setdefault("horizon_steps", int(self._horizon))
        if seed is None and self._first is not None:
            seed = self._first
        if seed is not None:
            asked.setdefault("seed", int(seed))
            asked.setdefault("episode", 0)
        self._first = None
        answer = self._server.ask({"reset": asked})
        return self._seen(answer), answer["info"]

    def step(self, action):
        answer = self._server.ask({"step": {"action": np.asarray(action, np.float32)}})
        info = answer["info"]
        # The name under which Stable-Baselines3 and LeRobot look for it.
        info["is_success"] = info["success"]
        return self._seen(answer), float(answer["reward"]), answer["terminated"], answer["truncated"], info

    def close(self):
        self._server.close()
