"""ROS 2 bags in MCAP, one an episode, as a LeRobotDataset v3.0.

    python rosbag2_mcap.py OUT BAG... --fps 20 --state /joint_states:position,velocity --action /commands:data [--task WORDS]

BAG is an .mcap file, or the directory of `ros2 bag record -s mcap` with one in it. State and action are numbers of messages: TOPIC:FIELD,FIELD; a field
may be inside another (pose.position.x). --state may be given more than once; its topics are put side by side. Messages are sampled at a steady rate,
each held until the next comes, from the first moment at which all topics have spoken to the last at which any does. Messages are decoded by the
definitions that the bag carries: no ROS is needed. Needs mcap, mcap-ros2-support, numpy and pyarrow.
"""

import argparse
import struct
from pathlib import Path

import numpy as np
from lerobot_v3 import Refused, run, write
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory


def source(text):
    topic, colon, fields = text.partition(":")
    if not colon or not topic or not fields:
        raise argparse.ArgumentTypeError(f"{text} is not TOPIC:FIELD,FIELD")
    return topic, fields.split(",")


def numbers(message, fields, topic):
    row = []
    for field in fields:
        value = message
        for part in field.split("."):
            if not hasattr(value, part):
                raise Refused(f"messages of {topic} have no {field}")
            value = getattr(value, part)
        value = np.asarray(value)
        if not np.issubdtype(value.dtype, np.number):
            raise Refused(f"{field} of {topic} holds no numbers")
        row.extend(value.reshape(-1))
    return np.asarray(row, np.float64)


def bag_file(path):
    path = Path(path)
    if path.is_dir():
        found = sorted(path.glob("*.mcap"))
        if len(found) != 1:
            raise Refused(f"{path} has {len(found)} .mcap files; name the one that is meant")
        return found[0]
    return path


def read(path, sources):
    """Times [ns] and rows of each topic."""
    rows = {topic: ([], []) for topic, _ in sources}
    fields = dict(sources)
    with path.open("rb") as stream:
        try:
            for _, channel, message, decoded in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(topics=list(fields)):
                times, values = rows[channel.topic]
                row = numbers(decoded, fields[channel.topic], channel.topic)
                if values and len(values[0]) != len(row):
                    raise Refused(f"{path}: messages of {channel.topic} have {len(values[0])} and {len(row)} numbers")
                times.append(message.log_time)
                values.append(row)
        except (McapError, struct.error, EOFError) as why:
            raise Refused(f"{path} cannot be read as MCAP: {why}") from None
    silent = [topic for topic, (times, _) in rows.items() if not times]
    if silent:
        raise Refused(f"{path} has no message of {silent[0]}")
    return {topic: (np.asarray(times, np.int64), np.asarray(values)) for topic, (times, values) in rows.items()}


def sampled(found, sources, at):
    """What was last said at each moment."""
    parts = [found[topic][1][np.searchsorted(found[topic][0], at, side="right") - 1] for topic, _ in sources]
    return np.concatenate(parts, axis=1).astype(np.float32)


def episodes(bags, states, action, fps, task):
    for bag in bags:
        path = bag_file(bag)
        found = read(path, [*states, action])
        begin, end = max(times[0] for times, _ in found.values()), max(times[-1] for times, _ in found.values())
        step = 1_000_000_000 / fps
        at = begin + np.round(np.arange(int((end - begin) // step) + 1) * step).astype(np.int64)
        yield task, {"observation.state": sampled(found, states, at), "action": sampled(found, [action], at)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out")
    parser.add_argument("bags", nargs="+")
    parser.add_argument("--fps", type=float, required=True, help="rate at which messages are sampled [Hz]")
    parser.add_argument("--state", type=source, action="append", required=True, metavar="TOPIC:FIELD,...")
    parser.add_argument("--action", type=source, required=True, metavar="TOPIC:FIELD,...")
    parser.add_argument("--task", default="demonstration", help="in words")
    args = parser.parse_args()
    topics = [topic for topic, _ in [*args.state, args.action]]
    if len(set(topics)) != len(topics):
        raise Refused("a topic is named twice; put its fields into one TOPIC:FIELD,FIELD, and state and action into two topics")
    write(args.out, episodes(args.bags, args.state, args.action, args.fps, args.task), args.fps)


if __name__ == "__main__":
    run(main)
