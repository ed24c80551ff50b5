"""Tests evalbus.run, start, compare and Environment with the program evalbus.

usage: evaluate_test.py BIN   (the folder of evalbus' programs)
"""

import support

support.need("numpy", "msgpack", "websockets")

import contextlib
import io
import itertools
import json
import os
import pathlib
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
from unittest import mock

import evalbus
import numpy as np
import websockets.exceptions
from evalbus import runs

BIN = os.path.abspath(sys.argv.pop(1))
os.environ["EVALBUS_BIN"] = BIN

# Prints the id of the program that it starts, and works until it is killed.
ACTIVE_RUN = """
import evalbus, sys
with evalbus.start("lift_pot/position", "hold", episodes=1000, out=sys.argv[1], in_process=True) as active:
    for event in active:
        print(active._program.pid, flush=True)
"""
HANGING_POLICY = """
import evalbus, sys, threading
called, never = threading.Event(), threading.Event()
def hang(_):
    called.set()
    never.wait()
with evalbus.start("lift_pot", hang, episodes=1, out=sys.argv[1], in_process=True) as active:
    called.wait()
    print(active._program.pid)
"""
ACTIVE_ENVIRONMENT = """
import evalbus
with evalbus.Environment("lift_pot/position") as environment:
    seen = environment.reset(0).observation
    print(environment._program.pid, flush=True)
    while True:
        step = environment.step(seen["state"])
        if step.episode:
            environment.reset(0)
"""


def hold(observation):
    return np.append(observation["state"][:14], [0, 0])


def wait_for_end(pid):
    """Waits until this process has ended."""
    try:
        descriptor = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    ended = select.select([descriptor], [], [], support.DEADLINE_S)[0]
    os.close(descriptor)
    assert ended, "a process was left behind"


class EvaluateTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def run_here(self, task, policy="expert", out="run", **options):
        return evalbus.run(task, policy, out=self.folder / out, in_process=True, **options)

    def test_results_are_those_of_the_program(self):
        support.evaluate(
            BIN, "lift_pot/position", "--policy", "noisy_expert", "--episodes", "4", "--seed", "3", out=self.folder / "a"
        )
        run = self.run_here("lift_pot/position", "noisy_expert", out="b", episodes=4, seed=3)
        lines = [(self.folder / name / "episodes.jsonl").read_bytes() for name in "ab"]
        self.assertEqual(*lines)
        self.assertEqual([episode.line for episode in run.episodes], [json.loads(x) for x in lines[0].splitlines()])
        content = json.loads((self.folder / "a" / "summary.json").read_bytes())
        self.assertEqual(run.summary.content, content)
        self.assertEqual(run.summary.successes, sum(episode.success for episode in run.episodes))
        self.assertEqual(run.summary.success_rate_95, tuple(content["success_rate_wilson_95"]))
        time = run.summary.metrics["completion_time"]
        self.assertAlmostEqual(time.mean, np.mean(run.scores["completion_time"][run.scores["success"] == 1]))
        self.assertEqual(run.task, "lift_pot/position")

    def test_a_function_is_a_policy(self):
        thread = []

        class Policy:
            episodes = 0

            def __call__(self, observation):
                thread.append(threading.current_thread())
                return hold(observation)

            def reset(self):
                self.episodes += 1

        policy = Policy()
        run = self.run_here("lift_pot", policy, episodes=2)
        self.assertEqual([episode.end_reason for episode in run.episodes], ["time_limit"] * 2)
        # The contract "plain" specifies 20 Hz.
        self.assertEqual((run.options["control_hz"], policy.episodes), (20, 2))
        # Each of the two episodes has 400 ticks (20 s at 20 Hz). Its last state may also be observed.
        self.assertIn(len(thread), range(800, 803))
        self.assertNotIn(threading.main_thread(), thread)

    def test_events(self):
        with evalbus.start("lift_pot", episodes=2, out=self.folder / "run", in_process=True) as active:
            for event in active:
                if event.kind == "begin":
                    begun = evalbus.read_run(active.folder)
                    self.assertEqual((begun.episodes, begun.summary), ([], None))
                if event.kind == "episode":
                    break
            self.assertEqual((active.folder, event.episode.index), (self.folder / "run", 0))
            # wait() continues after the event.
            self.assertEqual(active.wait().summary.complete, 2)
        with evalbus.start("lift_pot", episodes=2, out=self.folder / "other", in_process=True) as active:
            # Remarks depend on the load of the machine, for example "no PARTIAL for 0.3 s".
            kinds = [event.kind for event in active if event.kind != "remark"]
        self.assertEqual(kinds, ["begin"] + ["episode_begin", "episode"] * 2 + ["summary"])

    def test_partial_scores(self):
        with evalbus.start(
            "lift_pot", episodes=1, out=self.folder / "run", in_process=True, control_hz=20, partial_hz=20
        ) as active:
            partial = [event.content for event in active if event.kind == "partial"]
            run = active.wait()
        # There is one event for each tick, and the last one has the numbers of the episode.
        self.assertEqual([event["tick"] for event in partial], list(range(len(partial))))
        self.assertEqual([event["verdict"] for event in partial], ["undecided"] * (len(partial) - 1) + ["success"])
        self.assertEqual(partial[-1]["metrics"], run.episodes[0].metrics)
        log = evalbus.read_log(run.logs[0])["EVALBUS_PARTIAL"]
        np.testing.assert_array_equal(
            [event["metrics"]["completion_time"] for event in partial], log["metrics"]["completion_time_s"]
        )
        self.assertEqual({event["task"] for event in partial}, {"lift_pot"})

    def test_a_plan(self):
        plan = self.folder / "plan.yaml"
        plan.write_text("policies: [expert, hold]\ntasks: [lift_pot/position]\nepisodes: 2\n")
        with evalbus.start_plan(plan, out=self.folder / "out", workers=2) as active:
            events = list(active)
            runs = active.wait()
        self.assertEqual((events[0].kind, events[-1].kind), ("plan_begin", "plan_summary"))
        finished = [event for event in events if event.kind == "episode"]
        self.assertEqual(
            sorted((event.content["policy"], event.episode.index, event.episode.success) for event in finished),
            [("expert", 0, True), ("expert", 1, True), ("hold", 0, False), ("hold", 1, False)],
        )
        self.assertEqual({run.folder.parent.name: run.summary.success_rate for run in runs}, {"expert": 1, "hold": 0})
        comparison = events[-1].content["comparison"]["comparisons"][0]
        self.assertEqual((comparison["name"], comparison["success"]["difference"]), ("hold", -1))
        with self.assertRaisesRegex(evalbus.InputError, "missing.yaml"):
            evalbus.start_plan(self.folder / "missing.yaml").wait()
        with self.assertRaisesRegex(evalbus.InputError, "start_plan: expected a plan"):
            evalbus.start_plan("lift_pot/position", out=self.folder / "run").wait()

    def test_leaving_the_context_stops_the_run(self):
        with evalbus.start("lift_pot/position", "hold", episodes=1000, out=self.folder / "run", in_process=True) as active:
            next(event for event in active if event.kind == "episode")
        with self.assertRaisesRegex(evalbus.ProgramError, "stopped before its end"):
            active.wait()
        # Finished episodes are kept.
        self.assertEqual(evalbus.read_run(self.folder / "run").episodes[0].end_reason, "time_limit")

    def test_compare(self):
        a = self.run_here("lift_pot", "hold", out="a", episodes=2)
        b = self.run_here("lift_pot", "expert", out="b", episodes=2)
        comparison = evalbus.compare(b, self.folder / "a")
        self.assertEqual(comparison.difference, -1)
        self.assertIn("between a and b: -100 points", comparison.verdict)
        self.assertEqual(comparison.metrics["subtask_progress"]["mean"], 0)
        self.assertEqual(evalbus.compare(a, b).difference, 1)
        # The order is that of the program, whose first run is the baseline.
        command = [f"{BIN}/evalbus", "compare", self.folder / "b", self.folder / "a"]
        printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=support.DEADLINE_S).stdout
        self.assertIn("a (hold) against b (expert)", printed)
        with self.assertRaisesRegex(evalbus.InputError, "missing: no such run folder"):
            evalbus.compare(a, self.folder / "missing")

    def test_a_policy_that_fails_its_first_action_leaves_no_folder(self):
        there = os.getcwd()
        os.chdir(self.folder)
        try:
            with self.assertRaises(evalbus.ActionError):
                evalbus.run("lift_pot", lambda observation: np.full(16, "abc"), episodes=1)
            self.assertFalse(pathlib.Path("runs").exists())
        finally:
            os.chdir(there)

    def test_a_value_that_is_not_finite_ends_its_episode(self):
        run = self.run_here(
            "lift_pot", lambda seen: np.append(seen["state"][:14], [0, np.nan]), out="run", episodes=2
        )
        self.assertEqual([one.end_reason for one in run.episodes], 2 * ["policy_error"])
        self.assertRegex(run.episodes[0].line["end_detail"], "value 15 of the policy's action, for .* is nan")
        self.assertEqual((run.summary.episodes, run.summary.success_rate), (2, 0))

    def test_what_the_documentation_does(self):
        names = {}
        there = os.getcwd()
        os.chdir(self.folder)
        try:
            pathlib.Path("plan.yaml").write_text("policies: [expert, hold]\ntasks: [lift_pot/position]\nepisodes: 1\n")
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                for code in support.blocks("python.md")[:4]:
                    exec(code, names)
        finally:
            os.chdir(there)
        self.assertEqual((names["mine"].summary.success_rate, names["expert"].summary.success_rate), (0, 1))
        self.assertEqual(names["mine"].episodes[0].failure_reason, "timeout")
        lines = output.getvalue().splitlines()
        self.assertIn("difference", lines[0])
        self.assertRegex("\n".join(lines), r"\nfirst stage reached after \d\.\d+ s\n")
        self.assertEqual(set(lines[-2:]), {"expert lift_pot 0 True", "hold lift_pot 0 False"})
        self.assertEqual([run.options["policy"] for run in names["runs"]], ["expert", "hold"])

    def assert_fails(self, error, words, task="lift_pot", policy="expert", **options):
        with self.assertRaisesRegex(error, words) as caught:
            self.run_here(task, policy, episodes=1, **options)
        self.assertNotIn("\n", str(caught.exception))
        shutil.rmtree(self.folder / "run", ignore_errors=True)
        return caught.exception

    def test_wrong_input(self):
        self.assert_fails(evalbus.InputError, "unknown task 'lift_pott'; did you mean 'lift_pot'", task="lift_pott")
        self.assert_fails(evalbus.InputError, 'there is no policy "no_such"', policy="no_such")
        self.assert_fails(evalbus.InputError, "there is no option '--wrong'", wrong=1)
        self.assert_fails(evalbus.InputError, "task 'lift_pot/all': expected one task", task="lift_pot/all")
        self.assert_fails(evalbus.InputError, "policy: expected a function, .*, got int", policy=3)
        self.assert_fails(
            evalbus.ActionError,
            "^the policy contradicts its contract: the answer has 1 step of 7 values, the contract expects 16 values",
            policy=lambda _: np.zeros(7),
        )
        # Holds still, and returns a wrong number of values in the third and all later calls.
        numbers = itertools.count()
        self.assert_fails(
            evalbus.ActionError,
            "^the policy failed in episode 0: the answer has 1 step of 3 values, the contract expects 16 values",
            policy=lambda seen: np.append(seen["state"][:14], [0, 0])[: 16 if next(numbers) < 2 else 3],
        )
        self.assert_fails(evalbus.ActionError, "an action of type <U3, expected numbers", policy=lambda _: "abc")
        self.assert_fails(evalbus.ActionError, "an action of type object, expected numbers", policy=lambda _: None)
        self.assert_fails(evalbus.ActionError, "an action of type bool, expected numbers", policy=lambda _: 16 * [True])
        self.assert_fails(evalbus.ActionError, 'dictionary without "actions": a$', policy=lambda _: {"a": np.zeros(16)})
        self.assert_fails(evalbus.ActionError, "an action that is not an array: ", policy=lambda _: [[1, 2], [3]])
        self.assert_fails(evalbus.ActionError, r"actions have the shape \(\)", policy=lambda _: 0.0)
        self.assert_fails(
            evalbus.ActionError,
            r"the shape \(1, 2, 16\), expected \(steps, numbers\) or \(numbers,\)$",
            policy=lambda _: np.zeros((1, 2, 16)),
        )
        self.assert_fails(evalbus.ActionError, r"actions have the shape \(1, 0\)", policy=lambda _: [])
        self.assert_fails(
            evalbus.ActionError, "action of type float128, expected numbers", policy=lambda _: np.zeros(16, np.longdouble)
        )

        (self.folder / "full").mkdir()
        (self.folder / "full" / "file").write_text("")
        self.assert_fails(evalbus.InputError, "or add resume=True to continue", out=self.folder / "full")
        self.assert_fails(evalbus.InputError, "cannot create: Not a directory", out=pathlib.Path(__file__) / "run")
        self.assert_fails(evalbus.InputError, "--seed: expected a whole number .* not '1.5'", seed=1.5)
        for wrong in (True, False, np.True_):
            self.assert_fails(evalbus.InputError, f"^seed: expected a whole number, got {wrong!r}", seed=wrong)
            with self.assertRaisesRegex(evalbus.InputError, f"^episodes: expected a whole number, got {wrong!r}"):
                evalbus.run("lift_pot", episodes=wrong)
        self.assertEqual(evalbus.program.words({"a": np.True_, "b": np.False_, "c": True, "d": np.int64(3)}), ["--a", "--c", "--d", "3"])
        self.assert_fails(evalbus.InputError, "unknown task '--help'", task="--help")
        self.assert_fails(evalbus.InputError, "embedded null byte", task="lift_pot\0")
        self.assert_fails(evalbus.PolicyError, "the policy raised SystemExit: 3$", policy=lambda _: sys.exit(3))
        self.assert_fails(evalbus.PolicyError, "the policy raised StopIteration$", policy=lambda _: next(iter(())))

        def lose_its_own_connection(_):
            raise websockets.exceptions.ConnectionClosedError(None, None)

        self.assert_fails(evalbus.PolicyError, "the policy raised ConnectionClosedError: ", policy=lose_its_own_connection)
        masked = np.ma.masked_array(np.zeros(16), mask=[True] + 15 * [False])
        self.assert_fails(evalbus.ActionError, "actions have masked elements", policy=lambda _: masked)

        def fail_with_a_file_name(_):
            raise ValueError("no file \udcff")

        self.assert_fails(evalbus.PolicyError, r"ValueError: no file (\\udcff|\udcff)$", policy=fail_with_a_file_name)

        def fail_in_two_lines(_):
            raise ValueError("weights\nare missing")

        self.assert_fails(evalbus.PolicyError, "ValueError: weights are missing$", policy=fail_in_two_lines)

        def fail(_):
            raise KeyError("images")

        error = self.assert_fails(evalbus.PolicyError, "the policy raised KeyError: 'images'", policy=fail)
        self.assertIsInstance(error.__cause__, KeyError)

    def test_a_function_is_resumed(self):
        # The function is served at the port of the interrupted run, because the program compares the addresses.
        first = self.run_here("lift_pot", hold, episodes=1)
        resumed = self.run_here("lift_pot", hold, episodes=2, resume=True)
        self.assertEqual([episode.line for episode in resumed.episodes][:1], [first.episodes[0].line])
        self.assertEqual((len(resumed.episodes), resumed.options["policy"]), (2, first.options["policy"]))
        with socket.socket() as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            other.bind(("127.0.0.1", int(first.options["policy"].rpartition(":")[2])))
            other.listen()
            with self.assertRaisesRegex(evalbus.ProgramError, "cannot serve a policy at port .*in use"):
                self.run_here("lift_pot", hold, episodes=3, resume=True)

    def test_wrong_files(self):
        for function in (evalbus.read_run, evalbus.read_log):
            with self.assertRaisesRegex(evalbus.InputError, "missing"):
                function(self.folder / "missing")
        for function in (evalbus.read_run, evalbus.read_log):
            with self.assertRaisesRegex(evalbus.InputError, "None.*expected|expected.*None"):
                function(None)
        for folders, words in (((3, self.folder), "3: no such run folder"), (("--help", "--help"), "--help: no such")):
            with self.assertRaisesRegex(evalbus.InputError, words):
                evalbus.compare(*folders)

    def test_mistaken_arguments(self):
        with self.assertRaisesRegex(evalbus.InputError, "^task: expected a name .* as first argument, got <function hold"):
            evalbus.run(hold, "lift_pot/position")
        # The name of one camera is also accepted, as in video="head".
        with self.assertRaisesRegex(evalbus.InputError, "heed"):
            evalbus.Environment("lift_pot", cameras="heed")

    def test_unknown_scores_name_similar_ones(self):
        scores = runs.Scores(completion_time=np.zeros(1), success=np.zeros(1))
        for name, words in (("completion_tim", "no score 'completion_tim'; did you mean 'completion_time'"), ("x", "list")):
            with self.assertRaisesRegex(KeyError, words):
                scores[name]
        self.assertNotIn("completion_tim", scores)
        self.assertIsNone(scores.get("completion_tim"))

    def test_damaged_files(self):
        intact = self.run_here("lift_pot", "hold", out="intact", episodes=1)
        line = intact.episodes[0].line
        for name, content, words in (
            ("run.json", [], "run.json: expected a JSON object$"),
            ("run.json", {**intact.options, "task": 3}, "run.json: task: expected a name$"),
            ("summary.json", {"metrics": {}}, "summary.json: not the summary of a run: it has no 'episodes'$"),
            ("summary.json", {"metrics": []}, "summary.json: not the summary of a run: "),
            ("episodes.jsonl", {**line, "parameters": [1]}, "jsonl:1: not the line of .*: parameters: expected an object$"),
            ("episodes.jsonl", {**line, "episode": "x"}, "jsonl:1: not the line of an episode: "),
            ("episodes.jsonl", None, "jsonl: No such file or directory$"),
            ("suite.json", {"runs": 3}, "suite.json: runs: expected a list of folders$"),
        ):
            with self.subTest(words):
                folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder), "damaged")
                shutil.copytree(intact.folder, folder)
                if content is None:
                    (folder / name).unlink()
                else:
                    (folder / name).write_text(json.dumps(content) + "\n")
                with self.assertRaisesRegex(evalbus.InputError, words):
                    evalbus.read_run(folder)

    def test_errors_have_one_line(self):
        # Gymnasium's AsyncVectorEnv creates an exception from the exception of its worker process.
        error = evalbus.ActionError(evalbus.ActionError("wrong\nshape"))
        self.assertEqual(str(error), "wrong shape")

    def test_a_policy_that_hangs(self):
        """Neither evalbus nor Python keeps running after the context is left."""
        done = subprocess.run(
            [sys.executable, "-B", "-c", HANGING_POLICY, str(self.folder / "run")],
            capture_output=True, text=True, timeout=support.DEADLINE_S,
        )  # fmt: skip
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        wait_for_end(int(done.stdout))

    def test_version(self):
        done = subprocess.run([f"{BIN}/evalbus", "--version"], capture_output=True, text=True, check=True)
        self.assertIn(evalbus.__version__, done.stdout.split())

    def test_a_missing_package(self):
        run = self.run_here("lift_pot", "hold", episodes=1)
        with mock.patch.dict(sys.modules, {"pandas": None}):
            with self.assertRaisesRegex(evalbus.EvalbusError, "^to_pandas.. requires pandas: pip install pandas$"):
                run.to_pandas()

    def test_a_missing_program(self):
        for value, words in ((str(self.folder), "EVALBUS_BIN="), ("", "was not found")):
            command = [sys.executable, "-B", "-c", "import evalbus; evalbus.run('lift_pot')"]
            package = shutil.copytree(
                pathlib.Path(evalbus.__file__).parent, self.folder / f"package{bool(value)}" / "evalbus"
            )
            environment = {**os.environ, "EVALBUS_BIN": value, "PATH": "", "PYTHONPATH": str(package.parent)}
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=support.DEADLINE_S)
            self.assertRegex(done.stderr.splitlines()[-1], f"^evalbus.errors.ProgramError: .*{words}")

    def test_a_killed_program(self):
        with evalbus.start("lift_pot/position", "hold", episodes=1000, out=self.folder / "run", in_process=True) as active:
            next(active)
            os.kill(active._program.pid, signal.SIGKILL)
            with self.assertRaisesRegex(evalbus.ProgramError, "^evalbus was killed: Killed$"):
                active.wait()
        with evalbus.Environment("lift_pot") as environment:
            environment.reset(0)
            os.kill(environment._program.pid, signal.SIGKILL)
            with self.assertRaisesRegex(evalbus.ProgramError, "^evalbus was killed: Killed$"):
                environment.reset(0)

    def test_no_process_is_left_behind(self):
        for code in (ACTIVE_RUN, ACTIVE_ENVIRONMENT):
            for number in (signal.SIGKILL, signal.SIGINT):
                with self.subTest(code=code, signal=number):
                    out = tempfile.mkdtemp(dir=self.folder)
                    command = [sys.executable, "-B", "-c", code, out]
                    # A shell without job control starts background jobs with SIGINT ignored.
                    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                          preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)) as process:  # fmt: skip
                        pid = int(process.stdout.readline())
                        process.send_signal(number)
                        process.wait(support.DEADLINE_S)
                        wait_for_end(pid)


