"""A task as an environment, in which the caller chooses each action. evalbus.gym provides it for Gymnasium."""

import dataclasses
import json
import operator
import os
import struct
import warnings
from typing import Any, Dict, Optional, Sequence, Union

import numpy as np

from evalbus import codec
from evalbus.errors import ActionError, InputError, ProgramError, check_action_type, check_not_masked
from evalbus.program import Program, check_task, words
from evalbus.runs import Episode

# Version of the messages of `evalbus env` (docs/environment.md).
_VERSION = 1
# Largest episode number (base/run_layout.h).
_MAX_EPISODE = 99_999_999
# Seeds that RoboEval's env.reset() accepts, as for the program (base/random.h).
_ROBOEVAL_SEEDS, _MAX_ROBOEVAL_SEED = "roboeval/1", 2**32 - 1
_SIZE = struct.Struct("<I")
# Defaults of the observations and actions if there is no contract.
_DEFAULT_FORM = {"control": "joint", "cameras": [], "image_size": (224, 224), "control_hz": 20}


@dataclasses.dataclass(frozen=True)
class Step:
    """Result of a step of an environment."""

    # Observation as described by the contract. By default, "state" and, with cameras, "images", a dictionary by camera.
    observation: Dict[str, Any]
    # Metrics of this tick, as in episodes.jsonl: RoboEval's in `metrics`, those that evalbus adds in `extended`.
    metrics: Dict[str, Any]
    extended: Dict[str, Any]
    # The episode's result if this step has ended it; None otherwise.
    episode: Optional[Episode]


