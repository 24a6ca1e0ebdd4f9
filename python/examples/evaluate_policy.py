"""Evaluates a policy of hilt's through the Gymnasium environment: the episodes of `hilt evaluate`, one after the other.

    python evaluate_policy.py stack runs/stack/policy.safetensors --episodes 20
"""

import argparse

from hilt_gym import HiltEnv, PolicyClient


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task")
    parser.add_argument("policy")
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--hilt", help="the binary, where it is not on the PATH")
    args = parser.parse_args()

    with PolicyClient(args.policy, binary=args.hilt) as policy:
        horizon = policy.about["horizon_steps"]
        with HiltEnv(args.task, seed=args.seed, horizon_steps=horizon, binary=args.hilt) as env:
            successes = 0
            for episode in range(args.episodes):
                observation, _ = env.reset()
                policy.reset(episode)
                over = False
                while not over:
                    answer = policy.infer(observation)
                    # Before limits: the simulator has its own, as in `hilt evaluate`.
                    action = answer.get("unlimited_actions", answer["actions"])[0]
                    observation, _, terminated, truncated, info = env.step(action)
                    over = terminated or truncated
                successes += info["success"]
                print(f"episode {episode}: {'success' if info['success'] else info['failure']} in {info['steps']} steps")
    print(f"{args.task}: success {successes} of {args.episodes}")


if __name__ == "__main__":
    main()