class EnvironmentTest(unittest.TestCase):
    def test_episodes_are_those_of_a_run(self):
        """Replays the actions of a recorded run in which one episode fails."""
        seed = 7
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "run"
            support.evaluate(
                BIN, "lift_pot/position", "--policy", "noisy_expert", "--control-hz", "20", "--episodes", "10",
                "--only", "0,4", "--seed", str(seed), out=out
            )  # fmt: skip
            run = evalbus.read_run(out)
            self.assertEqual({episode.success for episode in run.episodes}, {True, False})
            with evalbus.Environment("lift_pot/position") as environment:
                for episode in run.episodes:
                    log = evalbus.read_log(run.logs[episode.index])
                    partial = log["EVALBUS_PARTIAL"]["metrics"]["completion_time_s"]
                    action = log["EVALBUS_ACTION"]
                    step = environment.reset(seed, episode.index)
                    rows = np.hstack([action["joint_position_rad"], action["gripper_closing"]])
                    for tick, row in enumerate(rows, 1):
                        self.assertIsNone(step.episode)
                        step = environment.step(row)
                        self.assertEqual(step.metrics["completion_time"], partial[tick])
                        if step.episode:
                            break
                    self.assertEqual(step.episode, episode)
                    # The last observation belongs to the last tick.
                    joints = log["EVALBUS_STATE"]["arm"]["joint_position_rad"][-1].ravel()
                    np.testing.assert_array_equal(step.observation["state"][:14], joints.astype(np.float32))

    def test_observations_and_actions(self):
        home = None
        for control, size in (("joint", 16), ("joint_delta", 16), ("eef_pose", 14), ("eef_delta", 14)):
            with evalbus.Environment("lift_pot", control=control, cameras=["head"], image_size=(64, 48)) as environment:
                step = environment.reset(0)
                self.assertEqual(environment.action_lower.shape, (size,))
                self.assertTrue((environment.action_lower < environment.action_upper).all())
                image = step.observation["images"]["head"]
                self.assertEqual((image.shape, image.dtype), ((48, 64, 3), np.uint8))
                self.assertGreater(len(np.unique(image)), 10)
                state = step.observation["state"]
                home = state if home is None else home
                np.testing.assert_array_equal(state, home)
                if control.endswith("delta"):
                    # Without a delta, the arms hold their position and the grippers open.
                    for _ in range(3):
                        step = environment.step(np.zeros(size))
                    np.testing.assert_allclose(step.observation["state"][:14], home[:14], atol=8e-3)
                    # Either the first joint turns or the left flange rises.
                    delta = np.zeros(size)
                    delta[0 if control == "joint_delta" else 2] = 0.02
                    for _ in range(5):
                        step = environment.step(delta)
                    moved = step.observation["state"] - home
                    self.assertGreater(np.abs(moved[:7]).max(), 0.01)
                    np.testing.assert_allclose(moved[7:14], 0, atol=8e-3)
        self.assertEqual(environment.task, "lift_pot/base")

    def test_renderers(self):
        """Software EGL, which machines without OSMesa use, draws the same bytes."""
        images = []
        for gl in (None, "egl-software"):
            with evalbus.Environment("lift_pot", cameras=["head"], image_size=(64, 48), gl=gl) as environment:
                self.assertRegex(environment.renderer, rf"^{gl or '(osmesa|egl-software)'} \(")
                images.append(environment.reset(0).observation["images"]["head"])
        self.assertGreater(len(np.unique(images[0])), 10)
        np.testing.assert_array_equal(*images)

    def test_a_contract(self):
        with evalbus.Environment("lift_pot", contract="plain") as environment:
            step = environment.reset(0)
            self.assertEqual(list(step.observation), ["state", "prompt"])
            self.assertEqual(step.observation["prompt"], environment.instruction)
            self.assertEqual(environment.renderer, "")
            self.assertEqual(environment.contract, (support.SOURCE / "models/policies/plain.yaml").read_text())

    def test_an_impossible_control_rate(self):
        with self.assertWarnsRegex(UserWarning, r"control rate: 29\.412 Hz instead of 30 Hz"):
            with evalbus.Environment("lift_pot", control_hz=30) as environment:
                self.assertAlmostEqual(environment.control_hz, 1 / 0.034)

    def test_wrong_input(self):
        for words, options in (
            ("unknown task 'nothing'", {"task": "nothing"}),
            ("--control levers: expected one of joint", {"control": "levers"}),
            ("--image-size 64: expected WIDTHxHEIGHT", {"image_size": (64,)}),
            ("image_size: expected a list, got 64", {"image_size": 64}),
            ("cameras: expected a list, got 3", {"cameras": 3}),
            ("control: cannot be combined with a contract", {"contract": "plain", "control": "eef_delta"}),
            ("cameras: cannot be combined with a contract", {"contract": "plain", "cameras": ["head"]}),
            ("unknown task '--help'", {"task": "--help"}),
            ("no camera 'nose'; this scene has head", {"cameras": ["nose"]}),
            ("--gl metal: expected software, osmesa, egl-software, egl or auto", {"gl": "metal"}),
        ):
            with self.assertRaisesRegex(evalbus.InputError, words):
                evalbus.Environment(**{"task": "lift_pot", **options})
        with evalbus.Environment("lift_pot", seed_stream="roboeval/1") as environment:
            for seed, episode in ((-1, 0), (2**32 - 1, 1)):
                with self.assertRaisesRegex(evalbus.InputError, "^reset: seed: expected 0 to 429496729[45] with"):
                    environment.reset(seed, episode)
            self.assertIsNone(environment.reset(2**32 - 1).episode)
        environment = evalbus.Environment("lift_pot")
        with environment:
            with self.assertRaisesRegex(evalbus.InputError, "no episode is active: reset the environment first"):
                environment.step(np.zeros(16))
            state = environment.reset(0).observation["state"]
            for words, action in (
                ("has the shape .3,., expected .16,", state[:3]),
                ("value 15 of the action is not finite", np.append(state[:15], np.inf)),
                ("is of type <U1", np.full(16, "a")),
                ("masked elements", np.ma.masked_array(np.zeros(16), mask=[True] + 15 * [False])),
                ("value 0 of the action is not finite", np.full(16, np.longdouble("1e4000"))),
            ):
                with self.assertRaisesRegex(evalbus.ActionError, words):
                    environment.step(action)
            # An action may have numbers of any type.
            self.assertIsNone(environment.step(state.astype(np.longdouble)).episode)
            with self.assertRaisesRegex(evalbus.ActionError, "the action is not an array: "):
                environment.step([[1, 2], [3]])
            for words, given in (
                ("seed: expected a whole number, got 1.5", (1.5,)),
                ("seed: expected a whole number, got 'abc'", ("abc",)),
                ("seed: expected a signed 64-bit number", (2**70,)),
                ("reset: episode: expected 0 to 99999999, got -1", (0, -1)),
                ("reset: episode: expected 0 to 99999999, got 2147483647", (0, 2**31 - 1)),
                ("reset: episode: expected 0 to 99999999, got 4611686018427387904", (0, 2**62)),
                ("episode: expected a whole number, got None", (0, None)),
            ):
                with self.assertRaisesRegex(evalbus.InputError, words):
                    environment.reset(*given)
            # The environment is still usable after these errors.
            self.assertIsNone(environment.step(state).episode)
        with self.assertRaisesRegex(evalbus.InputError, "the environment is closed"):
            environment.step(state)


support.main()
