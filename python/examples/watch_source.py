"""A source for `evalbus watch`, without LCM: the joints of recorded episodes, as a robot of its own would send them.

    evalbus watch lift_pot/position --episodes 2 &
    PYTHONPATH=python python3 python/examples/watch_source.py RUN/episodes/000[01]/events.lcmlog [--objects]

For a robot, replace `measured()`. Who says what when: docs/watch.md. EVALBUS_URL names another bus.
"""

import itertools
import os
import socket
import struct
import sys
import time
import urllib.parse

import numpy as np
from evalbus import events, messages, read_log

bus = urllib.parse.urlsplit(os.environ.get("EVALBUS_URL", "udpm://239.255.76.67:7667?ttl=0"))
ttl = int(urllib.parse.parse_qs(bus.query).get("ttl", ["0"])[0])
sequence = itertools.count()
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
heard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
heard.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
heard.bind((bus.hostname, bus.port))
heard.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(bus.hostname) + bytes(4))


def say(channel, type_, message):
    """LCM's small message: magic, number, channel, bytes."""
    data = struct.pack(">4sI", b"LC02", next(sequence)) + channel.encode() + b"\0" + messages.encode(type_, message)
    out.sendto(data, (bus.hostname, bus.port))


def measured(file):
    """(names of joints, of objects, s between samples, [(positions, [(position, quaternion)])])."""
    state = read_log(file)["EVALBUS_STATE"]
    model = next(message for _, channel, message in events(file) if channel == "EVALBUS_MODEL")
    names = [j for j in model["joint_name"] if j.split("/")[0] in [arm["name"] for arm in model["arm"]]]
    index = [model["joint_qpos_index"][model["joint_name"].index(j)] for j in names]
    objects = model["object_name"] if "--objects" in sys.argv else []
    bodies = [model["body_name"].index(o) for o in objects]
    period_s = model["timestep_us"] * model["substeps"] / 1e6
    poses = zip(state["body"]["position_m"][:, bodies], state["body"]["quat_wxyz"][:, bodies])
    return names, objects, period_s, [(q, list(zip(*p))) for q, p in zip(state["qpos_mixed"][:, index], poses)]


episodes = [measured(file) for file in sys.argv[1:] if file != "--objects"]
names, objects, period_s, _ = episodes[0]
hello = {"source": "recorded joints", "joint_name": names, "object_name": objects,
         "period_us": round(period_s * 1e6)}
heard.settimeout(0.5)
packet, said = b"", 0
while b"EVALBUS_MODEL\0" not in packet[:64]:  # long messages come in parts; the first names the channel
    if time.monotonic() - said > 0.5:
        said = time.monotonic()
        say("EVALBUS_HELLO", "hello_t", hello)
    try:
        packet = heard.recv(65536)
    except TimeoutError:
        pass
for episode, (_, _, _, samples) in enumerate(episodes):
    for k, (positions, poses) in enumerate(samples):
        say("EVALBUS_SOURCE_STATE", "source_state_t", {
            "episode": episode, "sample": k, "stamp_us": round(k * period_s * 1e6),
            "joint_position_mixed": positions, "is_last": k == len(samples) - 1,
            "object": [{"position_m": p, "quat_wxyz": q} for p, q in poses]})
        time.sleep(period_s)
