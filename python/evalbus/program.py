"""Starts the program evalbus."""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
from typing import IO, Any, List, Optional, Sequence

import numpy as np

from evalbus.errors import EvalbusError, InputError, ProgramError

# Time after which close() kills the program. It usually stops the processes of a run within two seconds.
_STOP_S = 10


def find_program() -> str:
    """Returns the path of the program evalbus: from EVALBUS_BIN (program or folder), next to this package, or in PATH.

    Raises ProgramError.
    """
    package = pathlib.Path(__file__).resolve().parent
    named = os.environ.get("EVALBUS_BIN")
    if named:
        candidates = [pathlib.Path(named), pathlib.Path(named) / "evalbus"]
    else:
        # Folders in a wheel, in the source tree, and in an installation (PREFIX/share/evalbus/python/evalbus).
        folders = [package / name for name in ("bin", "../../build/bin", "../../../../bin")]
        candidates = [pathlib.Path(os.path.normpath(folder / "evalbus")) for folder in folders]
        in_path = shutil.which("evalbus")
        candidates += [pathlib.Path(in_path)] if in_path else []
    for candidate in candidates:
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return str(candidate)
    if named:
        raise ProgramError(f"EVALBUS_BIN={named}: expected the program evalbus, or the folder that contains it")
    raise ProgramError("the program evalbus was not found: add its folder to PATH, or set EVALBUS_BIN to it")


def environment():
    """Returns the environment for the program: this process's environment, this Python, and the path of PyPI's ffmpeg
    for machines without ffmpeg."""
    own = dict(os.environ)
    own.setdefault("EVALBUS_PYTHON", sys.executable)
    try:
        import imageio_ffmpeg

        own.setdefault("EVALBUS_FFMPEG", imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        pass  # The program reports a missing ffmpeg when it needs one.
    return own


def check_task(task: Any) -> None:
    """Raises InputError for a name that the program would interpret as an option, or that is not text."""
    if not isinstance(task, (str, os.PathLike)):
        raise InputError(f"task: expected a name such as 'lift_pot/position' as first argument, got {task!r}")
    if str(task).startswith("-"):
        raise InputError(f"unknown task '{task}'")


def words(options: dict) -> List[str]:
    """Returns command-line arguments: {"workers": 2, "in_process": True} gives --workers 2 --in-process.

    None and False are omitted.
    """
    result = []
    for key, value in options.items():
        if isinstance(value, np.bool_):
            value = bool(value)
        if value is None or value is False:
            continue
        result.append("--" + key.replace("_", "-"))
        if isinstance(value, (list, tuple)):
            value = ",".join(map(str, value))
        if value is not True:
            result.append(os.fsdecode(value) if isinstance(value, (bytes, os.PathLike)) else str(value))
    return result


class Program:
    """A running evalbus whose standard input and output are pipes. If this process ends, the pipes close and it exits."""

    def __init__(self, arguments: Sequence[Any]):
        self._errors: IO[bytes] = tempfile.TemporaryFile()
        try:
            self._process = subprocess.Popen(
                [find_program(), *map(str, arguments)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=environment(),
                # Ctrl-C must reach only this process, which then stops the program in an orderly way.
                start_new_session=True,
            )
        except ValueError as error:  # An argument contains a zero byte.
            self._errors.close()
            raise InputError(f"the program evalbus cannot be started: {error}") from None
        except BaseException:
            self._errors.close()
            raise
        self.input = self._process.stdin
        self.output = self._process.stdout

    @property
    def pid(self) -> int:
        return self._process.pid

    def finish(self) -> None:
        """Waits for the program's end. Raises InputError or ProgramError if it failed."""
        self._process.wait()
        error = self._error()
        self.close()
        if error:
            raise error

    def _error(self) -> Optional[EvalbusError]:
        code = self._process.returncode
        if code == 0:
            return None
        if code < 0:
            return ProgramError(f"evalbus was killed: {signal.strsignal(-code) or f'signal {-code}'}")
        self._errors.seek(0)
        lines = [line for line in self._errors.read().decode(errors="replace").splitlines() if line.strip()]
        reason = lines[-1] if lines else f"evalbus exited with code {code}"
        return (InputError if code == 1 else ProgramError)(reason.removeprefix("error: "))

    def close(self) -> None:
        """Stops the program if it is running."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        for stream in (self.input, self.output, self._errors):
            try:
                stream.close()
            except BrokenPipeError:
                pass  # The program did not read all of its input.
