//! A whole MCAP file, walked record by record: what the summary says against what is there, chunks unpacked within a limit, their
//! checksums before their content.

use super::fields::Fields;
use super::records::{Record, Records, Sections, op};
use std::collections::BTreeMap;
use zstd::bulk::Decompressor;

/// Unpacked messages of a file: a recording of 20,000 steps, the most there can be, has some 60 MB.
const MOST_UNPACKED_BYTES: usize = 128 << 20;
/// Opcodes from here on are free for everybody's own records.
const PRIVATE: u8 = 0x80;
/// The packings of chunks that hilt writes, and none.
const ZSTD: &str = "zstd";
const NONE: &str = "";

/// What a file is made of.
pub(super) struct Outline<'a> {
    data: &'a [u8],
    from: usize,
    /// Entries of the metadata records by their names.
    pub(super) metadata: BTreeMap<&'a str, BTreeMap<&'a str, &'a str>>,
    /// Attachments by their names.
    pub(super) attachments: BTreeMap<&'a str, &'a [u8]>,
    /// Messages by the summary.
    messages: u64,
}

/// What a message is shown to, with its topic.
type See<'a> = dyn FnMut(&str, &[u8]) -> Result<(), String> + 'a;
/// Place and length of the records of a kind.
type Places = BTreeMap<u8, Vec<(u64, u64)>>;

impl<'a> Outline<'a> {
    /// Of a file that begins with the magic bytes.
    ///
    /// # Errors
    /// Says which record is broken, or where the summary disagrees with the data.
    pub(super) fn of(bytes: &'a [u8], sections: &Sections) -> Result<Self, String> {
        let from = mcap::MAGIC.len();
        let data = &bytes[from..sections.data_end];
        let (mut metadata, mut attachments, mut found) = (BTreeMap::new(), BTreeMap::new(), Places::new());
        for (number, record) in Records::new(data, from).enumerate() {
            let record = record?;
            if (number == 0) != (record.op == op::HEADER) {
                return Err("its header is not its first record".into());
            }
            if [op::CHUNK, op::ATTACHMENT, op::METADATA].contains(&record.op) {
                found.entry(record.op).or_default().push((record.at as u64, record.len() as u64));
            }
            match record.op {
                op::METADATA => {
                    let (name, entries) = metadata_entries(Fields(record.content))?;
                    metadata.insert(name, entries);
                }
                op::ATTACHMENT => {
                    let (name, content) = attachment(record.content)?;
                    attachments.insert(name, content);
                }
                _ => {}
            }
        }
        let (indexed, messages) = summary(&bytes[sections.summary..sections.footer], sections.summary)?;
        if indexed != found {
            return Err("its summary does not say where its chunks, attachments and metadata are".into());
        }
        Ok(Outline { data, from, metadata, attachments, messages })
    }

    /// Shows every message to `see`, with its topic.
    ///
    /// # Errors
    /// What `see` returns; says which chunk or message is broken.
    pub(super) fn messages(&self, see: &mut See) -> Result<(), String> {
        let mut messages = Messages { topics: BTreeMap::new(), count: 0, see };
        let mut unpacker = Unpacker::new()?;
        for record in Records::new(self.data, self.from) {
            let record = record?;
            match record.op {
                op::CHUNK => {
                    let at = record.at;
                    let unpacked = unpacker.unpack(record.content).map_err(|why| format!("the chunk at byte {at}: {why}"))?;
                    Records::new(unpacked, 0).try_for_each(|inner| messages.take(&inner?))?;
                }
                op::HEADER | op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA | PRIVATE.. => {}
                _ => messages.take(&record)?,
            }
        }
        if messages.count != self.messages {
            return Err(format!("its summary counts {} messages, {} are there", self.messages, messages.count));
        }
        Ok(())
    }
}

/// Messages on their way to their reader.
struct Messages<'a> {
    topics: BTreeMap<u16, String>,
    count: u64,
    see: &'a mut See<'a>,
}

