"""Converts a run of evalbus to a LeRobot dataset with LeRobot's own writer (pip install lerobot h5py).

    evalbus run lift_pot/position --control-hz 20 --policy expert --episodes 20 --out RUN
    evalbus export RUN --hdf5 set.hdf5 --successes --camera roboeval/head,roboeval/left_wrist,roboeval/right_wrist
    python3 python/examples/to_lerobot.py set.hdf5 --repo-id me/lift_pot --out DATASET

LeRobot 0.4 writes dataset format v3.0, LeRobot 0.3 writes v2.1. `observation.state` and `action` contain the joints of
all arms (rad), then all grippers (state: 1 open; action: 1 closed). For two Pandas, names and order match the public
LeRobot conversion of RoboEval, 16 numbers each: left_joint1..7, right_joint1..7, left_gripper, right_gripper; for one
Panda they are arm_joint1..7 and arm_gripper. Images: `observation.images.head`, ...; task: "INSTRUCTION; VARIATION".
"""
import argparse
import inspect
import json

import h5py
import numpy as np


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("hdf5", help="of evalbus export --hdf5")
    parser.add_argument("--out", required=True, help="folder to write")
    parser.add_argument("--repo-id", default="evalbus/run")
    options = parser.parse_args()
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    with h5py.File(options.hdf5, "r") as file:
        about = json.loads(file["data"].attrs["env_args"])
        kwargs = about["env_kwargs"]
        demos = sorted(file["data"], key=lambda name: int(name.split("_")[1]))
        first = file["data"][demos[0]]
        names = [f"{arm}_joint{k + 1}" for arm, joints in kwargs["num_joints"].items() for k in range(joints)]
        names += [f"{gripper}_gripper" for gripper in kwargs["grippers"]]
        images = {
            key: "observation.images." + key.removeprefix("roboeval_").removesuffix("_image")
            for key in first["obs"]
            if key.endswith("_image")
        }
        vector = {"dtype": "float32", "shape": (len(names),), "names": names}
        features = {"observation.state": vector, "action": vector}
        for key, name in images.items():
            shape = first["obs"][key].shape[1:]
            features[name] = {"dtype": "video", "shape": shape, "names": ["height", "width", "channels"]}
        dataset = LeRobotDataset.create(
            options.repo_id,
            fps=round(kwargs["control_hz"]),
            features=features,
            root=options.out,
            robot_type=kwargs["robot"],
            use_videos=True,
        )
        task = f"{kwargs['instruction'] or about['env_name']}; {kwargs['variation']}"
        # Before LeRobot 0.4, the task is an argument; since then it is a part of the frame.
        is_argument = "task" in inspect.signature(dataset.add_frame).parameters
        for name in demos:
            demo = file["data"][name]
            state = np.hstack([demo["obs/joint_position"][:], demo["obs/gripper_opening"][:]]).astype("f4")
            action = demo["actions_raw"][:].astype("f4")
            for step in range(len(action)):
                frame = {"observation.state": state[step], "action": action[step]}
                frame |= {name: demo["obs"][key][step] for key, name in images.items()}
                dataset.add_frame(frame, task=task) if is_argument else dataset.add_frame({**frame, "task": task})
            dataset.save_episode()
        # Exists only in versions that write several episodes into one file.
        if hasattr(dataset, "finalize"):
            dataset.finalize()


if __name__ == "__main__":
    main()
