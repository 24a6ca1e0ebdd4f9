//! What viewers get out of a recording: frames that add up, times of the simulation, the scene once, the robot attached.

use crate::fixtures::{episode, provenance};
use foxglove::messages::{FrameTransforms, JointStates, SceneUpdate};
use hilt::data::recording::{self, DESCRIPTION_TOPIC, ROBOT_NAME, TASK_NAME, URDF_NAME, WORLD_FRAME, frame_of};
use hilt::robot::{Robot, urdf};
use hilt::state::CONTROL_HZ;
use hilt::task::built_in::stack;
use hilt::tasks::Task;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use prost::Message;
use std::collections::BTreeMap;
use std::fs;
use tempfile::tempdir;

/// `world_from_frame` through the chain of parents.
fn world_from(frame: &str, transforms: &FrameTransforms) -> Isometry3<f64> {
    if frame == WORLD_FRAME {
        return Isometry3::identity();
    }
    let found = transforms.transforms.iter().find(|t| t.child_frame_id == frame).expect("the frame is known");
    let (at, turn) = (found.translation.as_ref().expect("set"), found.rotation.as_ref().expect("set"));
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(turn.w, turn.x, turn.y, turn.z));
    world_from(&found.parent_frame_id, transforms) * Isometry3::from_parts(Translation3::new(at.x, at.y, at.z), rotation)
}

/// Every link but the world is a frame of the transforms, on the parent that they say, and what is drawn is what `/scene` draws.
fn check_description(description: &str, transforms: &FrameTransforms) {
    let document = roxmltree::Document::parse(description).expect("XML");
    let named = |kind: &'static str| document.root_element().children().filter(move |c| c.has_tag_name(kind));
    let end = |joint: roxmltree::Node, end: &str| {
        let end = joint.children().find(|c| c.has_tag_name(end)).expect("an end");
        end.attribute("link").expect("a name").to_string()
    };
    let mut hung: Vec<(String, String)> = named("joint").map(|joint| (end(joint, "parent"), end(joint, "child"))).collect();
    let mut told: Vec<(String, String)> =
        transforms.transforms.iter().map(|t| (t.parent_frame_id.clone(), t.child_frame_id.clone())).collect();
    hung.sort();
    told.sort();
    assert_eq!(hung, told);
    let shown = |name: &str| {
        let link = named("link").find(|link| link.attribute("name") == Some(name)).expect("the link is there");
        link.children().filter(|c| c.has_tag_name("visual")).count()
    };
    // The table and an obstacle; a box each.
    assert_eq!([WORLD_FRAME, "object/block", "object/base"].map(shown), [2, 1, 1]);
    let base = named("joint").find(|joint| end(*joint, "child") == "object/base").expect("it hangs on the world");
    assert_eq!(base.attribute("type"), Some("floating"));
}

#[test]
fn transforms_add_up_to_the_kinematics_at_simulated_times() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("episode.mcap");
    let made = episode(&stack(), 1, 8);
    recording::write(&path, &made, &provenance("simulate", &stack())).expect("written");
    let bytes = fs::read(&path).expect("bytes");
    let moments: Vec<_> = made.steps.iter().chain([&made.last]).collect();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let (mut description, mut first) = (String::new(), None);
    for message in mcap::MessageStream::new(&bytes).expect("stream") {
        let message = message.expect("message");
        let t = seen.entry(message.channel.topic.clone()).or_default();
        match message.channel.topic.as_str() {
            "/tf" => {
                let transforms = FrameTransforms::decode(&message.data[..]).expect("transforms");
                assert_eq!(message.log_time, *t as u64 * 1_000_000_000 / u64::from(CONTROL_HZ));
                let expected = made.scene.robot.link_poses(&moments[*t].state.q);
                for (link, pose) in made.scene.robot.links.iter().zip(expected) {
                    let name = &link.name;
                    let error = world_from(name, &transforms).inverse() * pose;
                    assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-7, "{name} at {t}");
                }
                first.get_or_insert(transforms.clone());
                for (name, now) in ["block", "base"].into_iter().zip(&moments[*t].objects) {
                    let at = world_from(&frame_of(name), &transforms).translation.vector;
                    assert_eq!(<[f64; 3]>::from(at), now.pose.position_m);
                }
            }
            "/joint_states" => {
                let joints = JointStates::decode(&message.data[..]).expect("joints").joints;
                assert!(joints.iter().map(|j| j.name.as_str()).eq(made.scene.robot.joints.iter().map(|j| j.name.as_str())));
                assert!(joints.iter().zip(&moments[*t].state.q).all(|(j, q)| j.position == Some(*q)));
            }
            "/scene" => {
                let entities = SceneUpdate::decode(&message.data[..]).expect("scene").entities;
                let ids: Vec<&str> = entities.iter().map(|e| e.id.as_str()).collect();
                assert_eq!(ids, ["table", "block", "base", "obstacles"]);
            }
            DESCRIPTION_TOPIC => {
                let schema = message.channel.schema.as_ref().expect("it has one");
                let named = (schema.name.as_str(), schema.encoding.as_str(), message.channel.message_encoding.as_str());
                assert_eq!(named, ("std_msgs/msg/String", "ros2msg", "cdr"));
                let (head, text) = message.data.split_at(8);
                assert_eq!((&head[..4], text.last()), (&[0, 1, 0, 0][..], Some(&0)), "little endian, ends in a zero");
                assert_eq!(u32::from_le_bytes(head[4..].try_into().expect("four")) as usize, text.len());
                description = String::from_utf8(text[..text.len() - 1].to_vec()).expect("UTF-8");
            }
            _ => {}
        }
        *t += 1;
    }
    let counts: Vec<usize> = ["/tf", "/joint_states", "/scene", "/hilt/step", DESCRIPTION_TOPIC].map(|topic| seen[topic]).into();
    assert_eq!(counts, [9, 9, 1, 9, 1]);
    assert_eq!(description, recording::scene_urdf(&made.scene));
    check_description(&description, &first.expect("transforms"));
    let summary = mcap::Summary::read(&bytes).expect("summary").expect("a finished file");
    let attached = |i: usize| mcap::read::attachment(&bytes, &summary.attachment_indexes[i]).expect("attachment");
    let (first, second, third) = (attached(0), attached(1), attached(2));
    assert_eq!((first.name.as_str(), &first.data[..]), (URDF_NAME, urdf(&made.scene.robot).as_bytes()));
    let robot: Robot = serde_json::from_slice(&second.data).expect("a robot");
    assert_eq!((second.name.as_str(), &robot), (ROBOT_NAME, &*made.scene.robot));
    let task: Task = serde_json::from_slice(&third.data).expect("a task");
    assert_eq!((third.name.as_str(), &task), (TASK_NAME, &*made.scene.task));
}
