"""A policy of LeRobot (https://github.com/huggingface/lerobot) behind a server: ACT.

    pip install lerobot
    python3 python/examples/lerobot_policy.py [CHECKPOINT]
    evalbus run lift_pot --policy python/examples/lerobot_policy.yaml

CHECKPOINT: folder of a trained ACT policy, with what normalises for it. Without one its weights are random.

Observation: "state", 16 numbers: the 14 joint positions of the two arms (rad, left arm first), then the two
grippers' openings (1 open, 0 closed); "image", (224, 224, 3), uint8, RGB: the camera called "head" in
training.
Actions: 20 steps of 16 numbers (a checkpoint: as it was trained): 14 joint targets (rad), then the two
grippers.
"""

import sys

import evalbus
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors

RANDOM = dict(
    input_features={
        "observation.state": PolicyFeature(FeatureType.STATE, (16,)),
        "observation.images.head": PolicyFeature(FeatureType.VISUAL, (3, 224, 224)),
    },
    output_features={"action": PolicyFeature(FeatureType.ACTION, (16,))},
    chunk_size=20,
    n_action_steps=20,
    pretrained_backbone_weights=None,
    device="cpu",
)


class Policy:
    def __init__(self, checkpoint=None):
        if checkpoint:
            self.policy = ACTPolicy.from_pretrained(checkpoint)
        else:
            torch.manual_seed(0)
            self.policy = ACTPolicy(ACTConfig(**RANDOM))
        # LeRobot's policies neither normalise nor unnormalise themselves: without these a trained one acts at
        # random.
        self.before, self.after = make_pre_post_processors(self.policy.config, checkpoint)

    def reset(self):
        self.policy.reset()

    def __call__(self, observation):
        batch = self.before(
            {
                "observation.state": torch.from_numpy(observation["state"]).float(),
                "observation.images.head": torch.from_numpy(observation["image"]).permute(2, 0, 1) / 255,
            }
        )
        return self.after(self.policy.predict_action_chunk(batch))[0].numpy()


if __name__ == "__main__":
    evalbus.serve(Policy(*sys.argv[1:2]))
