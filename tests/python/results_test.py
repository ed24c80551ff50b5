"""Results for other programs: Hugging Face's parser, Inspect's reader and experiment trackers read what evalbus writes.

usage: results_test.py BIN   (the folder of evalbus' programs); see scripts/interop trackers
"""

import support

support.need("numpy")

import errno
import importlib.util
import json
import os
import pathlib
import resource
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import evalbus
import evalbus.inspect_log
import evalbus.trackers

BIN = os.path.abspath(sys.argv.pop(1))
os.environ |= {"EVALBUS_BIN": BIN, "EVALBUS_PYTHON": sys.executable}


def export(*arguments, **environment):
    command = [f"{BIN}/evalbus", "export", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})


def needs(module):
    return unittest.skipUnless(importlib.util.find_spec(module), f"needs {module}: scripts/interop trackers")


class ResultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.here = pathlib.Path(cls.folder.name)
        support.evaluate(BIN, "lift_pot/position", "--policy", "noisy_expert", "--episodes", "4", out=cls.here / "run")
        cls.recorded = evalbus.read_run(cls.here / "run")
        cls.rate = cls.recorded.summary.success_rate
        # The folder "half" has the run as it was after two episodes.
        shutil.copytree(cls.recorded.folder, cls.here / "half" / "run", ignore=shutil.ignore_patterns("summary.json", "episodes"))
        lines = (cls.recorded.folder / "episodes.jsonl").read_text().splitlines(keepends=True)
        (cls.here / "half/run/episodes.jsonl").write_text("".join(lines[:2]))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def send(self, *arguments, **environment):
        """Sends half of the run, then the whole run twice."""
        for folder in (self.here / "half/run", self.recorded.folder, self.recorded.folder):
            done = export(folder, *arguments, **environment)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_id_after_resume(self):
        # Every option that --resume allows to differ is different.
        resumed = shutil.copytree(self.recorded.folder, self.here / "resumed" / "run")
        options = ("--episodes", "6", "--only", "4", "--workers", "2", "--log", "zstd", "--model-path", self.here)
        command = [f"{BIN}/evalbus", "run", "lift_pot/position", "--policy", "noisy_expert", "--in-process", *options]
        done = subprocess.run([*map(str, command), "--out", resumed, "--resume"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        run = evalbus.read_run(resumed)
        self.assertNotEqual(run.options, self.recorded.options)
        self.assertEqual(evalbus.trackers.run_id(run), evalbus.trackers.run_id(self.recorded))

    def test_hugging_face(self):
        out = self.here / "hf"
        done = export(self.recorded.folder, "--hf", out, "--dataset", "me/pots")
        self.assertEqual((done.returncode, done.stdout), (0, f"{out}\n"), done.stderr)
        text = (out / "model/.eval_results/evalbus.yaml").read_text()
        self.assertIn(f'    id: "me/pots"\n    task_id: "lift_pot_position"\n  value: {100 * self.rate:.4g}\n', text)
        self.assertIn('  - id: "lift_pot_position"\n', (out / "dataset/eval.yaml").read_text())
        for arguments, words in (
            (("--hf", out, "--dataset", "me/pots"), f"{out}: exists; choose another name"),
            (("--hf", self.here / "x", "--dataset", "pots"), "--dataset pots: expected OWNER/NAME"),
            (("--hf", self.here / "x"), "the following arguments are required: --dataset"),
        ):
            done = export(self.recorded.folder, *arguments)
            self.assertEqual((done.returncode, done.stderr), (1, f"error: {words}\n"))
        done = export(self.here / "half/run", "--hf", self.here / "x", "--dataset", "me/pots")
        self.assertEqual(done.returncode, 1)
        self.assertIn("the run is not finished", done.stderr)
        self.assertFalse((self.here / "x").exists())
        edited = shutil.copytree(self.recorded.folder, self.here / "edited")
        lines = (edited / "episodes.jsonl").read_text().splitlines(keepends=True)
        (edited / "episodes.jsonl").write_text("".join(lines[:-1]))
        done = export(edited, "--hf", self.here / "x", "--dataset", "me/pots")
        self.assertEqual(done.returncode, 1)
        self.assertIn("edited: summary.json and episodes.jsonl differ", done.stderr)
        # A run that was interrupted also has a summary.
        longer = shutil.copytree(self.recorded.folder, self.here / "longer")
        (longer / "run.json").write_text(json.dumps({**self.recorded.options, "episodes": 9}))
        done = export(longer, "--hf", self.here / "x", "--dataset", "me/pots")
        self.assertEqual((done.returncode, done.stderr), (1, f"error: {longer}: the run is not finished: it has 4 of 9 episodes\n"))
        for key, value in (("only", [0, 1, 2, 3]), ("until", "alpha"), ("watch", True)):
            options = {**self.recorded.options, "episodes": 9, key: value}
            (longer / "run.json").write_text(json.dumps(options))
            evalbus.runs.check_finished(evalbus.read_run(longer))
        done = export(self.recorded.folder, "--hf", self.here / "run/run.json/x", "--dataset", "me/pots")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, "^error: .*Not a directory: .*\n$")

    def test_hugging_face_on_a_full_disk(self):
        out = self.here / "full" / "hf"
        out.parent.mkdir()
        done = subprocess.run(
            [f"{BIN}/evalbus", "export", self.recorded.folder, "--hf", out, "--dataset", "me/pots"],
            capture_output=True,
            text=True,
            # A file cannot grow beyond this size, which simulates a full disk.
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)),
        )
        self.assertEqual((done.returncode, done.stderr), (2, "error: [Errno 27] File too large\n"))
        self.assertEqual(list(out.parent.iterdir()), [])

    @needs("huggingface_hub")
    def test_the_parser_of_hugging_face(self):
        import yaml
        from huggingface_hub import parse_eval_result_entries

        out = self.here / "parsed"
        self.assertEqual(export(self.recorded.folder, "--hf", out, "--dataset", "me/pots").returncode, 0)
        (entry,) = parse_eval_result_entries(yaml.safe_load((out / "model/.eval_results/evalbus.yaml").read_text()))
        self.assertEqual((entry.dataset_id, entry.task_id, entry.value), ("me/pots", "lift_pot_position", 100 * self.rate))
        benchmark = yaml.safe_load((out / "dataset/eval.yaml").read_text())
        self.assertEqual([task["id"] for task in benchmark["tasks"]], [entry.task_id])

    @needs("inspect_ai")
    def test_inspect(self):
        from inspect_ai.log import read_eval_log

        for name in ("log.eval", "log.json"):
            done = export(self.recorded.folder, "--inspect", self.here / name)
            self.assertEqual(done.returncode, 0, done.stderr)
            log = read_eval_log(str(self.here / name))
            self.assertEqual((log.status, log.results.scores[0].metrics["accuracy"].value), ("success", self.rate))
            self.assertEqual(
                [bool(sample.scores["success"].value) for sample in log.samples], [episode.success for episode in self.recorded.episodes]
            )

    def test_a_log_for_inspect_is_complete_or_missing(self):
        def write(_, file):
            pathlib.Path(file).write_text("the first bytes")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        modules = {name: mock.MagicMock() for name in ("inspect_ai", "inspect_ai.log", "inspect_ai.scorer")}
        modules["inspect_ai.log"].write_eval_log = write
        folder = self.here / "full_disk"
        folder.mkdir()
        with mock.patch.dict(sys.modules, modules), self.assertRaises(OSError):
            evalbus.inspect_log.write_log(self.recorded.folder, folder / "log.eval")
        self.assertEqual(list(folder.iterdir()), [])

    @needs("trackio")
    def test_trackio(self):
        self.send("--trackio", "pots", TRACKIO_DIR=str(self.here / "trackio"))
        with sqlite3.connect(self.here / "trackio/pots.db") as database:
            rows = database.execute("select run_name, step from metrics order by step").fetchall()
        self.assertEqual(rows, [(f"run-{evalbus.trackers.run_id(self.recorded)}", step) for step in range(4)])

    @needs("wandb")
    def test_wandb(self):
        self.send("--wandb", "pots", WANDB_MODE="offline", WANDB_DIR=str(self.here / "wandb"), WANDB_SILENT="true")
        found = list((self.here / "wandb").rglob(f"run-{evalbus.trackers.run_id(self.recorded)}.wandb"))
        # Each of them is a part of the run with this id. `wandb sync` combines them.
        self.assertEqual(len(found), 3)

    @needs("mlflow")
    def test_mlflow(self):
        store = self.here / "mlflow"
        self.send("--mlflow", "pots", MLFLOW_TRACKING_URI=f"file://{store}", MLFLOW_ALLOW_FILE_STORE="true")
        (points,) = store.glob("*/*/metrics/success")
        steps = [int(line.split()[2]) for line in points.read_text().splitlines()]
        self.assertEqual(steps, [0, 1, 2, 3])

    @needs("tensorboard")
    def test_tensorboard(self):
        from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

        self.send("--tensorboard", self.here / "board")
        (folder,) = (self.here / "board").iterdir()
        events = EventAccumulator(str(folder)).Reload()
        steps = [event.step for event in events.Tensors("success")]
        self.assertEqual((folder.name, steps), (f"run-{evalbus.trackers.run_id(self.recorded)}", [0, 1, 2, 3]))

    def test_a_missing_package(self):
        done = export(self.recorded.folder, "--wandb", "pots", EVALBUS_PYTHON="/nonexistent/python")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(
            done.stderr, "error: /nonexistent/python: No such file or directory; set EVALBUS_PYTHON to another Python\n"
        )
        # This Python has no site packages and therefore no numpy.
        bare = self.here / "python"
        bare.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
        bare.chmod(0o755)
        done = export(self.recorded.folder, "--wandb", "pots", EVALBUS_PYTHON=bare)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
        self.assertIn("has no numpy: install it, or set EVALBUS_PYTHON", done.stderr)
        if importlib.util.find_spec("wandb") is None:
            done = export(self.recorded.folder, "--wandb", "pots")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn("has no wandb: install it", done.stderr)


support.main()
