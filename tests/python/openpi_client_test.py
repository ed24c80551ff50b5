"""Tests serve() with openpi's own client (openpi-client of PyPI)."""

import support

support.need("openpi_client")

import pathlib
import unittest

import numpy as np
from evalbus import codec
from openpi_client import msgpack_numpy, websocket_client_policy

POLICY = pathlib.Path(__file__).with_name("policies_under_test.py")


class OpenpiClientTest(unittest.TestCase):
    def test_conversation(self):
        with support.Server(POLICY, 0) as server:
            client = websocket_client_policy.WebsocketClientPolicy(server.url)
            self.assertEqual(client.get_server_metadata(), {"name": "test", "reset_pose": [0, 1.5]})
            reply = client.infer({"state": np.array([0.5, -1], np.float32), "prompt": "lift the pot"})
            np.testing.assert_array_equal(reply["actions"], [[1, -2]])
            self.assertGreaterEqual(reply["server_timing"]["infer_ms"], 0)
            self.assertEqual(client.infer({"what": "chunk"})["actions"].shape, (3, 2))
            with self.assertRaisesRegex(RuntimeError, "the pot is too hot"):
                client.infer({"what": "raise"})

    def test_bytes(self):
        value = {
            "image": np.arange(24, dtype=np.uint8).reshape(2, 4, 3),
            "state": np.arange(8, dtype=np.float64)[::2],
            "gripper": np.float32(0.5),
            "nested": {"flags": np.array([True]), "prompt": "lift", "none": None, "list": [1, 2.5]},
        }
        self.assertEqual(codec.pack(value), msgpack_numpy.packb(value))
        back = codec.unpack(msgpack_numpy.packb(value))
        np.testing.assert_array_equal(back["image"], value["image"])
        self.assertEqual(back["gripper"], 0.5)


support.main()
