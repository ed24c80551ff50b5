"""Builds examples/ outside the source tree against an installed evalbus, and uses them in a run."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1])
# Only a hang reaches this timeout.
DEADLINE_S = 900
URL = f"udpm://239.255.76.67:{20000 + os.getpid() % 10000}?ttl=0"


def call(*command, code=0, **more):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=DEADLINE_S, **more)
    assert done.returncode == code, (command, done.returncode, done.stdout[-2000:], done.stderr[-2000:])
    return done.stdout + done.stderr


with tempfile.TemporaryDirectory() as folder:
    here = pathlib.Path(folder)
    call("cmake", "--install", BUILD, "--prefix", here / "installed")
    # The examples are copied, so no command names a path of the source tree.
    call("cp", "-r", ROOT / "examples", here / "examples")
    call("cmake", "-S", here / "examples", "-B", here / "build", f"-DCMAKE_PREFIX_PATH={here / 'installed'}")
    call("cmake", "--build", here / "build", "--parallel", "2")
    evalbus = here / "installed" / "bin" / "evalbus"

    # The task is a copy with a metric that only the plugin provides.
    call(evalbus, "tasks", "new", "mine", "--from", "lift_pot", cwd=here)
    task = here / "mine.yaml"
    text = task.read_text().replace("\ntarget_distance:\n", "\ntarget_distance:\n  wrists_over_pot: {wrists_above: {object: pot}}\n")
    task.write_text(text.replace("time_limit_s: 20", "time_limit_s: 1"))
    assert "there is no quantity 'wrists_above'" in call(evalbus, "tasks", "check", task, code=1)
    plugins = {
        **os.environ,
        "EVALBUS_PREDICATES": str(here / "build" / "libwrists_above.so"),
        "EVALBUS_POLICIES": str(here / "build" / "libwaving.so"),
    }
    call(evalbus, "tasks", "check", task, env=plugins)

    listener = subprocess.Popen([here / "build" / "listener", URL, "1"], stdout=subprocess.PIPE, text=True)
    assert listener.stdout.readline() == "listening\n"
    run = here / "run"
    call(evalbus, "run", f"{task}/base", "--policy", "waving", "--episodes", "1", "--out", run, "--url", URL, env=plugins)
    assert listener.communicate(timeout=DEADLINE_S)[0] == "episode 0: time_limit after 1.00 s\n"
    episode = json.loads((run / "episodes.jsonl").read_text())
    # The pot's origin is at 0.996 m. The wrists are above it, at a height that follows from the robot's home
    # pose.
    assert 0.1 < episode["metrics"]["target_distance"]["wrists_over_pot"] < 0.5, episode
    loaded = json.loads((run / "run.json").read_text())["plugins"]
    assert sorted(loaded) == ["libwaving.so", "libwrists_above.so"], loaded
    # A resume with different plugins is refused, because it would be a different run.
    assert "other plugins" in call(evalbus, "run", "--resume", "--out", run, f"{task}/base", "--policy", "waving", "--episodes",
                                   "2", code=1, env={**plugins, "EVALBUS_PREDICATES": ""})

    other = here / "libother.so"
    library = pathlib.Path(plugins["EVALBUS_POLICIES"]).read_bytes()
    version = re.search(rb"\d+\.\d+\.\d+-[0-9a-f]{12}\0", library)[0]
    other.write_bytes(library.replace(version, b"0.3.0-000000000000\0"))
    for named, words in (
        (other, "was built for evalbus 0.3.0-000000000000, this is 0.3.0-"),
        ("/nowhere.so", "cannot open shared object file"),
        ("waving.so", "expected an absolute path"),
        ("/lib/x86_64-linux-gnu/libz.so.1", "is not an evalbus plugin"),
        (plugins["EVALBUS_POLICIES"] + ":" + plugins["EVALBUS_POLICIES"], "policy name 'waving': is taken"),
    ):
        said = call(evalbus, "tasks", "list", code=1, env={**os.environ, "EVALBUS_POLICIES": str(named)})
        assert words in said and said.count("\n") == 1, said
