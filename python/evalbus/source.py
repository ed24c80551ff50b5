"""Publishes the measurements of a robot or simulator for `evalbus watch`: joints, object poses, contacts, images.

The LCM library is not needed, because this module encodes the datagrams itself. docs/watch.md describes the protocol.
"""

import itertools
import os
import socket
import struct
import time
import urllib.parse

import numpy as np

from evalbus import messages

_USUAL_URL = "udpm://239.255.76.67:7667?ttl=0"
# Maximum number of bytes of channel name and message per datagram; longer messages are fragmented.
_PART = 60_000


class Source:
    """A robot, or a scene of an external simulator.

    name: shown to users. joints: joint names of the task ("left/joint1"), in the order in which positions are
    published. objects: names of tracked objects. period_s: time between two samples. has_velocity: each sample has joint
    velocities. url: the bus of `evalbus watch`; by default EVALBUS_URL, or LCM's default bus if it is not set.
    has_contacts: each sample has the source's own contacts; requires `evalbus watch --contacts source`.
    """

    def __init__(self, name, joints, period_s, objects=(), has_velocity=False, url=None, has_contacts=False):
        self.announcement = {
            "source": name,
            "joint_name": list(joints),
            "object_name": list(objects),
            "has_velocity": has_velocity,
            "has_contacts": has_contacts,
            "period_us": round(period_s * 1e6),
        }
        group, port, ttl = bus_address(url or os.environ.get("EVALBUS_URL") or _USUAL_URL)
        self._to = (group, port)
        self._sequence = itertools.count()
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
        self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._in.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._in.bind(self._to)
        self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + bytes(4))
        self._episode = -1
        self._sample = 0

    def meet(self):
        """Publishes SOURCE_ANNOUNCEMENT until `evalbus watch` answers with MODEL."""
        self._in.settimeout(0.5)
        published, packet = 0, b""
        while b"EVALBUS_MODEL\0" not in packet[:64]:  # the first fragment has the channel name
            if time.monotonic() - published > 0.5:
                published = time.monotonic()
                self._publish("EVALBUS_SOURCE_ANNOUNCEMENT", "source_announcement_t", self.announcement)
            try:
                packet = self._in.recv(65536)
            except socket.timeout:  # TimeoutError since Python 3.10
                pass

    def begin_episode(self):
        self._episode += 1
        self._sample = 0

    def publish(self, stamp_s, positions, objects=(), velocities=(), is_last=False, contacts=()):
        """Publishes a sample: joint positions (rad, m), and (position in m, quaternion wxyz) of each object, world frame.

        stamp_s: time of the measurement on any monotonic clock. velocities: of the joints (rad/s, m/s), if the source
        was created with has_velocity. is_last: the episode ends with this sample. contacts:
        (a, b, penetration in m, position in m, unit normal from a to b) of each contact, world frame; a and b are names
        of bodies or geoms of the task.
        """
        if self.announcement["has_contacts"]:
            touching = {"episode": self._episode, "sample": self._sample, "contact": [_contact(*c) for c in contacts]}
            self._publish("EVALBUS_SOURCE_CONTACTS", "source_contacts_t", touching)
        elif contacts:
            raise ValueError("contacts require Source(has_contacts=True)")
        sample = {
            "episode": self._episode,
            "sample": self._sample,
            "stamp_us": round(stamp_s * 1e6),
            "joint_position_mixed": np.asarray(positions, float),
            "joint_velocity_mixed": np.asarray(velocities, float),
            "object": [{"position_m": position, "quat_wxyz": quat} for position, quat in objects],
            "is_last": is_last,
        }
        self._sample += 1
        self._publish("EVALBUS_SOURCE_STATE", "source_state_t", sample)

    def image(self, stamp_s, camera, jpeg):
        """Publishes an image of a camera ("front", "left/wrist").

        jpeg: content of a JPEG file. stamp_s: time of the image on the clock of publish(). `evalbus watch` accepts at
        most ten images per second and camera, with at most 512 KiB and 2048 pixels per side.
        """
        width, height = jpeg_size(jpeg)
        image = {
            "header": {"episode": self._episode, "sim_time_us": round(stamp_s * 1e6)},
            "view": {"camera": camera, "width_px": width, "height_px": height, "encoding": "jpeg"},
            "data": np.frombuffer(jpeg, np.uint8),
        }
        self._publish("EVALBUS_SOURCE_IMAGE_" + camera.replace("/", "_"), "image_t", image)

    def _publish(self, channel, type_, message):
        """Sends a message in LCM's UDP format, in one datagram or, if it is long, in fragments."""
        data = messages.encode(type_, message)
        name, sequence = channel.encode() + b"\0", next(self._sequence) & 0xFFFFFFFF
        if len(name) + len(data) <= _PART:
            self._out.sendto(struct.pack(">4sI", b"LC02", sequence) + name + data, self._to)
            return
        parts = [data[: _PART - len(name)]]
        parts += [data[at : at + _PART] for at in range(len(parts[0]), len(data), _PART)]
        offset = 0
        for number, part in enumerate(parts):
            header = struct.pack(">4sIIIHH", b"LC03", sequence, len(data), offset, number, len(parts))
            self._out.sendto(header + (b"" if number else name) + part, self._to)
            offset += len(part)


def bus_address(url):
    """Returns (multicast address, port, ttl) of a bus URL. As in LCM, address and port may be omitted."""
    bus = urllib.parse.urlsplit(url)
    usual = urllib.parse.urlsplit(_USUAL_URL)
    ttl = int(urllib.parse.parse_qs(bus.query).get("ttl", ["0"])[0])
    return bus.hostname or usual.hostname, bus.port or usual.port, ttl


def _contact(name_a, name_b, penetration_m, position_m, normal):
    return {
        "name_a": name_a,
        "name_b": name_b,
        "penetration_m": penetration_m,
        "position_m": position_m,
        "normal": normal,
    }


def jpeg_size(jpeg):
    """Returns (width, height) of a JPEG file's content. Raises ValueError if it is not a JPEG file."""
    at = 2
    while jpeg[:2] == b"\xff\xd8" and len(jpeg) >= at + 9 and jpeg[at] == 0xFF:
        marker, (size,) = jpeg[at + 1], struct.unpack_from(">H", jpeg, at + 2)
        # SOFn marker (start of frame); C4, C8 and CC have other meanings.
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", jpeg, at + 5)
            return width, height
        at += 2 + size
    raise ValueError("these bytes are not a JPEG file")
