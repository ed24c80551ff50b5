"""Tests training sets with training software: robomimic's loader, safetensors' own reader, and LeRobot's.

Runs in an environment of requirements/data.txt: scripts/interop data.
"""
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import av
import h5py
import numpy
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from robomimic.utils import obs_utils
from robomimic.utils.dataset import SequenceDataset
from safetensors import safe_open
from safetensors.numpy import save_file

import support

BIN = pathlib.Path(sys.argv[1]) / "evalbus"
os.environ["EVALBUS_PYTHON"] = sys.executable
CAMERAS = ["roboeval/head", "roboeval/left_wrist"]


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=support.DEADLINE_S)
    assert done.returncode == 0, (command, done.stdout[-2000:], done.stderr[-2000:])
    return done.stdout


def check_robomimic(file):
    """Batches of robomimic's own loader equal the data that h5py reads."""
    run(sys.executable, "-m", "robomimic.scripts.get_dataset_info", "--dataset", file)
    images = [camera.replace("/", "_") + "_image" for camera in CAMERAS]
    low = ["joint_position", "joint_velocity", "gripper_opening", "pot_pose"]
    obs_utils.initialize_obs_utils_with_obs_specs({"obs": {"low_dim": low, "rgb": images}})
    for cache in ("all", "low_dim", None):
        data = SequenceDataset(
            str(file),
            low + images,
            ["actions", "rewards", "dones"],
            seq_length=4,
            hdf5_cache_mode=cache,
            filter_by_attribute="success",
            load_next_obs=True,
        )
        # robomimic opens the file for shared reading. This excludes another reader that opens it without sharing.
        length, batch = len(data), next(iter(torch.utils.data.DataLoader(data, batch_size=8)))
        data.close_and_delete_hdf5_handle()
        with h5py.File(file) as f:
            names = [name.decode() for name in f["mask/success"][:]]
            assert length == sum(f["data"][name].attrs["num_samples"] for name in names)
            demo = f["data"][names[0]]

            def same(read, wanted):
                """robomimic's cache stores 32-bit numbers."""
                return (read.numpy().astype("f4") == wanted.astype("f4")).all()

            for row in range(8):
                assert same(batch["actions"][row], demo["actions"][row : row + 4])
                for key in low + images:
                    assert same(batch["obs"][key][row], demo["obs"][key][row : row + 4]), key
                    # The next observation of a step equals the observation of the following step.
                    assert same(batch["next_obs"][key][row], demo["obs"][key][row + 1 : row + 5]), key
        data.close_and_delete_hdf5_handle()


# These are the required members of RoboEval's classes Metadata and EnvData.
@dataclasses.dataclass
class Metadata:
    observation_mode: str
    environment_data: dict
    seed: int
    package_versions: dict


@dataclasses.dataclass
class EnvData:
    env_name: str
    action_mode_name: str
    floating_base: bool
    observation_config: dict


def check_roboeval(file, steps):
    """Converts a demonstration to the form of RoboEval's loader, with the names from its documentation."""
    with safe_open(file, framework="np", device="cpu") as f:
        metadata = {key: json.loads(value) for key, value in f.metadata().items()}
        tensors = {key: f.get_tensor(key) for key in f.keys()}
    about = Metadata(**{m.name: metadata[m.name] for m in dataclasses.fields(Metadata)})
    environment = EnvData(**{m.name: about.environment_data[m.name] for m in dataclasses.fields(EnvData)})
    assert environment.env_name == "LiftPotPosition" and about.environment_data["robot_name"] == "BimanualPanda"
    assert about.environment_data["action_mode_absolute"] and about.observation_mode == "state"
    shapes = {key: tensor.shape for key, tensor in tensors.items()}
    assert shapes == {
        "info_demo_action": (steps, 16),
        "obs_proprioception": (steps, 36),
        "obs_proprioception_grippers": (steps, 2),
        "reward": (steps,),
        "termination": (steps,),
        "truncation": (steps,),
    }, shapes
    assert tensors["termination"].dtype == bool and tensors["info_demo_action"].dtype == numpy.float64
    return tensors


def check_lerobot(recorded, hdf5, folder):
    """Checks LeRobot's own writer and loader. PyAV decodes the videos."""
    run(BIN, "export", recorded, "--lerobot", folder, "--camera", ",".join(CAMERAS), "--size", "96x64")
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["fps"] == 20 and info["robot_type"] == "bimanual_panda", info
    names = info["features"]["action"]["names"]
    assert names[0] == "left_joint1" and names[13] == "right_joint7" and names[14:] == ["left_gripper", "right_gripper"]
    data = LeRobotDataset("evalbus/run", root=folder)
    with h5py.File(hdf5) as f:
        demos = [f[f"data/demo_{k}"] for k in range(len(f["data"]))]
        assert data.meta.total_episodes == len(demos)
        assert len(data) == sum(demo.attrs["num_samples"] for demo in demos)
        # There are no images, because decoding them needs parts of torchvision that Debian's package lacks.
        rows = data.hf_dataset.with_format("numpy")
        first, at = demos[0], len(demos[0]["actions"])
        joints = numpy.hstack([first["obs/joint_position"], first["obs/gripper_opening"]]).astype("f4")
        assert (numpy.stack(rows[:at]["observation.state"]) == joints).all()
        assert (numpy.stack(rows[:at]["action"]) == first["actions_raw"][:].astype("f4")).all()
        assert rows[at]["frame_index"] == 0 and rows[at]["episode_index"] == 1
        for camera in ("head", "left_wrist"):
            file = folder / data.meta.get_video_file_path(0, f"observation.images.{camera}")
            with av.open(str(file)) as video:
                frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
            wanted = first[f"obs/roboeval_{camera}_image"][:].astype(int)
            shown = numpy.array(frames[:at], int)
            # The video is compressed. A wrong frame, or an image upside down, would have a larger error.
            error = numpy.abs(shown - wanted).mean()
            assert error < 6, (camera, error)
            assert numpy.abs(shown[:, ::-1] - wanted).mean() > 2 * error, camera
    tasks = data.meta.tasks
    text = list(tasks.values())[0] if isinstance(tasks, dict) else tasks.index[0]
    assert text == "lift the pot by the handles", text
    return info["codebase_version"]


