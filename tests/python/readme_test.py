"""Runs the commands of README.md and docs/commands.md exactly as printed, in their order.

Each page runs in a folder that has the layout of the source tree.

usage: readme_test.py BIN   (the folder of evalbus' programs)

The commands run in a network namespace of their own. Runs are shortened: numbers of episodes, sizes of images
and speeds of replays are reduced.
"""

import os
import pathlib
import re
import signal
import sys
import tempfile
import time

import support
from page_commands import Shell, blocks, enter_network

support.need("numpy", "msgpack", "websockets")

BIN = pathlib.Path(sys.argv[1]).resolve()
# These commands install or build, need Java (StockTools.SpyKnowsOurTypes) or use a shell's job control.
LEFT_OUT = {"./run", "./test", "scripts/spy", "kill %1 %2"}
REDUCED = [
    (r"^\./run ", "evalbus run "),
    (r"^evalbus run all ", "evalbus run rotate_valve/all "),
    (r"(--episodes|episodes:) \d+", lambda m: f"{m[1]} {min(int(m[0].split()[1]), 4)}"),
    (r"^(evalbus run (?!.*(--episodes|plan\.yaml)).*?)( *#.*|)$", r"\1 --episodes 1\3"),
    (r"^(evalbus render .*)$", r"\1 --size 64x48"),
    (r"^(lcm-logplayer|evalbus replay) ", r"\1 --speed 20 "),
]
# These commands end by Ctrl-C. Each has the output to wait for before it, and whether it needs an active run.
UNTIL_CTRL_C = [
    (r"^evalbus run .*--web", r"(?s)http://.*episodes? in ", False),
    (r"^evalbus web ", r"http://", False),
    (r"^evalbus monitor", r"listening to ", True),
    (r"^evalbus-viz ", r"viz ready", True),
    (r"^lcm-logger ", r"", False),
]


def reduced(command):
    for pattern, to in REDUCED:
        command = re.sub(pattern, to, command)
    return command


def run_block(shell, commands):
    """Runs each command once. Returns how many were run."""
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
            # The user types the next line in another terminal.
            run = shell.stay(command, "evalbus-sim --options")
            parts = shell.run(commands.pop(0).replace("& done", ">/dev/null 2>&1 & echo $!; done")).split()
            ran += 1
            assert run.wait(support.DEADLINE_S) == 0, run.output()
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


def check_lines(expected, said):
    missing = [line for line in expected.splitlines() if line not in said.splitlines()]
    assert not missing, (missing, said)


def run_readme(shell):
    """Returns how many commands ran."""
    text = (support.SOURCE / "README.md").read_text()
    # The comparison of the two policies must be equal to the last digit.
    for command in re.findall(r"^evalbus run .* --out runs/.*", text, flags=re.MULTILINE):
        shell.run(command.replace("--out runs/", "--in-process --video none --out runs/whole-"))
    (excerpt,) = re.findall(r"^```text\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    said = shell.run("cd runs && for run in expert noisy; do mv whole-$run $run; done && evalbus compare expert noisy")
    sentence, table = excerpt.split("\n\n")
    assert " ".join(sentence.split()) in " ".join(said.split()), (sentence, said)
    check_lines(table, said)
    shell.run("rm -r runs")
    return sum(run_block(shell, commands) for commands, _ in blocks("README.md"))


def run_commands_page(shell):
    """Returns how many commands ran."""
    all_blocks = list(blocks("docs/commands.md"))
    # The table of ten episodes must be equal to the last digit.
    (at,) = [i for i, (commands, _) in enumerate(all_blocks) if "--episodes 10 --seed 7" in "".join(commands)]
    (command,), table = all_blocks[at][0], all_blocks[at + 1][1]
    said = shell.run(command.replace("./run", "evalbus run") + " --in-process --video none --out runs/ten")
    check_lines(re.sub(r"^10 episodes in .*\n", "", table, flags=re.MULTILINE), said)
    return sum(run_block(shell, commands) for i, (commands, _) in enumerate(all_blocks) if i != at + 1)


def main():
    enter_network()
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    ran = 0
    for run_page in (run_readme, run_commands_page):
        with tempfile.TemporaryDirectory() as name:
            shell = Shell(pathlib.Path(name))
            try:
                ran += run_page(shell)
            finally:
                shell.end()
    print(f"{ran} commands", flush=True)
    assert ran > 50, ran


main()
