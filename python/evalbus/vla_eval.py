"""Provides evalbus tasks as a benchmark of vla-evaluation-harness: `benchmark: evalbus.vla_eval:EvalbusBenchmark`."""

from typing import Any, Dict, List, Optional, Sequence

import numpy as np
from vla_eval.benchmarks.base import StepBenchmark, StepResult
from vla_eval.specs import LANGUAGE, STATE_JOINT, DimSpec

from evalbus.environment import Environment, Step
from evalbus.errors import ActionError


class EvalbusBenchmark(StepBenchmark):
    """Runs tasks of evalbus; `params` in the configuration of vla-eval are the constructor's arguments.

    tasks: "lift_pot/position", ... seed: episode K of a task is episode K of `evalbus run --seed SEED`. The other
    arguments are passed to evalbus.Environment. Observations: "images" by camera, "state" and "task_description";
    an action's "actions" has the numbers that `control` describes. Only mode "sync" is supported: in mode "live", time
    must pass while the policy computes, but simulated time does not advance then.
    """

    # evalbus renders images in software unless `gl` selects a GPU.
    render_backends = frozenset({"gpu", "cpu"})

    def __init__(
        self,
        tasks: Sequence[str] = ("lift_pot/position",),
        seed: int = 0,
        control: str = "joint",
        cameras: Sequence[str] = ("head",),
        image_size: Sequence[int] = (224, 224),
        control_hz: float = 20,
        robot: Optional[str] = None,
        gl: Optional[str] = None,
    ):
        super().__init__()
        self._tasks = list(tasks)
        self._seed = seed
        self._options = {
            "control": control,
            "cameras": list(cameras),
            "image_size": image_size,
            "control_hz": control_hz,
            "robot": robot,
            "gl": gl,
        }
        # Only one task's environment is open at a time.
        self._environment: Optional[Environment] = None
        self._step: Optional[Step] = None
        self._open(self._tasks[0])

    @classmethod
    def configure_render(cls, mode: str) -> Dict[str, str]:
        return {}

    def get_tasks(self) -> List[Dict[str, Any]]:
        return [{"name": task, "suite": task.partition("/")[0]} for task in self._tasks]

    def reset(self, task: Dict[str, Any]) -> Step:
        self._open(task["name"])
        self._step = self._environment.reset(self._seed, task["episode_idx"])
        return self._step

    def step(self, action: Dict[str, Any]) -> StepResult:
        values = np.asarray(action["actions"]) if "actions" in action else None
        if values is None:
            raise ActionError(f'the server sent an action without "actions": {", ".join(map(str, action))}')
        self._step = self._environment.step(values)
        ended = self._step.episode is not None
        return StepResult(self._step, float(ended and self._step.episode.success), ended, {})

    def make_obs(self, raw_obs: Step, task: Dict[str, Any]) -> Dict[str, Any]:
        seen = {key: value for key, value in raw_obs.observation.items() if key in ("state", "images")}
        return {**seen, "task_description": self._environment.instruction}

    def get_step_result(self, step_result: StepResult) -> Dict[str, Any]:
        scores = step_result.obs.metrics
        return {"success": scores["success"] == 1, "completion_time": scores["completion_time"]}

    def get_metric_keys(self) -> Dict[str, str]:
        return {"success": "mean", "completion_time": "mean"}

    def get_metadata(self) -> Dict[str, Any]:
        # This limit is never reached, because evalbus ends episodes at their time limit.
        steps = round(self._environment.time_limit_s * self._environment.control_hz) + 1
        return {"max_steps": steps, "evalbus_contract": self._environment.contract}

    def get_action_spec(self) -> Dict[str, DimSpec]:
        size = len(self._environment.action_lower)
        return {"actions": DimSpec("actions", size, f"evalbus_{self._options['control']}_gripper_close_positive")}

    def get_observation_spec(self) -> Dict[str, DimSpec]:
        return {"state": STATE_JOINT, "language": LANGUAGE}

    def cleanup(self) -> None:
        if self._environment:
            self._environment.close()
        self._environment = None

    def _open(self, task: str) -> None:
        if self._environment and self._environment.task == task:
            return
        self.cleanup()
        self._environment = Environment(task, **self._options)
