"""Environments of evalbus for lerobot-eval and lerobot-train: --env.type=evalbus.

LeRobot finds them by the package lerobot_env_evalbus (python/plugins), by
--env.discover_packages_path=evalbus.lerobot, or by make_env() below in an EnvHub repository's env.py.
"""

import dataclasses
import functools
from typing import Dict, List, Optional

import gymnasium
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.envs.utils import freeze_after_episode_end

from evalbus.environment import Environment
from evalbus.errors import InputError
from evalbus.gym import EvalbusEnv
from evalbus.lerobot import keys


class LeRobotEnv(gymnasium.ObservationWrapper):
    """EvalbusEnv with the observation keys, attributes and seeds that LeRobot expects.

    reset(seed=K) starts episode K of `evalbus run --seed RUN_SEED`, because lerobot-eval counts its seeds up from --seed.
    """

    def __init__(self, run_seed: int, cameras: List[str], render_mode: Optional[str] = "rgb_array", **options):
        super().__init__(
            EvalbusEnv(
                cameras=cameras,
                # An image that the policy receives anyway needs no additional time.
                render_camera=cameras[0] if cameras else "front",
                render_mode=render_mode,
                **options,
            )
        )
        self._run_seed = run_seed
        self._image_names = dict(zip(cameras, keys.image_names(cameras)))
        spaces = {"agent_pos": self.env.observation_space["state"]}
        if cameras:
            images = self.env.observation_space["images"].spaces
            spaces["pixels"] = gymnasium.spaces.Dict(
                {name: images[camera] for camera, name in self._image_names.items()}
            )
        self.observation_space = gymnasium.spaces.Dict(spaces)
        self.task = options["task"]
        self.task_description = self.env.instruction
        # lerobot-eval stops a rollout after this number of steps. evalbus ends the episode earlier, at its time limit.
        self._max_episode_steps = self.env.max_steps

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict] = None):
        if seed is None:
            return super().reset(options=options)
        return super().reset(seed=self._run_seed, options={**(options or {}), "episode": seed})

    def observation(self, observation: dict) -> dict:
        seen = {"agent_pos": observation["state"]}
        if self._image_names:
            seen["pixels"] = {name: observation["images"][camera] for camera, name in self._image_names.items()}
        return seen


@EnvConfig.register_subclass("evalbus")
@dataclasses.dataclass
class EvalbusEnvConfig(EnvConfig):
    """Options of --env.type=evalbus.

    task: "lift_pot/position", or several tasks, separated by commas. fps: steps per simulated second. run_seed: as in
    LeRobotEnv. robot, control, cameras, image_size (width, height), gl: as in evalbus.Environment. With the default of
    control, state and action are the joint positions of all arms (rad), then all grippers (state: 1 open; action:
    1 closed), as in data sets of `evalbus export --lerobot`. render_mode: None draws no images for videos, which policies
    without cameras do not need.
    """

    task: str = "lift_pot/position"
    fps: int = 20
    run_seed: int = 0
    control: str = "joint"
    cameras: List[str] = dataclasses.field(default_factory=lambda: ["roboeval/head"])
    image_size: List[int] = dataclasses.field(default_factory=lambda: [224, 224])
    robot: Optional[str] = None
    gl: Optional[str] = None
    render_mode: Optional[str] = "rgb_array"

    def __post_init__(self):
        if not self.task:
            raise InputError("task: expected at least one task")
        if len(self.image_size) != 2:
            raise InputError(f"image_size: expected a width and a height, got {self.image_size}")
        # The robot determines the shapes.
        with Environment(self._tasks()[0], control=self.control, control_hz=self.fps, robot=self.robot) as environment:
            state = environment.reset(0).observation["state"].shape
            action = environment.action_lower.shape
        width, height = self.image_size
        self.features = {
            keys.ACTION: PolicyFeature(FeatureType.ACTION, action),
            "agent_pos": PolicyFeature(FeatureType.STATE, state),
        }
        self.features_map = {keys.ACTION: keys.ACTION, "agent_pos": keys.STATE}
        for name in keys.image_names(self.cameras):
            key = keys.IMAGES + name
            self.features[key] = PolicyFeature(FeatureType.VISUAL, (height, width, 3))
            self.features_map[key] = key

    @property
    def gym_kwargs(self) -> dict:
        return {
            "run_seed": self.run_seed,
            "control": self.control,
            "cameras": list(self.cameras),
            "image_size": tuple(self.image_size),
            "control_hz": self.fps,
            "robot": self.robot,
            "gl": self.gl,
            "render_mode": self.render_mode,
        }

    def create_envs(
        self, n_envs: int, use_async_envs: bool = False
    ) -> Dict[str, Dict[int, gymnasium.vector.VectorEnv]]:
        """Returns {task: {0: vector environment}}."""
        is_async = use_async_envs and n_envs > 1
        vector = gymnasium.vector.AsyncVectorEnv if is_async else gymnasium.vector.SyncVectorEnv
        options = {"context": "forkserver"} if is_async else {}
        return {
            task: {
                0: vector(
                    # An environment whose episode has ended waits for the other environments.
                    [freeze_after_episode_end(functools.partial(LeRobotEnv, task=task, **self.gym_kwargs))] * n_envs,
                    autoreset_mode=gymnasium.vector.AutoresetMode.NEXT_STEP,
                    **options,
                )
            }
            for task in self._tasks()
        }

    def _tasks(self) -> List[str]:
        return [task.strip() for task in self.task.split(",")]


def make_env(n_envs: int = 1, use_async_envs: bool = False, cfg: Optional[EnvConfig] = None):
    """Entry point of an EnvHub repository: its env.py contains `from evalbus.lerobot.env import make_env`."""
    cfg = cfg if isinstance(cfg, EvalbusEnvConfig) else EvalbusEnvConfig()
    return cfg.create_envs(n_envs, use_async_envs)
