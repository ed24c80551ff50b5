"""Serves an ACT policy of LeRobot (https://github.com/huggingface/lerobot).

    pip install lerobot
    python3 python/examples/lerobot_policy.py [CHECKPOINT]
    evalbus run lift_pot --policy python/examples/lerobot_policy.yaml

CHECKPOINT: folder of a trained ACT policy with its normalization data, as written by `lerobot-train`. Without it, the
weights are random.

Observation: the keys of the data set that to_lerobot.py writes: "observation.state", 16 numbers: the 14 joint
positions of the two arms (rad, left arm first), then the openings of the two grippers (1 open, 0 closed);
"observation.images.head" and others, (height, width, 3), uint8, RGB, in the same size as in training.
Actions: 20 steps (with a checkpoint: as many as in training) of 16 numbers: 14 joint targets (rad), then the two
grippers (0 open, 1 closed).
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
        # LeRobot's policies do not normalize inputs or unnormalize outputs themselves. Without these processors, the
        # actions of a trained policy would be meaningless.
        self.before, self.after = make_pre_post_processors(self.policy.config, checkpoint)

    def reset(self):
        self.policy.reset()

    def __call__(self, observation):
        batch = {}
        for key, value in observation.items():
            if key.startswith("observation.images."):
                batch[key] = torch.from_numpy(value).permute(2, 0, 1) / 255
            elif key.startswith("observation."):
                batch[key] = torch.from_numpy(value).float()
        batch = self.before(batch)
        return self.after(self.policy.predict_action_chunk(batch))[0].numpy()


if __name__ == "__main__":
    evalbus.serve(Policy(*sys.argv[1:2]))
