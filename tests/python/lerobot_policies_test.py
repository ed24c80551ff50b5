"""Checkpoints of LeRobot's diffusion, SmolVLA and pi0 policies, in LeRobot's loop and behind `evalbus policy serve`.

usage: lerobot_policies_test.py BIN   (the folder of evalbus' programs); see scripts/interop lerobot

The policies are small and have random weights. Both sides receive equal random numbers, so all actions are equal.
"""

import support

support.need("torch", "lerobot", "numpy", "msgpack", "websockets", "gymnasium", "h5py", "diffusers", "transformers")

import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest

import evalbus
import numpy as np
import torch
from lerobot.configs import FeatureType, PolicyFeature

BIN = os.path.abspath(sys.argv.pop(1))
EPISODES = 2
SEED = 9
SIDE_PX = 64
FEATURES = {
    "observation.state": PolicyFeature(FeatureType.STATE, (16,)),
    "observation.images.head": PolicyFeature(FeatureType.VISUAL, (3, SIDE_PX, SIDE_PX)),
}
ACTION = {"action": PolicyFeature(FeatureType.ACTION, (16,))}
os.environ |= {
    "EVALBUS_BIN": BIN,
    "EVALBUS_PYTHON": sys.executable,
    "HF_HUB_OFFLINE": "1",
    # On a few cores, PyTorch's threads would wait for each other.
    "OMP_NUM_THREADS": "1",
}
torch.set_num_threads(1)


def diffusion(here, n_obs_steps):
    from lerobot.policies.diffusion.configuration_diffusion import DiffusionConfig

    return DiffusionConfig(
        device="cpu", input_features=FEATURES, output_features=ACTION, pretrained_backbone_weights=None,
        n_obs_steps=n_obs_steps, horizon=16, n_action_steps=8, down_dims=(32, 64), use_separate_rgb_encoder_per_camera=False,
        spatial_softmax_num_keypoints=4, noise_scheduler_type="DDIM", num_inference_steps=2,
    )  # fmt: skip


def smolvla(here):
    from lerobot.policies.smolvla.configuration_smolvla import SmolVLAConfig

    return SmolVLAConfig(
        device="cpu", input_features=FEATURES, output_features=ACTION, vlm_model_name=str(vision_language_model(here)),
        resize_imgs_with_padding=(SIDE_PX, SIDE_PX), num_vlm_layers=2, num_steps=2,
    )  # fmt: skip


def vision_language_model(here):
    """Returns a folder with the configuration and the processor of a small SmolVLM, which LeRobot otherwise
    downloads."""
    from tokenizers import Tokenizer, models, pre_tokenizers
    from transformers import PreTrainedTokenizerFast, SmolVLMConfig, SmolVLMImageProcessor, SmolVLMProcessor
    from transformers import SmolVLMVideoProcessor

    folder = here / "vlm"
    special = ["<pad>", "<bos>", "<eos>", "<image>", "<fake_token_around_image>", "<global-img>", "<end_of_utterance>"]
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    tokenizer = Tokenizer(models.BPE({token: k for k, token in enumerate(special + sorted(alphabet))}, []))
    tokenizer.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    tokenizer = PreTrainedTokenizerFast(
        tokenizer_object=tokenizer, pad_token="<pad>", bos_token="<bos>", eos_token="<eos>",
        extra_special_tokens={
            "image_token": "<image>", "fake_image_token": "<fake_token_around_image>",
            "global_image_token": "<global-img>", "end_of_utterance_token": "<end_of_utterance>",
        },
    )  # fmt: skip
    text = {
        "model_type": "llama", "hidden_size": 64, "intermediate_size": 128, "num_hidden_layers": 2, "num_attention_heads": 4,
        "num_key_value_heads": 2, "head_dim": 16, "vocab_size": len(tokenizer), "pad_token_id": 0,
    }  # fmt: skip
    vision = {
        "hidden_size": 32, "intermediate_size": 64, "num_hidden_layers": 2, "num_attention_heads": 2, "image_size": SIDE_PX,
        "patch_size": 16,
    }  # fmt: skip
    config = SmolVLMConfig(text_config=text, vision_config=vision, scale_factor=2, image_token_id=3, pad_token_id=0)
    config.save_pretrained(folder)
    SmolVLMProcessor(SmolVLMImageProcessor(), tokenizer, SmolVLMVideoProcessor()).save_pretrained(folder)
    return folder


class PoliciesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        from lerobot.datasets.lerobot_dataset import LeRobotDatasetMetadata

        cls.folder = tempfile.TemporaryDirectory()
        cls.here = pathlib.Path(cls.folder.name)
        run = evalbus.run("lift_pot/base", episodes=1, control_hz=20, in_process=True, video=["none"], out=cls.here / "expert")
        command = [
            f"{BIN}/evalbus", "export", run.folder, "--lerobot", cls.here / "set", "--camera", "roboeval/head",
            "--size", f"{SIDE_PX}x{SIDE_PX}",
        ]  # fmt: skip
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        cls.stats = LeRobotDatasetMetadata("evalbus/set", root=cls.here / "set").stats

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def checkpoint(self, name, config):
        """Writes a checkpoint with random weights, as lerobot-train does."""
        from lerobot.policies import make_pre_post_processors
        from lerobot.policies.factory import get_policy_class

        folder = self.here / name
        torch.manual_seed(1)
        get_policy_class(config.type)(config).save_pretrained(folder)
        for processor in make_pre_post_processors(config, dataset_stats=self.stats):
            processor.save_pretrained(folder)
        return folder

    def in_lerobot(self, checkpoint):
        """Returns verdicts and actions of each episode in the loop of lerobot-eval."""
        from lerobot.configs import PreTrainedConfig
        from lerobot.envs import close_envs
        from lerobot.policies import make_pre_post_processors
        from lerobot.policies.factory import get_policy_class
        from lerobot.processor import PolicyProcessorPipeline
        from lerobot.scripts.lerobot_eval import eval_policy_all

        from evalbus.lerobot.env import EvalbusEnvConfig

        config = PreTrainedConfig.from_pretrained(checkpoint)
        policy = get_policy_class(config.type).from_pretrained(checkpoint, config=config).eval()
        before, after = make_pre_post_processors(config, pretrained_path=str(checkpoint))
        actions = []

        def reset(original=policy.reset):
            original()
            # lerobot-eval sets the seed only once.
            torch.manual_seed(0)
            actions.append([])

        def processed(action):
            result = after(action)
            actions[-1].append(result[0].numpy())
            return result

        policy.reset = reset
        env = EvalbusEnvConfig(task="lift_pot/position", run_seed=SEED, image_size=[SIDE_PX, SIDE_PX])
        envs = env.create_envs(n_envs=1)
        none = PolicyProcessorPipeline(steps=[], to_transition=lambda x: x, to_output=lambda x: x)
        result = eval_policy_all(envs, policy, none, none, before, processed, n_episodes=EPISODES, start_seed=0)
        close_envs(envs)
        return result["per_task"][0]["metrics"]["successes"], actions

    def in_evalbus(self, checkpoint):
        """Returns the verdicts and actions behind `evalbus policy serve`."""
        contract = self.here / f"{checkpoint.name}.yaml"
        command = [f"{BIN}/evalbus", "policy", "serve", "--lerobot", checkpoint, "--port", "0", "--contract", contract]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            try:
                lines = iter(server.stdout.readline, "")
                url = next(line for line in lines if line.startswith("policy server ready: ")).split(": ")[1].strip()
                run = evalbus.run(
                    "lift_pot/position", url, contract=contract, episodes=EPISODES, seed=SEED, in_process=True, video=["none"],
                    out=self.here / f"{checkpoint.name}_run",
                )  # fmt: skip
            finally:
                server.send_signal(signal.SIGINT)
        actions = []
        for episode in run.episodes:
            answers = evalbus.read_log(run.logs[episode.index])["EVALBUS_POLICY_ACTION"]
            actions.append(np.concatenate([
                chunk[:steps] for chunk, steps in zip(answers["value_mixed"], answers["execute_steps"])
            ]))  # fmt: skip
        return [episode.success for episode in run.episodes], actions

    def assert_both_agree(self, name, config):
        checkpoint = self.checkpoint(name, config)
        verdicts, theirs = self.in_lerobot(checkpoint)
        our_verdicts, ours = self.in_evalbus(checkpoint)
        self.assertEqual(verdicts, our_verdicts)
        self.assertEqual(len(theirs), EPISODES)
        for a, b in zip(theirs, ours):
            # The last chunk may extend beyond the end of the episode.
            self.assertLessEqual(len(a) - 1, len(b))
            steps = min(len(a), len(b))
            self.assertGreater(np.ptp(b[:steps], axis=0).max(), 0)
            np.testing.assert_array_equal(np.array(a[:steps]), b[:steps])
        print(f"{name}: {verdicts}, {[len(a) for a in theirs]} equal actions")

    def test_checkpoints_that_cannot_be_loaded(self):
        checkpoint = self.checkpoint("broken", smolvla(self.here))
        config = json.loads((checkpoint / "config.json").read_text())
        for changed, words in (
            ({"vlm_model_name": "evalbus/nothing"}, f"{checkpoint}: LeRobot cannot load it: .*huggingface.co"),
            ({"type": "nothing"}, f"{checkpoint}: LeRobot cannot load it: .*nothing"),
        ):
            (checkpoint / "config.json").write_text(json.dumps({**config, **changed}))
            self.assert_not_served(checkpoint, words)
        (checkpoint / "model.safetensors").unlink()
        self.assert_not_served(checkpoint, f"{checkpoint}: expected a folder with model.safetensors")

    def assert_not_served(self, checkpoint, words):
        command = [f"{BIN}/evalbus", "policy", "serve", "--lerobot", checkpoint, "--port", "0"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=support.DEADLINE_S)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr.splitlines()[-1], f"^error: {words}")
        self.assertNotIn("Traceback", done.stderr)

    def test_diffusion(self):
        self.assert_both_agree("diffusion", diffusion(self.here, 2))

    def test_diffusion_of_one_observation(self):
        self.assert_both_agree("diffusion_one", diffusion(self.here, 1))

    def test_smolvla(self):
        self.assert_both_agree("smolvla", smolvla(self.here))


if __name__ == "__main__":
    support.main()
