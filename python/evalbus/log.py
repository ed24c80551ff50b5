"""Reader for LCM event logs; evalbus records one per episode (episodes/0007/events.lcmlog).

Compressed logs of `evalbus run --log zstd` (events.lcmlog.zst) require the program zstd.
"""

import contextlib
import mmap
import struct
import subprocess
import warnings

import numpy as np

from evalbus import messages
from evalbus.errors import InputError, ProgramError

_MAGIC = b"\xed\xa1\xda\x01"
_PACKED_MAGIC = b"\x28\xb5\x2f\xfd"
_MAX_UNPACKED_BYTES = 1 << 30
# Magic number, event number, time in microseconds, size of the channel name, size of the message.
_HEADER = struct.Struct(">4sqqII")
_MAX_CHANNEL_BYTES = 63
_MAX_MESSAGE_BYTES = 64 << 20


class Log(dict):
    """Maps channels to columns: one column per member of the channel's messages, in the order of the log.

    For T messages, log["EVALBUS_STATE"]["qpos_mixed"] is an array (T, nq), ["header"]["tick"] is (T,), and
    ["arm"]["joint_position_rad"] is (T, arms, joints). ["time_us"] is (T,): the time at which each message was
    recorded. A column is a list with one entry per message if it contains text or if sizes differ between
    messages, as in ["EVALBUS_CONTACTS"]["contact"]["position_m"].
    """

    def __init__(self):
        super().__init__()
        # Number of bytes that are not part of a complete event, and number of contiguous blocks of such bytes.
        self.damaged_bytes = 0
        self.damaged_places = 0
        # Maps a channel to the number of its events that are not messages of this evalbus version.
        self.not_decoded = {}


def read_log(file):
    """Reads the messages of a log as numpy arrays (see Log). Damaged parts are skipped, counted and warned about.

    Raises InputError if the file cannot be read or has no LCM event, ProgramError if zstd is needed but not installed, and
    TypeError if `file` is a number.
    """
    log = Log()
    times, found, names = {}, {}, {}
    for time_us, channel, name, message in _messages(file, log):
        if names.setdefault(channel, name) != name:
            raise InputError(f"{file}: {channel} has messages of two types: {names[channel]} and {name}")
        times.setdefault(channel, []).append(time_us)
        found.setdefault(channel, []).append(message)
    for channel, name in names.items():
        log[channel] = {
            "time_us": np.array(times[channel]),
            **_columns(messages.types()[name], found[channel], 1),
        }
    return log


def events(file):
    """Yields (time in microseconds, channel, message) for each message of a log; a message is a dictionary.

    Raises the errors of read_log(). At the end, it warns about damaged parts, like read_log().
    """
    for time_us, channel, _, message in _messages(file, Log()):
        yield time_us, channel, message


def _messages(file, log):
    reasons = {}
    is_log = False
    for time_us, channel, data in _events(file, log):
        is_log = True
        try:
            name, message = messages.decode(data)
        except messages.MessageError as error:
            log.not_decoded[channel] = log.not_decoded.get(channel, 0) + 1
            reasons.setdefault(channel, error)
        else:
            yield time_us, channel, name, message
    if not is_log:
        raise InputError(f"{file}: no LCM event in this file")
    if log.damaged_bytes:
        warnings.warn(f"{file}: {_count(log.damaged_bytes, 'damaged byte')} skipped", stacklevel=2)
    for channel, reason in reasons.items():
        warnings.warn(
            f"{file}: {_count(log.not_decoded[channel], 'event')} of {channel} left out: {reason}", stacklevel=2
        )


def _count(number, noun):
    return f"{number} {noun}{'s' if number != 1 else ''}"


