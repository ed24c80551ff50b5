"""Steps of evalbus.Environment per second, with and without cameras: lift_pot/position at 20 Hz, robot at home.

usage: environment_speed.py BIN [STEPS]   (the folder of evalbus' programs; steps per measurement, default 390)

Prints wall-clock time and the CPU time of both processes. Each is the difference of two measurements,
so the start of the program does not count.
"""

import os
import resource
import sys
import time

import evalbus
import numpy as np

CAMERAS = ["head", "left/hand/wrist", "right/hand/wrist"]


def processor_s():
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def measure(cameras, steps):
    """Returns the wall-clock time of the steps and the CPU time of everything, in seconds."""
    used = processor_s()
    with evalbus.Environment("lift_pot/position", cameras=cameras) as environment:
        action = np.append(environment.reset(0).observation["state"][:14], [0, 0])
        began = time.perf_counter()
        for _ in range(steps):
            step = environment.step(action)
        wall = time.perf_counter() - began
    # The robot has not moved, but the simulated time has passed.
    assert abs(step.metrics["completion_time"] - steps / 20) < 1e-9, step.metrics
    assert max(step.metrics["joint_path_length"].values()) < 1e-3, step.metrics
    return wall, processor_s() - used


def main():
    os.environ["EVALBUS_BIN"] = os.path.abspath(sys.argv[1])
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 390
    print("cameras 224x224   steps/s   processor ms per step")
    for count in (0, 1, 3):
        few, many = measure(CAMERAS[:count], steps // 10), measure(CAMERAS[:count], steps)
        added = steps - steps // 10
        wall, used = (many[k] - few[k] for k in (0, 1))
        print(f"{count:15}   {added / wall:7.1f}   {used / added * 1e3:7.2f}", flush=True)
    times = []
    with evalbus.Environment("lift_pot/position") as environment:
        for seed in range(30):
            began = time.perf_counter()
            environment.reset(seed)
            times.append(time.perf_counter() - began)
    print(f"reset: {np.median(times) * 1e3:.1f} ms (median of {len(times)})")


main()
