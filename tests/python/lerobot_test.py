"""LeRobot's own programs with evalbus: a data set, a policy trained on it, and its evaluation on both sides.

usage: lerobot_test.py BIN   (the folder of evalbus' programs); see scripts/interop lerobot
"""

import support

support.need("torch", "lerobot", "numpy", "msgpack", "websockets", "gymnasium", "h5py")

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import evalbus
import numpy as np
import torch

# Processes of vector environments also import this file, without arguments.
BIN = os.path.abspath(sys.argv.pop(1)) if __name__ == "__main__" else os.environ["EVALBUS_BIN"]
SEED = 9
EPISODES = 2
STEPS = int(os.environ.get("EVALBUS_LEROBOT_STEPS", "200"))
os.environ |= {
    "EVALBUS_BIN": BIN,
    "EVALBUS_PYTHON": sys.executable,
    "HF_HUB_OFFLINE": "1",
    # On a few cores, PyTorch's threads would wait for each other.
    "OMP_NUM_THREADS": "1",
}
TRAIN = [
    "--policy.type=act", "--policy.push_to_hub=false", "--policy.device=cpu", "--policy.pretrained_backbone_weights=null",
    "--policy.chunk_size=20", "--policy.n_action_steps=10", "--policy.dim_model=64", "--policy.dim_feedforward=128",
    "--policy.n_encoder_layers=1", "--policy.n_heads=2", "--policy.use_vae=false", "--policy.optimizer_lr=0.001",
    "--policy.optimizer_lr_backbone=0.001", "--batch_size=8", "--num_workers=0", f"--steps={STEPS}", "--wandb.enable=false",
]  # fmt: skip


def program(name, *arguments, check=True):
    """Runs a program of LeRobot, or evalbus."""
    path = f"{BIN}/evalbus" if name == "evalbus" else pathlib.Path(sys.executable).parent / name
    command = [path, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=support.DEADLINE_S)
    assert not check or done.returncode == 0, f"{command}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done


class EnvironmentTest(unittest.TestCase):
    def test_the_environment(self):
        """Tests shapes and texts, and that seeds select the episodes."""
        from evalbus.lerobot.env import EvalbusEnvConfig

        config = EvalbusEnvConfig(cameras=["roboeval/head", "left/hand/wrist"], image_size=[48, 32], run_seed=SEED)
        self.assertEqual(sorted(config.features_map.values()), [
            "action", "observation.images.head", "observation.images.left_hand_wrist", "observation.state",
        ])  # fmt: skip
        envs = config.create_envs(n_envs=2, use_async_envs=True)["lift_pot/position"][0]
        try:
            seen, _ = envs.reset(seed=[0, 3], options={"lerobot_new_rollout": True})
            self.assertEqual(seen["pixels"]["left_hand_wrist"].shape, (2, 32, 48, 3))
            self.assertEqual(envs.call("task_description"), ("lift the pot by the handles",) * 2)
            self.assertEqual(envs.call("_max_episode_steps"), (401, 401))
        finally:
            envs.close()
        with evalbus.Environment("lift_pot/position") as reference:
            for index, episode in enumerate((0, 3)):
                np.testing.assert_array_equal(seen["agent_pos"][index], reference.reset(SEED, episode).observation["state"])

    def test_verdicts_in_the_loop_of_lerobot(self):
        """A policy that replays the actions of a success in lift_pot/base succeeds there but not everywhere."""
        from lerobot.envs import close_envs
        from lerobot.policies import PreTrainedPolicy
        from lerobot.policies.act.configuration_act import ACTConfig
        from lerobot.processor import PolicyProcessorPipeline
        from lerobot.scripts.lerobot_eval import eval_policy_all

        from evalbus.lerobot.env import EvalbusEnvConfig

        class Replay(PreTrainedPolicy):
            config_class, name = ACTConfig, "replay"

            def __init__(self, rows):
                super().__init__(ACTConfig(device="cpu"))
                self.rows = torch.from_numpy(rows.astype(np.float32))

            def reset(self):
                self.step = -1

            def select_action(self, batch):
                self.step += 1
                action = self.rows[min(self.step, len(self.rows) - 1)]
                return action.expand(len(batch["observation.state"]), -1)

            def __call__(self, observation):
                return self.select_action({"observation.state": [0]})[0].numpy()

            forward = predict_action_chunk = get_optim_params = None

        tasks, episodes = ["lift_pot/base", "lift_pot/position"], 3
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            run = evalbus.run("lift_pot/base", episodes=1, control_hz=20, in_process=True, out=here / "expert")
            action = evalbus.read_log(run.logs[0])["EVALBUS_ACTION"]
            policy = Replay(np.hstack([action["joint_position_rad"], action["gripper_closing"]]))
            config = EvalbusEnvConfig(task=",".join(tasks), run_seed=7, cameras=[], render_mode=None)
            envs = config.create_envs(n_envs=episodes)
            none = PolicyProcessorPipeline(steps=[], to_transition=lambda x: x, to_output=lambda x: x)
            found = eval_policy_all(envs, policy, none, none, none, none, n_episodes=episodes, start_seed=0)
            close_envs(envs)
            verdicts = set()
            for task, theirs in zip(tasks, found["per_task"]):
                ours = evalbus.run(
                    task, policy, episodes=episodes, seed=7, in_process=True, out=here / task.replace("/", "_")
                )
                print(task, theirs["metrics"]["successes"])
                self.assertEqual(theirs["task_group"], task)
                self.assertEqual(theirs["metrics"]["successes"], [episode.success for episode in ours.episodes])
                verdicts |= set(theirs["metrics"]["successes"])
        self.assertEqual(verdicts, {True, False})


class LeRobotTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.here = pathlib.Path(cls.folder.name)
        cls.recorded = evalbus.run(
            "lift_pot/base", episodes=2, control_hz=20, in_process=True, video=["none"], out=cls.here / "expert"
        )
        cls.set = cls.here / "set"
        program(
            "evalbus", "export", cls.recorded.folder, "--lerobot", cls.set, "--camera", "roboeval/head", "--size", "64x64"
        )
        program(
            "lerobot-train", f"--dataset.root={cls.set}", "--dataset.repo_id=evalbus/set",
            f"--output_dir={cls.here / 'trained'}", *TRAIN,
        )  # fmt: skip
        cls.checkpoint = cls.here / "trained/checkpoints/last/pretrained_model"

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_data_set(self):
        from lerobot.datasets.lerobot_dataset import LeRobotDataset

        found = LeRobotDataset("evalbus/set", root=self.set)
        self.assertEqual((found.fps, found.num_episodes, found.meta.info.codebase_version), (20, 2, "v3.0"))
        log = evalbus.read_log(self.recorded.logs[0])
        first = found[0]
        np.testing.assert_array_equal(
            first["action"].numpy(),
            np.hstack([log["EVALBUS_ACTION"]["joint_position_rad"][0], log["EVALBUS_ACTION"]["gripper_closing"][0]]).astype("f4"),
        )
        self.assertEqual(first["task"], "lift the pot by the handles")
        self.assertEqual(tuple(first["observation.images.head"].shape), (3, 64, 64))
        self.assertIn("mean", found.meta.stats["action"])
        # The data set stores the initial states for `trained_on` of a contract.
        starts = [json.loads(line) for line in (self.set / "evalbus_starts.jsonl").read_text().splitlines()]
        self.assertEqual(starts, [
            {"task": "lift_pot/base", "parameters": episode.line["parameters"]} for episode in self.recorded.episodes
        ])  # fmt: skip
        again = program("evalbus", "export", self.recorded.folder, "--lerobot", self.set, check=False)
        self.assertEqual((again.returncode, again.stderr), (1, f"error: {self.set}: exists; choose another name\n"))

    def test_verdicts_are_those_of_a_run(self):
        """Tests the same checkpoint in lerobot-eval, and behind `evalbus policy serve` in `evalbus run`."""
        tasks = ["lift_pot/base", "lift_pot/position"]
        program(
            "lerobot-eval", f"--policy.path={self.checkpoint}", "--policy.device=cpu", "--env.type=evalbus",
            "--env.discover_packages_path=evalbus.lerobot", f"--env.task={','.join(tasks)}", f"--env.run_seed={SEED}",
            "--env.image_size=[64,64]", "--seed=0", f"--eval.n_episodes={EPISODES}", "--eval.batch_size=1",
            f"--output_dir={self.here / 'eval'}",
        )  # fmt: skip
        per_task = json.loads((self.here / "eval/eval_info.json").read_text())["per_task"]
        contract = self.here / "act.yaml"
        server = subprocess.Popen(
            [f"{BIN}/evalbus", "policy", "serve", "--lerobot", self.checkpoint, "--port", "0", "--contract", contract],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        try:
            (url,) = [line.split(": ")[1].strip() for line in iter_until(server.stdout, "policy server ready: ")]
            checked = program("evalbus", "policy", "check", url, "--contract", contract, "--out", self.here / "check", check=False)
            self.assertIn(checked.returncode, (0, 6), checked.stdout)  # A policy this small may begin with a jump.
            for task, theirs in zip(tasks, per_task):
                ours = evalbus.run(
                    task, url, contract=contract, episodes=EPISODES, seed=SEED, in_process=True, video=["none"],
                    out=self.here / task.replace("/", "_"),
                )  # fmt: skip
                self.assertEqual(theirs["task_group"], task)
                print(task, theirs["metrics"]["successes"])
                self.assertEqual(theirs["metrics"]["successes"], [episode.success for episode in ours.episodes])
        finally:
            server.send_signal(signal.SIGINT)
            server.wait()
            server.stdout.close()

    def test_an_envhub_repository(self):
        from lerobot.envs import utils

        file = self.here / "env.py"
        file.write_text("from evalbus.lerobot.env import make_env\n")
        module = utils._import_hub_module(str(file), "me/evalbus")
        envs = utils._normalize_hub_result(utils._call_make_env(module, n_envs=1, use_async_envs=False, cfg=None))
        utils.close_envs(envs)
        self.assertEqual(list(envs), ["lift_pot/position"])

    def test_the_plugin_is_found(self):
        """LeRobot finds a plugin by the name of its distribution and imports it."""
        plugin = self.here / "plugin"
        shutil.copytree(support.SOURCE / "python/plugins/lerobot_env_evalbus", plugin)
        info = plugin / "lerobot_env_evalbus-0.3.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lerobot_env_evalbus\nVersion: 0.3.0\n")
        code = (
            "from lerobot.utils.import_utils import register_third_party_plugins; register_third_party_plugins()\n"
            "from lerobot.envs import make_env_config; print(make_env_config('evalbus').type)"
        )
        path = f"{plugin}:{os.environ.get('PYTHONPATH', '')}"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})
        self.assertEqual(done.stdout, "evalbus\n", done.stderr)

    def test_wrong_input(self):
        from evalbus.lerobot.env import EvalbusEnvConfig
        from evalbus.lerobot.policy import LeRobotPolicy, proposed_contract

        with self.assertRaisesRegex(evalbus.InputError, "nowhere"):
            EvalbusEnvConfig(task="nowhere")
        with self.assertRaisesRegex(evalbus.InputError, "two cameras have the images observation.images.head"):
            EvalbusEnvConfig(cameras=["head", "roboeval/head"])
        done = program("evalbus", "policy", "serve", "--lerobot", self.here / "nothing", check=False)
        self.assertEqual((done.returncode, done.stderr.splitlines()[-1]), (
            1, f"error: {self.here / 'nothing'}: expected a folder with config.json, as lerobot-train writes it"
        ))  # fmt: skip
        config = LeRobotPolicy(self.checkpoint).config
        self.assertIn("camera: front", proposed_contract(config, "act", cameras={"head": "front"}))
        with self.assertRaisesRegex(evalbus.InputError, "the checkpoint has no observation.images.wrist"):
            proposed_contract(config, "act", cameras={"wrist": "front"})


def iter_until(stream, beginning):
    """Returns the first line with this beginning. Fails at the end of the stream."""
    for line in stream:
        if line.startswith(beginning):
            return [line]
    raise AssertionError(f"no line begins with {beginning}")


if __name__ == "__main__":
    support.main()
