"""A policy that was trained on `evalbus export --lerobot` receives the same observations under the proposed contract.

Keys, shapes and, at the first tick, numbers are the same. LeRobot itself is not needed (scripts/interop data
and lerobot test with it).

usage: lerobot_keys_test.py BIN   (the folder of evalbus' programs)
"""

import support

support.need("numpy", "msgpack", "websockets", "h5py")

import json
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np
from evalbus.lerobot.policy import proposed_contract

BIN = sys.argv.pop(1)
# Replaces LeRobot's writer by one that stores what it is passed.
WRITER = """
import pickle

class LeRobotDataset:
    @classmethod
    def create(cls, repo_id, fps, features, root, **_):
        made = cls()
        made.features, made.root, made.frames = features, root, []
        root.mkdir()
        return made
    def add_frame(self, frame):
        self.frames.append(frame)
    def save_episode(self):
        pickle.dump((self.features, self.frames[0]), open(self.root / "first", "wb"))
    def finalize(self):
        pass
"""
# A policy that holds still and stores its first observation.
POLICY = """
import pickle, sys
import evalbus, numpy as np

def act(observation):
    pickle.dump(observation, open(sys.argv[1], "xb")) if act.first else None
    act.first = False
    return np.append(observation["observation.state"][:14], [0, 0])[None].repeat(10, 0)

act.first = True
evalbus.serve(act, port=0)
"""


def first_frame(here, task, export, *options):
    """Exports an episode of the expert. Returns the features and the values of the first frame."""
    support.evaluate(BIN, task, "--control-hz", "20", "--seed", "5", "--episodes", "1", *options, out=here / "run")
    package = here / "stub" / "lerobot" / "datasets"
    package.mkdir(parents=True)
    for folder in (package, package.parent):
        (folder / "__init__.py").touch()
    (package / "lerobot_dataset.py").write_text(WRITER)
    path = f"{here / 'stub'}:{os.environ.get('PYTHONPATH', '')}"
    subprocess.run([f"{BIN}/evalbus", "export", here / "run", "--lerobot", here / "frames", *export], check=True,
                   capture_output=True, timeout=support.DEADLINE_S,
                   env={**os.environ, "PYTHONPATH": path, "EVALBUS_PYTHON": sys.executable})  # fmt: skip
    # The export stores the initial state of each episode, for `trained_on` of a contract.
    (line,) = (here / "frames/evalbus_starts.jsonl").read_text().splitlines()
    (episode,) = (here / "run/episodes.jsonl").read_text().splitlines()
    episode = json.loads(episode)
    start = {"task": f"{episode['task']}/{episode['variation']}", "parameters": episode["parameters"]}
    assert json.loads(line) == start, (line, start)
    return pickle.loads((here / "frames/first").read_bytes())


def contract_for(features):
    """Returns the contract that evalbus proposes for an ACT policy with these features."""
    shaped = {
        key: types.SimpleNamespace(shape=value["shape"] if len(value["shape"]) == 1 else (3, *value["shape"][:2]))
        for key, value in features.items()
    }
    config = types.SimpleNamespace(
        type="act", input_features=shaped, output_features={"action": shaped.pop("action")}, n_action_steps=10
    )
    return proposed_contract(config, "test")


class LeRobotKeysTest(unittest.TestCase):
    def test_a_single_arm_has_names_of_its_own(self):
        with tempfile.TemporaryDirectory() as name:
            features, frame = first_frame(pathlib.Path(name), "pick_single_book_from_table", [], "--robot", "single_panda")
        self.assertEqual(features["action"]["names"], [f"arm_joint{k}" for k in range(1, 8)] + ["arm_gripper"])
        self.assertEqual(features["observation.state"], features["action"])
        self.assertEqual((frame["action"].shape, frame["observation.state"].shape), ((8,), (8,)))

    def test_the_contract_shows_what_the_data_set_has(self):
        with tempfile.TemporaryDirectory() as name:
            here, contract = pathlib.Path(name), pathlib.Path(name) / "act.yaml"
            features, frame = first_frame(here, "lift_pot/position", ["--camera", "roboeval/head", "--size", "224x224"])
            contract.write_text(contract_for(features))
            (here / "policy.py").write_text(POLICY)
            with support.Server(here / "policy.py", here / "observation") as server:
                support.evaluate(BIN, "lift_pot/position", "--policy", server.url, "--contract", str(contract), "--seed",
                                 "5", "--episodes", "1", out=here / "shown")  # fmt: skip
            observation = pickle.loads((here / "observation").read_bytes())
        keys = {key for key in features if key.startswith("observation.")}
        self.assertEqual({key for key in observation if key != "prompt"}, keys)
        for key in keys:
            self.assertEqual(tuple(observation[key].shape), tuple(features[key]["shape"]), key)
        np.testing.assert_array_equal(observation["observation.state"], frame["observation.state"])
        np.testing.assert_array_equal(observation["observation.images.head"], frame["observation.images.head"])


support.main()
