#!/usr/bin/python3
"""How much the noise of a recording changes each metric: docs/watch.md has the table.

    PYTHONPATH=python /usr/bin/python3 tests/bench/recording_noise.py [EPISODES]

Simulates episodes of lift_pot/position with noisy_expert at 50 Hz. Records their joints, gripper openings and
the pose of the pot as a robot would, with jitter of the timestamps, with noisy or coarse encoders, or at half
the rate. Scores the recordings with evalbus score, which uses the same rule of ticks as evalbus watch.
Prints, for each metric, the largest relative error over the episodes; 1 is twice as large.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from evalbus import events, read_log

PROGRAM = pathlib.Path(__file__).resolve().parents[2] / "build" / "bin" / "evalbus"
EPISODES = int(sys.argv[1]) if len(sys.argv) > 1 else 8
HZ = 50

DISTURBANCES = {
    "exact samples": lambda time, joints, random: (time, joints),
    "stamps 2 ms": lambda time, joints, random: (
        np.maximum.accumulate(time + random.normal(0, 2e-3, len(time)) + np.arange(len(time)) * 1e-9), joints),
    "encoder noise 1e-4 rad": lambda time, joints, random: (time, joints + random.normal(0, 1e-4, joints.shape)),
    "rounded to 1e-3 rad": lambda time, joints, random: (time, np.round(joints, 3)),
    "25 Hz": lambda time, joints, random: (time[::2], joints[::2]),
}
# If a row covers several numbers, it shows the largest error.
ROWS = {
    "wrist path, joint path": ["metrics.total_cartesian_path_length", "metrics.total_joint_path_length"],
    "wrist jerk, rms; joint jerk, rms": ["metrics.overall_rms_cartesian_jerk", "metrics.overall_rms_joint_jerk"],
    "log dimensionless jerk": ["extended.log_dimensionless_jerk.left", "extended.log_dimensionless_jerk.right"],
    "spectral arc length": ["extended.spectral_arc_length.left", "extended.spectral_arc_length.right"],
    "peak wrist acceleration": ["extended.peak_wrist_acceleration_mps2.left",
                                "extended.peak_wrist_acceleration_mps2.right"],
    "peak wrist speed": ["extended.peak_wrist_speed_mps.left", "extended.peak_wrist_speed_mps.right"],
    "arm speed difference": ["metrics.bimanual_arm_velocity_difference"],
    "gripper height difference": ["metrics.bimanual_gripper_vertical_difference"],
    "smallest clearance": ["extended.min_clearance_m"],
    "deepest penetration": ["extended.peak_penetration_m"],
    "completion time": ["metrics.completion_time"],
}


def evalbus(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def recorded(log):
    """Returns joint names, time (T,), joints (T, n), gripper openings (T, 2) and pose of the pot (T, 7)."""
    state = read_log(log)["EVALBUS_STATE"]
    model = next(message for _, channel, message in events(log) if channel == "EVALBUS_MODEL")
    names = [name for arm in model["arm"] for name in model["joint_name"]
             if name.startswith(arm["name"] + "/joint")]
    joints = state["qpos_mixed"][:, [model["joint_qpos_index"][model["joint_name"].index(n)] for n in names]]
    pot = model["body_name"].index("pot")
    pose = np.concatenate([state["body"]["position_m"][:, pot], state["body"]["quat_wxyz"][:, pot]], axis=1)
    return names, state["header"]["sim_time_us"] / 1e6, joints, state["gripper"]["opening"], pose


def lines(run):
    return [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]


def number(line, name):
    for key in name.split("."):
        line = line[key]
    return line


def main():
    table, ended_otherwise = {row: {} for row in ROWS}, {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        evalbus("run", "lift_pot/position", "--policy", "noisy_expert", "--episodes", EPISODES, "--control-hz", HZ,
                "--in-process", "--out", folder / "run")
        truth = lines(folder / "run")
        recordings = [recorded(folder / "run" / "episodes" / f"{i:04}" / "events.lcmlog") for i in range(EPISODES)]
        names = recordings[0][0]
        yaml = {"task": "lift_pot/position", "control_hz": HZ, "time": {"column": "t", "unit": "s"},
                "joints": {"unit": "rad", "columns": {name: f"q{k}" for k, name in enumerate(names)}},
                "grippers": {"left": {"column": "left", "open": 1, "closed": 0},
                             "right": {"column": "right", "open": 1, "closed": 0}},
                "objects": {"pot": {"position_m": ["x", "y", "z"], "quaternion_wxyz": ["a", "b", "c", "d"]}}}
        (folder / "map.yaml").write_text(json.dumps(yaml))  # JSON is valid YAML
        for column, disturb in DISTURBANCES.items():
            random = np.random.default_rng(1)
            data = folder / column.replace(" ", "_")
            data.mkdir()
            for i, (_, time, joints, openings, pose) in enumerate(recordings):
                stamps, measured = disturb(time, joints, random)
                step = round(len(time) / len(stamps))
                with open(data / f"{i:04}.csv", "w", newline="") as file:
                    out = csv.writer(file)
                    out.writerow(["t", *(f"q{k}" for k in range(len(names))), "left", "right", *"xyzabcd"])
                    out.writerows(np.column_stack([stamps, measured, openings[::step], pose[::step]]).tolist())
            evalbus("score", folder / "map.yaml", data, "--out", folder / f"scored_{data.name}")
            pairs = list(zip(truth, lines(folder / f"scored_{data.name}")))
            ended_otherwise[column] = sum(a["end_reason"] != b["end_reason"] for a, b in pairs)
            for row, members in ROWS.items():
                table[row][column] = max(abs(number(b, m) - number(a, m)) / abs(number(a, m))
                                         for a, b in pairs for m in members)
    print("| metric | " + " | ".join(DISTURBANCES) + " |")
    print("|---" * (len(DISTURBANCES) + 1) + "|")
    for row, cells in table.items():
        print(f"| {row} | " + " | ".join(f"{cells[c]:.1g}" for c in DISTURBANCES) + " |")
    print("| episodes that end otherwise | " + " | ".join(str(ended_otherwise[c]) for c in DISTURBANCES) + " |")


main()
