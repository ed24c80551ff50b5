"""Compares images of RoboEval's cameras in its scenes, composed by evalbus, with those in its own environment.

usage: PYTHON roboeval_images_test.py BIN ROBOEVAL OUT [--families A,B]

For the initial state of each family's base variation, prints the mean absolute difference per pixel and channel, of
255, and the share of pixels that differ by more than 32 in a channel. Exit code 1 if a mean is larger than allowed.
Writes both images of each camera to OUT. Needs the environment variable MUJOCO_GL=osmesa or egl.
"""

import subprocess
import sys

import numpy as np
from PIL import Image

import roboeval_env

_CAMERAS = ["external", "head", "left_wrist", "right_wrist"]
_SIZE = 224
# Largest allowed mean differences. MuJoCo 2.2 draws shadows of thin meshes, such as flaps and shelf, onto the meshes
# themselves.
_MOST = 12
_MOST_WITH_THIN_MESHES = 60
_THIN_MESHES = ("pack_box", "pick_single_book_from_table", "stack_single_book_shelf")


def main():
    parser = roboeval_env.argument_parser()
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    print(f"{'mean difference (share > 32)':30}" + "".join(f"{camera:>16}" for camera in _CAMERAS))
    failed = 0
    for family in args.families.split(","):
        line = ""
        for camera, (ours, theirs) in images(args, family).items():
            difference = np.abs(ours.astype(int) - theirs)
            failed |= difference.mean() > (_MOST_WITH_THIN_MESHES if family in _THIN_MESHES else _MOST)
            line += f"{difference.mean():8.1f} ({(difference.max(axis=2) > 32).mean():4.1%})"
            Image.fromarray(np.hstack([ours, theirs])).save(args.out / f"{family}-{camera}.png")
        print(f"{family:30}{line}", flush=True)
    return int(failed)


def images(args, family):
    """Returns evalbus's image and RoboEval's image by camera."""
    task = [f"roboeval/{family}/base", "--assets", f"roboeval={args.roboeval}"]
    run = args.out / family
    if not (run / "summary.json").exists():
        # RoboEval's environment of RotateValve is created with half of this rate, and it requires at least 20 Hz.
        call(args, "run", *task, "--policy", "hold", "--episodes", "1", "--in-process", "--control-hz", "40", "--out", run)
    environment = roboeval_env.Environment(run)
    theirs = environment.images(environment.episodes[0], 0, _CAMERAS, _SIZE)
    environment.close()
    result = {}
    for camera in _CAMERAS:
        file = args.out / "own.png"
        call(args, "tasks", "show", *task, "--image", file, "--camera", f"roboeval/{camera}", "--size", f"{_SIZE}x{_SIZE}")
        with Image.open(file) as image:
            result[camera] = np.asarray(image.convert("RGB")), theirs[camera]
        file.unlink()
    return result


def call(args, *arguments):
    subprocess.run([args.bin / "evalbus", *arguments], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
