"""Any Python policy as a server that `hilt evaluate --policy ws://...` can evaluate."""

import hmac
import http
import threading
import time

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

from .wire import MOST_BYTES, pack, unpack

LOOPBACK = ("127.0.0.1", "::1", "localhost")


class PolicyServer:
    """Serves a policy from a thread of its own until it is closed; ``address`` says where.

    ``function`` takes an observation, a dict with ``observation.state``, ``observation.environment_state``, ``task``, ``episode_index`` and
    ``frame_index``, and returns one action or several in rows. A policy that remembers something is given as ``make`` instead: it is called for
    each episode, which is a conversation of its own, and returns such a function. One call runs at a time.
    """

    def __init__(self, function=None, *, make=None, metadata=None, host="127.0.0.1", port=0, token=None):
        if (function is None) == (make is None):
            raise ValueError("give a function, or make, which returns one for each episode")
        if host not in LOOPBACK and not token:
            raise ValueError(f"{host}: other machines could reach it; give a token that clients must send")
        self._make = make or (lambda: function)
        self._metadata, self._token, self._lock = dict(metadata or {}), token, threading.Lock()
        self._server = serve(
            self._converse, host, port, compression=None, max_size=MOST_BYTES, process_request=self._admit, origins=[None]
        )
        name, port = self._server.socket.getsockname()[:2]
        self.address = f"ws://[{name}]:{port}" if ":" in name else f"ws://{name}:{port}"
        self._thread = threading.Thread(target=self._server.serve_forever, name="policy server", daemon=True)
        self._thread.start()

    def _admit(self, connection, request):
        if request.path == "/healthz":
            return connection.respond(http.HTTPStatus.OK, "OK\n")
        said = request.headers.get("Authorization", "")
        if self._token and not hmac.compare_digest(said.encode(), f"Bearer {self._token}".encode()):
            return connection.respond(http.HTTPStatus.UNAUTHORIZED, "send the token: Authorization: Bearer TOKEN\n")
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
        observation = unpack(message)
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


def serve_policy(function=None, *, make=None, metadata=None, host="127.0.0.1", port=8000, token=None):
    """Serves a policy until Ctrl-C; the arguments are those of PolicyServer."""
    server = PolicyServer(function, make=make, metadata=metadata, host=host, port=port, token=token)
    print(server.address, flush=True)
    server.wait()
