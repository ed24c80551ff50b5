"""Serves policies to evalbus, and reads its runs and logs.

    evalbus.serve(act)          serves a function as a policy (openpi's websocket protocol)
    evalbus.read_run(folder)    reads options, episodes and scores of a run
    evalbus.read_log(file)      reads the messages of an episode as numpy arrays
    evalbus.events(file)        iterates over the messages of an episode

See docs/python.md for examples.
"""

from evalbus.log import Log, events, read_log
from evalbus.run import read_run


def __getattr__(name):
    # Imported on first use: reading runs requires neither websockets nor msgpack.
    if name == "serve":
        from evalbus.server import serve

        return serve
    raise AttributeError(f"module 'evalbus' has no attribute {name!r}")


__all__ = ["Log", "events", "read_log", "read_run", "serve"]
