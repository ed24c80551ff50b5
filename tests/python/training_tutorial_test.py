"""Runs the commands of docs/tutorial_training.md in their own folder.

usage: training_tutorial_test.py BIN [EPISODES]   (EPISODES: number of demonstrations instead of the page's)
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(sys.argv[1]).resolve()
PAGE = (SOURCE / "docs/tutorial_training.md").read_text()
commands = [line for block in re.findall(r"```bash\n(.*?)```", PAGE, re.S) for line in block.splitlines()]
if len(sys.argv) > 2:
    commands = [re.sub(r"--episodes 200\b", f"--episodes {sys.argv[2]}", line) for line in commands]

with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    (here / "python").symlink_to(SOURCE / "python")
    # python3 in the commands is the interpreter that runs this test.
    os.environ["PATH"] = f"{BIN}:{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"
    server = None
    try:
        for command in commands:
            print(f"$ {command}", flush=True)
            if command.startswith("export "):
                os.environ["PYTHONPATH"] = str(here / "python")
            elif command == "kill $!":
                server.terminate()
                server.wait()
            elif command.endswith(" &"):
                server = subprocess.Popen(command[:-2].split(), cwd=here, stdout=subprocess.PIPE, text=True)
                while not (line := server.stdout.readline()).startswith("policy server ready: "):
                    assert line, "the server ended"
            else:
                subprocess.run(command.split(), cwd=here, check=True)
    finally:
        if server:
            server.kill()

    episodes = {
        name: [json.loads(line) for line in (here / "runs" / name / "episodes.jsonl").read_text().splitlines()]
        for name in ("demonstrations", "early", "late")
    }
    successes = {name: sum(e["metrics"].get("success", 0) for e in lines) for name, lines in episodes.items()}
    print(successes)
    assert [e["seed"] for e in episodes["early"]] == [e["seed"] for e in episodes["late"]]
    assert not {e["seed"] for e in episodes["late"]} & {e["seed"] for e in episodes["demonstrations"]}
    assert len(episodes["late"]) == 20 and successes["late"] > successes["early"], successes
    # Each failure has a reason, and the report states it.
    reasons = {e["failure_reason"] for e in episodes["early"] if not e["metrics"].get("success")}
    report = (here / "runs/early.html").read_text()
    assert reasons and all(reason in report or reason.replace("_", " ") in report for reason in reasons), reasons
print("the tutorial holds")
