"""Compares evalbus's episodes with RoboEval's own environment (scripts/interop roboeval).

usage: PYTHON roboeval_test.py BIN ROBOEVAL OUT [--episodes N] [--families A,B] [--policies A,B] [--engine VERSION]
    [--scenes own,2.2,engine] [--native]

Runs policies in evalbus's scenes. Plays their commands in RoboEval's scenes (composed by evalbus, with MuJoCo 2.2 and
with VERSION) and in RoboEval's environment. Prints how often verdicts and stages are equal. Exit code 1 if RoboEval's
scenes in evalbus have other verdicts than allowed, or if the verdict on a recorded state differs. --scenes selects from
evalbus's own scenes and RoboEval's with 2.2 and with VERSION. With --native, the policies act in RoboEval's scenes
themselves.
"""

import json
import subprocess
import sys

import numpy as np

import roboeval_env

_POLICIES = "expert,noisy_expert,flawed_expert:miss,flawed_expert:slip,flawed_expert:early"
# Smallest allowed fraction of equal verdicts, with MuJoCo 2.2 and with RoboEval's version.
_LEAST = {"2.2": 0.97, "engine": 0.99}


def main():
    parser = roboeval_env.argument_parser()
    parser.add_argument("--episodes", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--variation", default="position_and_orientation")
    parser.add_argument("--policies", default=_POLICIES)
    parser.add_argument("--engine", default="3.3.3")
    parser.add_argument("--scenes")
    parser.add_argument("--native", action="store_true")
    args = parser.parse_args()
    scenes = (args.scenes or ("engine" if args.native else "own,2.2,engine")).split(",")
    if args.native and "own" in scenes:
        parser.error("--native: expected --scenes without own")
    rows, states = [], []
    for family in args.families.split(","):
        for policy in args.policies.split(","):
            for scene in scenes:
                run = evaluate(args, family, policy, scene)
                rows += compare(run, scene, policy, states)
    (args.out / "roboeval.json").write_text(json.dumps({"episodes": rows, "states": states}, indent=1))
    summarize(rows)
    return (report_states(states) if states else 0) + report_verdicts(rows)


def evaluate(args, family, policy, scene):
    """Returns the folder of a run: of the policy in our own scene, or of the same commands in RoboEval's scene."""
    # RotateValve's actions last 25 ms in RoboEval.
    hz = 40 if family == "rotate_valve" else 20
    name = f"{family}-{policy.split(':')[-1]}"
    own, run = args.out / "own" / name, args.out / scene / name
    if (run / "summary.json").exists():
        return run
    command = [args.bin / "evalbus", "run", "--control-hz", str(hz), "--seed", str(args.seed)]
    command += ["--episodes", str(args.episodes), "--out", run]
    if scene == "own":
        command += [f"{family}/{args.variation}", "--policy", policy, "--in-process"]
    else:
        command += [f"roboeval/{family}/{args.variation}", "--assets", f"roboeval={args.roboeval}"]
        command += ["--policy", policy if args.native else f"replay_anyway:{own}"]
        command += ["--engine", args.engine] if scene == "engine" else ["--in-process"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return run


def compare(run, scene, policy, states):
    environment = roboeval_env.Environment(run)
    rows = []
    for episode in environment.episodes:
        rows.append({"scene": scene, "policy": policy} | environment.play(episode))
        if scene == "engine":
            counts, largest = environment.judge_states(episode)
            states.append({"family": environment.family, "policy": policy} | counts | largest)
    environment.close()
    own = [row["success"] for row in rows]
    theirs = [row["success_roboeval"] for row in rows]
    print(f"{scene:7} {run.name:45} evalbus {sum(own):3}, RoboEval {sum(theirs):3} of {len(rows)}", flush=True)
    return rows


def equal(rows, what):
    return np.mean([row[what] == row[what + "_roboeval"] for row in rows])


def summarize(rows):
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    cell = max(10, 16 // len(scenes))
    titles = ["equal verdicts", "equal stages", "wrists, mm rms"]
    print(f"\n{'':30}" + "".join(f"{title:>{cell * len(scenes)}}" for title in titles))
    print(f"{'family':30}" + len(titles) * "".join(f"{scene:>{cell}}" for scene in scenes))
    for family in [*dict.fromkeys(row["family"] for row in rows), "all"]:
        chosen = [row for row in rows if family in ("all", row["family"])]
        groups = [[row for row in chosen if row["scene"] == scene] for scene in scenes]
        line = [f"{equal(group, what):{cell}.1%}" for what in ("success", "stages") for group in groups]
        line += [f"{1e3 * np.sqrt(np.mean([row['wrist_rms_m'] ** 2 for row in group])):{cell}.2f}" for group in groups]
        print(f"{family:30}" + "".join(line))
    print("\nepisodes with all objects within 5 mm of RoboEval's at the end; median of the largest distance, mm")
    for family in [*dict.fromkeys(row["family"] for row in rows), "all"]:
        line = ""
        for scene in scenes:
            chosen = [row for row in rows if row["scene"] == scene and family in ("all", row["family"])]
            distances = np.array([max(row["object_end_m"].values()) for row in chosen])
            line += f"{scene:>10}{np.mean(distances < 0.005):10.1%}{1e3 * np.median(distances):10.2f}"
        print(f"{family:30}{line}")


def report_verdicts(rows):
    failed = 0
    for scene, least in _LEAST.items():
        chosen = [row for row in rows if row["scene"] == scene]
        if chosen and (fraction := equal(chosen, "success")) < least:
            print(f"error: {fraction:.1%} equal verdicts with {scene}, expected {least:.0%}")
            failed = 1
    return failed


def report_states(states):
    print("\nstates set into RoboEval's environment")
    failed = 0
    for family in dict.fromkeys(row["family"] for row in states):
        own = [row for row in states if row["family"] == family]
        number = sum(row["states"] for row in own)
        others = {what: sum(row[what] for row in own) for what in ("success", "stages")}
        distance = max(row["distance_m"] for row in own)
        pose = max(row["pose_error_rad"] for row in own)
        print(
            f"{family:30}{number:6} states; judged otherwise: success {others['success']}, stages {others['stages']}; "
            f"largest difference {distance:.1e} m, {pose:.1e} rad"
        )
        failed |= others["success"] + others["stages"] > 0
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
