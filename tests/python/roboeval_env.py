"""RoboEval's own environment, controlled by the logs of evalbus. Plays recorded actions in it or sets recorded
states."""

import argparse
import contextlib
import importlib
import io
import json
import pathlib

import numpy as np
import yaml

from evalbus import read_log

# For each family, its module in roboeval.envs and its objects by the names of evalbus's scene parts.
_FAMILIES = {
    "lift_pot": ("lift_pot", {"pot": lambda env: env.kitchenpot}),
    "stack_two_blocks": (
        "manipulation",
        {"red_cube": lambda env: env.blocks[0], "blue_cube": lambda env: env.blocks[1]},
    ),
    "cube_handover": ("manipulation", {"rod": lambda env: env.cube}),
    "rotate_valve": (
        "rotate_utility_objects",
        {
            "first_valve": lambda env: env.valves[0],
            "second_valve": lambda env: env.valves[1],
            "obstacle": lambda env: env.obstacle,
        },
    ),
    "pack_box": ("pack_objects", {"box": lambda env: env.packing_box}),
    "lift_tray": ("lift_tray", {"tray": lambda env: env.breakfast_tray}),
    "pick_single_book_from_table": ("stack_books", {"book": lambda env: env.books[0]}),
    "stack_single_book_shelf": ("stack_books", {"book": lambda env: env.books[0]}),
}
FAMILIES = list(_FAMILIES)
# Orientation (w, x, y, z) of RoboEval's frame of a part in our own scene part's frame, if they differ.
_TURNS = {"tray": (0.5, 0.5, 0.5, 0.5)}
# Simulated time for which the last action is held after evalbus's episode has ended, because contacts may come later.
_GRACE_S = 1


def _quietly(function, *args, **kwargs):
    with contextlib.redirect_stdout(io.StringIO()):
        return function(*args, **kwargs)


def _product(a, b):
    """Returns the product of two quaternions (w, x, y, z)."""
    vector = a[0] * np.array(b[1:]) + b[0] * np.array(a[1:]) + np.cross(a[1:], b[1:])
    return np.concatenate([[a[0] * b[0] - np.dot(a[1:], b[1:])], vector])


