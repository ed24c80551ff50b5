"""Serves a LeRobot checkpoint (ACT, diffusion, SmolVLA, pi0, ...) to evalbus.

CHECKPOINT is a folder with config.json, model.safetensors and the processors, as lerobot-train writes it
(.../pretrained_model). LeRobot's processors normalize observations and unnormalize actions. --contract writes a
contract for `evalbus run`, proposed from the checkpoint's config.json: check its rate and its cameras.
"""

import os
import pathlib
from typing import Any, Dict, List, Optional

import numpy as np

from evalbus.errors import InputError
from evalbus.lerobot import keys
from evalbus.command import parser, run_module
from evalbus.server import serve

# Maps names of images in data sets of `evalbus export --lerobot` to their cameras.
_CAMERAS = {
    keys.image_name(camera): camera
    for camera in (
        "roboeval/head", "roboeval/left_wrist", "roboeval/right_wrist", "roboeval/external", "front", "overview",
        "left/hand/wrist", "right/hand/wrist",
    )  # fmt: skip
}
# Names of the arms by the size of the state. Each arm has seven joints and a gripper.
_ARMS = {8: ["arm"], 16: ["left", "right"]}
_JOINTS = 7


class LeRobotPolicy:
    """A checkpoint as a policy for evalbus.serve().

    Most policies return the action chunk that LeRobot would execute before it calls the model again. Policies that
    remember observations or blend chunks are called at each step and return one action. reset() also restarts the
    random numbers, so that equal episodes receive equal noise.
    """

    def __init__(self, checkpoint, device: Optional[str] = None):
        # The files are checked here, because LeRobot's pi0 continues with random weights if its weights are missing.
        for name in ("config.json", "model.safetensors"):
            if not (pathlib.Path(checkpoint) / name).is_file():
                raise InputError(f"{checkpoint}: expected a folder with {name}, as lerobot-train writes it")
        import draccus
        import torch
        from lerobot.configs import PreTrainedConfig
        from lerobot.policies import make_pre_post_processors
        from lerobot.policies.factory import get_policy_class
        from lerobot.utils.import_utils import register_third_party_plugins

        register_third_party_plugins()
        self._torch = torch
        try:
            self.config = PreTrainedConfig.from_pretrained(checkpoint)
            if device:
                self.config.device = device
            self._policy = get_policy_class(self.config.type).from_pretrained(checkpoint, config=self.config)
            self._policy.to(self.config.device).eval()
            self._before, self._after = make_pre_post_processors(
                self.config,
                pretrained_path=str(checkpoint),
                preprocessor_overrides={"device_processor": {"device": str(self.config.device)}},
            )
        except (OSError, ValueError, RuntimeError, draccus.utils.DraccusException) as error:
            raise InputError(f"{checkpoint}: LeRobot cannot load it: {error}") from error
        self._steps_per_call = steps_per_call(self.config)

    def reset(self) -> None:
        self._policy.reset()
        self._torch.manual_seed(0)

    def __call__(self, observation: Dict[str, Any]) -> np.ndarray:
        torch = self._torch
        batch: Dict[str, Any] = {"task": [observation.get("prompt", "")]}
        for key, value in observation.items():
            if key.startswith(keys.IMAGES):
                batch[key] = torch.from_numpy(value.copy()).permute(2, 0, 1)[None].contiguous().float() / 255
            elif key != "prompt":
                batch[key] = torch.from_numpy(np.array(value, np.float32))[None]
        with torch.inference_mode():
            batch = self._before(batch)
            # LeRobot's policies queue the actions of a chunk, and call the model only when the queue is empty.
            steps = [self._after(self._policy.select_action(dict(batch))) for _ in range(self._steps_per_call)]
            return torch.cat(steps).cpu().numpy()


def steps_per_call(config) -> int:
    """Returns the number of steps before the policy is called again; 1 for policies that need each observation."""
    if getattr(config, "n_obs_steps", 1) > 1 or getattr(config, "temporal_ensemble_coeff", None) is not None:
        return 1
    return getattr(config, "n_action_steps", 1)