class Environment:
    """Runs episodes of a task step by step, in a separate `evalbus env` process.

    Episodes and scores are bit-identical to `evalbus run` with the same contract, seed and actions.

    task: "lift_pot/position". control: meaning of an action: "joint" (positions), "joint_delta", "eef_pose" or
    "eef_delta"; values of all arms, then of the grippers (0 open, 1 closed). cameras: name or names of cameras whose
    images are observed. image_size: (width, height). control_hz: steps per simulated second. contract: name or file of a contract
    (docs/connecting_a_policy.md), which describes all of these instead. seed_stream: "roboeval/1" starts episode 0 of
    a seed as RoboEval's env.reset(seed=...). gl: renderer of the images: "software", "egl" or "auto" (docs/videos.md).

    Raises InputError for wrong arguments, ProgramError if the program fails.
    """

    def __init__(
        self,
        task: str,
        *,
        control: str = "joint",
        cameras: Union[str, Sequence[str]] = (),
        image_size: Sequence[int] = (224, 224),
        control_hz: float = 20,
        contract: Union[str, os.PathLike, None] = None,
        robot: Union[str, os.PathLike, None] = None,
        seed_stream: Optional[str] = None,
        gl: Optional[str] = None,
    ):
        check_task(task)
        cameras = camera_list(cameras)
        check_list("image_size", image_size)
        options = {"contract": contract, "robot": robot, "seed_stream": seed_stream, "gl": gl}
        form = {"control": control, "cameras": list(cameras), "image_size": tuple(image_size), "control_hz": control_hz}
        if contract is None:
            options["camera"] = form.pop("cameras") or None
            options |= {**form, "image_size": "x".join(map(str, image_size))}
        elif given := [name for name, value in form.items() if value != _DEFAULT_FORM[name]]:
            raise InputError(f"{given[0]}: cannot be combined with a contract, which describes it")
        self._is_active = False
        self._seed_stream = seed_stream
        self._program: Optional[Program] = Program(["env", task, *words(options)])
        description = self._receive()
        if description["schema_version"] != _VERSION:
            self.close()
            raise ProgramError(
                f"the program evalbus has messages of version {description['schema_version']}, this package has {_VERSION}"
            )
        self.task: str = f"{description['task']}/{description['variation']}"
        self.robot: str = description["robot"]
        # The task's instruction, for policies that read text.
        self.instruction: str = description["instruction"]
        self.control_hz: float = description["control_hz"]
        self.time_limit_s: float = description["time_limit_s"]
        # Renderer of the images, such as "osmesa (llvmpipe (LLVM 15.0.6, 256 bits))"; empty without cameras. Programs
        # of older versions send neither a renderer nor a warning.
        self.renderer: str = description.get("renderer", "")
        if description.get("warning"):
            warnings.warn(f"evalbus: {description['warning']}", stacklevel=2)
        # Text of the contract. If it is saved as a file, `evalbus run --contract FILE` can evaluate a server with it.
        self.contract: str = description["contract"]
        # Usual range of each value of an action. Values outside it are also executed, as far as the robot can.
        self.action_lower: np.ndarray = description["action_lower"]
        self.action_upper: np.ndarray = description["action_upper"]

    def reset(self, seed: int, episode: int = 0) -> Step:
        """Starts episode `episode` of `evalbus run --seed SEED`, and abandons the current episode."""
        seed, episode = _whole("seed", seed), _whole("episode", episode)
        # The numbers are checked here, because an error of the program would close the environment.
        if not 0 <= episode <= _MAX_EPISODE:
            raise InputError(f"reset: episode: expected 0 to {_MAX_EPISODE}, got {episode}")
        most = _MAX_ROBOEVAL_SEED - episode
        if self._seed_stream == _ROBOEVAL_SEEDS and not 0 <= seed <= most:
            raise InputError(f"reset: seed: expected 0 to {most} with the seeds of RoboEval, got {seed}")
        return self._ask({"reset": {"seed": seed, "episode": episode}})

    def step(self, action) -> Step:
        """Executes an action. Raises ActionError if its shape or type is wrong, or if it is not finite."""
        check_not_masked(action)
        try:
            values = np.asarray(action)
        except ValueError as error:  # rows of different lengths
            raise ActionError(f"the action is not an array: {error}") from None
        if values.shape != self.action_lower.shape:
            raise ActionError(f"the action has the shape {values.shape}, expected {self.action_lower.shape}")
        check_action_type(values, "the action is")
        with np.errstate(over="ignore"):  # checked below
            values = np.ascontiguousarray(values, dtype=float)
        if not np.isfinite(values).all():
            raise ActionError(f"value {int(np.argmin(np.isfinite(values)))} of the action is not finite")
        # An error of the program would close the environment.
        if self._program and not self._is_active:
            raise InputError("no episode is active: reset the environment first")
        return self._ask({"step": values})

    def close(self) -> None:
        """Ends the program. Calling it again does nothing."""
        if self._program:
            self._program.close()
        self._program = None

    def __enter__(self) -> "Environment":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _ask(self, request) -> Step:
        if not self._program:
            raise InputError("the environment is closed")
        message = codec.pack(request)
        try:
            self._program.input.write(_SIZE.pack(len(message)) + message)
            self._program.input.flush()
        except BrokenPipeError:
            pass  # The program has ended; _receive() determines the reason.
        except BaseException:
            self.close()
            raise
        reply = self._receive()
        scores = json.loads(reply["scores"])
        episode = reply["episode"] and Episode.of(json.loads(reply["episode"]))
        self._is_active = not episode
        return Step(reply["observation"], scores["metrics"], scores["extended"], episode)

    def _receive(self):
        try:
            return codec.unpack(self._read(_SIZE.unpack(self._read(_SIZE.size))[0]))
        except BaseException:
            # An interrupted exchange cannot be continued.
            self.close()
            raise

    def _read(self, size: int) -> bytes:
        data = self._program.output.read(size)
        if len(data) < size:
            program, self._program = self._program, None
            program.finish()
            raise ProgramError("evalbus env has exited")
        return data


def camera_list(cameras: Any) -> list:
    """Returns the names of cameras as a list; a string is the name of one camera."""
    if isinstance(cameras, str):
        return [cameras]
    check_list("cameras", cameras)
    return list(cameras)


def check_list(name: str, value: Any) -> None:
    """Raises InputError if the argument is not a list."""
    if isinstance(value, str) or not hasattr(value, "__iter__"):
        raise InputError(f"{name}: expected a list, got {value!r}")


def _whole(name: str, value) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        raise InputError(f"reset: {name}: expected a whole number, got {value!r}") from None
    if not -(2**63) <= number < 2**63:
        raise InputError(f"reset: {name}: expected a signed 64-bit number, got {value!r}")
    return number
