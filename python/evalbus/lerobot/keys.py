"""Names that data sets, environments and contracts for LeRobot share."""

from typing import List

from evalbus.errors import InputError

STATE = "observation.state"
ACTION = "action"
IMAGES = "observation.images."
# RoboEval's cameras have no prefix, as in its public conversion to LeRobot.
_ROBOEVAL = "roboeval/"


def image_name(camera: str) -> str:
    """Returns the name of a camera's images after "observation.images.", for example "head" for "roboeval/head"."""
    return camera.removeprefix(_ROBOEVAL).replace("/", "_")


def image_names(cameras: List[str]) -> List[str]:
    """Returns the names of the cameras' images. Raises InputError if two cameras have the same name."""
    names = [image_name(camera) for camera in cameras]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two cameras have the images {IMAGES}{name}: {', '.join(cameras)}")
    return names
