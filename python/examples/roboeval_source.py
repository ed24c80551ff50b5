"""RoboEval's environment as a source for `evalbus watch`: plays the actions of recorded episodes in it.

    evalbus run lift_pot --policy noisy_expert:0.02 --control-hz 20 --episodes 5 --out runs/a
    evalbus watch lift_pot --hz 20 --contacts source --episodes 5 --out runs/b &
    PYTHONPATH=python:ROBOEVAL python3 python/examples/roboeval_source.py runs/a lift_pot.LiftPot 'pot=partnet_*' \\
        left_cabinet=base_cabinet_600_1 right_cabinet=base_cabinet_600

Arguments: the run; module and class of RoboEval's environment; for each object and fixture of evalbus' scene the name
of RoboEval's model, in which * matches any text. Prints RoboEval's verdict and stages. See docs/watch.md.
"""

import argparse
import fnmatch
import importlib
import pathlib
import re

import numpy as np
import roboeval.action_modes

import evalbus
from evalbus.source import Source

HOLD_S = 1  # the last action is held for this time


def scene_of(model, parts):
    """Returns the qpos indices of joints and of free objects by evalbus' names, and evalbus' name for each body."""

    def name(theirs):  # "panda nohand_left/panda hand_left/hand" becomes "left/hand/hand"
        ours = re.sub(r"^panda nohand_(left|right)/", r"\1/", re.sub("/panda hand_(left|right)/", "/hand/", theirs))
        root, _, rest = ours.partition("/")
        part = next((our for our, pattern in parts if fnmatch.fnmatch(root, pattern)), root)
        return {"floor": "world", "invisible_base": "world"}.get(part) or "/".join(filter(None, [part, rest]))

    names = {name(model.id2name(k, "joint")): k for k in range(model.njnt)}
    objects = {n: model.jnt_qposadr[k] for n, k in names.items() if model.jnt_type[k] == 0}
    moving = {"left", "right", *objects}
    joints = {n: model.jnt_qposadr[k] for n, k in names.items() if "/" in n and n.split("/")[0] in moving}
    jointed = {n.split("/")[0] for n in joints}
    bodies = [name(model.id2name(body, "body")) for body in range(model.nbody)]
    return joints, objects, [n if n.split("/")[0] in jointed else n.split("/")[0] for n in bodies]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("environment", metavar="MODULE.CLASS")
    parser.add_argument("part", nargs="+", type=lambda text: text.split("=", 1), metavar="NAME=MODEL")
    parser.add_argument("--hz", type=int, default=20, help="RoboEval's control_frequency")
    options = parser.parse_args()
    module, name = options.environment.split(".")
    mode = roboeval.action_modes.JointPositionActionMode(absolute=True, floating_base=True, floating_dofs=[])
    env = getattr(importlib.import_module("roboeval.envs." + module), name)(mode, control_frequency=options.hz)
    env.reset(seed=0)
    model, data = env.mojo.physics.model, env.mojo.physics.data
    joints, objects, bodies = scene_of(model, options.part)
    period_s = model.opt.timestep * env._sub_steps_count
    source = Source("RoboEval", joints, period_s, objects, has_contacts=True)

    def publish(is_last=False):
        poses = [(data.qpos[at : at + 3], data.qpos[at + 3 : at + 7]) for at in objects.values()]
        contacts = [
            (*[bodies[model.geom_bodyid[g]] for g in (c.geom1, c.geom2)], max(0, -c.dist), c.pos, c.frame[:3])
            for c in data.contact
            if c.dist <= 1e-8  # RoboEval's own limit
        ]
        source.publish(data.time, data.qpos[list(joints.values())], poses, is_last=is_last, contacts=contacts)

    source.meet()
    for log in sorted(options.run.glob("episodes/*/events.lcmlog*")):
        commands = evalbus.read_log(log)["EVALBUS_ACTION"]
        actions = np.hstack([commands["joint_position_rad"], commands["gripper_closing"]]).astype(np.float32)
        env.reset(seed=0)
        source.begin_episode()
        publish()
        steps, is_over = 0, False
        while not is_over:
            *_, is_over, _, info = env.step(actions[min(steps, len(actions) - 1)])
            steps += 1
            is_over = bool(is_over) or steps * period_s > len(actions) * period_s + HOLD_S
            publish(is_last=is_over)
        stages = [stage for stage in range(1, 10) if env.get_metric_stage(stage)]
        print(f"{log.parent.name}: success {info['task_success']:g}, stages {stages}, {steps} steps", flush=True)


if __name__ == "__main__":
    main()
