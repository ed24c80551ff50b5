"""Compares the speed of evalbus and RoboEval's own environment (scripts/interop roboeval_speed).

usage: PYTHON roboeval_speed_test.py BIN ROBOEVAL OUT [--families A,B] [--rates HZ,HZ] [--engines 2.2,3.3.3] [--rounds N]

Records episodes of the expert per family and rate. The same commands are then played, alternately, in RoboEval's
environment (env.step, which computes its metrics), in evalbus's own scene, and in RoboEval's scene composed by evalbus,
with its checks, metrics and log. Prints CPU time per control step and ratios, which are medians over the rounds.
The start of programs and environments does not count, so evalbus's time begins with the end of the first episode. Takes
3 minutes.
"""

import json
import os
import pathlib
import shutil
import subprocess
import time

import numpy as np

import roboeval_env

_EPISODES = 6


def processor_s(process):
    """Returns the CPU time that a process and its child processes have used so far, s."""
    children = pathlib.Path(f"/proc/{process}/task/{process}/children").read_text().split()
    ticks = 0
    for each in [str(process), *children]:
        # User and system time are the 12th and 13th values after the name, which is in parentheses.
        values = pathlib.Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
        ticks += int(values[11]) + int(values[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def main():
    parser = roboeval_env.argument_parser()
    parser.add_argument("--rates", default="20,500")
    parser.add_argument("--engines", default="2.2,3.3.3")
    parser.add_argument("--rounds", type=int, default=3)
    parser.set_defaults(families="lift_pot")
    args = parser.parse_args()
    # The first line names the library of engine 2.2, because PyPI's is faster than Debian's.
    doctor = subprocess.run([args.bin / "evalbus", "doctor"], capture_output=True, text=True)
    print(doctor.stdout.splitlines()[0])
    engines = "".join(f"{engine:>12}" for engine in args.engines.split(","))
    print(f"{'':37}RoboEval, times as fast: evalbus's own scene; RoboEval's scene, by engine")
    print(f"{'family':30}{'rate':>7}{'ms/step':>10}{'own':>12}{engines}")
    for family in args.families.split(","):
        for rate in args.rates.split(","):
            measure(args, family, int(rate))


def measure(args, family, rate):
    source = args.out / f"{family}-{rate}"
    if not (source / "summary.json").exists():
        run(args, family, rate, "expert", 1 + _EPISODES, ["--in-process"], source)
    scenes = [(family, ["--in-process"])]
    for engine in args.engines.split(","):
        options = ["--in-process"] if engine == "2.2" else ["--engine", engine]
        scenes.append((f"roboeval/{family}", ["--assets", f"roboeval={args.roboeval}", *options]))
    environment = roboeval_env.Environment(source)
    environment.play(environment.episodes[0])
    times = [
        [roboeval_s(environment), *(evalbus_s(args, task, rate, source, options) for task, options in scenes)]
        for _ in range(args.rounds)
    ]
    environment.close()
    times = np.array(times)
    ratios = np.median(times[:, :1] / times[:, 1:], axis=0)
    print(f"{family:30}{rate:4} Hz{np.median(times[:, 0]) * 1e3:10.2f}" + "".join(f"{x:12.1f}" for x in ratios), flush=True)


def roboeval_s(environment):
    """Returns the CPU time of a step of RoboEval's environment, s."""
    episode = environment.episodes[0]
    environment.reset(episode)
    began = time.process_time()
    for count, tick in enumerate(sorted(episode.actions), 1):
        if environment.step(episode.actions[tick]):
            break
    return (time.process_time() - began) / count


def evalbus_s(args, task, rate, source, options):
    """Returns the CPU time of a control step of evalbus, s, of all its processes, after the first episode."""
    used, steps = run(args, task, rate, f"replay_anyway:{source}", 1 + _EPISODES, options, args.out / "run")
    return (used[-1] - used[0]) / sum(steps[1:])


def run(args, task, rate, policy, episodes, options, out):
    """Returns the CPU time at the end of each episode, and the episodes' numbers of control steps."""
    shutil.rmtree(out, ignore_errors=True)
    command = [args.bin / "evalbus", "run", f"{task}/base", "--policy", policy, "--episodes", str(episodes), "--seed", "1"]
    command += ["--control-hz", str(rate), "--video", "none", "--json", "--out", out, *options]
    with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        used = [processor_s(process.pid) for line in process.stdout if json.loads(line)["event"] == "episode"]
    lines = (out / "episodes.jsonl").read_text().splitlines()
    assert process.returncode == 0 and len(used) == len(lines) == episodes, (command, process.returncode, len(lines))
    return used, [round(json.loads(line)["metrics"]["completion_time"] * rate) for line in lines]


main()
