"""Runs the commands of README.md as they stand there, in its order, in a folder that looks like the source tree.

usage: readme_test.py BIN   (the folder of evalbus' programs)

They run in a network of their own. Runs are short: numbers of episodes, sizes of images and speeds of replays are reduced.
"""

import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time

import support

support.need("numpy", "msgpack", "websockets")

BIN = pathlib.Path(sys.argv[1]).resolve()
NETWORK = "EVALBUS_README_TEST"
# They install and build, need Java (StockTools.SpyKnowsOurTypes) or a shell's jobs.
LEFT_OUT = {"./run", "./test", "scripts/spy", "kill %1 %2"}
REDUCED = [
    (r"^\./run ", "evalbus run "),
    (r"^evalbus run all ", "evalbus run rotate_valve/all "),
    (r"(--episodes|episodes:) \d+", lambda m: f"{m[1]} {min(int(m[0].split()[1]), 4)}"),
    (r"^(evalbus run (?!.*(--episodes|plan\.yaml|replay:)).*)$", r"\1 --episodes 1"),
    (r"^(evalbus render .*)$", r"\1 --size 64x48"),
    (r"^(lcm-logplayer|evalbus replay) ", r"\1 --speed 20 "),
]
# Commands that end by Ctrl-C, and what they have said by then. The second of a pair: they watch a run that is active.
UNTIL_CTRL_C = [
    (r"^evalbus run .*--web", r"(?s)http://.*episodes? in ", False),
    (r"^evalbus web ", r"http://", False),
    (r"^evalbus monitor", r"listening to ", True),
    (r"^evalbus-viz ", r"viz ready", True),
    (r"^lcm-logger ", r"", False),
]


def enter_network():
    """Begins this program again where its ports and multicast groups are its own; skips it where that is not allowed."""
    if not os.environ.get(NETWORK):
        inside = ["unshare", "--net", "--map-root-user", "--pid", "--fork", "--kill-child"]
        if subprocess.run([*inside, "true"], capture_output=True).returncode != 0:
            support.skip("no namespaces here")
        os.environ[NETWORK] = "1"
        os.execvp(inside[0], [*inside, sys.executable, "-B", *sys.argv])
    subprocess.run("ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo", shell=True, check=True)


def blocks():
    """The code blocks of README.md that have commands: [["evalbus ...", ...], ...], and the text behind each."""
    parts = re.split(r"^```.*\n", (support.SOURCE / "README.md").read_text(), flags=re.MULTILINE)
    fences = re.findall(r"^```(.*)$", (support.SOURCE / "README.md").read_text(), flags=re.MULTILINE)[::2]
    for language, text in zip(fences, parts[1::2]):
        if not language:
            yield [re.sub(r"\s+# .*", "", line) for line in text.splitlines() if line.strip()], text
        elif language == "python":
            yield [f"/usr/bin/python3 -c {shlex.quote(text)}"], text


class Shell:
    """Runs commands in one folder; a block's exports hold for its later commands."""

    def __init__(self, folder):
        self.folder = folder
        self.background = []
        self.exports = ""
        self.count = 0

    def start(self, command):
        log = open(self.folder / f"command-{self.count}.txt", "w+")
        self.count += 1
        process = subprocess.Popen(["/bin/bash", "-c", f"{self.exports}exec {command}"], cwd=self.folder, stdout=log,
                                   stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)  # fmt: skip
        process.said = lambda: pathlib.Path(log.name).read_text()
        return process

    def wait_for(self, condition, what):
        end = time.monotonic() + support.DEADLINE_S
        while not condition():
            assert time.monotonic() < end, what()
            time.sleep(0.01)

    def until_says(self, process, pattern):
        self.wait_for(lambda: re.search(pattern, process.said()) or process.poll() is not None, process.said)

    def stay(self, command, pattern=r"\n"):
        """Starts what goes on in the background."""
        process = self.start(command)
        self.background.append(process)
        self.until_says(process, pattern)
        assert process.poll() is None, f"{command}: {process.said()}"
        return process

    def run(self, command):
        shell = subprocess.run(["/bin/bash", "-c", self.exports + command], cwd=self.folder, capture_output=True,
                               text=True, timeout=support.DEADLINE_S, stdin=subprocess.DEVNULL)  # fmt: skip
        assert shell.returncode == 0, f"{command}: exit code {shell.returncode}\n{shell.stdout}{shell.stderr}"
        return shell.stdout

    def run_until_ctrl_c(self, command, pattern, needs_run):
        long_run = f"evalbus run lift_pot --realtime --episodes 1000 --out runs/live-{self.count}"
        live = self.stay(long_run, "udpm") if needs_run else None
        process = self.stay(command, pattern)
        if command.startswith("lcm-logger"):
            self.wait_for(lambda: (self.folder / command.split()[1]).exists(), process.said)
        process.send_signal(signal.SIGINT)
        code = process.wait(support.DEADLINE_S)
        assert code == 0, f"{command}: exit code {code}\n{process.said()}"
        if live:
            live.send_signal(signal.SIGINT)
            live.wait(support.DEADLINE_S)

    def end(self):
        """Ends what a block has left in the background."""
        for process in self.background:
            if process.poll() is None:
                process.terminate()
            process.wait(support.DEADLINE_S)
        self.background.clear()


def reduced(command):
    for pattern, to in REDUCED:
        command = re.sub(pattern, to, command)
    return command


def run_block(shell, commands):
    """Runs each command once; returns how many."""
    shell.end()
    shell.exports = ""
    ran = 0
    while commands:
        command = reduced(commands.pop(0))
        if command in LEFT_OUT:
            continue
        ran += 1
        began = time.monotonic()
        if command.startswith("export "):
            shell.exports += command + "; "
        elif command.endswith(" &"):
            shell.stay(command.removesuffix(" &").replace("PYTHONPATH=python ", "env PYTHONPATH=python "))
        elif commands and commands[0].endswith("& done"):
            # The next line is typed in another terminal.
            run = shell.stay(command, "evalbus-sim --options")
            parts = shell.run(commands.pop(0).replace("& done", ">/dev/null 2>&1 & echo $!; done")).split()
            ran += 1
            assert run.wait(support.DEADLINE_S) == 0, run.said()
            for part in parts:
                os.kill(int(part), signal.SIGTERM)
        else:
            for pattern, says, needs_run in UNTIL_CTRL_C:
                if re.search(pattern, command):
                    shell.run_until_ctrl_c(command, says, needs_run)
                    break
            else:
                shell.run(command)
        print(f"{time.monotonic() - began:5.1f} s  {command}", flush=True)
    return ran


def main():
    enter_network()
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    all_blocks = list(blocks())
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for part in ("python", "models", "lcmtypes", "tests", "scripts"):
            (folder / part).symlink_to(support.SOURCE / part)
        shell = Shell(folder)
        try:
            # The table of ten episodes, to the last digit.
            (at,) = [i for i, (commands, _) in enumerate(all_blocks) if "--episodes 10 --seed 7" in "".join(commands)]
            (command,), table = all_blocks[at][0], all_blocks[at + 1][1]
            said = shell.run(command.replace("./run", "evalbus run") + " --in-process --video none --out runs/ten")
            expected = [line for line in table.splitlines() if not line.startswith("10 episodes in")]
            missing = [line for line in expected if line not in said.splitlines()]
            assert not missing, (missing, said)
            ran = sum(run_block(shell, commands) for i, (commands, _) in enumerate(all_blocks) if i != at + 1)
            print(f"{ran} commands", flush=True)
            assert ran > 50, ran
        finally:
            shell.end()


main()
