"""msgpack with numpy arrays, in the format of openpi's policy servers and clients.

An array is a map {b"__ndarray__": true, b"data": bytes in C order, b"dtype": dtype.str, b"shape": sizes}.
A numpy scalar is a map {b"__npgeneric__": true, b"data": number, b"dtype": dtype.str}. Keys may also be text.
Decoding cannot execute code: pickle is not used, and object arrays are rejected in both directions.
"""

import msgpack
import numpy as np

# Supported numpy kinds: booleans, integers, floating-point numbers, fixed-length bytes and text.
_KINDS = "biufSU"


class CodecError(ValueError):
    """The bytes are not a valid message, or the value cannot be encoded."""


def pack(value):
    """Encodes dictionaries, lists, strings, numbers, None and numpy arrays. Raises CodecError."""
    try:
        return msgpack.packb(value, default=_to_map)
    except CodecError:
        raise
    except (ValueError, TypeError, OverflowError) as error:
        raise CodecError(f"cannot be sent: {error}") from None


def unpack(data):
    """Decodes a value; arrays are writable copies. Raises CodecError."""
    try:
        return msgpack.unpackb(data, object_hook=_from_map)
    except CodecError:
        raise
    except (ValueError, TypeError, msgpack.exceptions.UnpackException) as error:
        raise CodecError(f"not msgpack: {error or type(error).__name__}") from None


def _to_map(value):
    if isinstance(value, np.ndarray):
        _check(value.dtype)
        return {
            b"__ndarray__": True,
            b"data": value.tobytes(),
            b"dtype": value.dtype.str,
            b"shape": value.shape,
        }
    if isinstance(value, np.generic):
        _check(value.dtype)
        return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
    raise CodecError(f"cannot be sent: {type(value).__name__}; convert it to a numpy array, a number or a string")


def _from_map(value):
    named = {key.decode("utf-8", "replace") if isinstance(key, bytes) else key: key for key in value}
    for mark in ("__ndarray__", "__npgeneric__"):
        if mark in named:
            break
    else:
        return value
    try:
        data, dtype = value[named["data"]], np.dtype(value[named["dtype"]])
        _check(dtype)
        if mark == "__npgeneric__":
            return dtype.type(data)
        shape = value[named["shape"]]
        if not isinstance(data, bytes):
            raise CodecError(f"an array's data is {type(data).__name__}, not bytes")
        if any(type(size) is not int or size < 0 for size in shape):
            raise CodecError(f"an array's shape is {shape}, expected sizes of at least 0")
        return np.frombuffer(data, dtype).reshape(shape).copy()
    except KeyError as error:
        raise CodecError(f"an array without the key {error}") from None
    except CodecError:
        raise
    except (TypeError, ValueError) as error:
        raise CodecError(f"not a valid array: {error}") from None


def _check(dtype):
    if dtype.kind not in _KINDS or (dtype.kind == "f" and dtype.itemsize > 8):
        raise CodecError(f"numpy type {dtype} is not supported: expected real numbers of at most 64 bits, booleans or strings")
