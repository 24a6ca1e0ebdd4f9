//! All messages of a recording, in their order.

use super::topics::{DESCRIPTION_TOPIC, OUTCOME_TOPIC, SCENE_TOPIC, STEP_TOPIC};
use super::{encode, foxglove, surroundings};
use crate::data::proto;
use crate::demo::Episode;
use crate::state::CONTROL_HZ;
use ::foxglove::Encode;
use ::foxglove::messages::{FrameTransforms, JointStates, SceneUpdate};
use mcap::records::MessageHeader;
use mcap::{McapResult, Writer};
use prost::Message;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Duration of a control step on the clock of the file \[ns\].
const STEP_NS: u64 = 1_000_000_000 / CONTROL_HZ as u64;
/// Schema of ROS 2 under which viewers look for a robot, and its definition.
const TEXT: (&str, &[u8]) = ("std_msgs/msg/String", b"string data");
/// What ROS 2 writes before a message: little endian, no options.
const CDR_LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

type File = Writer<Cursor<Vec<u8>>>;

/// Writes them.
pub(super) fn write(writer: &mut File, episode: &Episode) -> McapResult<()> {
    let mut frames = foxglove_channel::<FrameTransforms>(writer, "/tf")?;
    let mut joints = foxglove_channel::<JointStates>(writer, "/joint_states")?;
    let mut drawing = foxglove_channel::<SceneUpdate>(writer, "/scene")?;
    let mut scene = channel(writer, SCENE_TOPIC, "hilt.Scene", "protobuf", proto::DESCRIPTORS)?;
    let mut steps = channel(writer, STEP_TOPIC, "hilt.Step", "protobuf", proto::DESCRIPTORS)?;
    let mut outcome = channel(writer, OUTCOME_TOPIC, "hilt.Outcome", "protobuf", proto::DESCRIPTORS)?;
    let schema = writer.add_schema(TEXT.0, "ros2msg", TEXT.1)?;
    let description = writer.add_channel(schema, DESCRIPTION_TOPIC, "cdr", &BTreeMap::new())?;
    let robot = &*episode.scene.robot;
    scene.write(writer, 0, &encode::scene(&episode.scene))?;
    drawing.write(writer, 0, &foxglove::drawing(&episode.scene))?;
    Topic { id: description, sequence: 0 }.write_bytes(writer, 0, &cdr(&surroundings::scene_urdf(&episode.scene)))?;
    let (end, conditions) = (episode.steps.len(), episode.scene.task.condition_names());
    for (t, step) in episode.steps.iter().chain([&episode.last]).enumerate() {
        let time = t as u64 * STEP_NS;
        frames.write(writer, time, &foxglove::frames(&episode.scene, step, time))?;
        joints.write(writer, time, &foxglove::joints(robot, &step.state, time))?;
        steps.write(writer, time, &encode::step(step, &conditions, t, t == end))?;
    }
    outcome.write(writer, end as u64 * STEP_NS, &encode::outcome(episode))
}

/// A text as ROS 2 has it: its length with the zero behind it, its bytes, the zero.
fn cdr(text: &str) -> Vec<u8> {
    let length = u32::try_from(text.len() + 1).expect("a description has some kilobytes");
    [&CDR_LITTLE_ENDIAN[..], &length.to_le_bytes(), text.as_bytes(), &[0]].concat()
}

/// A topic and the number of its next message.
struct Topic {
    id: u16,
    sequence: u32,
}

impl Topic {
    fn write(&mut self, writer: &mut File, time_ns: u64, message: &impl Message) -> McapResult<()> {
        self.write_bytes(writer, time_ns, &message.encode_to_vec())
    }

    fn write_bytes(&mut self, writer: &mut File, time_ns: u64, message: &[u8]) -> McapResult<()> {
        let header = MessageHeader { channel_id: self.id, sequence: self.sequence, log_time: time_ns, publish_time: time_ns };
        self.sequence += 1;
        writer.write_to_known_channel(&header, message)
    }
}

fn channel(writer: &mut File, topic: &str, name: &str, encoding: &str, schema: &[u8]) -> McapResult<Topic> {
    let schema = writer.add_schema(name, encoding, schema)?;
    Ok(Topic { id: writer.add_channel(schema, topic, "protobuf", &BTreeMap::new())?, sequence: 0 })
}

fn foxglove_channel<M: Encode>(writer: &mut File, topic: &str) -> McapResult<Topic> {
    let schema = M::get_schema().expect("Foxglove's own messages have schemas");
    channel(writer, topic, &schema.name, &schema.encoding, &schema.data)
}
