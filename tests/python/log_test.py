"""Tests read_run and read_log on a real run, compared with `evalbus export` and LCM's own generated decoders.

usage: log_test.py BIN   (the folder of evalbus' programs)
"""

import support

support.need("numpy")

import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import warnings

import evalbus
import evalbus.source
import numpy as np
from evalbus import messages

BIN = sys.argv.pop(1)

# Prints everything in a log with LCM's own decoders, one event per line. Runs without our package, because
# the generated one has the same name.
REFERENCE = """
import json, struct, sys
sys.path.insert(0, sys.argv[1])
import evalbus

def plain(value):
    if hasattr(value, '__slots__'):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (list, tuple, bytes, map)):
        return [plain(element) for element in value]
    return value

types = {getattr(evalbus, name)._get_packed_fingerprint(): getattr(evalbus, name)
         for name in dir(evalbus) if name.endswith('_t')}
print(json.dumps({t.__name__: f.hex() for f, t in types.items()}))
log, at = open(sys.argv[2], 'rb').read(), 0
while at < len(log):
    _, _, time_us, channel_size, data_size = struct.unpack_from('>IqqII', log, at)
    at += 28 + channel_size + data_size
    data = log[at - data_size:at]
    channel = log[at - data_size - channel_size:at - data_size].decode()
    print(json.dumps([time_us, channel, plain(types[data[:8]].decode(data))]))
"""


