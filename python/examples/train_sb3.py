"""Trains PPO of Stable-Baselines3 in a task of hilt's, and evaluates it on hilt's own episodes.

    pip install stable-baselines3
    python train_sb3.py pick-up --steps 4096

A few thousand steps show that it runs; they solve nothing. Training draws episodes that no evaluation has.
"""

import argparse

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor

from hilt_gym import HiltEnv

# Control steps of an episode: 10 s.
HORIZON = 200


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task")
    parser.add_argument("--steps", type=int, default=4096)
    parser.add_argument("--episodes", type=int, default=5, help="of the evaluation")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--hilt", help="the binary, where it is not on the PATH")
    args = parser.parse_args()

    def world(episodes):
        return HiltEnv(args.task, seed=args.seed, episodes=episodes, horizon_steps=HORIZON, flat=True, binary=args.hilt)

    with world("training") as env:
        model = PPO("MlpPolicy", Monitor(env), seed=args.seed, n_steps=1024, device="cpu", verbose=1)
        model.learn(args.steps)
    with world("evaluation") as env:
        results = []
        for _ in range(args.episodes):
            observation, _ = env.reset()
            over = False
            while not over:
                action, _ = model.predict(observation, deterministic=True)
                observation, _, terminated, truncated, info = env.step(action)
                over = terminated or truncated
            results.append((info["success"], info["return"]))
    successes = sum(success for success, _ in results)
    print(f"{args.task}: success {successes} of {args.episodes}, mean return {np.mean([r for _, r in results]):.3f}")


if __name__ == "__main__":
    main()
