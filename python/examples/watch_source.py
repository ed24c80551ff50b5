"""A source for `evalbus watch`, without LCM: publishes the joints of recorded episodes in the same way as a robot.

    evalbus watch lift_pot/position --episodes 2 &
    PYTHONPATH=python python3 python/examples/watch_source.py RUN/episodes/000[01]/events.lcmlog [--objects]
        [--contacts] [--images CAMERA=FOLDER]

--objects: also publishes the poses of the objects. --contacts: also publishes the recorded contacts, for `evalbus watch
--contacts source`. --images: publishes the JPEG files of a folder, sorted by name, as images of this camera, ten per
second. For a robot, replace `measured()` and pass its camera images to `source.image()`.
The protocol is described in docs/watch.md. Set EVALBUS_URL to use a different bus.
"""

import argparse
import pathlib
import time

from evalbus import events, read_log
from evalbus.source import Source

IMAGES_PER_S = 10


def measured(file, with_objects):
    """Returns (joint names, object names, sample period in s, [(positions, [(position, quaternion)])])."""
    state = read_log(file)["EVALBUS_STATE"]
    model = next(message for _, channel, message in events(file) if channel == "EVALBUS_MODEL")
    names = [j for j in model["joint_name"] if j.split("/")[0] in [arm["name"] for arm in model["arm"]]]
    index = [model["joint_qpos_index"][model["joint_name"].index(j)] for j in names]
    objects = model["object_name"] if with_objects else []
    bodies = [model["body_name"].index(o) for o in objects]
    period_s = model["timestep_us"] * model["substeps"] / 1e6
    poses = zip(state["body"]["position_m"][:, bodies], state["body"]["quat_wxyz"][:, bodies])
    return names, objects, period_s, [(q, list(zip(*p))) for q, p in zip(state["qpos_mixed"][:, index], poses)]


def touching(file):
    """Returns for each sample its contacts: [(a, b, penetration in m, position, normal from a to b)]."""
    messages = [(channel, message) for _, channel, message in events(file)]
    names = next(message["geom_name"] for channel, message in messages if channel == "EVALBUS_MODEL")
    return [
        [
            (names[c["geom_a"]], names[c["geom_b"]], max(0, -c["distance_m"]), c["position_m"], c["normal"])
            for c in message["contact"]
        ]
        for channel, message in messages
        if channel == "EVALBUS_CONTACTS"
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", nargs="+", help="events.lcmlog of a recorded episode")
    parser.add_argument("--objects", action="store_true")
    parser.add_argument("--contacts", action="store_true")
    parser.add_argument("--images", metavar="CAMERA=FOLDER", action="append", default=[])
    options = parser.parse_args()
    episodes = [measured(log, options.objects) for log in options.log]
    contacts = [touching(log) if options.contacts else [] for log in options.log]
    names, objects, period_s, _ = episodes[0]
    cameras = {}
    for text in options.images:
        camera, folder = text.split("=", 1)
        cameras[camera] = [file.read_bytes() for file in sorted(pathlib.Path(folder).glob("*.jpg"))]
        if not cameras[camera]:
            parser.error(f"--images {text}: the folder has no *.jpg")

    source = Source("recorded joints", names, period_s, objects, has_contacts=options.contacts)
    source.meet()
    for (_, _, _, samples), its_contacts in zip(episodes, contacts):
        source.begin_episode()
        images_published = 0
        for k, (positions, poses) in enumerate(samples):
            stamp_s = k * period_s
            its = its_contacts[k] if its_contacts else []
            source.publish(stamp_s, positions, poses, is_last=k == len(samples) - 1, contacts=its)
            if stamp_s * IMAGES_PER_S >= images_published - 1e-9:
                for camera, images in cameras.items():
                    source.image(stamp_s, camera, images[min(images_published, len(images) - 1)])
                images_published += 1
            time.sleep(period_s)


if __name__ == "__main__":
    main()
