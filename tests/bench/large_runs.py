#!/usr/bin/env python3
"""Time and memory that evalbus needs for runs of many episodes: docs/performance.md has the figures.

Evaluates a few episodes and makes large runs from them, with other seeds and times, and with the same logs
under other names (hard links). Then measures the time of the commands that read runs.

usage: tests/bench/large_runs.py FOLDER [EPISODES ...]
"""

import copy
import json
import os
import pathlib
import random
import resource
import shutil
import subprocess
import sys
import time

PROGRAM = pathlib.Path(__file__).resolve().parents[2] / "build" / "bin" / "evalbus"


def run(*arguments):
    began = time.monotonic()
    process = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    if code != 0:
        sys.exit(f"evalbus {' '.join(map(str, arguments))}: exit code {code}")
    return time.monotonic() - began, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def episode_seed(info, episode):
    """Computes SeedSource::OfEpisode() of base/random.h."""
    mask = (1 << 64) - 1

    def mix(z):
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return z ^ (z >> 31)

    fnv = 0xCBF29CE484222325
    for byte in "{seed_stream}/{task}/{variation}".format(**info).encode():
        fnv = ((fnv ^ byte) * 0x100000001B3) & mask
    return mix((mix(info["seed"] ^ fnv) + 0x9E3779B97F4A7C15 * (episode + 1)) & mask) >> 11


def episode_folder(run_folder, episode):
    group = [] if episode < 10_000 else [f"{episode // 10_000}xxxx"]
    return run_folder.joinpath("episodes", *group, f"{episode:04}")


def multiply(small, large, count, shift):
    """Makes a run of `count` episodes from a small run."""
    lines = [json.loads(line) for line in (small / "episodes.jsonl").read_text().splitlines()]
    large.mkdir(parents=True)
    shutil.copytree(small / "model", large / "model")
    (large / "logs").mkdir()
    info = json.loads((small / "run.json").read_text())
    info["episodes"] = count
    (large / "run.json").write_text(json.dumps(info, indent=2) + "\n")
    draw = random.Random(shift)
    with open(large / "episodes.jsonl", "w") as out:
        for episode in range(count):
            line = copy.deepcopy(lines[(episode * 7 + shift) % len(lines)])
            source = episode_folder(small, line["episode"])
            line["episode"], line["seed"] = episode, episode_seed(info, episode)
            for key in ("joint_path_length", "cartesian_path_length"):
                if isinstance(line["metrics"].get(key), float):
                    line["metrics"][key] *= draw.uniform(0.9, 1.1)
            folder = episode_folder(large, episode)
            folder.mkdir(parents=True)
            os.link(source / "events.lcmlog", folder / "events.lcmlog")
            text = json.dumps(line, separators=(",", ":"))
            (folder / "summary.json").write_text(text + "\n")
            out.write(text + "\n")


def plan(folder, count):
    """Makes a plan of two policies with `count` episodes, two thirds of which exist as plan shards."""
    file = folder.with_suffix(".yaml")
    file.write_text(f"policies: [expert, noisy_expert]\ntasks: lift_pot/position\nepisodes: {count // 2}\n")
    run("run", file, "--out", folder, "--part", f"{count}/{count}")  # this shard has no episode
    for policy in ("expert", "noisy_expert"):
        for first in range(0, count // 3, 20):
            chunk = folder / "parts" / f"{policy}+lift_pot-position+{first:04}-{first + 19:04}"
            chunk.mkdir()
            (chunk / "run.json").write_text("{}")


def main():
    folder = pathlib.Path(sys.argv[1])
    counts = [int(word) for word in sys.argv[2:]] or [1_000, 10_000, 100_000]
    folder.mkdir(parents=True, exist_ok=True)
    small = folder / "small"
    run("run", "lift_pot/position", "--policy", "noisy_expert", "--episodes", 20, "--in-process", "--out", small)
    print("episodes  command   time s  processor s  memory MB")
    for count in counts:
        a, b = folder / f"a{count}", folder / f"b{count}"
        multiply(small, a, count, 0)
        multiply(small, b, count, 3)
        plan(folder / f"plan{count}", count)
        for command in (
            ("report", a, "--out", folder / "report.html"),
            ("compare", a, b),
            ("export", a, "--csv", folder / f"{count}.csv"),
            ("status", folder / f"plan{count}"),
        ):
            took, processor, memory = run(*command)
            print(f"{count:8}  {command[0]:8} {took:7.2f}  {processor:11.2f}  {memory:9.0f}", flush=True)


if __name__ == "__main__":
    main()
