"""Serves a policy that LeRobot has trained on hilt's datasets (lerobot 0.6.1), so that hilt evaluates it:

    lerobot-train --dataset.repo_id=local/stack --dataset.root=runs/stack/dataset/train --policy.type=act ...
    python serve_lerobot.py outputs/train/.../checkpoints/last/pretrained_model
    hilt evaluate --task stack --policy ws://127.0.0.1:8000

Every episode gets a copy of the policy: ACT keeps the actions that it has not executed yet.
"""

import argparse
import copy

import numpy as np
import torch
from lerobot.configs import PreTrainedConfig
from lerobot.policies.factory import get_policy_class, make_pre_post_processors

from hilt_gym import serve_policy

KEYS = ("observation.state", "observation.environment_state")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint", help="a directory pretrained_model")
    parser.add_argument("--port", type=int, default=8000)
    parser.add_argument("--device", default="cpu")
    args = parser.parse_args()

    config = PreTrainedConfig.from_pretrained(args.checkpoint)
    config.device = args.device
    policy = get_policy_class(config.type).from_pretrained(args.checkpoint, config=config)
    device = {"device_processor": {"device": args.device}}
    before, after = make_pre_post_processors(config, pretrained_path=args.checkpoint, preprocessor_overrides=device)

    def make():
        own = copy.deepcopy(policy)
        own.reset()

        @torch.inference_mode()
        def act(observation):
            seen = {key: torch.from_numpy(np.asarray(observation[key], np.float32))[None] for key in KEYS if key in observation}
            seen["task"] = [observation.get("task", "")]
            return after(own.select_action(before(seen))).squeeze(0).cpu().numpy()

        return act

    about = {"server": f"lerobot {config.type}", "kind": "policy"}
    serve_policy(make=make, metadata=about, port=args.port)


if __name__ == "__main__":
    main()
