"""Runs policies with programs that are not hilt, and compares every action with those that hilt itself commanded.

Usage: policies.py RUNS HILT, where each directory RUNS/policies/NAME holds policy.safetensors, policy.onnx and rollouts (the recordings of hilt
evaluate --record), as tests/interop/policies.sh leaves them. NumPy runs the weights (python/examples/run_policy.py and the code of
docs/run-a-policy.md), onnxruntime the ONNX files; the checker of onnx and Netron open them. RUNS/foreign/NAME, a policy of the dataset
fixtures/foreign/NAME, has no recordings: its actions are those that hilt serve answers to random states. Exits 1 at the first thing that is not as
promised.
"""

import contextlib
import importlib.util
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

import netron
import netron.onnx
import numpy as np
import onnx
import onnxruntime
import pyarrow.parquet as pq
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

ROOT = Path(__file__).resolve().parents[2]
# Largest difference of an action [rad/s, m/s], and the states of each policy that it holds for.
TOLERANCE = 1e-5
STATES = 10_000
# How far random states go beyond those of a dataset, in parts of their range.
BEYOND = 0.2


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def row(layout, scene, step):
    """A recorded state as a row of the policy's layout."""
    moving, still, goals = list(step.objects), {placed.name: placed.pose for placed in scene.objects}, list(scene.goals)
    numbers = []
    for span in layout["state"]:
        if span["holds"] == "joint-positions":
            numbers += step.q_rad
        elif span["holds"] == "joint-velocities":
            numbers += step.dq_rad_s
        elif span["holds"] == "fixed-point":
            numbers += goals.pop(0).position_m
        else:
            pose = still[span["name"]] if span["holds"] == "fixed-pose" else moving.pop(0).pose
            numbers += [*pose.position_m, *pose.quaternion_xyzw]
    return numbers


def rollouts(directory, layout):
    """State rows and the actions commanded in them."""
    states, actions = [], []
    for path in sorted(directory.glob("*.mcap")):
        with path.open("rb") as stream:
            scene = None
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages(topics=["/hilt/scene", "/hilt/step"]):
                if channel.topic == "/hilt/scene":
                    scene = message
                elif channel.topic == "/hilt/step" and not message.final_state:
                    states.append(row(layout, scene, message))
                    actions.append(message.commanded_rad_s)
    return np.array(states, np.float32), np.array(actions, np.float32)


def served(policy_file, data, layout, hilt):
    """Random states near those of a dataset of another program, and what hilt serve answers to them."""
    spans = {span["name"]: len(span["entries"]) for span in layout["state"]}
    rows = [row for path in sorted(data.glob("data/*/*.parquet")) for row in pq.read_table(path, columns=list(spans)).to_pylist()]
    rows = np.array([np.concatenate([row[name] for name in spans]) for row in rows])
    low, high = rows.min(axis=0), rows.max(axis=0)
    more = BEYOND * (high - low)
    states = np.random.default_rng(0).uniform(low - more, high + more, (STATES, len(low))).astype(np.float32)
    cuts = np.cumsum(list(spans.values()))[:-1]
    lines = [json.dumps({name: part.tolist() for name, part in zip(spans, np.split(state, cuts))}) for state in states]
    command = [hilt, "serve", str(policy_file), "--stdio", "--quiet"]
    done = subprocess.run(command, input="\n".join(lines) + "\n", capture_output=True, text=True)
    check(done.returncode == 0, f"{policy_file}: hilt serve --stdio: {done.stderr}")
    # The first line says what is served.
    return states, np.array([json.loads(line)["actions"][0] for line in done.stdout.splitlines()[1:]], np.float32)


