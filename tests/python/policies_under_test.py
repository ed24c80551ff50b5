"""A policy whose behavior is selected by the observation. server_test.py starts this program."""

import sys
import threading

import evalbus
import numpy as np


class Policy:
    def __init__(self):
        self.resets = 0
        self.calls = 0

    def reset(self):
        self.resets += 1

    def __call__(self, observation):
        what = observation.get("what", "row")
        self.calls += 1
        if what == "count":
            return {"actions": [[0]], "calls": self.calls}
        if what == "row":
            return observation["state"] * 2
        if what == "chunk":
            return np.arange(6.0).reshape(3, 2)
        if what == "dictionary":
            return {"actions": [[1, 2]], "resets": self.resets, "thread": threading.get_ident()}
        if what == "wait":
            # Blocks until the test writes into this pipe.
            with open(observation["until"]) as pipe:
                pipe.read()
            return [0.0]
        if what == "raise":
            raise RuntimeError("the pot is too hot")
        if what == "cube":
            return np.zeros((1, 2, 3))
        if what == "no actions":
            return {"action": [1]}
        if what == "words":
            return ["up"]
        return object()


policy = Policy if sys.argv[2:] == ["class"] else Policy()
evalbus.serve(policy, port=int(sys.argv[1]), metadata={"name": "test", "reset_pose": [0, 1.5]})
