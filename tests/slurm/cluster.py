"""A temporary Slurm cluster of two nodes on one machine, in one folder, without systemd, on loopback only."""

import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue", "scancel", "sinfo")
NODES = ("n1", "n2")
# Only a hang reaches this timeout.
DEADLINE_S = 900
_NAMESPACE = "EVALBUS_TEST_NAMESPACE"


def enter_namespace():
    """Restarts this program in new namespaces for network, host name and processes; exits with 77 if not permitted."""
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing:
        print(f"skipped: no {', '.join(missing)} (apt-get install slurm-wlm munge)")
        sys.exit(77)
    if os.environ.get(_NAMESPACE):
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        socket.sethostname("localhost")
        return
    inside = ["unshare", "--net", "--uts", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
    if subprocess.run([*inside, "true"], capture_output=True).returncode != 0:
        print("skipped: no namespaces here (needs root)")
        sys.exit(77)
    os.environ[_NAMESPACE] = "1"
    os.execvp(inside[0], [*inside, sys.executable, *sys.argv])


def wait_for(condition, what, describe=lambda: ""):
    """Waits for a condition. describe() returns the state at the deadline, for the error message."""
    end = time.monotonic() + DEADLINE_S
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"waited {DEADLINE_S} s for {what}\n{describe()}")
        time.sleep(0.3)


class Cluster:
    def __init__(self, folder, cpus=1):
        self.folder = pathlib.Path(folder)
        self.cpus = cpus
        self.conf = self.folder / "slurm.conf"
        os.environ["SLURM_CONF"] = str(self.conf)

    def start(self):
        for name in ("log", "run", "spool"):
            (self.folder / name).mkdir(parents=True)
        for name in ("munge", "state"):
            (self.folder / name).mkdir(mode=0o700)
        key = self.folder / "munge" / "key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(128))
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        self._write_conf()
        run = self.folder / "run"
        self._call("munged", f"--key-file={key}", f"--socket={run}/munge.sock", f"--pid-file={run}/munged.pid",
                   f"--log-file={self.folder}/munge/log", f"--seed-file={self.folder}/munge/seed")
        self._call("slurmctld", "-c")
        for node in NODES:
            self._call("slurmd", "-c", "-N", node)
        wait_for(lambda: self.say("sinfo", "-h", "-N", "-o", "%T").split() == ["idle"] * len(NODES), "idle nodes")

    def _write_conf(self):
        folder = self.folder
        settings = {
            "ClusterName": "test", "SlurmctldHost": "localhost(127.0.0.1)", "SlurmctldPort": 16817,
            "SlurmUser": "root", "SlurmdUser": "root", "AuthType": "auth/munge", "CredType": "cred/munge",
            "AuthInfo": f"socket={folder}/run/munge.sock,cred_expire=5",
            # If loopback is the only network interface, Slurm finds 127.0.0.1 only with these parameters.
            "CommunicationParameters": "NoInAddrAny,NoCtldInAddrAny,EnableIPv6",
            "StateSaveLocation": f"{folder}/state", "SlurmdSpoolDir": f"{folder}/spool/%n",
            "SlurmctldPidFile": f"{folder}/run/slurmctld.pid", "SlurmdPidFile": f"{folder}/run/slurmd.%n.pid",
            "SlurmctldLogFile": f"{folder}/log/slurmctld.log", "SlurmdLogFile": f"{folder}/log/slurmd.%n.log",
            "ProctrackType": "proctrack/linuxproc", "TaskPlugin": "task/none", "MpiDefault": "none",
            "MailProg": "/bin/true", "JobAcctGatherType": "jobacct_gather/none",
            "AccountingStorageType": "accounting_storage/none", "SchedulerType": "sched/backfill",
            "SchedulerParameters": "batch_sched_delay=1,bf_interval=2,sched_interval=2",
            "SelectType": "select/cons_tres", "SelectTypeParameters": "CR_CPU",
            "SlurmdParameters": "config_overrides", "ReturnToService": 2, "SlurmdTimeout": 10,
            "SlurmctldTimeout": 10, "BatchStartTimeout": 10, "KillWait": 2, "JobRequeue": 1,
        }
        lines = [f"{key}={value}" for key, value in settings.items()]
        for i, node in enumerate(NODES):
            lines.append(f"NodeName={node} NodeHostname=localhost NodeAddr=127.0.0.1 Port={16821 + i} "
                         f"CPUs={self.cpus} RealMemory=500 State=UNKNOWN")
        lines.append(f"PartitionName=test Nodes={','.join(NODES)} Default=YES MaxTime=10 State=UP")
        self.conf.write_text("\n".join(lines) + "\n")

    def _call(self, *command):
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S)
        assert done.returncode == 0, f"{' '.join(command)}: {done.stdout}{done.stderr}"
        return done.stdout

    def say(self, *command):
        """Returns the output of a Slurm command; empty if the controller does not answer."""
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S)
        return done.stdout if done.returncode == 0 else ""

    def jobs(self):
        """Returns {"12_3": "RUNNING", ...} of jobs that have not finished."""
        lines = self.say("squeue", "-h", "-r", "-o", "%i %T").splitlines()
        return dict(line.split() for line in lines)

    def wait_until_done(self):
        wait_for(lambda: not self._release() and not self.jobs(), "the last job", self._describe)

    def _describe(self):
        log = (self.folder / "log" / "slurmctld.log").read_text(errors="replace").splitlines()
        return "\n".join([self.say("squeue", "-r", "-o", "%i %T %N %r"), self.say("sinfo", "-N", "-l"), *log[-60:]])

    def _release(self):
        """Releases jobs that wait for an administrator or for a start time.

        Without it, a node that was set down, or that Slurm drains because a slurmstepd died, returns late or
        never. A requeued job starts at once instead of after the two minutes in which its credential might be
        used. If the node still runs its first copy then, the launch fails, and Slurm holds the job.
        """
        for line in self.say("sinfo", "-h", "-N", "-o", "%N %T").splitlines():
            node, state = line.split()
            if state.startswith(("down", "drain")):
                self.say("scontrol", "update", f"nodename={node}", "state=resume")
        for job, state in self.jobs().items():
            if state != "PENDING":
                continue
            reason = self.say("squeue", "-h", "-r", "-j", job, "-o", "%r")
            if "BeginTime" in reason:
                self.say("scontrol", "update", f"jobid={job}", "StartTime=now")
            elif "requeued held" in reason:
                self.say("scontrol", "release", job)

    def stop(self):
        for state in ("PENDING", "RUNNING"):
            self.say("scancel", f"--state={state}")
        # The other processes end with the namespace.
        for file in sorted((self.folder / "run").glob("*.pid")):
            try:
                os.kill(int(file.read_text()), signal.SIGKILL)
            except (ProcessLookupError, ValueError):
                pass
