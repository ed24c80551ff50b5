"""Runs commands of the documentation's pages exactly as printed, in a private network namespace."""

import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import time

import support

_NETWORK = "EVALBUS_PAGE_COMMANDS"
# Folders of the source tree that the commands use.
TREE = ("python", "models", "lcmtypes", "tests", "scripts")


def enter_network():
    """Restarts this program with its own ports, multicast groups and processes; skips it if that is not
    permitted.
    """
    if not os.environ.get(_NETWORK):
        inside = ["unshare", "--net", "--map-root-user", "--pid", "--fork", "--kill-child", "--mount-proc"]
        if subprocess.run([*inside, "true"], capture_output=True).returncode != 0:
            support.skip("no namespaces here")
        os.environ[_NETWORK] = "1"
        os.execvp(inside[0], [*inside, sys.executable, "-B", *sys.argv])
    subprocess.run("ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo", shell=True, check=True)


def blocks(page):
    """Returns the code blocks of a page of the documentation as (["evalbus ...", ...], the block's text)."""
    text = (support.SOURCE / page).read_text()
    parts = re.split(r"^```.*\n", text, flags=re.MULTILINE)
    fences = re.findall(r"^```(.*)$", text, flags=re.MULTILINE)[::2]
    for language, text in zip(fences, parts[1::2]):
        if not language:
            yield [re.sub(r"\s+# .*", "", line) for line in text.splitlines() if line.strip()], text
        elif language == "python":
            yield [f"/usr/bin/python3 -c {shlex.quote(text)}"], text


def catches(pid, number):
    """Returns whether a program has installed a handler for a signal. The shell that starts it has none."""
    if os.path.basename(os.readlink(f"/proc/{pid}/exe")) == "bash":
        return False
    (caught,) = re.findall(r"^SigCgt:\s*(\w+)", pathlib.Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return int(caught, 16) >> (number - 1) & 1 == 1


class Shell:
    """Runs commands in one folder. Variables that a block exports stay set for its later commands."""

    def __init__(self, folder):
        self.folder = folder
        for part in TREE:
            (folder / part).symlink_to(support.SOURCE / part)
        self.background = []
        self.exports = ""
        self.count = 0

    def start(self, command):
        log = open(self.folder / f"command-{self.count}.txt", "w+")
        self.count += 1
        process = subprocess.Popen(["/bin/bash", "-c", f"{self.exports}exec {command}"], cwd=self.folder, stdout=log,
                                   stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)  # fmt: skip
        process.output = lambda: pathlib.Path(log.name).read_text()
        return process

    def wait_for(self, condition, what):
        end = time.monotonic() + support.DEADLINE_S
        while not condition():
            assert time.monotonic() < end, what()
            time.sleep(0.01)

    def wait_for_output(self, process, pattern):
        self.wait_for(lambda: re.search(pattern, process.output()) or process.poll() is not None, process.output)

    def stay(self, command, pattern=r"\n"):
        """Starts a program that stays in the background, and waits until its output matches `pattern`."""
        process = self.start(command)
        self.background.append(process)
        self.wait_for_output(process, pattern)
        assert process.poll() is None, f"{command}: {process.output()}"
        return process

    def run(self, command):
        shell = subprocess.run(["/bin/bash", "-c", self.exports + command], cwd=self.folder, capture_output=True,
                               text=True, timeout=support.DEADLINE_S, stdin=subprocess.DEVNULL)  # fmt: skip
        # With so few episodes, a gate may remain undecided (exit code 11).
        accepted = (0, 11) if command.startswith("evalbus gate ") else (0,)
        assert shell.returncode in accepted, f"{command}: exit code {shell.returncode}\n{shell.stdout}{shell.stderr}"
        return shell.stdout

    def run_until_ctrl_c(self, command, pattern, needs_run):
        out = f"runs/live-{self.count}"
        long_run = f"evalbus run lift_pot --realtime --episodes 1000 --out {out}"
        live = self.stay(long_run, "udpm") if needs_run else None
        if live:
            # The bus is printed before the component processes start, but the commands find a run by these processes.
            self.wait_for(lambda: any((self.folder / out).glob("episodes/*/events.lcmlog")), live.output)
        process = self.stay(command, pattern)
        self.wait_for(lambda: catches(process.pid, signal.SIGINT), process.output)
        process.send_signal(signal.SIGINT)
        code = process.wait(support.DEADLINE_S)
        assert code == 0, f"{command}: exit code {code}\n{process.output()}"
        if live:
            live.send_signal(signal.SIGINT)
            live.wait(support.DEADLINE_S)

    def end(self):
        """Terminates the programs that a block has left in the background."""
        for process in self.background:
            if process.poll() is None:
                process.terminate()
            process.wait(support.DEADLINE_S)
        self.background.clear()
