"""openpi's protocol: its packing to the letter, and its own client, which knows nothing of hilt.

Usage: openpi.py HILT RUNS, after wire.py, which installs what it needs. Exits 1 at the first thing that is not as promised.
"""

import functools
import os
import sys
import tempfile
import time
from pathlib import Path

import msgpack
import numpy as np
from hilt_gym import HiltProcess, PolicyServer
from openpi_client.action_chunk_broker import ActionChunkBroker
from openpi_client.websocket_client_policy import WebsocketClientPolicy
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

TASK = "pick-up"
TOKEN = "0123456789abcdef"
OBSERVATIONS = 200


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def pack_array(value):
    if isinstance(value, np.ndarray):
        return {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
    if isinstance(value, np.generic):
        return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
    return value


def unpack_array(value):
    if b"__ndarray__" in value:
        return np.ndarray(buffer=value[b"data"], dtype=np.dtype(value[b"dtype"]), shape=value[b"shape"])
    if b"__npgeneric__" in value:
        return np.dtype(value[b"dtype"]).type(value[b"data"])
    return value


pack = msgpack.Packer(default=pack_array).pack
unpack = functools.partial(msgpack.unpackb, object_hook=unpack_array)


def call(server, key=None):
    """A conversation as openpi's client holds it."""
    headers = {"Authorization": f"Api-Key {key}"} if key else None
    return connect(server.address, compression=None, max_size=None, additional_headers=headers)


def check_packing(hilt, policy_file):
    """What a client of openpi's sends and reads, written out."""
    with HiltProcess("serve", policy_file, binary=hilt) as server, call(server) as socket:
        about = unpack(socket.recv())
        check(about["task"] == TASK and about["period_s"] == 0.05, f"metadata {about}")
        observation = {key: np.zeros(len(names)) for key, names in about["keys"].items()}
        observation |= {"prompt": "do it", "image": np.zeros((224, 224, 3), np.uint8), "gripper": np.float32(0.5)}
        socket.send(pack(observation))
        first = unpack(socket.recv())
        check(first["actions"].shape == (1, len(about["actions"])) and first["actions"].dtype == np.float32, f"answer {first}")
        check(first["server_timing"]["infer_ms"] >= 0.0, f"timing {first}")
        socket.send(pack({"image": observation["image"]}))
        refusal = socket.recv()
        check(isinstance(refusal, str) and "observation.state" in refusal, f"refusal {refusal}")
        pickled = {b"__ndarray__": True, b"data": b"\x80\x04.", b"dtype": "|O", b"shape": (1,)}
        socket.send(msgpack.packb({"observation.state": pickled}))
        check("|O" in socket.recv(), "an array of objects is not refused")
        times = []
        for _ in range(2000):
            began = time.perf_counter()
            socket.send(pack(observation))
            again = unpack(socket.recv())
            times.append(1e3 * (time.perf_counter() - began))
        check(np.array_equal(again["actions"], first["actions"]), "the same observation has another action")
    p50, p99 = np.percentile(times, [50, 99])
    print(f"openpi's packing is spoken; with a picture aboard p50 {p50:.3f} ms, p99 {p99:.3f} ms")


def check_client(hilt, policy_file):
    """openpi's client, with the secret as it sends it, gets the answers that the packing written out gets."""

    def turned_away(server, key):
        try:
            WebsocketClientPolicy(server.address, api_key=key)
        except InvalidStatus as why:
            return why.response.status_code == 401
        return False

    with tempfile.NamedTemporaryFile("w") as secret:
        secret.write(TOKEN)
        secret.flush()
        with HiltProcess("serve", policy_file, "--token-file", secret.name, binary=hilt) as server, call(server, TOKEN) as socket:
            check(turned_away(server, None) and turned_away(server, TOKEN[::-1]), "who has no secret, or another, is let in")
            client, about = WebsocketClientPolicy(server.address, api_key=TOKEN), unpack(socket.recv())
            check(client.get_server_metadata() == about and about["task"] == TASK, f"metadata {client.get_server_metadata()}")
            broker, rng = ActionChunkBroker(client, action_horizon=1), np.random.default_rng(0)
            for _ in range(OBSERVATIONS):
                observation = {key: rng.standard_normal(len(names)).astype(np.float32) for key, names in about["keys"].items()}
                socket.send(pack(observation))
                known = unpack(socket.recv())
                found = client.infer(observation)
                for name in ("actions", "unlimited_actions"):
                    same = (name in found) == (name in known) and np.array_equal(found.get(name), known.get(name))
                    check(same, f"{name}: openpi's client has {found.get(name)}, the packing {known.get(name)}")
                check(np.array_equal(broker.infer(observation)["actions"], known["actions"][0]), "openpi's broker has another action")
                client.reset()
                broker.reset()
            try:
                client.infer({"image": np.zeros((8, 8, 3), np.uint8)})
                check(False, "an observation without a state is answered")
            except RuntimeError as why:
                check("observation.state" in str(why), f"refusal {why}")
            check(np.array_equal(client.infer(observation)["actions"], known["actions"]), "after a refusal it has another action")
    print(f"openpi's client: metadata, secret, and to the bit the actions of {OBSERVATIONS} observations")


def check_client_of_python():
    """openpi's client talks to what hilt_gym serves, too."""
    with PolicyServer(lambda observation: 2 * observation["x"], metadata={"a": 1}, token=TOKEN) as server:
        client = WebsocketClientPolicy(server.address, api_key=TOKEN)
        check(client.get_server_metadata() == {"a": 1}, f"metadata {client.get_server_metadata()}")
        found = client.infer({"x": np.float32([1, 2])})["actions"]
        check(np.array_equal(found, np.float32([[2, 4]])), f"a policy of Python's: {found}")
    print("openpi's client: so with a policy that Python serves")


def main():
    hilt, runs = sys.argv[1:]
    # No proxy stands between this machine and itself; openpi's client would ask one.
    os.environ["no_proxy"] = "127.0.0.1"
    policy_file = str(Path(runs) / "policies" / f"{TASK}-bc-rl" / "policy.safetensors")
    check_packing(hilt, policy_file)
    check_client(hilt, policy_file)
    check_client_of_python()


if __name__ == "__main__":
    main()
