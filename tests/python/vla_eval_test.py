"""Tests evalbus.vla_eval in the vla-evaluation-harness: `vla-eval run` with a server from the harness's own package.

usage: vla_eval_test.py BIN   (the folder of evalbus' programs); see scripts/interop vla_eval
"""

import support

support.need("vla_eval", "anyio", "numpy", "msgpack", "websockets")

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest

import anyio
import evalbus
import numpy as np
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve_async

BIN = os.path.abspath(sys.argv.pop(1))
os.environ["EVALBUS_BIN"] = BIN
SEED = 7
EPISODES = 3
CONFIG = {
    "benchmarks": [
        {
            "benchmark": "evalbus.vla_eval:EvalbusBenchmark",
            "episodes_per_task": EPISODES,
            "params": {"tasks": ["lift_pot/position", "lift_pot/base"], "seed": SEED, "cameras": []},
        }
    ]
}


def replay():
    """Answers each state with the next action of a recorded success in lift_pot/base: a policy that succeeds there, and
    not everywhere."""
    with tempfile.TemporaryDirectory() as folder:
        run = evalbus.run("lift_pot/base", episodes=1, control_hz=20, in_process=True, out=pathlib.Path(folder) / "run")
        action = evalbus.read_log(run.logs[0])["EVALBUS_ACTION"]
    rows = np.hstack([action["joint_position_rad"], action["gripper_closing"]])

    class Replay:
        def reset(self):
            self.step = -1

        def __call__(self, observation):
            self.step += 1
            return rows[min(self.step, len(rows) - 1)]

    return Replay()


class Server:
    """A policy behind vla-eval's own server, in a thread."""

    def __init__(self, policy):
        class Toy(PredictModelServer):
            async def on_episode_start(self, config, context):
                policy.reset()
                await super().on_episode_start(config, context)

            def predict(self, observation, context):
                return {"actions": policy(observation)}

        self._toy, self._ready = Toy(), threading.Event()
        threading.Thread(target=anyio.run, args=(self._serve,), daemon=True).start()
        assert self._ready.wait(support.DEADLINE_S)

    async def _serve(self):
        async with anyio.create_task_group() as group:
            self.port = await group.start(serve_async, self._toy, "127.0.0.1", 0)
            self._ready.set()
            await anyio.sleep_forever()


class VlaEvalTest(unittest.TestCase):
    def test_verdicts_are_those_of_a_run(self):
        policy = replay()
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            config = {**CONFIG, "server": {"url": f"ws://127.0.0.1:{Server(policy).port}"}, "output_dir": str(here / "out")}
            (here / "config.yaml").write_text(json.dumps(config))
            done = subprocess.run(
                [sys.executable, "-m", "vla_eval.cli.main", "run", "--config", here / "config.yaml"],
                capture_output=True, text=True, timeout=support.DEADLINE_S,
            )  # fmt: skip
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            results = [json.loads(file.read_text()) for file in (here / "out").rglob("*.json")]
            (result,) = [result for result in results if "tasks" in result]
            for task in result["tasks"]:
                run = evalbus.run(task["task"], policy, episodes=EPISODES, seed=SEED, in_process=True, out=here / task["task"].replace("/", "_"))
                theirs = sorted(task["episodes"], key=lambda episode: episode["episode_id"])
                for key in ("success", "completion_time"):
                    self.assertEqual(
                        [episode["metrics"][key] for episode in theirs], [episode.metrics[key] for episode in run.episodes]
                    )
                print(task["task"], [episode["metrics"] for episode in theirs])
        verdicts = {episode["metrics"]["success"] for task in result["tasks"] for episode in task["episodes"]}
        self.assertEqual(len(verdicts), 2, "expected both verdicts")

    def test_wrong_input(self):
        from evalbus.vla_eval import EvalbusBenchmark

        with self.assertRaisesRegex(evalbus.InputError, "nowhere"):
            EvalbusBenchmark(tasks=["nowhere"])
        benchmark = EvalbusBenchmark(cameras=[])
        try:
            benchmark.reset({"name": "lift_pot/position", "episode_idx": 0})
            with self.assertRaisesRegex(evalbus.ActionError, r"the action has the shape \(7,\)"):
                benchmark.step({"actions": np.zeros(7)})
            with self.assertRaisesRegex(evalbus.ActionError, 'without "actions": action'):
                benchmark.step({"action": np.zeros(16)})
        finally:
            benchmark.cleanup()


support.main()
