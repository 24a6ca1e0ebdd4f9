//! Recordings taken apart and put together again with other content, so that lengths, indices and checksums are right.

use super::mutate::{self, below, one_in, pick};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::io::Cursor;

/// Opcodes of MCAP.
const FOOTER: u8 = 0x02;
const CHUNK: u8 = 0x06;
const CHUNK_INDEX: u8 = 0x08;
const ATTACHMENT: u8 = 0x09;
const ATTACHMENT_INDEX: u8 = 0x0a;
const METADATA: u8 = 0x0c;
const METADATA_INDEX: u8 = 0x0d;
const SUMMARY_OFFSET: u8 = 0x0e;
const DATA_END: u8 = 0x0f;
/// Bytes before a record's content.
const PREFIX: usize = 9;
/// Bytes of a chunk before the name of its packing: two times, length and checksum.
const CHUNK_FIELDS: usize = 28;
/// Bytes behind the summary's checksum.
const MAGIC: usize = mcap::MAGIC.len();

/// The same messages, some of them changed, dropped or doubled, and attachments, some of them with a hostile value or left out; `None` when the library does not read the file.
pub fn with_other_messages(file: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let messages = mcap::MessageStream::new(file).ok()?.collect::<Result<Vec<_>, _>>().ok()?;
    let options = WriteOptions::new().compression(Some(mcap::Compression::Zstd)).compression_threads(0).library("hilt 0.1.0");
    let mut writer = options.create(Cursor::new(Vec::new())).ok()?;
    let summary = mcap::Summary::read(file).ok()??;
    let hit = below(messages.len(), rng);
    for (number, message) in messages.iter().enumerate() {
        let channel = &message.channel;
        let schema = channel.schema.as_ref()?;
        let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).ok()?;
        let id = writer.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata).ok()?;
        let time = message.log_time;
        let header = MessageHeader { channel_id: id, sequence: message.sequence, log_time: time, publish_time: time };
        let changed = number == hit || one_in(20, rng);
        let data = if changed { mutate::bytes(message.data.to_vec(), &messages[hit].data, rng) } else { message.data.to_vec() };
        let times = if changed { rng.random_range(0..3) } else { 1 };
        (0..times).try_for_each(|_| writer.write_to_known_channel(&header, &data)).ok()?;
    }
    for index in &summary.attachment_indexes {
        let mut attachment = mcap::read::attachment(file, index).ok()?;
        if let (true, Ok(mut value)) = (one_in(8, rng), serde_json::from_slice(&attachment.data)) {
            mutate::value(&mut value, rng);
            attachment.data = serde_json::to_vec(&value).ok()?.into();
        }
        if !one_in(16, rng) {
            writer.attach(&attachment).ok()?;
        }
    }
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(file, index).ok()?).ok()?;
    }
    writer.finish().ok()?;
    Some(writer.into_inner().into_inner())
}

/// The same file with other bytes in one of its chunks: packed anew, with its checksum.
pub fn with_another_chunk(file: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let mut records = records(file)?;
    let chunks: Vec<usize> = (0..records.len()).filter(|i| records[*i].0 == CHUNK).collect();
    let chunk = &mut records[*chunks.get(below(chunks.len().max(1), rng))?].1;
    let name = u32::from_le_bytes(chunk.get(CHUNK_FIELDS..CHUNK_FIELDS + 4)?.try_into().ok()?) as usize;
    let packed = chunk.get(CHUNK_FIELDS + 4 + name + 8..)?;
    let inside = zstd::bulk::decompress(packed, 1 << 24).ok()?;
    let inside = mutate::bytes(inside.clone(), &inside, rng);
    let plain = one_in(4, rng);
    let packed = if plain { inside.clone() } else { zstd::bulk::compress(&inside, 1).ok()? };
    let length = if one_in(8, rng) { *pick(&[0, u64::MAX, 8 << 30, 1 << 27], rng) } else { inside.len() as u64 };
    let crc = if one_in(8, rng) { 0 } else { crc32fast::hash(&inside) };
    let name: &[u8] = if plain { b"" } else { b"zstd" };
    let mut content = chunk[..16].to_vec();
    content.extend(length.to_le_bytes());
    content.extend(crc.to_le_bytes());
    content.extend((name.len() as u32).to_le_bytes());
    content.extend(name);
    content.extend((packed.len() as u64).to_le_bytes());
    content.extend(packed);
    *chunk = content;
    put_together(records)
}

type Record = (u8, Vec<u8>);

fn records(file: &[u8]) -> Option<Vec<Record>> {
    let mut rest = file.get(MAGIC..file.len().checked_sub(MAGIC)?)?;
    let mut found = Vec::new();
    while !rest.is_empty() {
        let length = u64::from_le_bytes(rest.get(1..PREFIX)?.try_into().ok()?) as usize;
        found.push((rest[0], rest.get(PREFIX..PREFIX.checked_add(length)?)?.to_vec()));
        rest = &rest[PREFIX + length..];
    }
    Some(found)
}

/// The file with every place in its summary right, and no checksum but the chunks' own.
fn put_together(records: Vec<Record>) -> Option<Vec<u8>> {
    let mut out = mcap::MAGIC.to_vec();
    let (mut places, mut summary) = (Vec::new(), 0);
    for (op, mut content) in records {
        let at = out.len() as u64;
        match op {
            CHUNK | ATTACHMENT | METADATA => places.push((op, at, (PREFIX + content.len()) as u64)),
            CHUNK_INDEX => put_place(&mut content, 16, take(&mut places, CHUNK)?)?,
            ATTACHMENT_INDEX => put_place(&mut content, 0, take(&mut places, ATTACHMENT)?)?,
            METADATA_INDEX => put_place(&mut content, 0, take(&mut places, METADATA)?)?,
            DATA_END => content.fill(0),
            SUMMARY_OFFSET => continue,
            FOOTER => {
                content.fill(0);
                content.get_mut(..8)?.copy_from_slice(&u64::to_le_bytes(summary));
            }
            _ => {}
        }
        out.push(op);
        out.extend((content.len() as u64).to_le_bytes());
        out.extend(content);
        if op == DATA_END {
            summary = out.len() as u64;
        }
    }
    out.extend(mcap::MAGIC);
    Some(out)
}

fn take(places: &mut Vec<(u8, u64, u64)>, op: u8) -> Option<(u64, u64)> {
    let at = places.iter().position(|place| place.0 == op)?;
    let (_, from, length) = places.remove(at);
    Some((from, length))
}

fn put_place(content: &mut [u8], at: usize, (from, length): (u64, u64)) -> Option<()> {
    content.get_mut(at..at + 8)?.copy_from_slice(&from.to_le_bytes());
    content.get_mut(at + 8..at + 16)?.copy_from_slice(&length.to_le_bytes());
    Some(())
}

/// The file with its seal and its checksums made anew, where it still has places for them.
pub fn reseal(mut file: Vec<u8>) -> Vec<u8> {
    let end = file.len();
    if let Some(crc) = end.checked_sub(MAGIC + 4).and_then(|at| file.get_mut(at..at + 4)) {
        crc.fill(0);
    }
    let untouched = file.clone();
    hilt::guard::guarded(move || hilt::data::recording::close(file)).unwrap_or(untouched)
}
