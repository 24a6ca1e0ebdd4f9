//! TensorBoard's event files: records of TFRecord (a length, its checksum, the bytes, their checksum), each a protobuf `Event`. Read by TensorBoard and
//! whatever else reads its files.
//!
//! The same table gives the same bytes: where an event says when it was written, ours say the step, a second each, so that TensorBoard's axis of wall time
//! counts steps too. Numbers are single precision, which is what the format has for them; one that was not computed is left out.

mod proto;

use prost::Message;
use proto::event::What;
use proto::summary::Value;
use proto::summary::value::Value as Kind;
use proto::summary_metadata::PluginData;
use proto::{Event, Summary, SummaryMetadata};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::Path;

/// Name of an event file: TensorBoard looks for `tfevents` in it; the number stands where others have the time.
pub const FILE: &str = "events.out.tfevents.0.hilt";
/// What the first event says.
const VERSION: &str = "brain.Event:2";
/// The constant that masks a checksum, so that one over bytes that hold checksums is still one.
const MASK: u32 = 0xa282_ead8;
/// Bits by which it is turned.
const TURN: u32 = 15;

/// A scalar of a step: its tag, what it is, and its value.
pub type Scalar<'a> = (&'a str, &'a str, f64);

/// Whether a path below an exported directory is one of ours.
pub fn is_file(path: &Path) -> bool {
    path.file_name() == Some(OsStr::new(FILE)) && path.components().count() <= 2
}

/// The first record of a file.
pub fn head() -> Vec<u8> {
    record(&Event { wall_time: 0.0, step: 0, what: Some(What::FileVersion(VERSION.into())) })
}

/// The part of TensorBoard that shows numbers.
const PLUGIN: &str = "scalars";

/// The records of a training, one a step.
#[derive(Debug, Default)]
pub struct Steps {
    step: u64,
    /// Tags whose first value has been written: what a tag is stands with that.
    told: BTreeSet<String>,
}

impl Steps {
    /// The record of the next step, the first of which is 1. Values that are no numbers are left out.
    pub fn next(&mut self, scalars: &[Scalar]) -> Vec<u8> {
        self.step += 1;
        let mut summary = Summary::default();
        for (tag, doc, value) in scalars.iter().filter(|(_, _, value)| value.is_finite()) {
            let about = || SummaryMetadata {
                plugin_data: Some(PluginData { plugin_name: PLUGIN.into() }),
                summary_description: doc.to_string(),
            };
            let metadata = self.told.insert(tag.to_string()).then(about);
            summary.value.push(Value { tag: tag.to_string(), value: Some(Kind::SimpleValue(*value as f32)), metadata });
        }
        record(&Event { wall_time: self.step as f64, step: self.step.cast_signed(), what: Some(What::Summary(summary)) })
    }
}

fn record(event: &Event) -> Vec<u8> {
    let content = event.encode_to_vec();
    let length = (content.len() as u64).to_le_bytes();
    [&length[..], &masked(&length), &content, &masked(&content)].concat()
}

fn masked(bytes: &[u8]) -> [u8; 4] {
    crc32c::crc32c(bytes).rotate_right(TURN).wrapping_add(MASK).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a value of 0 is written, as the readers tell by the field's presence whether there is one.
    #[test]
    fn records_have_their_checksums_and_zeros_are_written() {
        // The first record of every file that TensorBoard's own writer makes, but for its time:
        // python -c "from tensorboard.summary.writer.record_writer import RecordWriter; ..." over Event(file_version="brain.Event:2").
        let head = head();
        assert_eq!(&head[..8], 15_u64.to_le_bytes());
        assert_eq!(head.len(), 8 + 4 + 15 + 4);
        assert_eq!(&head[12..27], b"\x1a\x0dbrain.Event:2");
        // CRC-32C of "123456789" is 0xe3069283 in every table of checksums.
        assert_eq!(masked(b"123456789"), 0xe306_9283_u32.rotate_right(15).wrapping_add(0xa282_ead8).to_le_bytes());
        let mut steps = Steps::default();
        let [first, second] = [f64::NAN, 0.5].map(|l_sc| {
            let bytes = steps.next(&[("alpha", "mixing weight", 0.0), ("l_sc", "", l_sc)]);
            let event = Event::decode(&bytes[12..bytes.len() - 4]).expect("an event");
            let Some(What::Summary(summary)) = event.what else { panic!("a summary") };
            (event.step, event.wall_time, summary.value)
        });
        assert_eq!((first.0, first.1, first.2.len()), (1, 1.0, 1));
        assert_eq!(first.2[0].value, Some(Kind::SimpleValue(0.0)));
        assert_eq!(first.2[0].metadata.as_ref().expect("words").summary_description, "mixing weight");
        assert_eq!((second.0, second.2.len()), (2, 2));
        // What a tag is stands with its first value.
        assert_eq!(second.2.iter().map(|value| value.metadata.is_some()).collect::<Vec<_>>(), [false, true]);
    }
}
