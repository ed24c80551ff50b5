#!/usr/bin/env python3
"""A plan on a Slurm cluster gives the same bytes as without a cluster, whatever happens to its tasks.

usage: slurm_test.py FOLDER_OF_PROGRAMS
"""
import filecmp
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import cluster
import evalbus.log

PLAN = """plan: check points
policies:
  - expert
  - {name: shaky, policy: noisy_expert}
tasks: [lift_pot/position, lift_pot/orientation, lift_pot/position_and_orientation]
episodes: 6
seed: 5
shard_episodes: 2
"""
TASKS = 6
# Files of a run folder that are equal in two runs of equal seeds.
RESULTS = ("episodes.jsonl", "summary.json", "run.json")


class SlurmTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="evalbus-slurm-")
        cls.folder = pathlib.Path(cls.scratch.name)
        # Munge requires these permissions.
        cls.folder.chmod(0o755)
        (cls.folder / "plan.yaml").write_text(PLAN)
        cls.reference = cls.folder / "reference"
        cls.evalbus("run", str(cls.folder / "plan.yaml"), "--out", str(cls.reference), "--workers", "2")
        cls.cluster = cluster.Cluster(cls.folder / "cluster")
        cls.cluster.start()

    @classmethod
    def tearDownClass(cls):
        cls.cluster.stop()
        cls.scratch.cleanup()

    @classmethod
    def evalbus(cls, *arguments, code=0):
        done = subprocess.run([f"{PROGRAMS}/evalbus", *arguments], capture_output=True, text=True,
                              timeout=cluster.DEADLINE_S)
        assert done.returncode == code, f"evalbus {' '.join(arguments)}: {done.stdout}{done.stderr}"
        return done.stdout + done.stderr

    def submit(self, name):
        """Returns the plan's folder and the id of the array job."""
        out = self.folder / name
        said = self.evalbus("run", str(self.folder / "plan.yaml"), "--out", str(out), "--slurm", "--array-size",
                            str(TASKS))
        return out, re.search(r"array +job (\d+)", said).group(1)

    def expect_equal(self, out):
        for run in sorted(self.reference.glob("*/*/run.json")):
            own = out / run.parent.relative_to(self.reference)
            for name in RESULTS:
                self.assertTrue(filecmp.cmp(run.parent / name, own / name, shallow=False), own / name)
            events = [self.events(folder / "episodes" / "0003" / "events.lcmlog") for folder in (run.parent, own)]
            self.assertGreater(len(events[0]), 100)
            self.assertEqual(*events)
            logs = [len(list((folder / "episodes").glob("*/events.lcmlog"))) for folder in (run.parent, own)]
            self.assertEqual(logs, [6, 6])
        for policy in ("expert", "shaky"):
            for name in ("suite.json", "summary.json"):
                self.assertTrue(filecmp.cmp(self.reference / policy / name, out / policy / name, shallow=False), name)
        # No unfinished shard remains after every orphaned task has ended. This includes a task that its retry
        # overtook.
        cluster.wait_for(lambda: not list((out / "parts").iterdir()), f"{out}/parts to be empty")

    def events(self, log):
        """Returns the events that do not depend on the process or on how much of the run it made. MODEL does
        depend on it, because it names files where they were written.
        """
        skipped = ("EVALBUS_MODEL", "EVALBUS_STATUS", "EVALBUS_RUN_SUMMARY")
        # evalbus.events is not used, because Python would take minutes to decode this many events.
        return [event for event in evalbus.log._events(log, evalbus.log.Log()) if event[1] not in skipped]

    def running(self, array):
        tasks = [job for job, state in self.cluster.jobs().items() if state == "RUNNING" and job.startswith(array)]
        return sorted(tasks)

    def wait_for_running(self, array):
        cluster.wait_for(lambda: self.running(array), "a task that runs")
        return self.running(array)[0]

    def test_is_as_without_it(self):
        # sbatch splits unquoted values at blanks and replaces "%a" in the name of a job's output.
        out, _ = self.submit("50%a of it")
        self.assertIn("of 36 episodes done", self.evalbus("status", str(out)))
        self.cluster.wait_until_done()
        self.expect_equal(out)
        logs = sorted(log.name for log in (out / "slurm").glob("*.log"))
        self.assertEqual(logs, ["merge.log", *(f"part-{part}.log" for part in range(1, TASKS + 1))])
        self.assertIn("36 of 36 episodes done (100 %), 0 in running shards, 0 shards failed", self.evalbus("status", str(out)))
        # Two more merges at the same time change nothing.
        merges = [subprocess.Popen([f"{PROGRAMS}/evalbus", "merge", str(out)], stdout=subprocess.DEVNULL)
                  for _ in range(2)]
        self.assertEqual([merge.wait(cluster.DEADLINE_S) for merge in merges], [0, 0])
        self.expect_equal(out)
        self.assertIn("all episodes exist and are merged", self.evalbus("run", str(out / "plan.json"), "--slurm", code=1))

    def test_is_the_same_whatever_happens(self):
        out = self.folder / "faults"
        out.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600M", "tmpfs", str(out)], check=True)
        try:
            _, array = self.submit("faults")
            self.fill_the_disk_for_a_while(out, array)
            self.take_a_node_down(array)
            self.kill_a_slurmstepd(array)
            task = self.wait_for_running(array)
            self.cluster.say("scontrol", "requeue", task)
            cluster.wait_for(lambda: task not in self.running(array), "the task to stop")
            self.cluster.say("scancel", self.wait_for_running(array))
            # The retry of the orphaned task starts three quarters of a minute after it.
            self.cluster.wait_until_done()
            # Canceled shards are missing, so only these are submitted again.
            self.assertIn("shards are missing", (out / "slurm" / "merge.log").read_text())
            self.assertIn("1 task", self.evalbus("run", str(out / "plan.json"), "--slurm", "--array-size", str(TASKS)))
            self.cluster.wait_until_done()
            self.expect_equal(out)
        finally:
            subprocess.run(["umount", "-l", str(out)], check=False)

    def fill_the_disk_for_a_while(self, out, array):
        self.wait_for_running(array)
        ballast = out / "slurm" / "ballast"
        with open(ballast, "wb") as file:
            try:
                while True:
                    file.write(bytes(1 << 20))
            except OSError:
                pass
        # The tasks' own logs are also on this disk.
        os.truncate(ballast, ballast.stat().st_size - (256 << 10))
        cluster.wait_for(lambda: any(": retrying" in log.read_text() for log in (out / "slurm").glob("part-*")),
                         "a task that finds the disk full")
        ballast.unlink()

    def take_a_node_down(self, array):
        task = self.wait_for_running(array)
        node = self.cluster.say("squeue", "-h", "-r", "-j", task, "-o", "%N").strip()
        self.cluster.say("scontrol", "update", f"nodename={node}", "state=down", "reason=test")

    def kill_a_slurmstepd(self, array):
        """Makes the task an orphan that continues to run while Slurm restarts it."""
        self.wait_for_running(array)
        said = subprocess.run(["pgrep", "-f", "^slurmstepd"], capture_output=True, text=True).stdout.split()
        self.assertTrue(said)
        os.kill(int(said[0]), signal.SIGKILL)


if __name__ == "__main__":
    cluster.enter_namespace()
    PROGRAMS = sys.argv.pop(1)
    unittest.main(verbosity=2)
