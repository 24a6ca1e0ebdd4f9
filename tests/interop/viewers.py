"""Reads recordings as viewers do: every Foxglove message against Foxglove's own published schemas, the URDF of /robot_description as ROS 2 and a URDF reader
see it, and what Rerun's importer makes of the file.

Usage: viewers.py RECORDINGS..., MCAP files. Exits 1 at the first thing that is not as promised.
"""

import importlib
import io
import subprocess
import sys
import tempfile
from pathlib import Path

import yourdfpy
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

# Schema of each topic that Foxglove draws.
TOPICS = {"/tf": "FrameTransforms", "/joint_states": "JointStates", "/scene": "SceneUpdate"}
# Words by which Rerun's importer has drawn a solid, and moved a frame.
DRAWN, MOVED = "visual_geometries", "Transform3D:child_frame"


def check(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def fields(message):
    """Number, type and cardinality of each field."""
    return {field.name: (field.number, field.type, field.label, field.type_name) for field in message.field}


def recorded(data):
    """The messages of a recorded schema, by name."""
    files = FileDescriptorSet.FromString(data).file
    return {f"{file.package}.{message.name}": fields(message) for file in files for message in file.message_type}


def published(name):
    """Foxglove's own class of this name, and the fields of its message."""
    kind = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)
    descriptor = type(FileDescriptorSet().file.add().message_type.add())()
    kind.DESCRIPTOR.CopyToProto(descriptor)
    return kind, fields(descriptor)


def unknown_fields(message):
    """The message once more without what its class does not know."""
    copy = type(message).FromString(message.SerializeToString())
    copy.DiscardUnknownFields()
    return copy.ByteSize() != message.ByteSize()


def viewed(path):
    counts, parents, description = {}, {}, None
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        for schema, channel, message in reader.iter_messages():
            if channel.topic not in TOPICS:
                continue
            name = TOPICS[channel.topic]
            check(schema.name == f"foxglove.{name}" and schema.encoding == "protobuf", f"{path}: schema of {channel.topic}")
            kind, wanted = published(name)
            have = recorded(schema.data)[schema.name]
            check(have.items() <= wanted.items() or wanted.items() <= have.items(), f"{path}: {name} is not as published: {have} {wanted}")
            decoded = kind.FromString(message.data)
            check(not unknown_fields(decoded), f"{path}: {channel.topic} has fields that Foxglove does not know")
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if channel.topic == "/tf":
                parents |= {transform.child_frame_id: transform.parent_frame_id for transform in decoded.transforms}
            elif channel.topic == "/scene":
                drawn = [entity.frame_id for entity in decoded.entities]
                check(all(frame == "world" or frame.startswith("object/") for frame in drawn), f"{path}: frames of /scene {drawn}")
    check(set(counts) == set(TOPICS), f"{path}: messages {counts}")
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, _, decoded in reader.iter_decoded_messages(topics=["/robot_description"]):
            check(description is None, f"{path}: one description")
            description = decoded.data
    robot = yourdfpy.URDF.load(io.BytesIO(description.encode()), build_scene_graph=False, load_meshes=False)
    links = {link.name for link in robot.robot.links}
    hung = {joint.child: joint.parent for joint in robot.robot.joints}
    check(hung == parents, f"{path}: links hang on {hung}, frames on {parents}")
    check(links == set(parents) | {"world"}, f"{path}: links {links}")
    return counts["/tf"], len(links)


def in_rerun(path, solids):
    with tempfile.TemporaryDirectory() as directory:
        made = Path(directory, "made.rrd")
        rerun = Path(sys.executable).parent / "rerun"
        subprocess.run([rerun, "mcap", "convert", path, "-o", made], check=True, capture_output=True)
        said = subprocess.run([rerun, "rrd", "print", "-v", made], check=True, capture_output=True, text=True).stdout
    drawn = {word for word in said.replace("@", " ").split() if DRAWN in word}
    check(len(drawn) >= solids, f"{path}: Rerun draws {sorted(drawn)}")
    check(MOVED in said, f"{path}: Rerun moves no frame")
    return len(drawn)


def main():
    for path in map(Path, sys.argv[1:]):
        frames, links = viewed(path)
        print(f"  {path.name}: {frames} frames of {links} links as Foxglove's schemas say, {in_rerun(path, links)} solids in Rerun")


main()
