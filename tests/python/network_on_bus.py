"""Runs the network of pytorch_policy.py as a policy on the bus. bus_test.py starts this program.

usage: network_on_bus.py URL RUN
"""

import sys

import support

sys.path.insert(0, str(support.EXAMPLES))

import lcm_policy
import numpy as np
import pytorch_policy

# Number of steps of an action chunk that are executed before the next request.
EXECUTE = 10


class Policy(lcm_policy.Policy):
    def __init__(self, url, network):
        self.network = pytorch_policy.Policy(network)
        super().__init__(url)

    def act(self, state):
        step = state["header"]["tick"] % EXECUTE
        if step == 0:
            joints = np.concatenate([arm["joint_position_rad"] for arm in state["arm"]])
            opening = [gripper["opening"] for gripper in state["gripper"]]
            self.chunk = self.network({"state": np.concatenate([joints, opening])})
        return self.chunk[step, :14].astype(float), self.chunk[step, 14:].astype(float)


url, run = sys.argv[1:]
Policy(url, pytorch_policy.train(*pytorch_policy.demonstrations([run]))).run()
