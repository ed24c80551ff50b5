"""Serves a function as a policy over openpi's websocket protocol.

The first frame from the server is a map with its metadata. After that, each binary request contains an observation
and receives one binary reply, a map with "actions". If the policy raises an exception, the reply is the traceback as
text, and the connection is closed with code 1011.
GET /healthz returns OK. Frames are uncompressed and at most 256 MiB. Requests from web pages are rejected; otherwise
any site open in a browser on this machine could read the metadata and call the policy.
"""

import asyncio
import concurrent.futures
import http
import sys
import time
import traceback

import numpy as np
import websockets

from evalbus import codec

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


# How long a connection waits for the previous one to close; must be shorter than the client's timeout for the metadata.
_RELEASE_S = 5
_BUSY = (
    "this policy has reset(), so it remembers its episode and serves one connection at a time, and another one is "
    "open: use one worker, or pass the policy's class to evalbus.serve()"
)
# Maximum size of a request, which is held in memory as a whole.
_MAX_BYTES = 256 << 20


def serve(act, port=8000, host="127.0.0.1", metadata={}):
    """Serves a policy until the program is interrupted.

    act: called as act(observation) with a dictionary of numpy arrays and texts. It returns an action chunk: an array
    (H, D) of H steps of D numbers, an array (D,) for a single step, or a dictionary with such an array as "actions".
    act.reset(), if it exists, is called at the start of each connection. evalbus opens one connection per episode.
    All calls are made sequentially in one worker thread, not in the thread that called serve(). All connections share
    the policy. A policy with reset() is stateful and serves one connection at a time. To serve several episodes
    concurrently, pass its class; each connection then creates its own instance.
    port: 0 selects any free port, which is printed.
    host: use "0.0.0.0" to accept clients on other machines.
    metadata: sent to each client; evalbus compares it with its contract.
    """
    hello = codec.pack(dict(metadata))
    try:
        asyncio.run(_run(act, hello, host, port))
    except KeyboardInterrupt:
        pass


async def _run(act, hello, host, port):
    # For a stateful policy: held by the connection that is being served.
    turn = asyncio.Lock() if hasattr(act, "reset") and not isinstance(act, type) else None

    # The policy runs in a worker thread, so that the event loop can serve pings and other connections.
    with concurrent.futures.ThreadPoolExecutor(max_workers=1) as worker:

        async def handle(connection):
            try:
                if turn is None:
                    await _converse(connection, act, hello, worker)
                elif await _taken(turn):
                    try:
                        await _converse(connection, act, hello, worker)
                    finally:
                        turn.release()
                else:
                    await _refuse(connection, _BUSY)
            except websockets.exceptions.ConnectionClosed:
                pass

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
            address = next(iter(server.sockets)).getsockname()
            print(f"policy server ready: ws://{host}:{address[1]}", flush=True)
            await asyncio.get_running_loop().create_future()


async def _taken(turn):
    # The connection of the previous episode may still be closing.
    try:
        await asyncio.wait_for(turn.acquire(), _RELEASE_S)
        return True
    except asyncio.TimeoutError:
        return False


async def _refuse(connection, text):
    print(text, file=sys.stderr, flush=True)
    await connection.send(text)
    await connection.close(1011, "the policy failed; the previous frame has the reason")


async def _converse(connection, act, hello, worker):
    loop = asyncio.get_running_loop()
    await connection.send(hello)
    try:
        if isinstance(act, type):
            act = await loop.run_in_executor(worker, act)
        if hasattr(act, "reset"):
            await loop.run_in_executor(worker, act.reset)
        async for request in connection:
            await connection.send(await loop.run_in_executor(worker, _answer, act, request))
    except websockets.exceptions.ConnectionClosed:
        raise
    except Exception:
        await _refuse(connection, traceback.format_exc())


def _answer(act, request):
    if isinstance(request, str):
        raise codec.CodecError("a request is a binary frame, this one is text")
    observation = codec.unpack(request)
    if not isinstance(observation, dict):
        raise codec.CodecError(f"an observation is a map, this one is {type(observation).__name__}")
    began = time.perf_counter()
    reply = act(observation)
    infer_ms = (time.perf_counter() - began) * 1e3
    if not isinstance(reply, dict):
        reply = {"actions": reply}
    if "actions" not in reply:
        raise ValueError(f'the policy returned a dictionary without "actions": {", ".join(map(str, reply))}')
    return codec.pack({**reply, "actions": _chunk(reply["actions"]), "server_timing": {"infer_ms": infer_ms}})


def _chunk(actions):
    actions = np.asarray(actions)
    if actions.dtype.kind not in "biuf":
        raise ValueError(f"actions are of type {actions.dtype}, expected numbers")
    if actions.ndim == 1:
        actions = actions[None]
    if actions.ndim != 2 or actions.size == 0:
        raise ValueError(f"actions have the shape {actions.shape}, expected (steps, numbers) or (numbers,)")
    return actions
