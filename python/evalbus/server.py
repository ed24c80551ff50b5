"""Serves a function as a policy over openpi's websocket protocol.

The first frame from the server is a map with its metadata. After that, each binary request contains an observation
and receives one binary reply, a map with "actions". If the policy raises an exception, the reply is the traceback as
text, and the connection is closed with code 1011.
GET /healthz returns OK. Frames are uncompressed, and requests have at most 256 MiB. Requests from web pages are rejected;
otherwise any site open in a browser on this machine could read the metadata and call the policy.
"""

import asyncio
import concurrent.futures
import http
import queue
import sys
import threading
import time
import traceback

import numpy as np
import websockets

from evalbus import codec
from evalbus.errors import ActionError, InputError, ProgramError, check_not_masked, check_sent_action_type

try:
    # websockets 13 and later; newer versions no longer contain the legacy API.
    from websockets.asyncio.server import serve as _serve

    def _health(connection, request):
        return connection.respond(http.HTTPStatus.OK, "OK\n") if request.path == "/healthz" else None

except ImportError:
    from websockets import serve as _serve

    def _health(path, _):
        return (http.HTTPStatus.OK, [("Content-Type", "text/plain")], b"OK\n") if path == "/healthz" else None

    # The legacy API requires a coroutine.
    _answer_health = _health

    async def _health(path, headers):
        return _answer_health(path, headers)


# Time for which a new connection waits until the previous one closes. Must be shorter than the client's timeout for the
# metadata.
_RELEASE_S = 5
# Longest time that Serving.close() waits for the end of the server.
_CLOSE_S = 1
_BUSY = (
    "another connection is open, and a policy with reset() keeps state during an episode, so it "
    "serves one connection at a time: use one worker, or pass the policy's class to evalbus.serve()"
)
# Maximum size of a request, which is held in memory as a whole.
_MAX_BYTES = 256 << 20


def serve(act, port=8000, host="127.0.0.1", metadata={}):
    """Serves a policy until the program is interrupted.

    act: called as act(observation) with a dictionary of numpy arrays and strings. It returns an action chunk: an array
    (H, D) of H steps of D numbers, an array (D,) for a single step, or a dictionary with such an array as "actions".
    act.reset(), if it exists, is called at the start of each connection. evalbus opens one connection per episode.
    All calls are made sequentially in one worker thread, not in the thread that called serve(). All connections share
    the policy. A policy with reset() is stateful and serves one connection at a time. To serve several episodes
    concurrently, pass its class; each connection then creates its own instance.
    port: 0 selects any free port, which is printed.
    host: use "0.0.0.0" to accept clients on other machines.
    metadata: sent to each client; evalbus compares it with its contract.

    Raises InputError if act is not callable, ProgramError if the port cannot be opened.
    """
    if not callable(act):
        raise InputError(f"policy: expected a function or a class, got {type(act).__name__}")
    server = _Server(act, metadata)
    try:
        asyncio.run(server.run(host, port, lambda url: print(f"policy server ready: {url}", flush=True)))
    except KeyboardInterrupt:
        pass
    except (OSError, OverflowError) as error:
        raise ProgramError(f"cannot serve a policy at {host}:{port}: {error}") from None


class Serving:
    """Serves a policy in a thread of this process until close(). url: its address, on this machine only.

    port: 0 selects any free port. Raises ProgramError if the port cannot be opened.
    error: the first exception that the policy raised; None if there is none. It is not printed.
    """

    def __init__(self, act, metadata={}, port=0):
        self._port = port
        self._server = _Server(act, metadata, self._keep)
        self._ready = threading.Event()
        self.url = self.error = None
        self._thread = threading.Thread(target=self._serve, name="evalbus policy server", daemon=True)
        self._thread.start()
        self._ready.wait()
        if not self.url:
            self._thread.join()
            if isinstance(self.error, (OSError, OverflowError)):
                raise ProgramError(f"cannot serve a policy at port {port}: {self.error}") from None
            raise self.error

    def close(self):
        self._server.stop()
        # Afterwards, the port is free. A policy that hangs delays this only for a short time.
        self._thread.join(_CLOSE_S)

    def _serve(self):
        try:
            asyncio.run(self._server.run("127.0.0.1", self._port, self._on_ready))
        except BaseException as error:
            self._keep(error)
        self._ready.set()

    def _on_ready(self, url):
        self.url = url
        self._ready.set()

    def _keep(self, error):
        self.error = self.error or (error.__cause__ if isinstance(error, _Carried) else error)