def check_their_demonstrations(here):
    """Checks a file that safetensors' own writer wrote in RoboEval's layout, at its 500 Hz."""
    folder = here / "BimanualPanda/LiftPot/JointPositionActionMode_absolute_joint/lightweight"
    folder.mkdir(parents=True)
    random = numpy.random.default_rng(1)
    home = numpy.array([0, 0, 0, -1.5707963, 0, 1.5707963, -0.7853982] * 2)
    actions = numpy.hstack([home + random.normal(0, 0.01, (1013, 14)), numpy.zeros((1013, 2))])
    actions[400:, 14] = 1
    metadata = {
        "seed": "7",
        "observation_mode": '"lightweight"',
        "environment_data": json.dumps({"env_name": "LiftPotStatic", "action_mode_absolute": True}),
        "package_versions": '{"mujoco": "3.1.5"}',
        "uuid": '"0123"',
    }
    ends = numpy.zeros(1013, bool)
    tensors = {"info_demo_action": actions, "termination": ends, "truncation": ends, "reward": numpy.zeros(0)}
    save_file(tensors, folder / "0123.safetensors", metadata=metadata)
    info = json.loads(run(BIN, "demo", "info", here / "BimanualPanda", "--json"))
    # The name of the folder determines the task, and the file names another one.
    (facts,) = [info["LiftPot"]]
    assert facts["steps"] == 1013 and facts["hz"] == 500 and abs(facts["seconds"] - 2.026) < 1e-9
    assert facts["gripper_closings"] == {"left": 1, "right": 0}
    left = numpy.linalg.norm(numpy.diff(actions[:, :7], axis=0), axis=1).sum()
    assert abs(facts["joint_path_length_rad"]["left"] - left) < 1e-9
    assert (numpy.array(facts["max"]) == actions.max(0)).all() and (numpy.array(facts["min"]) == actions.min(0)).all()

    run(BIN, "demo", "convert", folder, "--hz", "20", "--out", here / "converted")
    (converted,) = (here / "converted").glob("*.safetensors")
    with safe_open(converted, framework="np") as f:
        rows, kept = f.get_tensor("info_demo_action"), f.metadata()
    # Demonstrations of several rates have no common one.
    (here / "several").mkdir()
    for source in (folder / "0123.safetensors", converted):
        shutil.copy(source, here / "several" / f"{source.parent.name}.safetensors")
    (several,) = json.loads(run(BIN, "demo", "info", here / "several", "--json")).values()
    assert several["demonstrations"] == 2 and several["hz"] is None
    assert "at 20 and 500 Hz" in run(BIN, "demo", "info", here / "several")
    # RoboEval's rule uses windows of 25 steps. The last window is padded with its last step.
    padded = numpy.vstack([actions, numpy.repeat(actions[-1:], -1013 % 25, axis=0)]).reshape(-1, 25, 16)
    assert rows.shape == (41, 16) and numpy.allclose(rows[:, :14], padded[:, :, :14].mean(1), atol=1e-12)
    assert (rows[:, 14:] == padded[:, -1, 14:]).all()
    assert kept["control_frequency"] == "20" and kept["uuid"] == '"0123"' and kept["seed"] == "7"


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    of = here / "run"
    run(BIN, "run", "lift_pot/position", "--policy", "expert", "--episodes", "2", "--control-hz", "20",
        "--in-process", "--video", "none", "--out", of)  # fmt: skip
    hdf5 = here / "set.hdf5"
    run(BIN, "export", of, "--hdf5", hdf5, "--camera", ",".join(CAMERAS), "--size", "96x64")
    check_robomimic(hdf5)
    run(BIN, "export", of, "--safetensors", here / "demos")
    with h5py.File(hdf5) as f:
        demo = f["data/demo_1"]
        tensors = check_roboeval(here / "demos/0001.safetensors", len(demo["actions"]))
        assert (tensors["info_demo_action"] == demo["actions_raw"][:]).all()
        # Positions, then velocities. Each has 7 values for the left arm, 2 for its fingers, 7 for the right arm and
        # 2 for its fingers.
        seen = tensors["obs_proprioception"]
        arms = [*range(7), *range(9, 16)]
        assert (seen[:, arms] == demo["obs/joint_position"][:]).all()
        assert (seen[:, [18 + k for k in arms]] == demo["obs/joint_velocity"][:]).all()
        fingers = (seen[:, [7, 8, 16, 17]].reshape(-1, 2, 2).mean(2) / 0.04).clip(0, 1)
        assert numpy.abs(fingers - demo["obs/gripper_opening"][:]).max() < 1e-9
        assert numpy.abs(tensors["obs_proprioception_grippers"] - fingers).max() <= 0.05 + 1e-9
    check_their_demonstrations(here)
    version = check_lerobot(of, hdf5, here / "lerobot")
print(f"read by robomimic, safetensors and LeRobot {version}")
