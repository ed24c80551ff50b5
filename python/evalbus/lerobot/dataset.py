"""Writes the episodes of a run as a LeRobot data set, with LeRobot's own writer (pip install lerobot[dataset] h5py).

`observation.state` and `action` have the joints of all arms (rad), then all grippers (state: 1 open; action: 1 closed).
For two Pandas, names and order match the public LeRobot conversion of RoboEval, 16 numbers each: left_joint1..7,
right_joint1..7, left_gripper, right_gripper. Images: `observation.images.head`, ... The task's text is the
instruction that policies are also shown during evaluation. LeRobot computes the statistics for normalization.
"""

import contextlib
import json
import os
import pathlib
import tempfile
from typing import Any, Dict, List

import numpy as np

from evalbus.errors import InputError
from evalbus.lerobot import keys
from evalbus.command import parser, run_module
from evalbus.program import Program, words


def write_dataset(run, out, cameras: List[str] = (), size: str = "256x256", successes: bool = False) -> int:
    """Writes a data set in the format of the installed LeRobot to the folder `out`. Returns the number of episodes.

    cameras: their images become videos of this size, WIDTHxHEIGHT. successes: omit episodes that failed. Raises
    InputError if `out` exists or the run cannot be exported.
    """
    import h5py
    import lerobot.datasets  # noqa: F401  Fails early.

    out = pathlib.Path(out)
    if out.exists():
        raise InputError(f"{out}: exists; choose another name")
    if not out.absolute().parent.is_dir():
        raise InputError(f"{out}: no such folder: {out.absolute().parent}")
    names = keys.image_names(cameras)
    # The temporary folder is next to `out`, so that the finished data set can be renamed to `out`.
    with tempfile.TemporaryDirectory(prefix=f".{out.name}.", dir=out.absolute().parent) as scratch:
        training_set = pathlib.Path(scratch) / "set.hdf5"
        options = {"hdf5": training_set, "successes": successes, "camera": list(cameras) or None}
        if cameras:
            options["size"] = size
        with contextlib.closing(Program(["export", run, *words(options)])) as program:
            program.output.read()
            program.finish()
        with h5py.File(training_set, "r") as file:
            count = _convert(file["data"], dict(zip(cameras, names)), pathlib.Path(scratch) / out.name)
            # A contract's `trained_on` can refer to these starts.
            starts = b"".join(line + b"\n" for line in file["evalbus_starts"][:])
            (pathlib.Path(scratch) / out.name / "evalbus_starts.jsonl").write_bytes(starts)
        os.rename(pathlib.Path(scratch) / out.name, out)
    return count


def _convert(demos: Any, images: Dict[str, str], folder: pathlib.Path) -> int:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    task = json.loads(demos.attrs["env_args"])
    kwargs = task["env_kwargs"]
    fps = kwargs["control_hz"]
    if fps != round(fps):
        raise InputError(f"the run has {fps:g} steps per second; LeRobot requires a whole number")
    sources = {camera.replace("/", "_") + "_image": keys.IMAGES + name for camera, name in images.items()}
    order = sorted(demos, key=lambda name: int(name.split("_")[1]))
    dataset = LeRobotDataset.create(
        f"evalbus/{folder.name}",
        fps=round(fps),
        features=_features(kwargs, {name: demos[order[0]]["obs"][key].shape[1:] for key, name in sources.items()}),
        root=folder,
        robot_type=kwargs["robot"],
        use_videos=True,
    )
    try:
        for name in order:
            demo = demos[name]
            state = np.hstack([demo["obs/joint_position"][:], demo["obs/gripper_opening"][:]]).astype(np.float32)
            action = demo["actions_raw"][:].astype(np.float32)
            for step in range(len(action)):
                frame = {key: demo["obs"][source][step] for source, key in sources.items()}
                frame |= {keys.STATE: state[step], keys.ACTION: action[step]}
                dataset.add_frame({**frame, "task": kwargs["instruction"] or task["env_name"]})
            dataset.save_episode()
    finally:
        dataset.finalize()
    return len(order)


def _features(kwargs: dict, images: Dict[str, tuple]) -> dict:
    names = [f"{arm}_joint{k + 1}" for arm, joints in kwargs["num_joints"].items() for k in range(joints)]
    names += [f"{gripper}_gripper" for gripper in kwargs["grippers"]]
    vector = {"dtype": "float32", "shape": (len(names),), "names": names}
    video = {"dtype": "video", "names": ["height", "width", "channels"]}
    return {
        keys.STATE: vector,
        keys.ACTION: vector,
        **{name: {**video, "shape": shape} for name, shape in images.items()},
    }


def main():
    options = parser(__doc__, "evalbus export --lerobot")
    options.add_argument("run", help="folder of a run or a suite")
    options.add_argument("--lerobot", dest="out", required=True, help="folder to write")
    options.add_argument("--camera", default="", help="cameras, separated by commas")
    options.add_argument("--size", default="256x256", help="size of the images, WIDTHxHEIGHT")
    options.add_argument("--successes", action="store_true", help="successful episodes only")
    given = options.parse_args()
    cameras = [camera for camera in given.camera.split(",") if camera]
    count = write_dataset(given.run, given.out, cameras, given.size, given.successes)
    print(f"{count} episode{'s' if count != 1 else ''}  {given.out}")


if __name__ == "__main__":
    run_module(main)
