"""Checks servers of third-party software against contracts with evalbus policy check.

usage: wires_test.py BIN   (the folder of evalbus' programs)

The parts are real (openpi-client's codec, pyzmq, json-numpy, vla-eval's model server). The code that joins
them follows the servers of openpi, Isaac-GR00T N1.5 and OpenVLA.
"""

import support

support.need("openpi_client", "zmq", "json_numpy", "vla_eval")

import asyncio
import http.server
import io
import json
import subprocess
import sys
import tempfile
import threading
import unittest

import anyio
import json_numpy
import msgpack
import numpy as np
import websockets.asyncio.server
import zmq
from openpi_client import msgpack_numpy
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve_async

BIN = sys.argv.pop(1)
HOME = np.array([0, 0, 0, -np.pi / 2, 0, np.pi / 2, -np.pi / 4], np.float32)


def check(contract, url):
    with tempfile.TemporaryDirectory() as folder:
        command = [f"{BIN}/evalbus", "policy", "check", url, "--contract", contract, "--json", "--out", folder]
        done = subprocess.run(command, capture_output=True, text=True, timeout=support.DEADLINE_S)
        assert done.stdout, done.stderr
        return done.returncode, json.loads(done.stdout)


class Loop:
    """Runs a coroutine in a thread until the end of the block; the coroutine calls a given function once it
    listens.
    """

    def __init__(self, serve):
        self.loop = asyncio.new_event_loop()
        self.listens = threading.Event()
        self.thread = threading.Thread(target=self.run, args=(serve,), daemon=True)
        self.thread.start()
        assert self.listens.wait(support.DEADLINE_S)

    def run(self, serve):
        asyncio.set_event_loop(self.loop)
        self.task = self.loop.create_task(serve(self.say))
        try:
            self.loop.run_until_complete(self.task)
        except asyncio.CancelledError:
            pass

    def say(self, port):
        self.port = port
        self.listens.set()

    def __enter__(self):
        return self.port

    def __exit__(self, *_):
        self.loop.call_soon_threadsafe(self.task.cancel)
        self.thread.join(support.DEADLINE_S)


