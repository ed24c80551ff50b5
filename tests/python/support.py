"""What the tests of python/ share. A program that cannot run exits with 77, which ctest shows as skipped."""

import asyncio
import pathlib
import subprocess
import sys
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = SOURCE / "python" / "examples"
# Only a hang reaches this limit, as tests/deadline.h has it for tests in C++.
DEADLINE_S = 900


def skip(why):
    print(f"skipped: {why}", flush=True)
    sys.exit(77)


def need(*modules):
    """Skips the program where a module is missing."""
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


def snippet(having):
    """The Python of docs/python.md that has this in it."""
    blocks = (SOURCE / "docs" / "python.md").read_text().split("```")[1::2]
    (found,) = [block.removeprefix("python\n") for block in blocks if having in block]
    return found


def evaluate(bin_folder, *arguments, out):
    """`evalbus run` in one process, which needs no network."""
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
    """A program in Python, from the line of its output that begins with `ready` on."""

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
        raise AssertionError(f"never said {ready}: {self.process.stderr.read()}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate(timeout=DEADLINE_S)


class Server(Program):
    """One that serves a policy; url: on the port that it prints."""

    def __init__(self, *command):
        super().__init__(*command, ready="policy server ready: ")
        self.url = self.line.split(": ")[1]


async def converse(url, conversation):
    """What conversation(connection, metadata) returns of a new connection."""
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