def proposed_contract(config, name: str, rate_hz: float = 20, cameras: Optional[Dict[str, str]] = None) -> str:
    """Returns the text of a contract for a checkpoint's configuration.

    cameras: camera for each name of images ("head" of observation.images.head) that is not one of evalbus' own.
    Raises InputError if the configuration does not describe joint positions of one or two arms of seven joints.
    """
    state, action = _size(config.input_features, keys.STATE), _size(config.output_features, keys.ACTION)
    if action not in _ARMS or state not in (None, action):
        raise InputError(
            f"no contract can be proposed for a state of {state or 0} and an action of {action or 0} numbers: expected 8 or "
            "16 for both, the joints of one or two arms and their grippers; write a contract (docs/connecting_a_policy.md)"
        )
    arms = _ARMS[action]
    joints = _JOINTS * len(arms)
    lines = [
        f"# Proposed from config.json of {name}. Check the rate and the cameras: the configuration does not contain them.",
        f"description: LeRobot's {config.type}, {name}",
        "wire: openpi",
        "url: ws://127.0.0.1:8000",
        f"rate_hz: {rate_hz:g}",
        "observation:",
        *_image_lines(config.input_features, cameras or {}),
    ]
    if state:
        signals = [f"{arm}.joint_position_rad" for arm in arms] + [f"{arm}.gripper_opening" for arm in arms]
        lines += [f"  - key: {keys.STATE}", f"    state: [{', '.join(signals)}]"]
    lines += ["  - {key: prompt, prompt: true}", "action:", "  kind: joint_position", f"  values: {action}", "  arms:"]
    for k, arm in enumerate(arms):
        lines.append(
            f"    - {{arm: {arm}, indices: {_JOINTS * k}-{_JOINTS * (k + 1) - 1}, "
            f"gripper: {{index: {joints + k}, open: 0, closed: 1}}}}"
        )
    return "\n".join([*lines, f"  execute_steps: {steps_per_call(config)}", ""])


def _image_lines(features, cameras: Dict[str, str]) -> List[str]:
    lines = []
    for key, feature in features.items():
        if not key.startswith(keys.IMAGES):
            continue
        name = key.removeprefix(keys.IMAGES)
        camera = cameras.get(name, _CAMERAS.get(name))
        if not camera:
            raise InputError(f"{key}: the camera is unknown: add --image {name}=CAMERA, for example --image {name}=roboeval/head")
        _, height, width = feature.shape
        lines.append(f"  - {{key: {key}, camera: {camera}, size_px: [{width}, {height}]}}")
    unknown = [name for name in cameras if keys.IMAGES + name not in features]
    if unknown:
        raise InputError(f"--image {unknown[0]}: the checkpoint has no {keys.IMAGES}{unknown[0]}")
    return lines


def _size(features, key: str) -> Optional[int]:
    return features[key].shape[0] if key in features else None


def main():
    options = parser(__doc__, "evalbus policy serve --lerobot")
    options.add_argument("checkpoint", help="folder of the checkpoint")
    options.add_argument("--port", type=int, default=8000, help="0 selects any free port, which is printed")
    options.add_argument("--host", default="127.0.0.1", help="0.0.0.0 also serves other machines, without a password")
    options.add_argument("--device", help="cpu or cuda; default: the checkpoint's")
    options.add_argument("--contract", help="write a proposed contract to this file, which must not exist")
    options.add_argument("--rate-hz", type=float, default=20, help="rate of the training data, for --contract")
    options.add_argument("--image", action="append", default=[], help="NAME=CAMERA, a camera for --contract; may be repeated")
    given = options.parse_args()
    cameras = dict(pair.partition("=")[::2] for pair in given.image)
    policy = LeRobotPolicy(given.checkpoint, given.device)
    if given.contract:
        name = os.path.basename(os.path.abspath(given.checkpoint))
        text = proposed_contract(policy.config, name, given.rate_hz, cameras)
        try:
            with open(given.contract, "x") as file:
                file.write(text)
        except OSError as error:
            raise InputError(f"{given.contract}: {error.strerror}") from None
        print(f"contract: {given.contract}", flush=True)
    serve(policy, given.port, given.host, {"policy": f"lerobot {policy.config.type}"})


if __name__ == "__main__":
    run_module(main)