def example():
    """python/examples/run_policy.py as a module."""
    spec = importlib.util.spec_from_file_location("run_policy", ROOT / "python/examples/run_policy.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def page(directory, hilt):
    """Runs every block of docs/run-a-policy.md as it stands there, over a run of stack; returns what its Python defines."""
    text = (ROOT / "docs/run-a-policy.md").read_text()
    blocks = re.findall(r"^```(sh|python)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    check({"sh", "python"} == {language for language, _ in blocks}, "docs/run-a-policy.md has no blocks of sh and python")
    names, path = {}, f"{Path(hilt).resolve().parent}{os.pathsep}{os.environ['PATH']}"
    here = os.getcwd()
    os.chdir(directory)
    try:
        for language, code in blocks:
            if language == "sh":
                done = subprocess.run(["sh", "-euc", code], env={**os.environ, "PATH": path}, capture_output=True, text=True)
                check(done.returncode == 0, f"docs/run-a-policy.md: {code}{done.stderr}")
            else:
                with contextlib.redirect_stdout(io.StringIO()):
                    exec(compile(code, "docs/run-a-policy.md", "exec"), names)
    finally:
        os.chdir(here)
    return names


def opened_by_netron(path, model):
    """Whether Netron's server hands its page the file, and its loader for ONNX finds all operators."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        address = netron.start(str(path), address=("localhost", 0), browse=False)
        try:
            url = f"http://{address[0]}:{address[1]}"
            place = re.search('<meta name="file" content="([^"]*)"', urllib.request.urlopen(url).read().decode()).group(1)
            served = urllib.request.urlopen(url + place).read()
        finally:
            netron.stop(address)
    loaded = netron.onnx.ModelFactory().open(model).to_json()
    found = [node["type"]["name"] for node in loaded["graphs"][0]["nodes"]]
    return served == path.read_bytes() and found == [node.op_type for node in model.graph.node]


def check_file(path, meta):
    """The ONNX file by itself: sound, standard, and says what it is."""
    model = onnx.load(path)
    onnx.checker.check_model(model, full_check=True)
    check({node.domain for node in model.graph.node} == {""}, f"{path}: operators that are not ONNX's own")
    said = {entry.key: entry.value for entry in model.metadata_props}
    entries = lambda row: [entry for span in meta["layout"][row] for entry in span["entries"]]
    check(json.loads(said["state_entries"]) == entries("state"), f"{path}: entries of the state")
    check(json.loads(said["action_entries"]) == entries("action"), f"{path}: entries of the action")
    check(json.loads(said["network_inputs"]) == meta["inputs"], f"{path}: inputs of the network")
    check(json.loads(said["hilt"])["seed"] == json.loads(said["seed"]), f"{path}: provenance")
    check(all(entry in model.graph.input[0].doc_string for entry in entries("state")), f"{path}: description of the input")
    check(opened_by_netron(path, model), f"{path}: Netron does not open it")


def worst(found, actions, what):
    check(found.shape == actions.shape and found.dtype == np.float32, f"{what}: {found.shape} of {found.dtype}")
    difference = np.abs(found - actions).max()
    check(difference <= TOLERANCE, f"{what}: an action differs by {difference}")
    return difference


def compare(directory, states_and_actions, hilt):
    """Runs the policy of a directory in every way, on the states that this finds for its file and layout."""
    policy = example().Policy(directory / "policy.safetensors")
    states, actions = states_and_actions(policy.layout)
    check(len(states) >= STATES, f"{directory}: {len(states)} states, {STATES} are needed")
    check_file(directory / "policy.onnx", policy.meta)
    session = onnxruntime.InferenceSession(directory / "policy.onnx")
    by_onnx = worst(session.run(["action"], {"state": states})[0], actions, f"{directory}: onnxruntime")
    one = np.concatenate([session.run(["action"], {"state": states[i : i + 1]})[0] for i in range(100)])
    worst(one, actions[:100], f"{directory}: onnxruntime, row by row")
    by_numpy = worst(policy.act(states), actions, f"{directory}: run_policy.py")
    print(f"  {directory.name}: {len(states)} states, largest difference {by_onnx:.1e} onnxruntime, {by_numpy:.1e} NumPy")
    with tempfile.TemporaryDirectory() as place:
        shutil.copy(directory / "policy.safetensors", place)
        names = page(place, hilt)
        worst(names["act"](states), actions, f"{directory}: docs/run-a-policy.md")
        worst(names["session"].run(None, {"state": states})[0], actions, f"{directory}: ONNX of docs/run-a-policy.md")


def main():
    runs, hilt = Path(sys.argv[1]), sys.argv[2]
    own, foreign = (sorted((runs / kind).iterdir()) for kind in ("policies", "foreign"))
    check(own and foreign, f"no policies in {runs}/policies or {runs}/foreign")
    for directory in own:
        compare(directory, lambda layout: rollouts(directory / "rollouts", layout), hilt)
    for directory in foreign:
        data = ROOT / "fixtures/foreign" / directory.name
        compare(directory, lambda layout: served(directory / "policy.safetensors", data, layout, hilt), hilt)
    print(f"all act alike; docs/run-a-policy.md ran over {len(own) + len(foreign)} policies")


if __name__ == "__main__":
    main()
