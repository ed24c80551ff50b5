"""Encodes and decodes evalbus' messages in LCM's binary format, according to the definitions in lcmtypes/*.lcm.

A message is a dictionary of its members: numbers, strings, numpy arrays (arrays of numbers), lists (arrays of
strings), and dictionaries or lists of them (nested messages). Neither generated code nor the lcm module is needed.
"""

import dataclasses
import functools
import math
import pathlib
import re
import struct

import numpy as np

_DTYPES = {
    # The encoding is big-endian.
    "int8_t": ">i1",
    "int16_t": ">i2",
    "int32_t": ">i4",
    "int64_t": ">i8",
    "byte": ">u1",
    "boolean": ">i1",
    "float": ">f4",
    "double": ">f8",
}


class MessageError(ValueError):
    """The bytes are not a valid message, or a dictionary does not match its message type."""


@dataclasses.dataclass(frozen=True)
class Member:
    name: str
    type: str
    # Sizes of an array: each is a number, or the name of a preceding member that contains the size.
    dimensions: tuple


@dataclasses.dataclass(frozen=True)
class Type:
    name: str
    members: tuple
    constants: dict
    # Hash by which LCM identifies the type.
    fingerprint: int


def types():
    """Returns a map from the name ("state_t") to the Type of each message."""
    return _types()[0]


def dtype(name):
    """Returns the numpy dtype of an LCM number type ("int32_t")."""
    return np.dtype(bool) if name == "boolean" else np.dtype(_DTYPES[name]).newbyteorder("=")


def decode(data):
    """Decodes a message; returns (name of its type, message). Raises MessageError."""
    if len(data) < 8:
        raise MessageError(f"expected a message of at least 8 bytes, got {len(data)}")
    fingerprint = int.from_bytes(data[:8], "big")
    found = _types()[1].get(fingerprint)
    if found is None:
        raise MessageError(f"{fingerprint:016x}: no message of this version of evalbus has this fingerprint")
    reader = _Reader(data, found.name)
    message = reader.struct(found)
    if reader.at != len(data):
        raise MessageError(f"{found.name}: expected {reader.at} bytes, got {len(data)}")
    return found.name, message


def encode(name, message):
    """Encodes a message of the named type ("action_t").

    Missing members become zero or empty; a missing size member is set to the size of its array. Raises MessageError.
    """
    if name not in types():
        raise MessageError(f"there is no message type {name}")
    parts = [types()[name].fingerprint.to_bytes(8, "big")]
    _encode_struct(types()[name], message, parts, name)
    return b"".join(parts)


class _Reader:
    def __init__(self, data, name):
        self.data = memoryview(data)
        self.at = 8
        self.name = name

    def take(self, size):
        if size > len(self.data) - self.at:
            raise MessageError(f"{self.name}: truncated, or a count is too large")
        self.at += size
        return self.data[self.at - size : self.at]

    def struct(self, type_):
        values = {}
        for member in type_.members:
            shape = [size if isinstance(size, int) else values[size] for size in member.dimensions]
            if any(size < 0 for size in shape):
                raise MessageError(f"{self.name}: {member.name} has a negative size")
            values[member.name] = self.array(member.type, shape)
        return values

    def array(self, name, shape):
        if name in _DTYPES:
            wire = np.dtype(_DTYPES[name])
            taken = np.frombuffer(self.take(math.prod(shape) * wire.itemsize), wire).astype(dtype(name))
            return taken.reshape(shape) if shape else taken[0].item()
        if not shape:
            return self.text() if name == "string" else self.struct(types()[name])
        if shape[0] * _least_bytes(name) > len(self.data) - self.at:
            raise MessageError(f"{self.name}: truncated, or a count is too large")
        return [self.array(name, shape[1:]) for _ in range(shape[0])]

    def text(self):
        (size,) = struct.unpack(">i", self.take(4))
        if size < 1:
            raise MessageError(f"{self.name}: the length of a text is {size}, expected at least 1")
        text = bytes(self.take(size))
        if text.find(b"\0") != size - 1:
            raise MessageError(f"{self.name}: the terminating NUL of a text is not at its stated length")
        return text[:-1].decode("utf-8", "surrogateescape")


def _encode_struct(type_, message, parts, where):
    unknown = set(message) - {member.name for member in type_.members}
    if unknown:
        raise MessageError(f"{where} has no member {', '.join(sorted(unknown))}")
    sizes = {}
    for member in type_.members:
        for axis, size in enumerate(member.dimensions):
            if isinstance(size, str) and member.name in message:
                sizes.setdefault(
                    size, np.shape(message[member.name])[axis] if axis else len(message[member.name])
                )
    sizes = {name: message.get(name, size) for name, size in sizes.items()}
    for member in type_.members:
        shape = [size if isinstance(size, int) else int(sizes.get(size, 0)) for size in member.dimensions]
        value = sizes[member.name] if member.name in sizes else message.get(member.name)
        _encode(member.type, shape, value, parts, f"{where}.{member.name}")