def argument_parser():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("roboeval", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--families", default=",".join(FAMILIES))
    return parser


class Episode:
    """An episode that evalbus recorded."""

    def __init__(self, folder):
        log = read_log(next(folder.glob("events.lcmlog*")))
        model = log["EVALBUS_MODEL"]
        self.number = int(folder.name)
        self.bodies = list(model["body_name"][0])
        self.joint_at = dict(zip(model["joint_name"][0], model["joint_qpos_index"][0]))
        self.states = log["EVALBUS_STATE"]
        self.num_ticks = len(self.states["header"]["tick"])
        actions = log["EVALBUS_ACTION"]
        values = np.concatenate([actions["joint_position_rad"], actions["gripper_closing"]], axis=1)
        self.actions = dict(zip(actions["header"]["tick"], values))
        # PARTIAL of each tick, without repeated messages.
        partial = log["EVALBUS_PARTIAL"]
        at = np.unique(partial["header"]["tick"], return_index=True)[1]
        self.stages = np.asarray(partial["metrics"]["stage_reached"], dtype=bool)[at]
        self.successes = np.asarray(partial["verdict"])[at] == 1
        self.distances = np.asarray(partial["metrics"]["target_distance_m"])[at]
        self.pose_errors = np.asarray(partial["metrics"]["object_pose_error_rad"])[at]

    def pose(self, tick, part):
        body = self.states["body"]
        at = self.bodies.index(part)
        return body["position_m"][tick, at], body["quat_wxyz"][tick, at]

    def joint(self, tick, name):
        return self.states["qpos_mixed"][tick, self.joint_at[name]]


class Environment:
    """RoboEval's environment of the task of a run."""

    def __init__(self, run):
        from roboeval.action_modes import JointPositionActionMode

        info = json.loads((run / "run.json").read_text())
        self.family = info["task"].removeprefix("roboeval_")
        self.is_own_scene = self.family == info["task"]
        self.variation = info["variation"]
        task_file = info["task_path"].partition(".yaml")[0] + ".yaml"
        with open(task_file, encoding="utf-8") as stream:
            name = yaml.safe_load(stream)["variations"][self.variation]["alias"]
        # RotateValve's physics step is 1 ms, but RoboEval makes as many steps per action as with 2 ms.
        self.control_hz = info["control_hz"]
        hz = self.control_hz / 2 if self.family == "rotate_valve" else self.control_hz
        module, self.objects = _FAMILIES[self.family]
        make = getattr(importlib.import_module("roboeval.envs." + module), name)
        mode = JointPositionActionMode(absolute=True, floating_base=True, floating_dofs=[])
        self.env = _quietly(make, action_mode=mode, control_frequency=round(hz))
        self.episodes = [Episode(folder) for folder in sorted((run / "episodes").glob("*")) if folder.name.isdigit()]

    def close(self):
        self.env.close()

    def _joints_of(self, part):
        """Returns RoboEval's joints of an object by evalbus's names."""
        prop = self.objects[part](self.env)
        joints = getattr(prop, "_joints", [])
        return {f"{part}/{joint.mjcf.name}": joint.mjcf for joint in joints if joint.mjcf.tag == "joint"}

    def _poses(self, episode, tick):
        """Yields part, RoboEval's body, and the body's position and orientation in the episode."""
        for part, prop in self.objects.items():
            if part not in episode.bodies:
                continue
            position, quaternion = episode.pose(tick, part)
            if self.is_own_scene and part in _TURNS:
                quaternion = _product(quaternion, _TURNS[part])
            yield part, prop(self.env).body, position, quaternion

    def place_objects(self, episode, tick):
        physics = self.env.mojo.physics
        for part, body, position, quaternion in self._poses(episode, tick):
            body.set_position(position, True)
            body.set_quaternion(quaternion, True)
            for name, joint in self._joints_of(part).items():
                if name in episode.joint_at:
                    physics.bind(joint).qpos = episode.joint(tick, name)

    def start_difference(self, episode, seed):
        """Returns an object's largest distance (m) and rotation (rad) after reset(seed=SEED) from its initial pose in
        the episode."""
        _quietly(self.env.reset, seed=seed)
        distance = rotation = 0
        for _, body, position, quaternion in self._poses(episode, 0):
            distance = max(distance, np.linalg.norm(body.get_position() - position))
            other = body.get_quaternion() / np.linalg.norm(body.get_quaternion())
            # The chord keeps the precision that the cosine of the angle loses.
            chord = min(np.linalg.norm(other - quaternion), np.linalg.norm(other + quaternion))
            rotation = max(rotation, 4 * np.arcsin(chord / 2))
        return distance, rotation

    def _robot_joints(self):
        """Returns the robot's joints by evalbus's names, with their indices in RoboEval."""
        model, joints = self.env.mojo.physics.model, {}
        for index in range(model.njnt):
            name = model.id2name(index, "joint")
            side = "left" if "nohand_left" in name else "right" if "nohand_right" in name else None
            if side:
                own = name.split("/")[-1]
                joints[index] = f"{side}/hand/{own}" if "finger" in own else f"{side}/{own}"
        return joints

    def _set_state(self, episode, tick, joints):
        physics = self.env.mojo.physics
        for index, name in joints.items():
            physics.data.qpos[physics.model.jnt_qposadr[index]] = episode.joint(tick, name)
        self.place_objects(episode, tick)
        physics.forward()

    def images(self, episode, tick, cameras, size):
        """Returns the images of RoboEval's cameras for a recorded state, as (size, size, 3) arrays of 0 to 255 by
        camera."""
        import mujoco

        _quietly(self.env.reset, seed=0)
        self._set_state(episode, tick, self._robot_joints())
        physics = self.env.mojo.physics
        names = {physics.model.id2name(k, "camera").split("/")[-1]: k for k in range(physics.model.ncam)}
        renderer = mujoco.Renderer(physics.model.ptr, size, size)
        result = {}
        for camera in cameras:
            renderer.update_scene(physics.data.ptr, camera=names[camera])
            result[camera] = renderer.render()
        renderer.close()
        return result

    def object_position(self, part):
        return np.asarray(self.objects[part](self.env).body.get_position())

    def stages(self, number):
        return [self.env.get_metric_stage(stage + 1) for stage in range(number)]

    def reset(self, episode):
        """Sets the initial state of the episode."""
        _quietly(self.env.reset, seed=0)
        self.place_objects(episode, 0)
        self.env.mojo.physics.forward()

    def step(self, action):
        """Returns whether the episode has ended."""
        *_, terminated, truncated, _ = _quietly(self.env.step, action)
        return terminated or truncated

    def _update_positions(self):
        """After a step, RoboEval has the positions before its last physics step, and evalbus has the positions after
        it."""
        import mujoco

        physics = self.env.mojo.physics
        mujoco.mj_kinematics(physics.model.ptr, physics.data.ptr)

    def play(self, episode):
        """Plays the episode's actions from its initial state. Returns the verdicts of evalbus and RoboEval."""
        self.reset(episode)
        distances, success_tick, last, tick = [], None, max(episode.actions), 0
        for tick in range(last + 1 + round(_GRACE_S * self.control_hz)):
            *_, terminated, _, info = _quietly(self.env.step, episode.actions[min(tick, last)])
            if tick < min(last, episode.num_ticks - 1):
                self._update_positions()
                there = [gripper.wrist_position for gripper in self.env.robot.grippers.values()]
                here = episode.states["arm"]["wrist_position_m"][tick + 1]
                distances.append(np.linalg.norm(here - np.array(there), axis=-1))
            if terminated:
                success_tick = tick + 1 if info["task_success"] else None
                break
        self._update_positions()
        end = min(tick + 1, episode.num_ticks - 1)
        ours = episode.stages[-1].tolist()
        return {
            "family": self.family,
            "variation": self.variation,
            "episode": episode.number,
            "success": bool(episode.successes[-1]),
            "success_roboeval": success_tick is not None,
            "success_tick_roboeval": success_tick,
            "ticks": len(episode.actions),
            "stages": ours,
            "stages_roboeval": self.stages(len(ours)),
            "wrist_rms_m": float(np.sqrt(np.mean(np.square(distances)))),
            "object_end_m": {
                part: float(np.linalg.norm(episode.pose(end, part)[0] - self.object_position(part)))
                for part in self.objects
                if part in episode.bodies
            },
        }

    def judge_states(self, episode):
        """Sets all recorded states. Returns for how many RoboEval's verdict differs, and the largest differences.

        Every tick counts, because a stage that is reached at one tick stays reached.
        """
        physics = self.env.mojo.physics
        env = self.env
        _quietly(env.reset, seed=0)
        self.place_objects(episode, 0)
        # RoboEval stores these values at the beginning of an episode.
        if hasattr(env, "initial_gripper"):
            env.initial_gripper = None
        joints = self._robot_joints()
        counts = {"states": 0, "success": 0, "stages": 0}
        largest = {"distance_m": 0.0, "pose_error_rad": 0.0}
        for tick in range(min(episode.num_ticks, len(episode.stages))):
            self._set_state(episode, tick, joints)
            success = bool(_quietly(env._success))
            counts["states"] += 1
            counts["success"] += int(success != episode.successes[tick])
            counts["stages"] += self.stages(episode.stages.shape[1]) != episode.stages[tick].tolist()
            metrics = env._final_metrics
            theirs = metrics.get("target_distance", {})
            if theirs:
                # RoboEval's distances have different names and a different order, so sorted values are compared.
                difference = np.sort(list(theirs.values())) - np.sort(episode.distances[tick])
                largest["distance_m"] = max(largest["distance_m"], float(np.abs(difference).max()))
            if episode.pose_errors.shape[1]:
                difference = abs(metrics["object_pose_error"] - episode.pose_errors[tick, 0])
                largest["pose_error_rad"] = max(largest["pose_error_rad"], float(difference))
        return counts, largest
