"""Environments for Gymnasium: gymnasium.make("evalbus/LiftPot-v0"). Importing this module registers them."""

import string
from typing import Any, Optional, Sequence, Union

import gymnasium
import numpy as np
from gymnasium import spaces

from evalbus.environment import Environment, Step, camera_list
from evalbus.errors import InputError

TASKS = {
    "CubeHandover": "cube_handover",
    "LiftPot": "lift_pot",
    "LiftTray": "lift_tray",
    "PackBox": "pack_box",
    "PickSingleBookFromTable": "pick_single_book_from_table",
    "RotateValve": "rotate_valve",
    "StackSingleBookShelf": "stack_single_book_shelf",
    "StackTwoBlocks": "stack_two_blocks",
}
_MAX_TEXT = 4096
_SEEDS = 2**31


class EvalbusEnv(gymnasium.Env):
    """A task of evalbus.

    task, variation: "lift_pot", "position"; or task alone: "lift_pot/position", a task file.
    control, cameras, image_size, control_hz, contract, robot, seed_stream, gl: as in evalbus.Environment.
    render_mode: "rgb_array": render() returns the image of render_camera, which is drawn at every step.

    reset(seed=S) starts episode 0 of `evalbus run --seed S`, and each reset() after it the next episode of that run;
    options={"episode": K} selects another one. The reward is 1 at the step that succeeds, otherwise 0. info has
    "metrics" (RoboEval's dictionary of this step), "extended" (evalbus' metrics), "is_success" and, at the end of an
    episode, "result" (its line of episodes.jsonl). Numbers that do not exist have no key.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(
        self,
        task: str,
        variation: Optional[str] = None,
        *,
        control: str = "joint",
        cameras: Union[str, Sequence[str]] = (),
        image_size: Sequence[int] = (224, 224),
        control_hz: float = 20,
        contract: Optional[str] = None,
        robot: Optional[str] = None,
        seed_stream: Optional[str] = None,
        gl: Optional[str] = None,
        render_mode: Optional[str] = None,
        render_camera: str = "front",
    ):
        cameras = camera_list(cameras)
        self.render_mode = render_mode
        self._render_camera = render_camera if render_mode else None
        self._hides_camera = bool(render_mode) and render_camera not in cameras
        if render_mode and contract:
            raise InputError(f'render_mode="{render_mode}" cannot be combined with a contract')
        self._environment = Environment(
            f"{task}/{variation}" if variation else task,
            control=control,
            cameras=[*cameras, render_camera] if self._hides_camera else list(cameras),
            image_size=image_size,
            control_hz=control_hz,
            contract=contract,
            robot=robot,
            seed_stream=seed_stream,
            gl=gl,
        )
        self.metadata = {**self.metadata, "render_fps": self._environment.control_hz}
        self.action_space = spaces.Box(
            self._environment.action_lower, self._environment.action_upper, dtype=np.float32
        )
        # The first observation determines the shapes.
        self.observation_space = _space(self._seen(self._environment.reset(0)))
        self._run_seed: Optional[int] = None
        self._episode = 0
        self._image: Optional[np.ndarray] = None

    @property
    def instruction(self) -> str:
        return self._environment.instruction

    @property
    def contract(self) -> str:
        """Text of the contract. With it, `evalbus run` gives a policy server the same observations and actions."""
        return self._environment.contract

    @property
    def max_steps(self) -> int:
        """Upper bound of the number of steps of an episode."""
        return round(self._environment.time_limit_s * self._environment.control_hz) + 1

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict] = None):
        super().reset(seed=seed)
        run_seed, episode = self._run_seed, self._episode + 1
        if seed is not None or run_seed is None:
            run_seed = int(self.np_random.integers(_SEEDS)) if seed is None else int(seed)
            episode = 0
        if options is not None and not isinstance(options, dict):
            raise InputError(f"reset: options: expected a dictionary, got {options!r}")
        for name in options or {}:
            if name != "episode":
                raise InputError(f"reset: options: expected the key 'episode', got {name!r}")
        episode = (options or {}).get("episode", episode)
        step = self._environment.reset(run_seed, episode)
        # If reset() fails, neither of these two members changes.
        self._run_seed, self._episode = run_seed, episode
        return self._seen(step), _info(step)

    def step(self, action):
        step = self._environment.step(action)
        has_ended = step.episode is not None
        truncated = has_ended and step.episode.end_reason == "time_limit"
        info = _info(step)
        reward = float(has_ended and step.episode.success)
        return self._seen(step), reward, has_ended and not truncated, truncated, info

    def render(self):
        return self._image

    def close(self):
        self._environment.close()

    def _seen(self, step: Step):
        observation = step.observation
        if self._render_camera:
            images = dict(observation["images"])
            self._image = images.pop(self._render_camera) if self._hides_camera else images[self._render_camera]
            observation = {**observation, "images": images}
            if not images:
                del observation["images"]
        return _plain(observation)


def register() -> None:
    """Registers an environment per built-in task, such as evalbus/LiftPot-v0, and evalbus/Task-v0 for any task=."""
    for name, task in [*TASKS.items(), ("Task", None)]:
        if f"evalbus/{name}-v0" not in gymnasium.registry:
            gymnasium.register(
                f"evalbus/{name}-v0", entry_point="evalbus.gym:EvalbusEnv", kwargs={"task": task} if task else {}
            )


def _info(step: Step) -> dict:
    info = {"metrics": _numbers(step.metrics), "extended": _numbers(step.extended)}
    info["is_success"] = step.metrics["success"] == 1
    if step.episode:
        info["result"] = step.episode.line
    return info


def _numbers(values: dict) -> dict:
    """Returns the values that are not None, so that vector environments can stack them."""
    return {
        key: _numbers(value) if isinstance(value, dict) else value
        for key, value in values.items()
        if value is not None
    }


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return value if isinstance(value, str) else np.asarray(value)


def _space(value: Any) -> spaces.Space:
    if isinstance(value, dict):
        return spaces.Dict({key: _space(entry) for key, entry in value.items()})
    if isinstance(value, str):
        # An instruction may have characters of any language. Their order must be equal in all processes.
        charset = string.printable + "".join(sorted(set(value) - set(string.printable)))
        return spaces.Text(max(_MAX_TEXT, len(value)), min_length=0, charset=charset)
    if value.dtype.kind == "f":
        return spaces.Box(-np.inf, np.inf, value.shape, value.dtype)
    limits = np.iinfo(value.dtype)
    return spaces.Box(limits.min, limits.max, value.shape, value.dtype)


register()
