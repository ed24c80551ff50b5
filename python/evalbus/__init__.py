"""Evaluates policies with evalbus, serves them, and reads runs and logs.

    evalbus.run(task, policy)        evaluates a policy: a function, a name, or the address of a server
    evalbus.start(task, policy)      the same, with an iterator over the events of the run
    evalbus.start_plan(file)         runs a plan of policies and tasks, with an iterator over the events of its runs
    evalbus.compare(baseline, run)   tests whether a run differs from a baseline
    evalbus.read_run(folder)         reads options, episodes and scores of a run
    evalbus.read_log(file)           reads the messages of an episode as numpy arrays
    evalbus.events(file)             iterates over the messages of an episode
    evalbus.serve(act)               serves a function as a policy (openpi's websocket protocol)
    evalbus.Environment(task)        a task, step by step; evalbus.gym has it for Gymnasium

See docs/python.md for examples.
"""

import importlib

from evalbus.errors import ActionError, EvalbusError, InputError, PolicyError, ProgramError
from evalbus.evaluate import ActivePlan, ActiveRun, Comparison, Event, compare, run, start, start_plan
from evalbus.log import Log, events, read_log
from evalbus.runs import Episode, Metric, Run, Summary, read_run

__version__ = "0.3.0"

# These names are imported on first use, because reading runs requires neither websockets nor msgpack.
_LAZY = {"serve": "evalbus.server", "Environment": "evalbus.environment", "Step": "evalbus.environment"}


def __getattr__(name):
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'evalbus' has no attribute {name!r}")


__all__ = [
    "ActionError",
    "ActivePlan",
    "ActiveRun",
    "Comparison",
    "Environment",
    "Episode",
    "EvalbusError",
    "Event",
    "InputError",
    "Log",
    "Metric",
    "PolicyError",
    "ProgramError",
    "Run",
    "Step",
    "Summary",
    "compare",
    "events",
    "read_log",
    "read_run",
    "run",
    "serve",
    "start",
    "start_plan",
]
