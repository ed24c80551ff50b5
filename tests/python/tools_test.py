"""Output for external tools, read by their own software: MCAP's reader, Foxglove's client and schemas.

usage: tools_test.py BIN NODE   (the folder of evalbus' programs; a folder with node_modules and client.js)
"""

import support

support.need("mcap", "jsonschema", "websockets", "numpy")

import asyncio
import json
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import evalbus
import jsonschema
import websockets
from mcap.reader import NonSeekingReader, make_reader

NODE = sys.argv.pop(2)
BIN = sys.argv.pop(1)


class Server:
    """Runs `evalbus bridge foxglove` with these arguments, on a free port."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen(
            [f"{BIN}/evalbus", "bridge", "foxglove", *map(str, arguments), "--port", "0"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for line in self.process.stdout:
            if found := re.search(r"ws://localhost:(\d+)", line):
                self.url = f"ws://localhost:{found[1]}"
                return
        raise AssertionError(self.process.stderr.read())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate(timeout=support.DEADLINE_S)


def node(*arguments, **environment):
    return subprocess.Popen(
        ["node", "client.js", *map(str, arguments)],
        cwd=NODE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )


def ended_well(process):
    out, err = process.communicate(timeout=support.DEADLINE_S)
    assert process.returncode == 0, err
    return out


class Tools(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.recorded = pathlib.Path(cls.folder.name) / "run"
        support.evaluate(BIN, "lift_pot/position", "--policy", "expert", "--episodes", "1", out=cls.recorded)
        cls.log = cls.recorded / "episodes" / "0000" / "events.lcmlog"
        cls.mcap = cls.recorded / "e.mcap"
        subprocess.run(
            [f"{BIN}/evalbus", "export", cls.recorded, "--mcap", cls.mcap, "--camera", "overview"],
            check=True,
            capture_output=True,
        )
        cls.messages = {}
        cls.schemas = {}
        with open(cls.mcap, "rb") as file:
            reader = make_reader(file, validate_crcs=True)
            cls.summary = reader.get_summary()
            for schema, channel, message in reader.iter_messages():
                assert message.log_time == message.publish_time
                cls.schemas[channel.topic] = (schema.name, json.loads(schema.data))
                cls.messages.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
        cls.states = [m for _, channel, m in evalbus.events(cls.log) if channel == "EVALBUS_STATE"]
        cls.model = next(m for _, channel, m in evalbus.events(cls.log) if channel == "EVALBUS_MODEL")
        cls.foxgloves = json.loads(ended_well(node("--schemas")))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def check(self, topic, message):
        name, schema = self.schemas[topic]
        jsonschema.Draft7Validator(schema).validate(message)
        if name.startswith("foxglove."):
            jsonschema.Draft7Validator(self.foxgloves[name]).validate(message)

    def test_both_readers_agree(self):
        with open(self.mcap, "rb") as file:
            linear = [(c.topic, m.log_time) for _, c, m in NonSeekingReader(file, validate_crcs=True).iter_messages()]
        indexed = [(topic, t) for topic, messages in self.messages.items() for t, _ in messages]
        self.assertEqual(sorted(linear), sorted(indexed))
        self.assertEqual(self.summary.statistics.message_count, len(linear))
        self.assertGreater(self.summary.statistics.chunk_count, 1)

    def test_every_message_is_what_its_schema_says(self):
        for topic, messages in self.messages.items():
            for _, message in messages:
                self.check(topic, message)

    def test_wrong_messages_are_seen(self):
        with self.assertRaises(jsonschema.ValidationError):
            self.check("/tf", {"transforms": [{}]})
        with self.assertRaises(jsonschema.ValidationError):
            self.check("/scene", {"deletions": [], "entities": [{"id": 1}]})

    def test_poses_and_joints_are_those_of_state(self):
        tf, joints = self.messages["/tf"], self.messages["/joint_states"]
        self.assertEqual(len(tf), len(self.states))
        for (t, message), (_, measured), state in zip(tf, joints, self.states):
            self.assertEqual(t, state["header"]["sim_time_us"] * 1000)
            self.assertEqual(len(message["transforms"]), len(state["body"]) - 1)
            for name, transform, body in zip(self.model["body_name"][1:], message["transforms"], state["body"][1:]):
                self.assertEqual(transform["child_frame_id"], name)
                self.assertEqual([transform["translation"][k] for k in "xyz"], list(body["position_m"]))
                self.assertEqual([transform["rotation"][k] for k in "wxyz"], list(body["quat_wxyz"]))
            positions = [p for arm in state["arm"] for p in arm["joint_position_rad"]]
            self.assertEqual([joint["position"] for joint in measured["joints"]], positions)

    def test_scores_are_those_of_episodes_jsonl(self):
        episode = json.loads((self.recorded / "episodes.jsonl").read_text().splitlines()[0])
        _, last = self.messages["/metrics"][-1]
        self.assertEqual(last["completion_time_s"], episode["metrics"]["completion_time"])
        self.assertEqual(last["slip_count"], episode["metrics"]["slip_count"])
        for arm, value in episode["metrics"]["cartesian_path_length"].items():
            self.assertEqual(last["cartesian_path_length_m"][arm], value)
        _, result = self.messages["/episode"][-1]
        self.assertEqual(result["end_reason"], episode["end_reason"])
        self.assertEqual(result["seed"], str(episode["seed"]))
        self.assertEqual(self.messages["/events"][-1][1]["kind"], "end")

    def test_scene_is_there_once_in_frames_that_move(self):
        ((t, scene),) = self.messages["/scene"]
        self.assertEqual(t, 0)
        frames = {entity["frame_id"] for entity in scene["entities"]}
        self.assertLessEqual(frames, set(self.model["body_name"]) | {"world"})
        triangles = [t for entity in scene["entities"] for t in entity["triangles"]]
        self.assertGreater(len(triangles), 5)
        for mesh in triangles:
            self.assertEqual(len(mesh["indices"]) % 3, 0)
            self.assertLess(max(mesh["indices"]), len(mesh["points"]))

    def test_images_are_jpeg(self):
        import base64

        images = self.messages["/camera/overview"]
        self.assertGreater(len(images), 10)
        for _, image in images:
            self.assertEqual(base64.b64decode(image["data"], validate=True)[:2], b"\xff\xd8")

    def test_foxgloves_client_sees_the_same(self):
        """The older subprotocol has no player, so playback starts when a client subscribes."""
        with Server(self.recorded, "--episode", "0") as server:
            file = pathlib.Path(self.folder.name) / "played.jsonl"
            ended_well(node(server.url, file))
        lines = [json.loads(line) for line in file.read_text().splitlines()]
        info = next(line["serverInfo"] for line in lines if "serverInfo" in line)
        self.assertEqual(info["capabilities"], ["time"])
        heard = {}
        for line in lines:
            if "message" in line:
                self.check(line["topic"], line["message"])
                heard.setdefault(line["topic"], []).append((line["time_ns"], line["message"]))
        for topic in ("/tf", "/metrics", "/contacts", "/joint_states"):
            recorded = dict(self.messages[topic])
            self.assertGreater(len(heard[topic]), len(recorded) / 2)
            for t, message in heard[topic]:
                self.assertEqual(message, recorded[t])
            self.assertEqual(heard[topic][-1][0], self.messages[topic][-1][0])
        self.assertEqual([m for _, m in self.messages["/scene"]], [m for _, m in heard["/scene"]])

    def test_playback_obeys(self):
        async def drive(url):
            async with websockets.connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket_:
                self.assertEqual(socket_.subprotocol, "foxglove.sdk.v1")
                info = json.loads(await socket_.recv())
                self.assertEqual((info["op"], info["capabilities"]), ("serverInfo", ["time", "playbackControl"]))
                channels = json.loads(await socket_.recv())["channels"]
                (tf,) = [c["id"] for c in channels if c["topic"] == "/tf"]
                await socket_.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 9, "channelId": tf}]}))
                target = self.messages["/tf"][50][0] + 1
                await socket_.send(struct.pack("<BBfBQI", 3, 1, 1.0, 1, target, 2) + b"me")
                state = last = None
                while state is None or last is None:
                    frame = await asyncio.wait_for(socket_.recv(), support.DEADLINE_S)
                    if isinstance(frame, str):
                        continue
                    if frame[0] == 5:
                        found = struct.unpack_from("<BBQfBI", frame)
                        if frame[19:] == b"me":
                            state, last = found, None
                    elif frame[0] == 1 and state:
                        last = struct.unpack_from("<BIQ", frame)
                self.assertEqual(state[1:5], (1, target, 1.0, 1))
                self.assertEqual(last, (1, 9, self.messages["/tf"][50][0]))

        with Server(self.recorded, "--episode", "0") as server:
            asyncio.run(drive(server.url))

    def test_pages_of_others_are_refused(self):
        async def connect(url, **options):
            async with websockets.connect(url, subprotocols=["foxglove.sdk.v1"], **options):
                pass

        with Server(self.recorded, "--episode", "0", "--allow-origin", "https://ours.example") as server:
            for origin in (None, "https://app.foxglove.dev", "https://ours.example"):
                asyncio.run(connect(server.url, origin=origin))
            for origin in ("https://evil.example", "null", "https://app.foxglove.dev.evil.example"):
                with self.assertRaises(websockets.InvalidStatus):
                    asyncio.run(connect(server.url, origin=origin))
            with self.assertRaises(websockets.InvalidStatus):
                asyncio.run(connect(server.url, additional_headers={"Host": "evil.example"}))

    def test_who_never_reads_stalls_nobody(self):
        async def watch(url):
            options = {"subprotocols": ["foxglove.sdk.v1"], "max_size": None}
            async with websockets.connect(url, max_queue=1, **options) as slow:
                async with websockets.connect(url, **options) as fast:
                    for viewer in (slow, fast):
                        await viewer.recv()
                        channels = json.loads(await viewer.recv())["channels"]
                        everything = [{"id": k, "channelId": c["id"]} for k, c in enumerate(channels)]
                        await viewer.send(json.dumps({"op": "subscribe", "subscriptions": everything}))
                    times = [m[0] for m in self.messages["/tf"]]
                    (tf,) = [k for k, c in enumerate(channels) if c["topic"] == "/tf"]
                    for _ in range(12):
                        # Playback starts from the beginning, 20 times as fast.
                        await fast.send(struct.pack("<BBfBQI", 3, 0, 20.0, 1, 0, 0))
                        got, has_begun = [], False
                        while True:
                            frame = await asyncio.wait_for(fast.recv(), support.DEADLINE_S)
                            if isinstance(frame, str):
                                continue
                            if frame[0] == 5:
                                has_begun |= frame[14] == 1
                                if has_begun and frame[1] == 3:
                                    break
                            elif frame[0] == 1 and has_begun:
                                _, subscription, t = struct.unpack_from("<BIQ", frame)
                                got += [t] if subscription == tf else []
                        self.assertLessEqual(set(got), set(times))
                # The queue of a slow client is bounded, and the client is notified of lost messages.
                frames = []
                while not any(isinstance(frame, str) and "too slowly" in frame for frame in frames):
                    frames.append(await asyncio.wait_for(slow.recv(), support.DEADLINE_S))

        with Server(self.recorded, "--episode", "0") as server:
            asyncio.run(watch(server.url))

    def test_a_run_that_goes_on(self):
        """Foxglove's client and PlotJuggler's datagrams come from the same live run."""
        out = pathlib.Path(self.folder.name) / "live"
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        receiver.bind(("127.0.0.1", 0))
        url = "udpm://239.255.76.67:29871?ttl=0"
        port = receiver.getsockname()[1]
        tap = subprocess.Popen(
            [f"{BIN}/evalbus", "bridge", "plotjuggler", f"127.0.0.1:{port}", "--url", url],
            stdout=subprocess.PIPE,
            text=True,
        )
        self.assertIn("forwarding", tap.stdout.readline())
        file = pathlib.Path(self.folder.name) / "live.jsonl"
        with Server("--url", url) as server:
            client = node(server.url, file, SUBPROTOCOL="foxglove.sdk.v1")
            # The client is connected before the run begins.
            deadline = time.monotonic() + support.DEADLINE_S
            while not (file.exists() and "\"channel\"" in file.read_text()):
                self.assertLess(time.monotonic(), deadline)
            command = f"{BIN}/evalbus run lift_pot/position --policy expert --episodes 1 --realtime --video none"
            subprocess.run(
                [*command.split(), "--url", url, "--out", out], check=True, capture_output=True, timeout=support.DEADLINE_S
            )
            ended_well(client)
        tap.terminate()
        tap.wait(timeout=support.DEADLINE_S)
        tap.stdout.close()

        log = out / "episodes" / "0000" / "events.lcmlog"
        states = {m["header"]["sim_time_us"] * 1000: m for _, c, m in evalbus.events(log) if c == "EVALBUS_STATE"}
        heard = [json.loads(line) for line in file.read_text().splitlines()]
        tf = [line for line in heard if line.get("topic") == "/tf"]
        self.assertGreater(len(tf), 0.9 * len(states))
        for line in tf:
            first = line["message"]["transforms"][0]["translation"]
            self.assertEqual([first[k] for k in "xyz"], list(states[line["time_ns"]]["body"][1]["position_m"]))

        openings = {}
        receiver.setblocking(False)
        self.addCleanup(receiver.close)
        while True:
            try:
                datagram = receiver.recv(65536)
            except BlockingIOError:
                break
            self.assertLessEqual(len(datagram), 1400)
            numbers = json.loads(datagram)
            for path, value in numbers.items():
                self.assertIsInstance(value, (int, float), path)
                if path == "/robot/gripper_opening/left":
                    openings[round(numbers["timestamp"] * 1e9)] = value
        self.assertGreater(len(openings), 0.5 * len(states))
        left = [gripper["name"] for gripper in self.model["gripper"]].index("left")
        for t, value in openings.items():
            self.assertEqual(value, states[t]["gripper"][left]["opening"])


if __name__ == "__main__":
    unittest.main()
