//! The records of an MCAP file, read with every length checked against what is there: `opcode`, length, content, one after another.

use super::fields::Fields;

/// Records that a recording is made of.
pub(super) mod op {
    pub(in super::super) const HEADER: u8 = 0x01;
    pub(in super::super) const FOOTER: u8 = 0x02;
    pub(in super::super) const SCHEMA: u8 = 0x03;
    pub(in super::super) const CHANNEL: u8 = 0x04;
    pub(in super::super) const MESSAGE: u8 = 0x05;
    pub(in super::super) const CHUNK: u8 = 0x06;
    pub(in super::super) const MESSAGE_INDEX: u8 = 0x07;
    pub(in super::super) const CHUNK_INDEX: u8 = 0x08;
    pub(in super::super) const ATTACHMENT: u8 = 0x09;
    pub(in super::super) const ATTACHMENT_INDEX: u8 = 0x0a;
    pub(in super::super) const STATISTICS: u8 = 0x0b;
    pub(in super::super) const METADATA: u8 = 0x0c;
    pub(in super::super) const METADATA_INDEX: u8 = 0x0d;
    pub(in super::super) const SUMMARY_OFFSET: u8 = 0x0e;
    pub(in super::super) const DATA_END: u8 = 0x0f;
}

/// Bytes before a record's content: its opcode and its length.
pub(super) const PREFIX_BYTES: usize = 1 + 8;
/// Content of a footer: where the summary and its offsets begin, and the checksum of both.
const FOOTER_BYTES: usize = 8 + 8 + 4;
/// Content of the record that ends the data section: its checksum.
const DATA_END_BYTES: usize = 4;
const CRC_BYTES: usize = 4;

/// A record and where it stands.
pub(super) struct Record<'a> {
    pub(super) op: u8,
    /// Place of its opcode.
    pub(super) at: usize,
    pub(super) content: &'a [u8],
}

impl Record<'_> {
    /// Bytes of the whole record.
    pub(super) fn len(&self) -> usize {
        PREFIX_BYTES + self.content.len()
    }
}

/// Reads records from a piece of a file that begins at `from` in it.
pub(super) struct Records<'a> {
    fields: Fields<'a>,
    from: usize,
    whole: usize,
}

impl<'a> Records<'a> {
    pub(super) fn new(bytes: &'a [u8], from: usize) -> Self {
        Records { fields: Fields(bytes), from, whole: bytes.len() }
    }

    fn next_record(&mut self) -> Result<Record<'a>, String> {
        let at = self.from + self.whole - self.fields.0.len();
        let (op, len) = (self.fields.u8()?, self.fields.u64()?);
        let left = self.fields.0.len();
        let content = usize::try_from(len).ok().and_then(|len| self.fields.take(len).ok());
        let content = content.ok_or_else(|| format!("the record at byte {at} has {len} bytes, {left} are left"))?;
        Ok(Record { op, at, content })
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<Record<'a>, String>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.fields.0.is_empty() {
            return None;
        }
        let record = self.next_record();
        if record.is_err() {
            self.fields.0 = &[];
        }
        Some(record)
    }
}

/// Where the sections of a file end.
pub(super) struct Sections {
    /// Place of the record that ends the data section.
    pub(super) data_end: usize,
    /// Place of the first record of the summary.
    pub(super) summary: usize,
    /// Place of the footer.
    pub(super) footer: usize,
}

impl Sections {
    /// Of a file that begins and ends with the magic bytes, as its footer has them.
    ///
    /// # Errors
    /// Says that the footer is none, or what it says about the summary cannot be.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, String> {
        let broken = || "its footer does not say where the summary is".to_string();
        let footer = bytes.len().checked_sub(mcap::MAGIC.len() + FOOTER_BYTES + PREFIX_BYTES).ok_or_else(broken)?;
        let record = Records::new(&bytes[footer..bytes.len() - mcap::MAGIC.len()], footer).next_record()?;
        let summary = usize::try_from(Fields(record.content).u64()?).map_err(|_| broken())?;
        let data_end = summary.checked_sub(PREFIX_BYTES + DATA_END_BYTES).ok_or_else(broken)?;
        if record.op != op::FOOTER || record.content.len() != FOOTER_BYTES || summary > footer || data_end < mcap::MAGIC.len() {
            return Err(broken());
        }
        let end = Records::new(&bytes[data_end..summary], data_end).next_record()?;
        if end.op != op::DATA_END || end.content.len() != DATA_END_BYTES {
            return Err(broken());
        }
        Ok(Sections { data_end, summary, footer })
    }

    /// Where the checksum of the data section stands.
    pub(super) fn data_crc(&self) -> std::ops::Range<usize> {
        self.summary - CRC_BYTES..self.summary
    }

    /// Both checksums against what they cover; 0 means that there is none.
    ///
    /// # Errors
    /// Says which differs.
    pub(super) fn check_crcs(&self, bytes: &[u8]) -> Result<(), String> {
        // The summary's own checksum covers the footer up to itself.
        let summary_crc = bytes.len() - mcap::MAGIC.len() - CRC_BYTES;
        let sums = [
            ("data section", 0..self.data_end, self.data_crc()),
            ("summary", self.summary..summary_crc, summary_crc..summary_crc + CRC_BYTES),
        ];
        for (name, covered, at) in sums {
            let noted = Fields(&bytes[at]).u32()?;
            if noted != 0 && noted != crc32fast::hash(&bytes[covered]) {
                return Err(format!("its {name} does not match its own checksum"));
            }
        }
        Ok(())
    }
}
