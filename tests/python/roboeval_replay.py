"""Plays the actions of recorded evalbus runs in RoboEval's own environment, and compares verdicts, stages and motion.

usage: PYTHON roboeval_replay.py ROBOEVAL RUN... [--compensate] [--json FILE]

ROBOEVAL: a checkout of https://github.com/Robo-Eval/RoboEval with its submodule. PYTHON can import it. Each episode
starts from the start poses in evalbus's log. --compensate: also with gravity compensation in RoboEval, which shows how
much of a difference it explains. Exit code 0; the figures are judged by the caller.
"""

import argparse
import contextlib
import importlib
import io
import json
import pathlib
import sys

import numpy as np

# Names of RoboEval's attributes that hold the objects of a family.
_OBJECTS = {
    "lift_pot": {"pot": lambda env: env.kitchenpot.body},
    "stack_two_blocks": {"red_cube": lambda env: env.blocks[0].body, "blue_cube": lambda env: env.blocks[1].body},
    "cube_handover": {"rod": lambda env: env.cube.body},
    "rotate_valve": {
        "first_valve": lambda env: env.valves[0].body,
        "second_valve": lambda env: env.valves[1].body,
        "obstacle": lambda env: env.obstacle.body,
    },
    "pack_box": {"box": lambda env: env.packing_box.body},
    "lift_tray": {"tray": lambda env: env.breakfast_tray.body},
    "pick_single_book_from_table": {"book": lambda env: env.books[0].body},
    "stack_single_book_shelf": {"book": lambda env: env.books[0].body},
}
_GRACE_S = 1
_MODULES = {
    "lift_pot": "lift_pot",
    "stack_two_blocks": "manipulation",
    "cube_handover": "manipulation",
    "rotate_valve": "rotate_utility_objects",
    "pack_box": "pack_objects",
    "lift_tray": "lift_tray",
    "pick_single_book_from_table": "stack_books",
    "stack_single_book_shelf": "stack_books",
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("roboeval", type=pathlib.Path)
    parser.add_argument("runs", type=pathlib.Path, nargs="+")
    parser.add_argument("--compensate", action="store_true")
    parser.add_argument("--json", type=pathlib.Path)
    args = parser.parse_args()
    sys.path.insert(0, str(args.roboeval))
    rows = []
    for run in args.runs:
        rows += compare(run, args.compensate)
    summarize(rows)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1))


def compare(run, compensate):
    """Plays every episode of a run; returns one row for each."""
    from evalbus import read_log  # imported here so that --help works without it

    info = json.loads((run / "run.json").read_text())
    family = info["task"].removeprefix("roboeval_")
    environment = make_environment(family, alias_of(info), info["control_hz"])
    rows = []
    for folder in sorted((run / "episodes").glob("*")):
        log = read_log(next(folder.glob("events.lcmlog*")))
        row = {"run": run.name, "family": family, "variation": info["variation"], "episode": int(folder.name)}
        row |= play(environment, family, log, compensate, info["control_hz"])
        print(json.dumps(row), flush=True)
        rows.append(row)
    environment.close()
    return rows


def alias_of(info):
    import yaml

    task = yaml.safe_load(pathlib.Path(info["task_path"].split(".yaml")[0] + ".yaml").read_text())
    return task["variations"][info["variation"]]["alias"]


def make_environment(family, name, control_hz):
    from roboeval.action_modes import JointPositionActionMode

    module = importlib.import_module("roboeval.envs." + _MODULES[family])
    # RotateValve's physics step is 1 ms, but RoboEval makes as many steps for an action as with 2 ms.
    hz = control_hz / 2 if family == "rotate_valve" else control_hz
    mode = JointPositionActionMode(absolute=True, floating_base=True, floating_dofs=[])
    return getattr(module, name)(action_mode=mode, control_frequency=int(round(hz)))


