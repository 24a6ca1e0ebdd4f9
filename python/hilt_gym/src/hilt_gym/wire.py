"""msgpack with NumPy's arrays, as openpi packs them, and a conversation in it. Nothing is ever unpickled."""

import inspect
from contextlib import ExitStack

import msgpack
import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

# hilt sends no larger message.
MOST_BYTES = 4 << 20
# No proxy stands between this machine and itself; older versions know none.
DIRECT = {"proxy": None} if "proxy" in inspect.signature(connect.__init__ if inspect.isclass(connect) else connect).parameters else {}
# Kinds of numbers: bool, signed, unsigned, floating.
KINDS = "biuf"


class Refused(RuntimeError):
    """The other end says why it does not answer."""


def _pack(value):
    if isinstance(value, (np.ndarray, np.generic)):
        if value.dtype.kind not in KINDS:
            raise ValueError(f"arrays of type {value.dtype} are not sent")
        value = value.astype(value.dtype.newbyteorder("<"), copy=False)
    if isinstance(value, np.ndarray):
        return {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
    if isinstance(value, np.generic):
        return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
    raise TypeError(f"{type(value).__name__} cannot be sent")


def _dtype(name):
    dtype = np.dtype(name)
    if dtype.kind not in KINDS:
        raise ValueError(f"arrays of type {name!r} are not taken")
    return dtype


def _unpack(value):
    if b"__ndarray__" in value:
        return np.frombuffer(value[b"data"], dtype=_dtype(value[b"dtype"])).reshape(value[b"shape"]).copy()
    if b"__npgeneric__" in value:
        return _dtype(value[b"dtype"]).type(value[b"data"])
    return value


def pack(value):
    """The bytes of a message."""
    return msgpack.packb(value, default=_pack)


def unpack(data):
    """The message in bytes."""
    return msgpack.unpackb(data, object_hook=_unpack, strict_map_key=False)


class Conversation:
    """Questions to a server, each with its answer. ``metadata`` is what the server says first."""

    def __init__(self, address, token=None, timeout=60.0):
        headers = {"Authorization": f"Bearer {token}"} if token else None
        self._timeout, self._open = timeout, ExitStack()
        self._socket = self._open.enter_context(
            connect(address, compression=None, max_size=MOST_BYTES, additional_headers=headers, open_timeout=timeout, **DIRECT)
        )
        try:
            self.metadata = self._receive()
        except BaseException:
            self.close()
            raise

    def _receive(self):
        answer = self._socket.recv(timeout=self._timeout)
        if isinstance(answer, str):
            raise Refused(answer)
        return unpack(answer)

    def ask(self, message):
        """Sends a message and returns the answer."""
        self._socket.send(pack(message))
        try:
            return self._receive()
        except ConnectionClosed as closed:
            raise ConnectionError("the server has ended the conversation") from closed

    def close(self):
        """Ends the conversation."""
        self._open.close()