def _encode(name, shape, value, parts, where):
    if name in _DTYPES:
        value = np.zeros(shape) if value is None else np.asarray(value)
        if value.shape != tuple(shape) or value.dtype.kind not in "biuf":
            raise MessageError(
                f"{where}: expected numbers of shape {tuple(shape)}, got {value.dtype} of shape {value.shape}"
            )
        wire = value.astype(_DTYPES[name])
        if wire.dtype.kind in "iu" and not np.array_equal(wire, value):
            raise MessageError(f"{where}: {value} is not a value of type {name}")
        parts.append(wire.tobytes())
    elif shape:
        value = [None] * shape[0] if value is None else value
        if len(value) != shape[0]:
            raise MessageError(f"{where}: {len(value)} values, expected {shape[0]}")
        for index, element in enumerate(value):
            _encode(name, shape[1:], element, parts, f"{where}[{index}]")
    elif name == "string":
        if not isinstance(value, (str, type(None))):
            raise MessageError(f"{where}: {value} is not a text")
        text = (value or "").encode("utf-8", "surrogateescape")
        if b"\0" in text:
            raise MessageError(f"{where}: expected a text without NUL")
        parts.append(struct.pack(">i", len(text) + 1) + text + b"\0")
    else:
        _encode_struct(types()[name], {} if value is None else value, parts, where)


@functools.lru_cache(maxsize=None)
def _least_bytes(name):
    """Returns the minimum encoded size of a value in bytes. A string has at least its length and a NUL."""
    if name == "string":
        return 5
    if name in _DTYPES:
        return np.dtype(_DTYPES[name]).itemsize
    least = 0
    for member in types()[name].members:
        if all(isinstance(size, int) for size in member.dimensions):
            least += math.prod(member.dimensions) * _least_bytes(member.type)
    return max(least, 1)


@functools.lru_cache(maxsize=None)
def _types():
    folder = pathlib.Path(__file__).parent / "lcmtypes"
    parsed = dict(_parse(file) for file in sorted(folder.glob("*.lcm")))
    if not parsed:
        raise MessageError(f"no message definitions in {folder}")
    found = {}
    for name, (members, constants) in parsed.items():
        found[name] = Type(name, members, constants, _fingerprint(parsed, name))
    return found, {type_.fingerprint: type_ for type_ in found.values()}


_TOKEN = re.compile(r"//[^\n]*|/\*.*?\*/|([A-Za-z_][\w.]*|[-+]?[\d.][\w.+-]*|\S)|\s", re.DOTALL)


def _parse(file):
    """Parses a file; returns (name, (members, constants)) of its struct. Supports only the syntax used in lcmtypes/."""
    tokens = [match[1] for match in _TOKEN.finditer(file.read_text()) if match[1]]
    at = 0

    def next_token(expected=None):
        nonlocal at
        token = tokens[at] if at < len(tokens) else "the end"
        at += 1
        if expected is not None and token != expected:
            raise MessageError(f"{file}: expected {expected}, got {token}")
        return token

    next_token("package")
    next_token()
    next_token(";")
    next_token("struct")
    name = next_token()
    next_token("{")
    members, constants = [], {}
    while (type_ := next_token()) != "}":
        if type_ == "const":
            number = float if next_token() in ("float", "double") else int
            separator = ","
            while separator == ",":
                constant = next_token()
                next_token("=")
                constants[constant] = number(next_token())
                separator = next_token()
        else:
            separator = ","
            while separator == ",":
                member, dimensions = next_token(), []
                while (separator := next_token()) == "[":
                    size = next_token()
                    dimensions.append(int(size) if size.isdigit() else size)
                    next_token("]")
                members.append(Member(member, type_, tuple(dimensions)))
        if separator != ";":
            raise MessageError(f"{file}: expected ;, got {separator}")
    return name, (tuple(members), constants)


# LCM's fingerprint, as computed by lcm-gen: a hash of a struct's member names, built-in types and dimensions, plus
# the fingerprints of nested structs.


def _signed(value):
    value &= 0xFFFFFFFFFFFFFFFF
    return value - (1 << 64) if value >> 63 else value


def _hash_byte(hash_, byte):
    return _signed(((hash_ << 8) ^ (hash_ >> 55)) + byte)


def _hash_text(hash_, text):
    for byte in [len(text), *text.encode()]:
        hash_ = _hash_byte(hash_, byte)
    return hash_


def _fingerprint(parsed, name, inside=()):
    if name in inside:
        return 0
    if name not in parsed:
        raise MessageError(f"{inside[-1]} has a member of type {name}, which is not defined")
    members, _ = parsed[name]
    hash_ = 0x12345678
    for member in members:
        hash_ = _hash_text(hash_, member.name)
        if member.type in _DTYPES or member.type == "string":
            hash_ = _hash_text(hash_, member.type)
        hash_ = _hash_byte(hash_, len(member.dimensions))
        for size in member.dimensions:
            hash_ = _hash_byte(hash_, 0 if isinstance(size, int) else 1)
            hash_ = _hash_text(hash_, str(size))
    for member in members:
        if member.type not in _DTYPES and member.type != "string":
            hash_ += _fingerprint(parsed, member.type, (*inside, name))
    hash_ &= 0xFFFFFFFFFFFFFFFF
    return (hash_ << 1 | hash_ >> 63) & 0xFFFFFFFFFFFFFFFF
