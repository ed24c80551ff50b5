"""Exceptions of evalbus. Each has one line that states what is wrong and what to do."""

from typing import Any


class EvalbusError(Exception):
    """Base class of all of them."""

    def __init__(self, text: Any):
        # Gymnasium's AsyncVectorEnv passes the exception of its worker process instead of a text.
        super().__init__(" ".join(str(text).splitlines()))


class InputError(EvalbusError, ValueError):
    """A task, policy, option or file is wrong."""


class ActionError(InputError):
    """An action has the wrong shape or type, or is not finite."""


class ProgramError(EvalbusError, RuntimeError):
    """The program evalbus is missing, failed or was killed, or the machine does not provide what it needs."""


class PolicyError(EvalbusError, RuntimeError):
    """A policy that this process serves raised an exception, which is this one's __cause__."""
