"""The wheel of scripts/wheel as a user installs it, in a new virtual environment of this Python; downloads from PyPI.

usage: try_wheel.py WHEEL REFERENCE

REFERENCE is the folder of the run that RUN makes with the programs of the build. `scripts/wheel --try` calls this in
fresh systems.
"""

import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

RUN = ("run", "lift_pot/position", "--episodes", "2", "--video", "overview", "--out")
# Fails unless the messages of two logs are bit-identical. The times at which they were recorded may differ.
# The action that answers the last state is not executed and may be too late for the log.
SAME_LOG = """
import sys, evalbus
def bits(column):
    if isinstance(column, dict):
        return {key: bits(value) for key, value in column.items() if key != "time_us"}
    return [bits(entry) for entry in column] if isinstance(column, list) else getattr(column, "tobytes", lambda: column)()
def first(column, number):
    return {key: first(value, number) for key, value in column.items()} if isinstance(column, dict) else column[:number]
a, b = map(evalbus.read_log, sys.argv[1:])
ticks = len(a["EVALBUS_STATE"]["time_us"])
assert ticks > 100
for channel, number in {"STATE": ticks + 1, "CONTACTS": ticks + 1, "ACTION": ticks - 1, "PARTIAL": ticks + 1}.items():
    one, other = (first(log["EVALBUS_" + channel], number) for log in (a, b))
    assert len(one["time_us"]) == min(number, ticks) and bits(one) == bits(other), channel
"""


def call(*command, code=0):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == code, (command, done.returncode, done.stdout[-2000:], done.stderr[-2000:])
    return done.stdout + done.stderr


wheel, reference = (pathlib.Path(word).resolve() for word in sys.argv[1:])
system = platform.freedesktop_os_release()["PRETTY_NAME"]
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    began = time.monotonic()
    call(sys.executable, "-m", "venv", "env")
    call("env/bin/pip", "install", wheel)
    installed = time.monotonic()
    call("env/bin/evalbus", *RUN, "run")
    ended = time.monotonic()
    print(f"{system}, Python {platform.python_version()}: {installed - began:.0f} s to install, "
          f"{ended - installed:.0f} s to two scored episodes with videos", flush=True)  # fmt: skip
    assert pathlib.Path("run/episodes.jsonl").read_bytes() == (reference / "episodes.jsonl").read_bytes()
    for episode in ("0000", "0001"):
        assert pathlib.Path("run/episodes", episode, "overview.mp4").stat().st_size > 10000
        logs = (run / "episodes" / episode / "events.lcmlog" for run in (pathlib.Path("run"), reference))
        call("env/bin/python", "-c", SAME_LOG, *logs)

    print(call("env/bin/python", "-m", "evalbus", "doctor"), end="")
    call("env/bin/evalbus", "rescore", "run")
    call("env/bin/evalbus", "replay", "run", "--episode", "0")
    # The command needs the files of the page, among them three.js.
    call("env/bin/evalbus", "report", "run")

    call("env/bin/pip", "uninstall", "--yes", "imageio-ffmpeg")
    if not pathlib.Path("/usr/bin/ffmpeg").exists():
        said = call("env/bin/evalbus", "render", "run", "--episode", "0", "--out", "again.mp4", code=2)
        assert said.count("'pip install imageio-ffmpeg'") == 1 and "Traceback" not in said, said

    call("env/bin/pip", "install", "uv")
    call("env/bin/uvx", "--from", wheel, "evalbus", *RUN, "uvx")
    assert pathlib.Path("uvx/episodes.jsonl").read_bytes() == (reference / "episodes.jsonl").read_bytes()
