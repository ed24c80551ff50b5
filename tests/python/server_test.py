"""Tests serve() in a separate process, with a client over loopback."""

import support

support.need("numpy", "msgpack", "websockets")

import asyncio
import os
import pathlib
import socket
import tempfile
import unittest
import urllib.error
import urllib.request

import evalbus.server
import numpy as np
import websockets
from evalbus import codec

POLICY = pathlib.Path(__file__).with_name("policies_under_test.py")


async def ask(connection, what, **observation):
    await connection.send(codec.pack({"what": what, **observation}))
    return await connection.recv()


class ServerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = support.Server(POLICY, 0)

    @classmethod
    def tearDownClass(cls):
        cls.server.__exit__()

    def converse(self, conversation):
        async def checked(connection, metadata):
            self.assertEqual(metadata, {"name": "test", "reset_pose": [0, 1.5]})
            return await conversation(connection)

        return asyncio.run(support.converse(self.server.url, checked))

    def test_one_row_is_a_chunk_of_one_step(self):
        reply = self.converse(lambda c: ask(c, "row", state=np.array([0.5, -1], np.float32)))
        value = codec.unpack(reply)
        self.assertEqual((value["actions"].dtype, value["actions"].tolist()), (np.float32, [[1, -2]]))
        self.assertGreaterEqual(value["server_timing"]["infer_ms"], 0)
        self.assertEqual(set(value), {"actions", "server_timing"})

    def test_chunks_and_dictionaries(self):
        async def conversation(connection):
            chunk = codec.unpack(await ask(connection, "chunk"))
            return chunk, codec.unpack(await ask(connection, "dictionary"))

        chunk, dictionary = self.converse(conversation)
        self.assertEqual(chunk["actions"].tolist(), [[0, 1], [2, 3], [4, 5]])
        self.assertEqual(dictionary["actions"].tolist(), [[1, 2]])

    def test_each_connection_begins_with_reset(self):
        first = codec.unpack(self.converse(lambda c: ask(c, "dictionary")))
        second = codec.unpack(self.converse(lambda c: ask(c, "dictionary")))
        self.assertEqual(second["resets"], first["resets"] + 1)
        self.assertEqual(second["thread"], first["thread"])

    def test_a_policy_with_reset_serves_one_connection_at_a_time(self):
        async def conversation(first):
            async with websockets.connect(self.server.url) as second:
                refusal = await second.recv()
            return refusal, codec.unpack(await ask(first, "dictionary"))

        refusal, answer = self.converse(conversation)
        self.assertIn("serves one connection at a time", refusal)
        self.assertEqual(answer["actions"].tolist(), [[1, 2]])

    def test_each_connection_of_a_class_has_its_own_policy(self):
        with support.Server(POLICY, 0, "class") as server:

            async def conversation(first, _):
                async with websockets.connect(server.url) as second:
                    await second.recv()
                    counts = [codec.unpack(await ask(c, "count"))["calls"] for c in (first, second, first)]
                return counts

            self.assertEqual(asyncio.run(support.converse(server.url, conversation)), [1, 1, 2])

    def test_images_of_several_megabytes(self):
        # The message is larger than 1 MiB, the default limit of websockets.
        image = np.zeros((1080, 1920, 3), np.uint8)
        reply = self.converse(lambda c: ask(c, "row", state=image.reshape(-1)))
        self.assertEqual(codec.unpack(reply)["actions"].shape, (1, image.size))

    def expect_failure(self, request, *words):
        async def conversation(connection):
            await connection.send(request)
            text = await connection.recv()
            try:
                await connection.recv()
            except websockets.exceptions.ConnectionClosed as closed:
                return text, closed.rcvd.code
            self.fail("the connection is still open")

        text, code = self.converse(conversation)
        self.assertIsInstance(text, str)
        for word in ("Traceback", *words):
            self.assertIn(word, text)
        self.assertEqual(code, 1011)
        # The server continues to work.
        self.assertIn("actions", codec.unpack(self.converse(lambda c: ask(c, "chunk"))))

    def test_failures_are_told_and_close_the_connection(self):
        self.expect_failure(codec.pack({"what": "raise"}), "RuntimeError: the pot is too hot", "__call__")
        self.expect_failure(codec.pack({"what": "cube"}), "(1, 2, 3)")
        self.expect_failure(codec.pack({"what": "no actions"}), 'without "actions"')
        self.expect_failure(codec.pack({"what": "words"}), "expected numbers")
        self.expect_failure(codec.pack({"what": "an object"}), "expected numbers")

    def test_bad_requests_are_told(self):
        self.expect_failure("hello", "binary")
        self.expect_failure(b"\xc1", "not msgpack")
        self.expect_failure(codec.pack([1]), "expected a map of observations")

    def test_wrong_input(self):
        port = int(self.server.url.rpartition(":")[2])
        for error, words, arguments in (
            (evalbus.ProgramError, f"cannot serve a policy at 127.0.0.1:{port}: .*address already in use", (len, port)),
            (evalbus.ProgramError, "cannot serve a policy at 127.0.0.1:99999: ", (len, 99999)),
            (evalbus.InputError, "expected a function or a class, got int", (3, 0)),
        ):
            with self.assertRaisesRegex(error, words):
                evalbus.serve(*arguments)

    def test_an_ipv6_address(self):
        async def url():
            found, server = [], evalbus.server._Server(len, {})

            def on_ready(ready):
                found.append(ready)
                server.stop()

            await server.run("::1", 0, on_ready)
            return found[0]

        try:
            self.assertRegex(asyncio.run(url()), r"^ws://\[::1\]:\d+$")
        except OSError as error:
            self.skipTest(f"no IPv6: {error}")

    def test_health(self):
        url = self.server.url.replace("ws:", "http:")
        with urllib.request.urlopen(url + "/healthz", timeout=support.DEADLINE_S) as answer:
            self.assertEqual((answer.status, answer.read()), (200, b"OK\n"))
        with self.assertRaises(urllib.error.HTTPError):
            urllib.request.urlopen(url + "/health", timeout=support.DEADLINE_S)

    def test_answers_pings_and_health_while_the_policy_computes(self):
        with tempfile.TemporaryDirectory() as folder:
            until = pathlib.Path(folder) / "until"
            os.mkfifo(until)

            async def conversation(connection):
                await connection.send(codec.pack({"what": "wait", "until": str(until)}))
                await (await connection.ping())
                await asyncio.get_running_loop().run_in_executor(None, self.test_health)
                until.write_text("continue")
                return await connection.recv()

            self.assertEqual(codec.unpack(self.converse(conversation))["actions"].tolist(), [[0]])

    def shake_hands(self, connection, header=b""):
        """Sends a handshake with one more header line. Returns the answer and the bytes after it."""
        connection.sendall(
            b"GET / HTTP/1.1\r\nHost: here\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n" + header + b"\r\n"
        )
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += connection.recv(4096)
        head, _, rest = answer.partition(b"\r\n\r\n")
        return head, rest

    def connect(self):
        host, port = self.server.url.removeprefix("ws://").split(":")
        return socket.create_connection((host, int(port)), timeout=support.DEADLINE_S)

    def test_offers_of_compression_are_declined(self):
        with self.connect() as connection:
            head, _ = self.shake_hands(connection, b"Sec-WebSocket-Extensions: permessage-deflate\r\n")
        self.assertTrue(head.startswith(b"HTTP/1.1 101"), head)
        self.assertNotIn(b"extensions", head.lower())

    def test_pages_in_browsers_are_refused(self):
        # A browser sends the page's origin with every WebSocket handshake, but a policy's client sends none.
        for origin in (b"http://evil.example", b"http://127.0.0.1:8000", b"null"):
            with self.connect() as connection:
                head, _ = self.shake_hands(connection, b"Origin: " + origin + b"\r\n")
            self.assertTrue(head.startswith(b"HTTP/1.1 403"), head)

    def test_a_request_that_would_fill_the_memory_is_refused_when_announced(self):
        with self.connect() as connection:
            _, received = self.shake_hands(connection)
            # This is the header of a binary frame of 1 GiB.
            connection.sendall(b"\x82\xff" + (1 << 30).to_bytes(8, "big") + b"\0\0\0\0")
            while part := connection.recv(4096):
                received += part
        # The server answers with a close frame that has the code for "message too big".
        self.assertIn((1009).to_bytes(2, "big"), received[-125:])


support.main()
