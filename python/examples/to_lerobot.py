"""A run of evalbus as a LeRobot dataset, with LeRobot's own writer (pip install lerobot), which decides v2.1 or v3.0.

Names and order are those of the public RoboEval conversion: `observation.state` and `action` of 16, left_joint1..7,
right_joint1..7, left_gripper, right_gripper; `observation.images.CAMERA`; task = the instruction.

  evalbus export RUN --hdf5 set.hdf5 --successes --camera head,left_wrist,right_wrist
  python3 to_lerobot.py set.hdf5 --repo-id me/lift_pot --out DATASET
"""
import argparse
import json

import h5py
import numpy as np

NAMES = [f"{arm}_joint{k}" for arm in ("left", "right") for k in range(1, 8)] + ["left_gripper", "right_gripper"]


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
        if first["actions_raw"].shape[1] != 16:
            raise SystemExit("expected two arms with seven joints and a gripper each")
        images = [key for key in first["obs"] if key.endswith("_image")]
        vector = {"dtype": "float32", "shape": (16,), "names": NAMES}
        features = {"observation.state": vector, "action": vector}
        for key in images:
            features["observation.images." + key[: -len("_image")]] = {
                "dtype": "video", "shape": first["obs"][key].shape[1:], "names": ["height", "width", "channels"]}
        dataset = LeRobotDataset.create(options.repo_id, fps=round(kwargs["control_hz"]), features=features,
                                        root=options.out, robot_type=kwargs["robot"], use_videos=True)
        for name in demos:
            demo = file["data"][name]
            state = np.hstack([demo["obs/joint_position"][:], demo["obs/gripper_opening"][:]]).astype("f4")
            action = demo["actions_raw"][:].astype("f4")
            for step in range(len(action)):
                frame = {"observation.state": state[step], "action": action[step]}
                for key in images:
                    frame["observation.images." + key[: -len("_image")]] = demo["obs"][key][step]
                task = kwargs["instruction"] or about["env_name"]
                try:
                    dataset.add_frame({**frame, "task": task})
                except (TypeError, ValueError):
                    dataset.add_frame(frame, task=task)  # lerobot before 0.4
            dataset.save_episode()
        if hasattr(dataset, "finalize"):
            dataset.finalize()


if __name__ == "__main__":
    main()
