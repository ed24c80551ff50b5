"""Tests evalbus.gym with Gymnasium, to_pandas() with pandas, and the events' schema; see scripts/interop gymnasium.

usage: gymnasium_test.py BIN   (the folder of evalbus' programs)
"""

import support

support.need("gymnasium", "numpy", "msgpack", "pandas", "jsonschema")

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import warnings

import evalbus
import evalbus.gym
import gymnasium
import jsonschema
import numpy as np
import referencing
from gymnasium.utils.env_checker import check_env

BIN = os.path.abspath(sys.argv.pop(1))
os.environ["EVALBUS_BIN"] = BIN
EPISODES = int(os.environ.get("EVALBUS_GYMNASIUM_EPISODES", "100"))


def make(**options):
    return gymnasium.make("evalbus/LiftPot-v0", **{"variation": "position", **options})


class GymnasiumTest(unittest.TestCase):
    def test_the_checker_of_gymnasium(self):
        for options in (
            {},
            {"control": "eef_delta", "cameras": ["head", "left/hand/wrist"], "image_size": (64, 48)},
            {"render_mode": "rgb_array", "image_size": (64, 48)},
            {"contract": "plain"},
        ):
            with self.subTest(options), make(**options) as env, warnings.catch_warnings():
                warnings.simplefilter("ignore")  # Unbounded states, and ranges other than -1 to 1, cause warnings.
                # With a contract, there are no cameras that could render.
                check_env(env.unwrapped, skip_render_check="contract" in options)

    def test_there_is_an_environment_for_each_task(self):
        listed = subprocess.run([f"{BIN}/evalbus", "tasks", "list"], capture_output=True, text=True, check=True).stdout
        # Excludes the names with external assets ("roboeval/lift_pot").
        names = {line.split()[0] for line in listed.splitlines()[1:] if line[:1].strip() and "/" not in line.split()[0]}
        self.assertLessEqual(set(evalbus.gym.TASKS.values()), names)
        self.assertEqual({name for name in names if (support.SOURCE / f"models/tasks/{name}.yaml").exists()},
                         set(evalbus.gym.TASKS.values()))  # fmt: skip
        for name, task in evalbus.gym.TASKS.items():
            self.assertEqual(name, "".join(word.capitalize() for word in task.split("_")))

    def test_episodes_are_those_of_a_run(self):
        """Replays the recorded actions of a run. Observations, scores and verdicts must be equal."""
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "run"
            support.evaluate(
                BIN, "lift_pot/position", "--policy", "noisy_expert", "--control-hz", "20", "--episodes", str(EPISODES),
                "--seed", "7", out=out
            )  # fmt: skip
            run = evalbus.read_run(out)
            same = 0
            with make() as env:
                for episode in run.episodes:
                    action = evalbus.read_log(run.logs[episode.index])["EVALBUS_ACTION"]
                    env.reset(seed=None if episode.index else 7)
                    for row in np.hstack([action["joint_position_rad"], action["gripper_closing"]]):
                        _, reward, terminated, truncated, info = env.step(row)
                        if terminated or truncated:
                            break
                    self.assertEqual(info["result"], episode.line)
                    self.assertEqual(info["is_success"], episode.success)
                    self.assertEqual((reward, truncated), (episode.success, episode.end_reason == "time_limit"))
                    same += 1
        successes = sum(episode.success for episode in run.episodes)
        print(f"{same} of {len(run.episodes)} episodes equal, {successes} of them successes")
        self.assertIn(successes, range(1, len(run.episodes)))

    def test_seeds_and_episodes(self):
        with make() as env, evalbus.Environment("lift_pot/position") as reference:
            _, first = env.reset(seed=3)
            _, second = env.reset()
            _, chosen = env.reset(seed=3, options={"episode": 5})
            with make() as other:
                _, drawn = other.reset()
            for info, episode in ((first, 0), (second, 1), (chosen, 5)):
                self.assertEqual(info["metrics"], reference.reset(3, episode).metrics)
            self.assertNotEqual(first["metrics"], second["metrics"])
            self.assertNotIn(drawn["metrics"], (first["metrics"], second["metrics"]))

    def test_images(self):
        with make(cameras=["head"], image_size=(64, 48), render_mode="rgb_array", render_camera="front") as env:
            seen, _ = env.reset(seed=1)
            self.assertEqual(list(seen["images"]), ["head"])
            front = env.render()
            self.assertEqual((front.shape, front.dtype), ((48, 64, 3), np.uint8))
            self.assertGreater(np.abs(front.astype(int) - seen["images"]["head"]).mean(), 1)

    def test_vectors(self):
        envs = gymnasium.make_vec(
            "evalbus/LiftPot-v0", num_envs=2, vectorization_mode="async", variation="position", control="joint_delta"
        )
        try:
            states, infos = envs.reset(seed=[3, 4])
            with make(control="joint_delta") as env:
                for index, seed in enumerate((3, 4)):
                    state, info = env.reset(seed=seed)
                    np.testing.assert_array_equal(states["state"][index], state["state"])
                    distance = infos["metrics"]["target_distance"]["left_gripper_to_pot"][index]
                    self.assertEqual(distance, info["metrics"]["target_distance"]["left_gripper_to_pot"])
            for _ in range(400):
                _, _, terminated, truncated, infos = envs.step(np.zeros((2, 16), np.float32))
            self.assertEqual((terminated.tolist(), truncated.tolist()), ([False] * 2, [True] * 2))
            self.assertEqual(infos["result"]["end_reason"].tolist(), ["time_limit"] * 2)
        finally:
            envs.close()

    def test_instructions_of_any_language(self):
        instruction = "Hebe den Töpf – 持ち上げる"
        plain = (support.SOURCE / "models/policies/plain.yaml").read_text()
        with tempfile.TemporaryDirectory() as folder:
            contract = pathlib.Path(folder, "plain.yaml")
            contract.write_text(f"{plain}prompts: {{lift_pot: {json.dumps(instruction, ensure_ascii=False)}}}\n")
            with make(contract=contract) as env:
                observation, _ = env.reset(seed=0)
                self.assertEqual(observation["prompt"], instruction)
                self.assertIn(observation, env.observation_space)
            envs = gymnasium.make_vec(
                "evalbus/LiftPot-v0", num_envs=2, vectorization_mode="async", vector_kwargs={"shared_memory": False},
                variation="position", contract=contract
            )  # fmt: skip
            try:
                self.assertEqual(envs.reset(seed=0)[0]["prompt"], (instruction,) * 2)
            finally:
                envs.close()

    def test_wrong_input(self):
        with self.assertRaisesRegex(evalbus.InputError, "nowhere"):
            make(variation="nowhere")
        with make() as env:
            env.reset(seed=0)
            with self.assertRaisesRegex(evalbus.ActionError, "is not finite"):
                env.unwrapped.step(np.full(16, np.nan))
            env.close()
            with self.assertRaisesRegex(evalbus.InputError, "the environment is closed"):
                env.unwrapped.reset(seed=0)
        for options, words in (
            ({"cameras": 3}, "cameras: expected a list"),
            ({"cameras": None}, "expected a list"),
            ({"cameras": ["nose"]}, "no camera 'nose'; this scene has head"),
        ):
            with self.assertRaisesRegex(evalbus.InputError, words):
                make(**options)
        with make() as env:
            with self.assertRaisesRegex(evalbus.InputError, "options: expected a dictionary, got 3"):
                env.reset(seed=0, options=3)
            env.reset(seed=0)
            for wrong in (1.0, "1", -1):
                with self.subTest(wrong), self.assertRaises(evalbus.InputError):
                    env.reset(options={"episode": wrong})
            # The next episode is the one that follows the last successful reset.
            _, second = env.reset()
            _, same = env.reset(seed=0, options={"episode": 1})
            self.assertEqual(second["metrics"], same["metrics"])
        with make() as env, self.assertRaisesRegex(evalbus.InputError, "expected the key 'episode', got 'episodes'"):
            env.reset(seed=0, options={"episodes": 3})

    def test_wrong_input_of_vectors(self):
        for mode in ("sync", "async"):
            with self.subTest(mode):
                options = {"num_envs": 2, "vectorization_mode": mode, "variation": "position"}
                with self.assertRaisesRegex(evalbus.InputError, "nowhere"):
                    gymnasium.make_vec("evalbus/LiftPot-v0", **{**options, "variation": "nowhere"})
                for action, words in ((np.full((2, 16), np.nan), "is not finite"), (np.zeros((2, 3)), "has the shape .3,.")):
                    envs = gymnasium.make_vec("evalbus/LiftPot-v0", **options)
                    try:
                        envs.reset(seed=0)
                        with self.assertRaisesRegex(evalbus.ActionError, words):
                            envs.step(action)
                    finally:
                        envs.close()

    def test_what_the_documentation_does(self):
        names = {}
        for code in support.blocks("environment.md"):
            exec(code, names)
        self.assertEqual(len(names["observations"]["state"]), 4)

    def test_pandas(self):
        with tempfile.TemporaryDirectory() as folder:
            run = evalbus.run("lift_pot", episodes=2, out=pathlib.Path(folder) / "run", in_process=True)
        table = run.to_pandas()
        self.assertEqual(table.index.tolist(), [0, 1])
        self.assertEqual(table["success"].tolist(), [True, True])
        np.testing.assert_array_equal(table["completion_time"], run.scores["completion_time"])

    def test_events_match_their_schema(self):
        schemas = {file.name: json.loads(file.read_bytes()) for file in (support.SOURCE / "docs/schema").glob("*.json")}
        registry = referencing.Registry().with_resources(
            (name, referencing.Resource.from_contents(schema)) for name, schema in schemas.items()
        )
        validator = jsonschema.Draft202012Validator(schemas["event.json"], registry=registry)
        with tempfile.TemporaryDirectory() as folder:
            command = [f"{BIN}/evalbus", "run", "lift_pot", "--policy", "hold", "--episodes", "2", "--in-process",
                       "--json", "--quiet", "--out", f"{folder}/run"]  # fmt: skip
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            command[2:3] = ["lift_pot", "cube_handover"]
            command[-1] = f"{folder}/suite"
            suite = subprocess.run(command, capture_output=True, text=True, check=True)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual((len(lines), done.stderr), (6, ""))
        suite_lines = [json.loads(line) for line in suite.stdout.splitlines()]
        run_events = ["begin", *["episode_begin", "episode"] * 2, "summary"]
        self.assertEqual([line["event"] for line in suite_lines], ["suite_begin", *run_events * 2, "suite_summary"])
        for line in [*lines, *suite_lines, {"schema_version": 1, "event": "remark", "text": "again"}]:
            validator.validate(line)
        for broken in ({"event": "begin"}, {**lines[0], "schema_version": 2}, {**lines[2], "result": {}}):
            self.assertFalse(validator.is_valid(broken))


support.main()
