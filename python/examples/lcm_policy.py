"""A policy that uses the LCM bus directly; it holds the robot at its home position.

    pip install lcm            (not available as a Debian package)
    evalbus run lift_pot --policy lcm --url 'udpm://239.255.76.67:7667?ttl=0' &
    python3 python/examples/lcm_policy.py 'udpm://239.255.76.67:7667?ttl=0'

The protocol is described in docs/connecting_a_policy.md and docs/messages.md, the message types in lcmtypes/.
"""

import random
import sys
import threading

import lcm
import numpy as np
from evalbus import messages


class Policy:
    def __init__(self, url):
        self.bus = lcm.LCM(url)
        self.model = None
        self.status = {
            "component": "policy",
            "instance": random.getrandbits(62),
            "episode": -1,
            "attempt": -1,
        }
        for channel, handle in (
            ("EVALBUS_MODEL", self.on_model),
            ("EVALBUS_EPISODE_BEGIN", self.on_begin),
            ("EVALBUS_STATE", self.on_state),
        ):
            # 0 makes the queue unlimited, so that no message is dropped.
            self.bus.subscribe(
                channel, lambda _, data, handle=handle: handle(messages.decode(data)[1])
            ).set_queue_capacity(0)

    def act(self, state):
        """Returns (joint targets of all arms in rad, one number per gripper from 0 = open to 1 = closed)."""
        return np.concatenate([arm["joint_home_rad"] for arm in self.model["arm"]]), [0] * len(
            self.model["gripper"]
        )

    def on_model(self, model):
        self.model = model

    def on_begin(self, begin):
        header = begin["header"]
        ready = messages.types()["component_status_t"].constants["READY"]
        self.status = {
            **self.status,
            "session": header["session"],
            "state": ready,
            "episode": header["episode"],
            "attempt": header["attempt"],
        }
        self.publish_status()

    def on_state(self, state):
        joints, grippers = self.act(state)
        action = {
            "header": state["header"],
            "mode": messages.types()["action_t"].constants["JOINT_POSITION"],
            "joint_position_rad": joints,
            "gripper_closing": grippers,
        }
        self.bus.publish("EVALBUS_ACTION", messages.encode("action_t", action))

    def publish_status(self):
        self.bus.publish("EVALBUS_STATUS", messages.encode("component_status_t", self.status))

    def run(self):
        # STATUS is published by a separate thread, so that it is sent at least once a second even if act() is slow.
        stopped = threading.Event()

        def repeat():
            while not stopped.wait(0.4):
                self.publish_status()

        threading.Thread(target=repeat, daemon=True).start()
        print("policy ready", flush=True)
        try:
            while True:
                self.bus.handle()
        except KeyboardInterrupt:
            stopped.set()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: lcm_policy.py URL")
    Policy(sys.argv[1]).run()