def _events(file, log):
    with _bytes(file) as data:
        at, size = 0, len(data)
        while at < size:
            start = at
            while at < size and not (event_size := _event_size(data, at)):
                at = _find(data, at + 1)
            if at != start:
                log.damaged_bytes += at - start
                log.damaged_places += 1
            if at < size:
                _, _, time_us, channel_size, _ = _HEADER.unpack_from(data, at)
                body = at + _HEADER.size
                channel = data[body : body + channel_size].decode("utf-8", "surrogateescape")
                yield time_us, channel, data[body + channel_size : at + event_size]
                at += event_size


@contextlib.contextmanager
def _bytes(file):
    """Provides the content of a log, decompressed if necessary."""
    if isinstance(file, (int, np.integer)):  # open() would read a file descriptor
        raise TypeError(f"expected the path of a log, got the number {file}; Run.logs has the paths by episode")
    try:
        stream = open(file, "rb")
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from None
    except (TypeError, ValueError) as error:  # Not a path, or a path with a zero byte.
        raise InputError(f"{file!r}: expected a file: {error}") from None
    with stream:
        start = stream.read(len(_PACKED_MAGIC))
        if not start:
            yield b""
        elif start == _PACKED_MAGIC:
            yield _unpacked(file)
        else:
            with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
                yield data


def _unpacked(file):
    command = ["zstd", "-dcq", "--", str(file)]
    try:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    except FileNotFoundError:
        raise ProgramError(f"{file}: compressed with zstd; install the program zstd, which was not found") from None
    with process:
        data = process.stdout.read(_MAX_UNPACKED_BYTES + 1)
        if len(data) > _MAX_UNPACKED_BYTES:
            process.kill()
            raise InputError(f"{file}: unpacks to more than {_MAX_UNPACKED_BYTES} bytes")
        error = process.stderr.read().decode(errors="replace").strip()
    if process.returncode != 0:
        raise InputError(f"{file}: cannot be unpacked: {error}")
    return data


def _find(data, at):
    """Returns the position of the next magic number, or the end."""
    found = data.find(_MAGIC, at)
    return found if found >= 0 else len(data)


def _claimed_size(data, at):
    """Returns the size, according to its header, of the event at this position; 0 if there is no valid header."""
    if len(data) - at < _HEADER.size:
        return 0
    magic, _, _, channel_size, data_size = _HEADER.unpack_from(data, at)
    if magic != _MAGIC or not 0 < channel_size <= _MAX_CHANNEL_BYTES or data_size > _MAX_MESSAGE_BYTES:
        return 0
    size = _HEADER.size + channel_size + data_size
    return size if size <= len(data) - at else 0


def _is_boundary(data, at):
    return at == len(data) or data[at : at + 4] == _MAGIC


def _event_size(data, at):
    """Returns _claimed_size(), but 0 if the sizes are damaged, that is, if the event spans other complete events."""
    size = _claimed_size(data, at)
    if not size or _is_boundary(data, at + size):
        return size
    inside = _find(data, at + 4)
    while inside < at + size:
        if (claimed := _claimed_size(data, inside)) and _is_boundary(data, inside + claimed):
            return 0
        inside = _find(data, inside + 1)
    return size


def _columns(type_, values, depth):
    """Converts messages to columns. values: nested lists of depth `depth`; the outermost has one entry per message."""
    columns = {}
    for member in type_.members:
        inner = _pick(values, member.name, depth)
        if member.type in messages.types():
            columns[member.name] = _columns(
                messages.types()[member.type], inner, depth + len(member.dimensions)
            )
        else:
            columns[member.name] = _stacked(inner, member, depth)
    return columns


def _pick(values, name, depth):
    return values[name] if depth == 0 else [_pick(value, name, depth - 1) for value in values]


def _stacked(values, member, depth):
    if depth == 0 or member.type == "string":
        return values
    parts = [_stacked(value, member, depth - 1) for value in values]
    if not parts:
        shape = [size if isinstance(size, int) else 0 for size in member.dimensions]
        return np.zeros([0] * depth + shape, messages.dtype(member.type))
    if any(isinstance(part, list) for part in parts) or len({np.shape(part) for part in parts}) > 1:
        return parts
    return np.array(parts, messages.dtype(member.type))