def play(environment, family, log, compensate, hz):
    model = log["EVALBUS_MODEL"]
    states, actions, partial = log["EVALBUS_STATE"], log["EVALBUS_ACTION"], log["EVALBUS_PARTIAL"]
    names = list(model["body_name"][0])
    joint_names = list(model["joint_name"][0])
    index = dict(zip(actions["header"]["tick"], range(len(actions["header"]["tick"]))))
    with contextlib.redirect_stdout(io.StringIO()):
        environment.reset(seed=0)
    physics = environment.mojo.physics
    for part, body in _OBJECTS[family].items():
        if part not in names:
            continue
        pose = states["body"]
        at = names.index(part)
        with contextlib.suppress(AttributeError):
            body(environment).set_position(pose["position_m"][0, at], True)
            body(environment).set_quaternion(pose["quat_wxyz"][0, at], True)
    for part, prop in articulated(environment, family).items():
        for name, joint in prop.items():
            q = states["qpos_mixed"][0, model["joint_qpos_index"][0][joint_names.index(f"{part}/{name}")]]
            physics.bind(joint.mjcf).qpos = q
    if compensate:
        model_ptr = physics.model.ptr
        for body in range(model_ptr.nbody):
            if "panda" in physics.model.id2name(body, "body"):
                model_ptr.body_gravcomp[body] = 1
        model_ptr.ngravcomp = model_ptr.nbody
    physics.forward()
    wrists, success_tick, stages = [], None, {}
    last = max(index)
    for tick in range(last + 1 + round(_GRACE_S * hz)):
        # After the end of evalbus's episode its last action is held: contacts can come or go a little later.
        i = index[min(tick, last)]
        action = np.concatenate([actions["joint_position_rad"][i], actions["gripper_closing"][i]]).astype(np.float32)
        with contextlib.redirect_stdout(io.StringIO()):
            _, _, terminated, _, info = environment.step(action)
        if tick < last and tick + 1 < len(states["header"]["tick"]):
            here = states["arm"]["wrist_position_m"][tick + 1]
            there = np.array([environment.robot.grippers[side].wrist_position for side in environment.robot.grippers])
            wrists.append(np.linalg.norm(here - there, axis=-1))
        stages = {int(k): bool(v) for k, v in info.get("task_stage_reached", {}).items()}
        if terminated:
            success_tick = tick + 1 if info["task_success"] else None
            break
    metrics = partial["metrics"]
    ours = [bool(reached) for reached in metrics["stage_reached"][-1]]
    theirs = [stages.get(k + 1, False) for k in range(len(ours))]
    distance = {}
    for part, body in _OBJECTS[family].items():
        if part in names:
            there = np.asarray(body(environment).get_position())
            distance[part] = float(np.linalg.norm(states["body"]["position_m"][min(tick + 1, len(states["body"]["position_m"]) - 1), names.index(part)] - there))
    wrists = np.array(wrists)
    return {
        "success": int(partial["verdict"][-1]) == 1,
        "success_roboeval": success_tick is not None,
        "ticks": int(len(index)),
        "success_tick_roboeval": success_tick,
        "stages": ours,
        "stages_roboeval": theirs,
        "wrist_rms_m": float(np.sqrt((wrists**2).mean())) if wrists.size else None,
        "wrist_max_m": float(wrists.max()) if wrists.size else None,
        "object_end_m": distance,
    }


def articulated(environment, family):
    """Joints of objects whose start positions a task sets: part -> joint name in evalbus -> RoboEval's joint."""
    if family == "pack_box":
        prop = environment.packing_box
        return {"box": {joint.mjcf.name: joint for joint in prop._joints}}
    return {}


def summarize(rows):
    print()
    print(f"{'family':30} {'episodes':>8} {'evalbus':>8} {'RoboEval':>8} {'verdicts':>9} {'stages':>7}  wrists rms, mm")
    for family in [*dict.fromkeys(row["family"] for row in rows), None]:
        own = [row for row in rows if family in (None, row["family"])]
        verdicts = np.mean([row["success"] == row["success_roboeval"] for row in own])
        stages = np.mean([row["stages"] == row["stages_roboeval"] for row in own])
        rms = np.sqrt(np.mean([row["wrist_rms_m"] ** 2 for row in own if row["wrist_rms_m"] is not None]))
        print(
            f"{family or 'all':30} {len(own):8} {sum(row['success'] for row in own):8} "
            f"{sum(row['success_roboeval'] for row in own):8} {verdicts:9.0%} {stages:7.0%}  {1000 * rms:.1f}"
        )


if __name__ == "__main__":
    main()
