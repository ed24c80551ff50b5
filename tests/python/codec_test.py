"""Tests the codec against bytes that were computed by hand from openpi's convention."""

import support

support.need("numpy", "msgpack")

import unittest

import numpy as np
from evalbus import codec

ARRAY = "81a16184c40b5f5f6e6461727261795f5fc3c40464617461c403000102c4056474797065a37c7531c40573686170659103"
REPLY = (
    "82a7616374696f6e7384c40b5f5f6e6461727261795f5fc3c40464617461c4080000003f000080bfc4056474797065a33c6634"
    "c4057368617065920102ad7365727665725f74696d696e6781a8696e6665725f6d73cb3ff8000000000000"
)
# The same array with text keys, as vla-eval writes them.
TEXT_KEYS = "81a16184ab5f5f6e6461727261795f5fc3a464617461c403000102a56474797065a37c7531a573686170659103"
# {"x": {b"__npgeneric__": true, b"data": 3, b"dtype": "<i4"}}
SCALAR = "81a17883c40d5f5f6e7067656e657269635f5fc3c4046461746103c4056474797065a33c6934"


def array_bytes(**changes):
    value = {"__ndarray__": True, "data": b"\0" * 8, "dtype": "<f4", "shape": [2], **changes}
    return codec.pack({key: part for key, part in value.items() if part is not None})


class Codec(unittest.TestCase):
    def test_packs_the_vectors(self):
        self.assertEqual(codec.pack({}).hex(), "80")
        self.assertEqual(codec.pack({"a": np.array([0, 1, 2], np.uint8)}).hex(), ARRAY)
        reply = {"actions": np.array([[0.5, -1]], np.float32), "server_timing": {"infer_ms": 1.5}}
        self.assertEqual(codec.pack(reply).hex(), REPLY)
        self.assertEqual(codec.pack({"x": np.int32(3)}).hex(), SCALAR)

    def test_unpacks_the_vectors(self):
        for text in (ARRAY, TEXT_KEYS):
            value = codec.unpack(bytes.fromhex(text))["a"]
            self.assertEqual((value.dtype, value.tolist()), (np.uint8, [0, 1, 2]))
        reply = codec.unpack(bytes.fromhex(REPLY))
        self.assertEqual((reply["actions"].dtype, reply["actions"].tolist()), (np.float32, [[0.5, -1]]))
        self.assertEqual(reply["server_timing"], {"infer_ms": 1.5})
        scalar = codec.unpack(bytes.fromhex(SCALAR))["x"]
        self.assertEqual((type(scalar), scalar), (np.int32, 3))

    def test_every_kind_of_array_comes_back(self):
        for array in (
            np.arange(24, dtype=np.float64).reshape(2, 3, 4)[:, ::-1, 1:],
            np.asfortranarray([[1, 2], [3, 4]]),
            np.array([1, 256], ">i2"),
            np.array([True, False]),
            np.array(7.5, np.float32),
            np.zeros((0, 3)),
            np.array(["pot", "lid"]),
        ):
            back = codec.unpack(codec.pack(array))
            np.testing.assert_array_equal(back, array)
            self.assertEqual((back.dtype, back.shape), (array.dtype, array.shape))
            self.assertTrue(back.flags.writeable)

    def test_refuses_to_send_what_is_no_number(self):
        for value in (
            np.array([None]),
            np.array([1j]),
            np.zeros(1, "i4,f4"),
            np.complex64(1),
            object(),
            {1, 2},
        ):
            with self.assertRaisesRegex(codec.CodecError, "sent|supported"):
                codec.pack({"x": value})

    def test_refuses_arrays_that_are_none(self):
        codec.unpack(array_bytes())
        for changes in (
            dict(dtype="|O"),
            dict(dtype="<c8", shape=[1]),
            dict(dtype="i4,f4", shape=[1]),
            dict(dtype="boredom"),
            dict(dtype=4),
            dict(dtype=None),
            dict(data="text"),
            dict(data=b"\0" * 7),
            dict(shape=[3]),
            dict(shape=[-1, -2]),
            dict(shape=[1 << 40, 0]),
            dict(shape=[2.0]),
            dict(shape=[True, 2]),
            dict(shape=2),
            dict(shape=None),
        ):
            with self.subTest(changes), self.assertRaises(codec.CodecError):
                codec.unpack(array_bytes(**changes))

    def test_refuses_bytes_that_are_no_msgpack(self):
        whole = bytes.fromhex(REPLY)
        for size in range(len(whole)):
            with self.assertRaises(codec.CodecError):
                codec.unpack(whole[:size])
        # The texts announce a length of 4 GB, have an extra byte, have a byte that msgpack never uses, or have a text
        # that is not UTF-8.
        for text in ("c6ffffffff00", "8000", "c1", "a1ff"):
            with self.assertRaises(codec.CodecError):
                codec.unpack(bytes.fromhex(text))


support.main()
