"""Checks XPolicyLab's policy server against the preset with evalbus policy check.

usage: xpolicylab_test.py BIN CHECKOUT   (the folder of evalbus' programs; a checkout of XPolicyLab)
"""

import sys

import support

CHECKOUT = sys.argv.pop(2)
BIN = sys.argv.pop(1)
sys.path.insert(0, CHECKOUT)
support.need("msgpack_numpy", "pydantic", "websockets", "client_server")

import asyncio
import json
import subprocess
import tempfile
import threading
import unittest

import numpy as np
from client_server.ws.model_server import PolicyServer, PolicyServerConfig

HOME = np.array([0, 0, 0, -np.pi / 2, 0, np.pi / 2, -np.pi / 4], np.float32)


class Model:
    """A policy that stays at home. Its answers have each form of a value that NumPy users return."""

    def __init__(self, fails_in=None):
        self.fails_in, self.calls, self.observation = fails_in, [], None

    def call(self, name):
        self.calls.append(name)
        if name == self.fails_in:
            raise RuntimeError(f"{name} fails")

    def prepare_case(self, case):
        self.call("prepare_case")
        self.case = case

    def reset(self):
        self.call("reset")

    def update_obs(self, observation):
        self.call("update_obs")
        self.observation = observation

    def get_action(self):
        self.call("get_action")
        action = {
            "left_arm_joint_state": HOME,
            "left_ee_joint_state": np.float32(1),
            "right_arm_joint_state": HOME.tolist(),
            "right_ee_joint_state": 1.0,
        }
        return [action, dict(action)]

    def on_trial_end(self, result):
        self.call("on_trial_end")
        self.result = result


def check(model):
    """Returns the exit code and report of a check that is made while the server is active."""
    loop = asyncio.new_event_loop()
    server = PolicyServer(model, PolicyServerConfig("127.0.0.1", 0))
    loop.run_until_complete(server.start())
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    try:
        with tempfile.TemporaryDirectory() as folder:
            command = [f"{BIN}/evalbus", "policy", "check", server.url, "--contract", "xpolicylab", "--json"]
            command += ["--out", folder]
            done = subprocess.run(command, capture_output=True, text=True, timeout=support.DEADLINE_S)
            assert done.stdout, done.stderr
            return done.returncode, json.loads(done.stdout)
    finally:
        asyncio.run_coroutine_threadsafe(server.stop(), loop).result(support.DEADLINE_S)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(support.DEADLINE_S)
        loop.close()


class XPolicyLabTest(unittest.TestCase):
    def test_good(self):
        model = Model()
        code, report = check(model)
        self.assertEqual((code, report["num_steps"]), (0, 2), report)
        calls = ["prepare_case", "reset"] + ["update_obs", "get_action"] * 6 + ["on_trial_end"]
        self.assertEqual(model.calls, calls)
        self.assertEqual(model.case["instruction"], "lift the pot by the handles")
        self.assertRegex(model.result["trial_id"], "^evalbus-.*-episode0$")
        seen = model.observation
        self.assertEqual(seen["instruction"], "lift the pot by the handles")
        self.assertEqual((seen["env_idx"], seen["additional_info"]["frequency"]), (0, 25))
        self.assertEqual(sorted(seen["vision"]), ["cam_head", "cam_left_wrist", "cam_right_wrist"])
        for camera in seen["vision"].values():
            self.assertEqual((camera["color"].shape, camera["color"].dtype), ((480, 640, 3), np.uint8))
            self.assertGreater(camera["color"].std(), 1)
        for arm in ("left", "right"):
            np.testing.assert_allclose(seen["state"][f"{arm}_arm_joint_state"], HOME, atol=1e-3)
            self.assertEqual(seen["state"][f"{arm}_ee_joint_state"].shape, (1,))
            pose = seen["state"][f"{arm}_ee_pose"]
            self.assertEqual((pose.shape, pose.dtype), ((7,), np.float32))
            self.assertAlmostEqual(float(np.linalg.norm(pose[3:])), 1, places=5)

    def test_errors(self):
        for name, text in (
            ("reset", "the model's reset failed (reset_failed); the server reports: reset fails"),
            ("get_action", "the model's inference failed (infer_failed); the server reports: get_action fails"),
            ("prepare_case", "the request prepare_case caused an internal error of the server (internal); "
                             "the server reports: prepare_case fails"),
        ):
            with self.subTest(name):
                code, report = check(Model(fails_in=name))
                self.assertEqual((code, report["verdict"]), (4, "protocol"), report)
                self.assertIn(text, "\n".join(line["text"] for line in report["lines"]))


support.main()
