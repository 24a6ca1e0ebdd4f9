"""Meta-World (50 tasks of a Sawyer arm in MuJoCo) as the study sees it: starts, scripted experts, demonstrations, success.

Observations are Meta-World's own: 39 numbers, the goal among them; actions are its 4 numbers in [-1, 1]. Success is its own flag.
"""

import warnings

import metaworld
import numpy as np
from metaworld.policies import ENV_POLICY_MAP

TASKS = sorted(ENV_POLICY_MAP)
RATE_HZ = 80  # MuJoCo's .0025 s, five substeps a step
MOST_STEPS = 500  # Meta-World's own max_path_length
AFTER_SUCCESS = 10  # steps that a demonstration goes on, so that its end is no edge
# Names of the entries of an observation: what Meta-World gives, then the same of the step before, then the goal.
NOW = ["hand.x", "hand.y", "hand.z", "gripper"]
NOW += [f"object_{i}.{entry}" for i in (1, 2) for entry in ("x", "y", "z", "q0", "q1", "q2", "q3")]
STATE = NOW + [f"before.{name}" for name in NOW] + ["goal.x", "goal.y", "goal.z"]
ACTION = ["hand.dx", "hand.dy", "hand.dz", "grip"]

warnings.filterwarnings("ignore", message="Constant.s. may be too high")  # experts ask for more than 1; the command is clipped


class World:
    """One task, with the 50 starts that Meta-World draws from a seed."""

    def __init__(self, task, seed):
        benchmark = metaworld.MT1(task, seed=seed)
        self.task, self.starts = task, benchmark.train_tasks
        self._world = benchmark.train_classes[task]()

    def run(self, start, act, most_steps=MOST_STEPS, after_success=0):
        """States (T + 1), actions, rewards and success flags (T each) of an episode under `act`, a function of the observation."""
        self._world.set_task(self.starts[start])
        state, _ = self._world.reset()
        states, actions, rewards, solved, left = [state], [], [], [], after_success
        for _ in range(most_steps):
            action = np.clip(np.asarray(act(state.astype(np.float32)), np.float64), -1.0, 1.0)
            state, reward, _, over, info = self._world.step(action)
            states.append(state)
            actions.append(action)
            rewards.append(reward)
            solved.append(info["success"] > 0)
            if any(solved):
                left -= 1
            if over or (any(solved) and left < 0):
                break
        return np.array(states, np.float32), np.array(actions, np.float32), np.array(rewards, np.float32), np.array(solved)


def demonstrations(task, seed, count):
    """The first `count` episodes that the scripted expert solves, and how many it was given."""
    episodes, tried = [], 0
    while len(episodes) < count and tried < 8 * count + 50:
        world, expert = World(task, seed + tried), ENV_POLICY_MAP[task]()
        for start in range(len(world.starts)):
            tried += 1
            episode = world.run(start, lambda state: expert.get_action(state.astype(np.float64)), after_success=AFTER_SUCCESS)
            if episode[3].any():
                episodes.append(episode)
            if len(episodes) == count:
                break
    if len(episodes) < count:
        raise RuntimeError(f"{task}: the expert solves {len(episodes)} of {tried}; {count} demonstrations are needed")
    return episodes, tried


def columns(episode):
    """An episode as columns of a LeRobotDataset; every transition is told whole."""
    states, actions, rewards, solved = episode
    return {"observation.state": states[:-1], "next.observation.state": states[1:], "action": actions, "next.reward": rewards, "next.success": solved}
