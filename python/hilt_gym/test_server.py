"""Who is let in, and what is answered to bad messages: PYTHONPATH=src pytest test_server.py (needs the package's dependencies and pytest)."""

import socket
import threading
import time
from contextlib import ExitStack

import numpy as np
import pytest
from hilt_gym import PolicyServer, Refused, unpack
from hilt_gym.server import MOST_CALLERS, admits
from hilt_gym.wire import DIRECT, Conversation
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

TOKEN = "0123456789abcdef"


def test_a_token_admits_whoever_knows_it():
    for header in (f"Bearer {TOKEN}", f"bearer  {TOKEN} ", f"Api-Key {TOKEN}"):
        assert admits(TOKEN, header), header
    for header in ("", "Bearer", f"Bearer {TOKEN}f", f"Basic {TOKEN}", TOKEN, f"Bearer {TOKEN[:-1]}", "Bearer \udce4"):
        assert not admits(TOKEN, header), header


def test_openpis_client_is_let_in():
    with PolicyServer(lambda observation: np.zeros(2), metadata={"a": 1}, token=TOKEN) as server:
        for scheme in ("Bearer", "Api-Key"):
            with connect(server.address, additional_headers={"Authorization": f"{scheme} {TOKEN}"}, **DIRECT) as socket:
                assert unpack(socket.recv()) == {"a": 1}
        with pytest.raises(InvalidStatus, match="401"):
            connect(server.address, additional_headers={"Authorization": "Api-Key wrong"}, **DIRECT)


def test_what_is_no_map_is_an_error_and_the_conversation_goes_on():
    seen = []

    def act(observation):
        seen.append(observation)
        return np.zeros(2)

    with PolicyServer(act) as server:
        talk = Conversation(server.address)
        for message in ([1, 2], 7, "words", None):
            with pytest.raises(Refused, match="it must be a map"):
                talk.ask(message)
        talk._socket.send("words")
        with pytest.raises(Refused, match="it must be a map"):
            talk._receive()
        assert talk.ask({"x": 1})["actions"].shape == (1, 2)
        talk.close()
    assert seen == [{"x": 1}]


def test_no_more_than_so_many_at_the_same_time():
    with pytest.raises(ValueError, match="at least 1"):
        PolicyServer(lambda observation: np.zeros(2), connections=0)
    with PolicyServer(lambda observation: np.zeros(2), connections=2) as server:
        talks = [Conversation(server.address) for _ in range(2)]
        for _ in range(5):
            with pytest.raises(InvalidStatus, match="503"):
                Conversation(server.address)
        talks.pop().close()
        until = time.monotonic() + 5
        while True:  # its place is free as soon as its thread has ended
            try:
                talks.append(Conversation(server.address))
                break
            except InvalidStatus:
                assert time.monotonic() < until
                time.sleep(0.01)
        assert talks[-1].ask({})["actions"].shape == (1, 2)
        for talk in talks:
            talk.close()
    assert "policy server" not in [thread.name for thread in threading.enumerate()], "close waits for nobody who was turned away"


def test_who_says_nothing_takes_no_place():
    with PolicyServer(lambda observation: np.zeros(2), connections=1) as server, ExitStack() as silent:
        name, port = server.address.removeprefix("ws://").split(":")
        call = lambda: silent.enter_context(socket.create_connection((name, int(port))))
        for _ in range(MOST_CALLERS - 4):
            call()
        talk = Conversation(server.address)
        assert talk.ask({})["actions"].shape == (1, 2)
        talk.close()
        for _ in range(8):
            last = call()
        last.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert b" 503 " in last.recv(1000), "there are threads for so many, not for all"
        silent.close()
