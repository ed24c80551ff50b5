"""Helpers for the tests of python/. A program that cannot run exits with 77, which ctest reports as skipped."""

import asyncio
import pathlib
import subprocess
import sys
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = SOURCE / "python" / "examples"
# Only a hang reaches this timeout, which equals the timeout in tests/deadline.h.
DEADLINE_S = 900


def skip(why):
    print(f"skipped: {why}", flush=True)
    sys.exit(77)


def need(*modules):
    """Skips the program if a module is missing."""
    missing = []
    for module in modules:
        try:
            __import__(module)
        except ImportError:
            missing.append(module)
    if missing:
        skip(f"{sys.executable} has no {', '.join(missing)} (scripts/setup.sh installs Debian's packages)")


def need_torch(test):
    try:
        import torch  # noqa: F401
    except ImportError:
        test.skipTest("needs PyTorch: apt-get install python3-torch")


def blocks(page):
    """Returns the Python blocks of a page in docs/, in order."""
    found = (SOURCE / "docs" / page).read_text().split("```")[1::2]
    return [block.removeprefix("python\n") for block in found if block.startswith("python\n")]


def snippet(having):
    """Returns the Python block of docs/python.md that contains this text."""
    (found,) = [block for block in blocks("python.md") if having in block]
    return found


def evaluate(bin_folder, *arguments, out):
    """Runs `evalbus run` in one process, for which it needs no network."""
    command = [
        f"{bin_folder}/evalbus",
        "run",
        *arguments,
        "--in-process",
        "--video",
        "none",
        "--out",
        str(out),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}{done.stderr}"


class Program:
    """A running Python program; the constructor waits for the output line that begins with `ready`."""

    def __init__(self, *command, ready):
        self.process = subprocess.Popen(
            [sys.executable, "-B", *map(str, command)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for line in self.process.stdout:
            if line.startswith(ready):
                self.line = line.strip()
                return
        raise AssertionError(f"did not print {ready}: {self.process.stderr.read()}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate(timeout=DEADLINE_S)


class Server(Program):
    """A program that serves a policy. url has the port that it prints."""

    def __init__(self, *command):
        super().__init__(*command, ready="policy server ready: ")
        self.url = self.line.split(": ")[1]


async def converse(url, conversation):
    """Opens a connection. Returns the result of conversation(connection, metadata)."""
    from evalbus import codec

    try:
        from websockets.asyncio.client import connect
    except ImportError:
        from websockets import connect

    async def run():
        async with connect(url, compression=None, max_size=None) as connection:
            return await conversation(connection, codec.unpack(await connection.recv()))

    return await asyncio.wait_for(run(), DEADLINE_S)


def main():
    unittest.main(verbosity=2)