def plain(value):
    if isinstance(value, dict):
        return {name: plain(member) for name, member in value.items()}
    if isinstance(value, list):
        return [plain(element) for element in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


class LogTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.run_folder = cls.folder / "run"
        support.evaluate(
            BIN, "lift_pot/position", "--policy", "noisy_expert", "--episodes", "3", out=cls.run_folder
        )
        cls.file = cls.run_folder / "episodes" / "0001" / "events.lcmlog"

    def test_scores_are_those_of_export(self):
        run = evalbus.read_run(self.run_folder)
        table = self.folder / "table.csv"
        subprocess.run(
            [f"{BIN}/evalbus", "export", self.run_folder, "--csv", table], check=True, capture_output=True
        )
        with open(table) as lines:
            rows = list(csv.DictReader(lines))
        columns = list(rows[0])
        exported = {
            name: [float(row[name] or "nan") for row in rows]
            for name in columns[columns.index("complete") + 1 :]
        }
        self.assertEqual(list(run.scores), list(exported))
        for name, values in exported.items():
            np.testing.assert_array_equal(run.scores[name], values, err_msg=name)
        self.assertEqual([str(episode.seed) for episode in run.episodes], [row["seed"] for row in rows])
        self.assertEqual(run.options["policy"], "noisy_expert")
        self.assertEqual(run.summary.episodes, 3)
        self.assertEqual(list(run.logs), [0, 1, 2])
        self.assertEqual(run.logs[1], self.file)

    def test_packed_logs(self):
        packed = self.folder / "packed"
        support.evaluate(
            BIN, "lift_pot/position", "--policy", "noisy_expert", "--episodes", "3", "--log", "zstd", out=packed
        )
        file = evalbus.read_run(packed).logs[1]
        self.assertEqual(file.name, "events.lcmlog.zst")
        for channel in ("EVALBUS_STATE", "EVALBUS_PARTIAL"):  # compared as text because NaN differs from itself
            states, same = (
                [repr(plain(message)) for _, name, message in evalbus.events(log) if name == channel]
                for log in (file, self.file)
            )
            self.assertTrue(states and states == same)
        cut = self.folder / "cut.zst"
        cut.write_bytes(file.read_bytes()[:-100])
        with self.assertRaisesRegex(evalbus.InputError, "cut.zst: cannot be unpacked: "):
            evalbus.read_log(cut)

    def test_a_number_is_no_log(self):
        for read in (evalbus.read_log, lambda number: list(evalbus.events(number))):
            with self.assertRaisesRegex(TypeError, "^expected the path of a log, got the number 0; Run.logs has"):
                read(0)

    def test_what_the_documentation_does(self):
        names = {}
        exec(support.snippet("evalbus.read_run").replace("runs/expert", str(self.run_folder)), names)
        # Every name that the code looks up must exist.
        self.assertIn(names["channel"], names["log"])

    def test_interrupted_and_broken_runs(self):
        copy = self.folder / "copy"
        copy.mkdir()
        with self.assertRaisesRegex(ValueError, "no run.json"):
            evalbus.read_run(copy)
        shutil.copy(self.run_folder / "run.json", copy)
        lines = (self.run_folder / "episodes.jsonl").read_bytes().splitlines(keepends=True)
        episodes = copy / "episodes.jsonl"
        # Workers finish in any order, and the last line was cut off.
        episodes.write_bytes(lines[2] + lines[0] + lines[1][:-40])
        with self.assertWarnsRegex(UserWarning, "episodes.jsonl:3: the last line is truncated and ignored$"):
            run = evalbus.read_run(copy)
        self.assertEqual([episode.index for episode in run.episodes], [0, 2])
        self.assertIsNone(run.summary)
        self.assertEqual(len(run.scores["completion_time"]), 2)
        episodes.write_bytes(lines[0].replace(b'"complete":true', b'"complete":false') + lines[1])
        scores = evalbus.read_run(copy).scores["success"]
        self.assertEqual([bool(np.isnan(score)) for score in scores], [True, False])
        # An episode without a verdict has no "success".
        unjudged = json.loads(lines[1])
        unjudged["failure_reason"] = "not_judged"
        del unjudged["metrics"]["success"]
        episodes.write_bytes(lines[0] + json.dumps(unjudged).encode() + b"\n")
        judged = evalbus.read_run(copy)
        self.assertEqual([episode.judged for episode in judged.episodes], [True, False])
        self.assertFalse(judged.episodes[1].success)
        self.assertEqual([bool(np.isnan(score)) for score in judged.scores["success"]], [False, True])
        for broken, reason in (
            (lines[0].replace(b'"success":', b'"was":', 1), "jsonl:1: .*it has no 'success'"),
            (lines[0][:-40] + b"\n" + lines[1], "jsonl:1: "),
            (lines[0] + lines[0], "jsonl:2: a second line of episode 0"),
            (lines[0] + b"[]\n", "jsonl:2: "),
            (lines[0].replace(b'"slip_count":', b'"slip_count":NaN,"was":'), "jsonl:1: .*NaN is not a JSON number"),
        ):
            episodes.write_bytes(broken)
            with self.assertRaisesRegex(ValueError, reason):
                evalbus.read_run(copy)
        newer = {**run.options, "schema_version": 2}
        (copy / "run.json").write_text(json.dumps(newer))
        with self.assertRaisesRegex(evalbus.InputError, "run.json: the run folder has version 2, this package reads 1"):
            evalbus.read_run(copy)
        (copy / "suite.json").write_text('{"runs": ["lift_pot-base"]}')
        with self.assertRaisesRegex(ValueError, "suite.*lift_pot-base"):
            evalbus.read_run(copy)

    def reference(self):
        python = self.folder / "python"
        if not python.exists():
            python.mkdir()
            definitions = sorted((support.SOURCE / "lcmtypes").glob("*.lcm"))
            subprocess.run(["lcm-gen", "--python", "--ppath", python, *definitions], check=True)
        command = [sys.executable, "-B", "-E", "-c", REFERENCE, python, self.file]
        done = subprocess.run(command, capture_output=True, text=True, timeout=support.DEADLINE_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        return lines[0], lines[1:]

    def test_addresses_of_buses(self):
        for url, address in (
            ("udpm://239.255.76.68:7669?ttl=1", ("239.255.76.68", 7669, 1)),
            ("udpm://239.255.76.68", ("239.255.76.68", 7667, 0)),
            ("udpm://?ttl=1", ("239.255.76.67", 7667, 1)),
        ):
            self.assertEqual(evalbus.source.bus_address(url), address)

    def test_messages_are_those_of_lcm(self):
        fingerprints, expected = self.reference()
        self.assertEqual(
            {name: f"{type_.fingerprint:016x}" for name, type_ in messages.types().items()}, fingerprints
        )
        found = [
            json.loads(json.dumps([time, channel, plain(message)]))
            for time, channel, message in evalbus.events(self.file)
        ]
        self.assertGreater(len(found), 500)
        self.assertEqual(len(found), len(expected))
        for one, other in zip(found, expected):
            # Messages are compared as text, in which NaN equals itself.
            self.assertEqual(json.dumps(one, sort_keys=True), json.dumps(other, sort_keys=True))

    def test_fingerprints_are_the_pinned_ones(self):
        pinned = dict(
            line.split() for line in (support.SOURCE / "tests/data/fingerprints.txt").read_text().splitlines()
        )
        self.assertEqual(
            {name: f"{type_.fingerprint:016x}" for name, type_ in messages.types().items()}, pinned
        )

    def test_columns_are_the_messages(self):
        log = evalbus.read_log(self.file)
        events = list(evalbus.events(self.file))
        states = [message for _, channel, message in events if channel == "EVALBUS_STATE"]
        contacts = [message for _, channel, message in events if channel == "EVALBUS_CONTACTS"]
        model = log["EVALBUS_MODEL"]
        state = log["EVALBUS_STATE"]
        count = len(states)
        np.testing.assert_array_equal(state["qpos_mixed"], [s["qpos_mixed"] for s in states])
        np.testing.assert_array_equal(state["header"]["tick"], np.arange(count))
        self.assertEqual(state["arm"]["joint_position_rad"].shape, (count, 2, 7))
        np.testing.assert_array_equal(
            state["arm"]["wrist_position_m"][-1, 1], states[-1]["arm"][1]["wrist_position_m"]
        )
        self.assertEqual(state["gripper"]["opening"].shape, (count, 2))
        self.assertEqual(state["body"]["quat_wxyz"].shape, (count, len(model["body_name"][0]), 4))
        self.assertEqual(model["task"][0], "lift_pot")
        self.assertEqual(model["arm"]["joint_name"][0][1][0][:6], "right/")
        # The number of contacts varies. There is one entry per tick, which has the shape (0, 3) if there is no contact.
        self.assertGreater(len({message["num_contacts"] for message in contacts}), 1)
        position = log["EVALBUS_CONTACTS"]["contact"]["position_m"]
        for tick, message in enumerate(contacts):
            self.assertEqual(position[tick].shape, (message["num_contacts"], 3))
            for index, contact in enumerate(message["contact"]):
                np.testing.assert_array_equal(position[tick][index], contact["position_m"])
        self.assertEqual((log.damaged_bytes, log.damaged_places, log.not_decoded), (0, 0, {}))

    def test_messages_are_encoded_as_they_were(self):
        for channel, data in self.raw():
            name, message = messages.decode(data)
            self.assertEqual(messages.encode(name, message), data, channel)
        # Counts are computed, and missing members get default values.
        action = {"joint_position_rad": [0.5, 1], "header": {"tick": 7}}
        _, back = messages.decode(messages.encode("action_t", action))
        self.assertEqual((back["num_joints"], back["num_grippers"], back["error"]), (2, 0, ""))
        self.assertEqual((back["header"]["tick"], back["joint_position_rad"].tolist()), (7, [0.5, 1]))
        for broken in (
            {"tick": 7},
            {"mode": 1000},
            {"mode": 0.5},
            {"num_joints": 3, "joint_position_rad": [1, 2]},
            {"joint_position_rad": ["a"]},
            {"error": "a\0b"},
            {"error": 5},
        ):
            with self.subTest(broken), self.assertRaises(messages.MessageError):
                messages.encode("action_t", broken)
        with self.assertRaisesRegex(messages.MessageError, "no message"):
            messages.encode("boredom_t", {})

    def raw(self):
        with open(self.file, "rb") as stream:
            data = stream.read()
        at = 0
        while at < len(data):
            channel_size, data_size = (int.from_bytes(data[at + k : at + k + 4], "big") for k in (20, 24))
            body = at + 28 + channel_size
            yield data[at + 28 : body].decode(), data[body : body + data_size]
            at = body + data_size

    def test_bytes_that_are_no_message(self):
        seen = set()
        for channel, data in self.raw():
            if channel in seen:
                continue
            seen.add(channel)
            for size in [*range(0, min(len(data), 200)), len(data) - 1]:
                with self.assertRaises(messages.MessageError):
                    messages.decode(data[:size])
            with self.assertRaisesRegex(messages.MessageError, "expected [0-9]+ bytes, got "):
                messages.decode(data + b"\0")
            # A count that exceeds the data, at any position, may cause an error or give a different message, but must not
            # hang.
            for at in range(8, min(len(data) - 4, 400)):
                for count in (b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff"):
                    try:
                        messages.decode(data[:at] + count + data[at + 4 :])
                    except messages.MessageError:
                        pass
        self.assertIn("EVALBUS_STATE", seen)
        # A text ends with a NUL, which its length includes.
        text = messages.encode("log_t", {"text": "abc"})
        for changed in (b"a\0c\0", b"abcd"):
            with self.assertRaisesRegex(messages.MessageError, "terminating NUL"):
                messages.decode(text.replace(b"abc\0", changed))

    def damaged(self, change):
        """Changes bytes of the recorded log and reads it. Returns the log and the texts of the warnings."""
        file = self.folder / "damaged.lcmlog"
        file.write_bytes(change(self.file.read_bytes()))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            log = evalbus.read_log(file)
        return log, [str(warning.message) for warning in caught]

    def test_damage_is_skipped_and_told(self):
        whole = evalbus.read_log(self.file)
        ticks = len(whole["EVALBUS_STATE"]["time_us"])

        # The last event is cut off.
        log, words = self.damaged(lambda data: data[:-5])
        self.assertEqual(log.damaged_places, 1)
        self.assertIn(f"{log.damaged_bytes} damaged bytes", words[0])

        # Bytes are inserted between two events.
        first = self.first_event_size()
        log, words = self.damaged(lambda data: data[:first] + b"boredom" + data[first:])
        self.assertEqual((log.damaged_bytes, log.damaged_places), (7, 1))
        self.assertEqual(len(log["EVALBUS_STATE"]["time_us"]), ticks)

        # If a damaged length covers intact events, only the damaged event is lost.
        def stretched(data):
            size = int.from_bytes(data[24:28], "big") + 1000
            return data[:24] + size.to_bytes(4, "big") + data[28:]

        log, words = self.damaged(stretched)
        self.assertEqual((log.damaged_bytes, log.damaged_places), (first, 1))
        self.assertEqual(len(log["EVALBUS_STATE"]["time_us"]), ticks)

        for content in (b"\xed\xa1\xda\x01" * 1000, b"policies: [expert]\n", b""):
            with self.assertRaisesRegex(evalbus.InputError, "damaged.lcmlog: no LCM event in this file"):
                self.damaged(lambda _: content)

    def test_messages_of_another_version_are_told(self):
        channel = next(self.raw())[0]

        def changed(data):
            at = 28 + len(channel)
            return data[:at] + b"\0" * 8 + data[at + 8 :]

        log, words = self.damaged(changed)
        self.assertEqual(log.not_decoded, {channel: 1})
        self.assertIn(f"1 event of {channel} left out: 0000000000000000: no message", words[0])

    def first_event_size(self):
        channel, data = next(self.raw())
        return 28 + len(channel) + len(data)


support.main()
