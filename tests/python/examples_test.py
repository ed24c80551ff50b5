"""Serves each example and sends it one request. Examples whose packages are missing are skipped.

usage: examples_test.py BIN   (the folder of evalbus' programs)
"""

import support

support.need("numpy", "msgpack", "websockets")

import asyncio
import pathlib
import sys
import tempfile
import unittest

import evalbus
import numpy as np
from evalbus import codec

BIN = sys.argv.pop(1)
# Runs the unchanged example on any free port.
RUN = """
import functools, runpy, sys
import evalbus
evalbus.serve = functools.partial(evalbus.serve, port=0)
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
HOME = np.array([0, 0, 0, -np.pi / 2, 0, np.pi / 2, -np.pi / 4] * 2)
AT_HOME = np.append(HOME, [1, 1]).astype(np.float32)


def actions(example, *arguments, **observation):
    async def ask(connection, _):
        await connection.send(codec.pack(observation))
        return await connection.recv()

    with support.Server("-c", RUN, support.EXAMPLES / example, *arguments) as server:
        reply = asyncio.run(support.converse(server.url, ask))
    assert isinstance(reply, bytes), reply
    return codec.unpack(reply)["actions"]


class ExamplesTest(unittest.TestCase):
    def test_five_lines(self):
        """Tests the five lines of docs/python.md."""
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "policy.py"
            program.write_text(support.snippet("evalbus.serve(act)"))
            chunk = actions(program, state=AT_HOME)
        np.testing.assert_array_equal(chunk, [[*AT_HOME[:14], 0, 0]])

    def test_scripted(self):
        chunk = actions("scripted_policy.py", state=AT_HOME + 0.5)
        self.assertEqual(chunk.shape, (10, 16))
        np.testing.assert_allclose(chunk[0, :14], HOME + 0.45, atol=1e-6)
        np.testing.assert_allclose(chunk[-1, :14], HOME, atol=1e-6)
        np.testing.assert_array_equal(chunk[:, 14:], 0)

    def test_pytorch(self):
        """A policy that is trained on one run of the expert lifts the pot from the same initial pose, with the example's contract."""
        support.need_torch(self)
        with tempfile.TemporaryDirectory() as folder:
            expert, learnt = pathlib.Path(folder) / "expert", pathlib.Path(folder) / "learnt"
            support.evaluate(BIN, "lift_pot", "--control-hz", "20", "--episodes", "1", out=expert)
            with support.Server("-c", RUN, support.EXAMPLES / "pytorch_policy.py", expert) as server:
                contract = support.EXAMPLES / "pytorch_policy.yaml"
                support.evaluate(
                    BIN, "lift_pot", "--policy", server.url, "--contract", str(contract), "--episodes", "1", out=learnt
                )
            run = evalbus.read_run(learnt)
        self.assertEqual([episode.end_reason for episode in run.episodes], ["success"])


support.main()
