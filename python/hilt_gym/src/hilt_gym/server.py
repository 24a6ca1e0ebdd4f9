"""Any Python policy as a server that `hilt evaluate --policy ws://...` can evaluate."""

import hmac
import http
import socket
import threading
import time

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

from .wire import MOST_BYTES, pack, unpack

LOOPBACK = ("127.0.0.1", "::1", "localhost")
# As hilt takes them; openpi's client sends the second.
SCHEMES = ("bearer", "api-key")
MOST_CALLERS = 64  # at the same time who have not yet said who they are
BUSY = b"too many call at once; try again later\n"
TURN_AWAY_S = 1.0  # how long who is turned away may take to ask and to hear it; nobody waits for that
REQUEST_BYTES = 8 << 10


def admits(token, header):
    """Whether the value of an `Authorization` header holds the token; told in constant time."""
    scheme, _, said = header.strip().partition(" ")
    same = hmac.compare_digest(said.strip().encode(errors="surrogateescape"), token.encode())
    return same and scheme.lower() in SCHEMES


def turn_away(connection):
    """Says that there is no room and hangs up. What is asked is taken first: otherwise the system may drop the answer unheard."""
    head = f"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nContent-Length: {len(BUSY)}\r\nConnection: close\r\n\r\n"
    connection.settimeout(TURN_AWAY_S)
    try:
        connection.recv(REQUEST_BYTES)
    except OSError:  # Who says nothing is told all the same.
        pass
    try:
        connection.sendall(head.encode() + BUSY)
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:  # Who has gone does not want to know.
        pass
    connection.close()


class PolicyServer:
    """Serves a policy from a thread of its own until it is closed; ``address`` says where.

    ``function`` takes an observation, a dict with ``observation.state``, ``observation.environment_state``, ``task``, ``episode_index`` and
    ``frame_index``, and returns one action or several in rows. A policy that remembers something is given as ``make`` instead: it is called for
    each episode, which is a conversation of its own, and returns such a function. One call runs at a time. No more than ``connections`` are
    open at the same time; others are turned away with 503. Who has not shown the token takes no place.
    """

    def __init__(self, function=None, *, make=None, metadata=None, host="127.0.0.1", port=0, token=None, connections=16):
        if (function is None) == (make is None):
            raise ValueError("give a function, or make, which returns one for each episode")
        if host not in LOOPBACK and not token:
            raise ValueError(f"{host}: other machines could reach it; give a token that clients must send")
        if connections < 1:
            raise ValueError(f"connections is {connections}; at least 1 is needed")
        self._make = make or (lambda: function)
        self._metadata, self._token, self._lock = dict(metadata or {}), token, threading.Lock()
        self._server = serve(
            self._converse, host, port, compression=None, max_size=MOST_BYTES, process_request=self._admit, origins=[None]
        )
        self._seats, self._threads = threading.BoundedSemaphore(connections), threading.BoundedSemaphore(connections + MOST_CALLERS)
        self._handle, self._mine = self._server.handler, threading.local()
        self._server.handler = self._accept
        name, port = self._server.socket.getsockname()[:2]
        self.address = f"ws://[{name}]:{port}" if ":" in name else f"ws://{name}:{port}"
        self._thread = threading.Thread(target=self._server.serve_forever, name="policy server", daemon=True)
        self._thread.start()

    def _accept(self, connection, address):
        """Holds a conversation from its first byte to its last, in a thread of its own."""
        if not self._threads.acquire(blocking=False):
            turn_away(connection)
            # The library forgets its thread there; a socket that is closed ends it at once.
            self._handle(connection, address)
            return
        self._mine.seated = False
        try:
            self._handle(connection, address)
        finally:
            if self._mine.seated:
                self._seats.release()
            self._threads.release()

    def _admit(self, connection, request):
        if request.path == "/healthz":
            return connection.respond(http.HTTPStatus.OK, "OK\n")
        said = next(iter(request.headers.get_all("Authorization")), "")
        if self._token and not admits(self._token, said):
            return connection.respond(http.HTTPStatus.UNAUTHORIZED, "send the token: Authorization: Bearer TOKEN\n")
        self._mine.seated = self._seats.acquire(blocking=False)
        if not self._mine.seated:
            return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, "all connections are taken; try again later\n")
        return None

    def _converse(self, socket):
        try:
            socket.send(pack(self._metadata))
            with self._lock:
                act = self._make()
            for message in socket:
                began = time.perf_counter()
                try:
                    answer = self._answer(act, message)
                except Exception as error:  # The other end hears what went wrong; the policy goes on.
                    socket.send(f"{type(error).__name__}: {error}")
                    continue
                answer["server_timing"] = {"infer_ms": 1e3 * (time.perf_counter() - began)}
                socket.send(pack(answer))
        except ConnectionClosed:
            pass

    def _answer(self, act, message):
        observation = unpack(message) if isinstance(message, bytes) else message
        if not isinstance(observation, dict):
            raise ValueError(f"the message is of type {type(observation).__name__}; it must be a map in msgpack")
        if "reset" in observation:
            return {"reset": True}
        with self._lock:
            actions = np.asarray(act(observation), np.float32)
        return {"actions": actions[None] if actions.ndim == 1 else actions}

    def wait(self):
        """Serves until Ctrl-C."""
        try:
            while self._thread.is_alive():
                self._thread.join(0.2)
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def close(self):
        """Ends all conversations and frees the port."""
        self._server.shutdown()
        self._thread.join()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def serve_policy(function=None, *, make=None, metadata=None, host="127.0.0.1", port=8000, token=None, connections=16):
    """Serves a policy until Ctrl-C; the arguments are those of PolicyServer."""
    server = PolicyServer(function, make=make, metadata=metadata, host=host, port=port, token=token, connections=connections)
    print(server.address, flush=True)
    server.wait()