impl Messages<'_> {
    /// A record of a chunk.
    fn take(&mut self, record: &Record) -> Result<(), String> {
        let mut fields = Fields(record.content);
        match record.op {
            op::SCHEMA | PRIVATE.. => {}
            op::CHANNEL => {
                let (id, _schema, topic) = (fields.u16()?, fields.u16()?, fields.text()?);
                self.topics.insert(id, topic.into());
            }
            op::MESSAGE => {
                let (id, _sequence, _logged, _published) = (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
                let topic = self.topics.get(&id).ok_or_else(|| format!("a message is on channel {id}, which is not declared"))?;
                (self.see)(topic, fields.0)?;
                self.count += 1;
            }
            other => return Err(format!("a record of kind {other} does not belong among messages")),
        }
        Ok(())
    }
}

/// Unpacks one chunk after another into the same memory.
struct Unpacker {
    zstd: Decompressor<'static>,
    buffer: Vec<u8>,
    left: usize,
}

impl Unpacker {
    fn new() -> Result<Self, String> {
        let zstd = Decompressor::new().map_err(|e| format!("zstd cannot begin: {e}"))?;
        Ok(Unpacker { zstd, buffer: Vec::new(), left: MOST_UNPACKED_BYTES })
    }

    /// The records of a chunk.
    fn unpack<'a>(&'a mut self, content: &'a [u8]) -> Result<&'a [u8], String> {
        let mut fields = Fields(content);
        let (_start, _end, size, crc) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?);
        let (packing, packed) = (fields.text()?, fields.bytes64()?);
        let size = usize::try_from(size)
            .ok()
            .filter(|size| *size <= self.left)
            .ok_or_else(|| format!("it would unpack to {size} bytes, a recording has at most {MOST_UNPACKED_BYTES}"))?;
        self.left -= size;
        let unpacked = match packing {
            NONE => packed,
            ZSTD => {
                self.buffer.clear();
                self.buffer.reserve_exact(size);
                // As many bytes as there is room for: a chunk that holds more than it says is an error of zstd.
                self.zstd.decompress_to_buffer(packed, &mut self.buffer).map_err(|e| format!("it cannot be unpacked: {e}"))?;
                &self.buffer
            }
            other => return Err(format!("it is packed by \"{other}\", hilt packs by \"{ZSTD}\"")),
        };
        if unpacked.len() != size {
            return Err(format!("it unpacks to {} bytes, not {size}", unpacked.len()));
        }
        if crc != 0 && crc != crc32fast::hash(unpacked) {
            return Err("it does not match its own checksum".into());
        }
        Ok(unpacked)
    }
}

fn metadata_entries<'a>(mut fields: Fields<'a>) -> Result<(&'a str, BTreeMap<&'a str, &'a str>), String> {
    let (name, mut entries) = (fields.text()?, Fields(fields.bytes32()?));
    let mut found = BTreeMap::new();
    while !entries.0.is_empty() {
        found.insert(entries.text()?, entries.text()?);
    }
    Ok((name, found))
}

/// Name and content.
fn attachment(content: &[u8]) -> Result<(&str, &[u8]), String> {
    let mut fields = Fields(content);
    let (_logged, _created, name, _media, data) =
        (fields.u64()?, fields.u64()?, fields.text()?, fields.text()?, fields.bytes64()?);
    let covered = &content[..content.len() - fields.0.len()];
    let crc = fields.u32()?;
    if crc != 0 && crc != crc32fast::hash(covered) {
        return Err(format!("the attachment {name} does not match its own checksum"));
    }
    Ok((name, data))
}

/// Where the summary says that records are, and how many messages it counts.
fn summary(bytes: &[u8], from: usize) -> Result<(Places, u64), String> {
    let (mut places, mut messages) = (Places::new(), None);
    for record in Records::new(bytes, from) {
        let record = record?;
        let mut fields = Fields(record.content);
        let kind = match record.op {
            op::CHUNK_INDEX => {
                fields.take(2 * size_of::<u64>())?; // first and last time
                op::CHUNK
            }
            op::ATTACHMENT_INDEX => op::ATTACHMENT,
            op::METADATA_INDEX => op::METADATA,
            op::STATISTICS => {
                messages = Some(fields.u64()?);
                continue;
            }
            op::SCHEMA | op::CHANNEL | op::SUMMARY_OFFSET | PRIVATE.. => continue,
            other => return Err(format!("a record of kind {other} does not belong into the summary")),
        };
        places.entry(kind).or_default().push((fields.u64()?, fields.u64()?));
    }
    Ok((places, messages.ok_or("its summary counts no messages")?))
}