class _Server:
    def __init__(self, act, metadata, on_error=None):
        self._act = act
        self._hello = codec.pack(dict(metadata))
        self._on_error = on_error or _print
        self._loop = self._stopped = None

    async def run(self, host, port, on_ready):
        self._loop, self._stopped = asyncio.get_running_loop(), asyncio.Event()
        # Lock for a stateful policy. The connection that is being served holds it.
        is_stateful = hasattr(self._act, "reset") and not isinstance(self._act, type)
        turn = asyncio.Lock() if is_stateful else None
        # The policy runs in a worker thread, so that the event loop can serve pings and other connections.
        worker = _Worker()

        async def handle(connection):
            try:
                if turn is None:
                    await self._converse(connection, worker)
                elif await _taken(turn):
                    try:
                        await self._converse(connection, worker)
                    finally:
                        turn.release()
                else:
                    print(_BUSY, file=sys.stderr, flush=True)
                    await _refuse(connection, _BUSY)
            except websockets.exceptions.ConnectionClosed:
                pass

        try:
            async with _serve(
                handle,
                host,
                port,
                compression=None,
                max_size=_MAX_BYTES,
                # Only requests without Origin are accepted. Browsers always send it; policy clients do not.
                origins=[None],
                process_request=_health,
            ) as server:
                name = f"[{host}]" if ":" in host else host  # an IPv6 address
                on_ready(f"ws://{name}:{next(iter(server.sockets)).getsockname()[1]}")
                await self._stopped.wait()
        finally:
            worker.close()

    def stop(self):
        """Ends run(). May be called from any thread."""
        try:
            self._loop.call_soon_threadsafe(self._stopped.set)
        except RuntimeError:
            pass  # The loop has ended.

    async def _converse(self, connection, worker):
        act = self._act
        await connection.send(self._hello)
        try:
            if isinstance(act, type):
                act = await worker.call(act)
            if hasattr(act, "reset"):
                await worker.call(act.reset)
            async for request in connection:
                await connection.send(await worker.call(_answer, act, request))
        except websockets.exceptions.ConnectionClosed:
            raise
        except Exception as error:
            self._on_error(error)
            await _refuse(connection, traceback.format_exc())


class _Carried(RuntimeError):
    """Takes the place of an exception, its __cause__, that asyncio cannot pass."""

    def __init__(self, cause):
        super().__init__(repr(cause))
        self.__cause__ = cause


class _Worker:
    """Calls functions in a thread, one at a time. Unlike an executor's thread, it does not keep the process alive while
    a function hangs."""

    def __init__(self):
        self._calls = queue.SimpleQueue()
        threading.Thread(target=self._work, name="evalbus policy", daemon=True).start()

    async def call(self, function, *arguments):
        future = concurrent.futures.Future()
        self._calls.put((future, function, arguments))
        return await asyncio.wrap_future(future)

    def close(self):
        self._calls.put(None)

    def _work(self):
        while call := self._calls.get():
            future, function, arguments = call
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(function(*arguments))
            # asyncio cannot pass StopIteration to the coroutine that waits. There, ConnectionClosed would mean that the
            # client has left, and not that a connection of the policy ended.
            except (StopIteration, websockets.exceptions.ConnectionClosed) as error:
                future.set_exception(_Carried(error))
            except Exception as error:
                future.set_exception(error)
            except BaseException as error:  # SystemExit would end the event loop.
                future.set_exception(_Carried(error))


def _print(_):
    print(traceback.format_exc(), file=sys.stderr, flush=True)


async def _taken(turn):
    # The connection of the previous episode may still be closing.
    try:
        await asyncio.wait_for(turn.acquire(), _RELEASE_S)
        return True
    except asyncio.TimeoutError:
        return False


async def _refuse(connection, text):
    # The text may contain surrogates, for example for bytes of a file name that are not UTF-8.
    await connection.send(text.encode(errors="backslashreplace").decode())
    await connection.close(1011, "the previous frame has the reason")


def _answer(act, request):
    if isinstance(request, str):
        raise codec.CodecError("expected a binary request, got text")
    observation = codec.unpack(request)
    if not isinstance(observation, dict):
        raise codec.CodecError(f"expected a map of observations, got {type(observation).__name__}")
    began = time.perf_counter()
    reply = act(observation)
    infer_ms = (time.perf_counter() - began) * 1e3
    if not isinstance(reply, dict):
        reply = {"actions": reply}
    if "actions" not in reply:
        raise ValueError(f'the policy returned a dictionary without "actions": {", ".join(map(str, reply))}')
    return codec.pack({**reply, "actions": _chunk(reply["actions"]), "server_timing": {"infer_ms": infer_ms}})


def _chunk(actions):
    check_not_masked(actions)
    actions = np.asarray(actions)
    check_sent_action_type(actions, "actions are")
    if actions.ndim == 1:
        actions = actions[None]
    if actions.ndim != 2 or actions.size == 0:
        filled = ", not empty" if actions.size == 0 else ""
        raise ActionError(f"actions have the shape {actions.shape}, expected (steps, numbers) or (numbers,){filled}")
    return actions
