"""Serves a scripted policy: both arms move to their home position and the grippers open.

    python3 python/examples/scripted_policy.py
    evalbus run lift_pot --policy plain

Observation: "state", the 14 joint positions of the two Panda arms (rad, left arm first); further numbers are ignored.
Actions: 10 steps of 16 numbers: 14 joint targets (rad), then the two grippers (0 open, 1 closed).
"""

import evalbus
import numpy as np

HOME = np.array([0, 0, 0, -np.pi / 2, 0, np.pi / 2, -np.pi / 4] * 2)


def act(observation):
    joints = observation["state"][:14]
    way = np.linspace(0.1, 1, 10)[:, None]
    return np.hstack([joints + way * (HOME - joints), np.zeros((10, 2))])


if __name__ == "__main__":
    evalbus.serve(act)
