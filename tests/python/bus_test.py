"""Python policies on the bus of a real run, with LCM's module from PyPI, in a private network namespace.

usage: bus_test.py BIN   (the folder of evalbus' programs)
"""

import support

support.need("numpy", "lcm")

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import evalbus
import numpy as np

BIN = sys.argv.pop(1)
URL = "udpm://239.255.76.67:7667?ttl=0"
HOME = [0, 0, 0, -np.pi / 2, 0, np.pi / 2, -np.pi / 4] * 2


def run_on_bus(policy, out, *options):
    """Runs `evalbus run` against a program on the bus."""
    command = [
        f"{BIN}/evalbus",
        "run",
        "lift_pot",
        "--policy",
        "lcm",
        "--url",
        URL,
        "--video",
        "none",
        "--out",
        out,
    ]
    with support.Program(*policy, ready="policy ready"):
        done = subprocess.run(
            [*command, *options], capture_output=True, text=True, timeout=support.DEADLINE_S
        )
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
    return evalbus.read_run(out)


class BusTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_example_keeps_the_robot_at_home(self):
        run = run_on_bus([support.EXAMPLES / "lcm_policy.py", URL], self.folder / "run", "--episodes", "2")
        self.assertEqual([episode.end_reason for episode in run.episodes], ["time_limit"] * 2)
        self.assertEqual([episode.complete for episode in run.episodes], [True] * 2)
        log = evalbus.read_log(run.logs[1])
        action, state = log["EVALBUS_ACTION"], log["EVALBUS_STATE"]
        # The policy may also have answered the last state.
        ticks = len(action["time_us"])
        self.assertIn(len(state["time_us"]) - ticks, (0, 1))
        np.testing.assert_array_equal(action["header"]["tick"], np.arange(ticks))
        np.testing.assert_allclose(action["joint_position_rad"], np.tile(HOME, (ticks, 1)), rtol=1e-15)
        joints = state["arm"]["joint_position_rad"].reshape(len(state["time_us"]), -1)
        np.testing.assert_allclose(joints, np.tile(HOME, (len(joints), 1)), atol=0.01)

    def test_the_network_lifts_the_pot(self):
        """pytorch_policy.py learns from one expert run and controls the robot without a server in between."""
        support.need_torch(self)
        support.evaluate(BIN, "lift_pot", "--episodes", "1", "--policy", "expert", out=self.folder / "expert")
        program = pathlib.Path(__file__).with_name("network_on_bus.py")
        run = run_on_bus([program, URL, self.folder / "expert"], self.folder / "run", "--episodes", "1")
        self.assertEqual(run.scores["success"].tolist(), [1])


support.main()
