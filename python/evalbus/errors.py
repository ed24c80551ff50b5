"""Exceptions of evalbus. Each message is one line that states what is wrong."""

from typing import Any

import numpy as np


class EvalbusError(Exception):
    """Base class of all exceptions of evalbus."""

    def __init__(self, text: Any):
        # Gymnasium's AsyncVectorEnv passes the exception of its worker process instead of a text.
        super().__init__(" ".join(str(text).splitlines()))


class InputError(EvalbusError, ValueError):
    """A task, policy, option or file is wrong."""


class ActionError(InputError):
    """An action has the wrong shape or type, has masked values or, in an environment, values that are not finite."""


class ProgramError(EvalbusError, RuntimeError):
    """The program evalbus is missing, failed or was killed, or this machine does not meet its requirements."""


class PolicyError(EvalbusError, RuntimeError):
    """A policy that this process serves raised an exception (the __cause__ of this one), or did not answer in time."""


def check_not_masked(action):
    """Raises ActionError if elements of the action are masked. np.asarray() would drop the mask."""
    if np.ma.is_masked(action):
        raise ActionError("actions have masked elements, expected a number in each")


def check_action_type(action, subject):
    """Raises ActionError unless the array has integers or floating-point numbers. `subject`, such as "the action is",
    begins the message."""
    if action.dtype.kind not in "fiu":
        raise ActionError(f"{subject} of type {action.dtype}, expected numbers")


def check_sent_action_type(action, subject):
    """Also raises ActionError for numbers of more than 64 bits, which cannot be sent to the program evalbus."""
    check_action_type(action, subject)
    if action.dtype.itemsize > 8:
        raise ActionError(f"{subject} of type {action.dtype}, expected numbers of at most 64 bits")