class WiresTest(unittest.TestCase):
    def test_openpi(self):
        seen = {}

        async def converse(connection):
            packer = msgpack_numpy.Packer()
            await connection.send(packer.pack({}))
            async for message in connection:
                seen.update(msgpack_numpy.unpackb(message))
                await connection.send(packer.pack({"actions": np.zeros((10, 16)), "policy_timing": {"infer_ms": 1.5}}))

        async def serve(listens):
            options = dict(compression=None, max_size=None, ping_interval=0.2)
            async with websockets.asyncio.server.serve(converse, "127.0.0.1", 0, **options) as server:
                listens(server.sockets[0].getsockname()[1])
                await server.serve_forever()

        with Loop(serve) as port:
            code, report = check("roboeval", f"ws://127.0.0.1:{port}")
        self.assertEqual((code, report["num_steps"]), (0, 10), report)
        self.assertEqual(seen["prompt"], "lift the pot by the handles")
        for key in ("exterior_image_1_left", "wrist_image_left", "wrist_image_right"):
            image = seen[f"observation/{key}"]
            self.assertEqual((image.shape, image.dtype), ((256, 256, 3), np.uint8))
            self.assertGreater(image.std(), 1)
        state = seen["observation/joint_position"]
        self.assertEqual((state.shape, state.dtype), ((36,), np.float32))
        np.testing.assert_allclose(state[:7], HOME, atol=1e-3)
        np.testing.assert_allclose(state[9:16], HOME, atol=1e-3)

    def test_groot(self):
        def to_bytes(value):
            if not isinstance(value, np.ndarray):
                return value
            file = io.BytesIO()
            np.save(file, value, allow_pickle=False)
            return {"__ndarray_class__": True, "as_npy": file.getvalue()}

        def from_bytes(value):
            if "__ndarray_class__" not in value:
                return value
            return np.load(io.BytesIO(value["as_npy"]), allow_pickle=False)

        arms = ("right", "left")
        names = {
            "video": [f"{view}_view" for view in ("right_wrist", "left_wrist", "front")],
            "state": [f"{a}_{what}" for a in arms for what in ("arm_eef_pos", "arm_eef_quat", "gripper_qpos")],
            "action": [f"{a}_{what}" for a in arms for what in ("arm_eef_pos", "arm_eef_rot", "gripper_close")],
        }
        config = {}
        for modality, keys in names.items():
            indices = list(range(16)) if modality == "action" else [0]
            one = {"delta_indices": indices, "modality_keys": [f"{modality}.{key}" for key in keys]}
            config[modality] = {"__ModalityConfig_class__": True, "as_json": json.dumps(one)}
        seen = {}

        def answer(request):
            if request["endpoint"] == "ping":
                return {"status": "ok", "message": "Server is running"}
            if request["endpoint"] == "get_modality_config":
                return config
            seen.update(request["data"])
            sizes = {key: 1 if key.endswith("close") else 3 for key in names["action"]}
            # The shape is (steps, values), after the observations' batch dimension if they have one.
            batch = request["data"]["state.right_arm_eef_pos"].shape[:-2]
            actions = {key: np.zeros((*batch, 16, size), np.float32) for key, size in sizes.items()}
            return {f"action.{key}": value if batch else np.squeeze(value) for key, value in actions.items()}

        socket = zmq.Context.instance().socket(zmq.REP)
        port = socket.bind_to_random_port("tcp://127.0.0.1")
        ends = threading.Event()

        def serve():
            while not ends.is_set():
                if socket.poll(50):
                    request = msgpack.unpackb(socket.recv(), object_hook=from_bytes)
                    socket.send(msgpack.packb(answer(request), default=to_bytes))

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        code, report = check("groot_bimanual_panda", f"tcp://127.0.0.1:{port}")
        ends.set()
        thread.join(support.DEADLINE_S)
        socket.close(0)
        self.assertEqual((code, report["num_steps"]), (0, 16), report)
        self.assertEqual(seen["video.front_view"].shape[-4:], (1, 256, 256, 3))
        self.assertEqual(seen["state.right_arm_eef_quat"].shape[-1], 4)
        self.assertEqual(np.ravel(seen["annotation.human.action.task_description"])[0], "lift the pot by the handles")

    def test_rest(self):
        seen = {}

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                seen.update(json_numpy.loads(body))
                reply = json_numpy.dumps(np.zeros(7)).encode()
                self.send_response(200)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(reply)))
                self.end_headers()
                self.wfile.write(reply)

            def log_message(self, *_):
                pass

        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            code, report = check("openvla", f"http://127.0.0.1:{server.server_port}/act")
            server.shutdown()
        # An action of zeros closes the gripper and changes nothing else.
        self.assertEqual((code, report["num_steps"]), (0, 1), report)
        self.assertEqual((seen["image"].shape, seen["image"].dtype), ((224, 224, 3), np.uint8))
        self.assertEqual(list(seen), ["image", "instruction", "unnorm_key"])

    def test_vla_eval(self):
        seen = {}

        class Policy(PredictModelServer):
            def predict(self, observation, context):
                seen.update(observation)
                return {"actions": np.concatenate([HOME, [1], HOME, [1]]).astype(np.float32)}

        async def serve(listens):
            async with anyio.create_task_group() as group:
                listens(await group.start(serve_async, Policy(), "127.0.0.1", 0))
                await anyio.sleep_forever()

        with Loop(serve) as port:
            code, report = check("vla_eval", f"ws://127.0.0.1:{port}")
        self.assertEqual((code, report["num_steps"]), (0, 1), report)
        self.assertEqual(sorted(seen["images"]), ["head", "left_wrist", "right_wrist"])
        self.assertEqual(seen["images"]["head"].shape, (256, 256, 3))
        self.assertEqual(np.asarray(seen["states"]).shape, (16,))
        self.assertEqual(seen["task_description"], "lift the pot by the handles")


support.main()
