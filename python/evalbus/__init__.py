"""Serve a policy to evalbus, and read what evalbus recorded.

    evalbus.serve(act)          makes a function a policy server (openpi's websocket wire)
    evalbus.read_run(folder)    a run's options, episodes and scores
    evalbus.read_log(file)      an episode's messages as numpy arrays
    evalbus.events(file)        the same, one message after the other

docs/python.md has examples.
"""

from evalbus.log import Log, events, read_log
from evalbus.run import read_run


def __getattr__(name):
    # Who only reads runs needs neither websockets nor msgpack.
    if name == "serve":
        from evalbus.server import serve

        return serve
    raise AttributeError(f"module 'evalbus' has no attribute {name!r}")


__all__ = ["Log", "events", "read_log", "read_run", "serve"]
