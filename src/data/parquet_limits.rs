//! What a Parquet file says of its own size, checked before a decoder believes it: 20 kB can hold 20 GB.

use super::budget::Budget;
use super::thrift::{Value, walk};
use crate::layout::MOST_ENTRIES;
use std::borrow::Cow;

/// Bytes at the end of a file: the metadata's length and the format's name.
const TAIL: u64 = 8;
/// How wide a table may be.
#[derive(Clone, Copy)]
pub(super) struct Width {
    /// Entries of a schema, groups included; decoders descend into groups by recursion.
    schema_entries: usize,
    /// Numbers of a row in one column.
    values_of_a_row: i64,
}

/// Of hilt's own tables: the widest has some 200 entries, the longest list 32 numbers.
pub(super) const OWN: Width = Width { schema_entries: 1000, values_of_a_row: 1000 };
/// Of tables of others: LeRobot keeps ten statistics of each column, three entries each, and a picture's may be lists of lists; a row has as many
/// numbers as a layout may have.
pub(super) const OF_OTHERS: Width = Width { schema_entries: 20_000, values_of_a_row: MOST_ENTRIES as i64 };

/// Unpacked bytes of a page; hilt's own have a megabyte.
const MOST_PAGE_BYTES: i64 = 64 << 20;
/// What a decoder takes for each value: a number and its place.
const BYTES_OF_A_VALUE: u64 = 8;

/// Fields of the file's metadata and of a page's header.
mod field {
    pub(super) const SCHEMA: &[i16] = &[2];
    pub(super) const ROW_GROUP: &[i16] = &[4];
    pub(super) const COLUMN: &[i16] = &[4, 1];
    pub(super) const ROWS_OF_GROUP: &[i16] = &[4, 3];
    pub(super) const PHYSICAL_TYPE: &[i16] = &[4, 1, 3, 1];
    pub(super) const VALUES: &[i16] = &[4, 1, 3, 5];
    pub(super) const PACKED: &[i16] = &[4, 1, 3, 7];
    pub(super) const DATA_PAGE: &[i16] = &[4, 1, 3, 9];
    pub(super) const DICTIONARY_PAGE: &[i16] = &[4, 1, 3, 11];

    pub(super) const PAGE_UNPACKED: &[i16] = &[2];
    pub(super) const PAGE_PACKED: &[i16] = &[3];
    pub(super) const PAGE_VALUES: [&[i16]; 3] = [&[5, 1], &[7, 1], &[8, 1]];
}

/// Parquet's number of the type of texts.
const BYTE_ARRAY: i64 = 6;

/// A column of a row group, as the metadata has it.
#[derive(Clone, Copy, Debug, Default)]
struct Chunk {
    group: usize,
    physical_type: i64,
    values: i64,
    packed: i64,
    data_page: i64,
    dictionary_page: Option<i64>,
}

/// Gives so many bytes of a file from a place on; both are within its length.
pub(super) type Part<'a> = dyn Fn(u64, u64) -> Result<Cow<'a, [u8]>, String> + 'a;

/// Checks metadata and page headers of a whole file; returns the unpacked bytes of the largest page of texts: one value can be as long.
///
/// # Errors
/// Says what does not fit, or is too large.
pub(super) fn check(bytes: &[u8]) -> Result<usize, String> {
    let part = |from, len| Ok(Cow::Borrowed(&bytes[from as usize..(from + len) as usize]));
    check_parts(bytes.len() as u64, &part, OWN)
}

/// As [`check`], of a file of `len` bytes that is looked at in parts.
///
/// # Errors
/// As [`check`]; what `part` says.
pub(super) fn check_parts(len: u64, part: &Part, width: Width) -> Result<usize, String> {
    let end = len.checked_sub(TAIL).ok_or("it is shorter than its metadata")?;
    let length = metadata_bytes(&part(end, TAIL)?);
    let start = end.checked_sub(length).ok_or_else(|| format!("its metadata would have {length} bytes, the file has {end}"))?;
    let (chunks, rows) = columns(&part(start, length)?, width.schema_entries)?;
    let mut budget = Budget::new();
    budget.allow_for(len);
    let mut longest_text = 0;
    for chunk in &chunks {
        let most = rows.get(chunk.group).copied().unwrap_or(0).saturating_mul(width.values_of_a_row);
        if !(0..=most).contains(&chunk.values) {
            return Err(format!("a column has {} values, its rows can have at most {most}", chunk.values));
        }
        budget.take(chunk.values.unsigned_abs().saturating_mul(BYTES_OF_A_VALUE))?;
        let (from, packed) = chunk.place(start)?;
        let largest = pages(&part(from, packed)?, chunk, &mut budget)?;
        if chunk.physical_type == BYTE_ARRAY {
            longest_text = longest_text.max(largest);
        }
    }
    Ok(longest_text)
}

/// Bytes of the metadata by the end of a file, its last eight bytes.
pub(super) fn metadata_bytes(tail: &[u8]) -> u64 {
    tail.first_chunk().map_or(0, |length| u64::from(u32::from_le_bytes(*length)))
}

/// The columns of all row groups, and the rows of each group.
fn columns(metadata: &[u8], most_entries: usize) -> Result<(Vec<Chunk>, Vec<i64>), String> {
    let (mut chunks, mut rows) = (Vec::<Chunk>::new(), Vec::<i64>::new());
    walk(metadata, &mut |path, value| {
        match (path, value) {
            (field::SCHEMA, Value::List(count)) if count > most_entries => {
                return Err(format!("its schema has {count} entries, hilt reads at most {most_entries}"));
            }
            (field::ROW_GROUP, Value::Struct) => rows.push(0),
            (field::COLUMN, Value::Struct) => chunks.push(Chunk { group: rows.len().saturating_sub(1), ..Chunk::default() }),
            (field::ROWS_OF_GROUP, Value::Int(count)) => rows.iter_mut().last().into_iter().for_each(|last| *last = count),
            (_, Value::Int(number)) => {
                if let Some(chunk) = chunks.last_mut() {
                    chunk.take(path, number);
                }
            }
            _ => {}
        }
        Ok(())
    })?;
    Ok((chunks, rows))
}

impl Chunk {
    fn take(&mut self, path: &[i16], number: i64) {
        match path {
            field::PHYSICAL_TYPE => self.physical_type = number,
            field::VALUES => self.values = number,
            field::PACKED => self.packed = number,
            field::DATA_PAGE => self.data_page = number,
            field::DICTIONARY_PAGE => self.dictionary_page = Some(number),
            _ => {}
        }
    }

    /// Where the column begins in the data, which have `len` bytes, and its length.
    fn place(&self, len: u64) -> Result<(u64, u64), String> {
        let start = self.dictionary_page.filter(|at| *at > 0).map_or(self.data_page, |at| at.min(self.data_page));
        let place = (u64::try_from(start).ok()).zip(u64::try_from(self.packed).ok());
        place
            .filter(|(from, packed)| from.checked_add(*packed).is_some_and(|to| to <= len))
            .ok_or_else(|| format!("a column lies at byte {start} and has {} bytes, the data has {len}", self.packed))
    }
}

/// Walks the pages of a column; returns the unpacked bytes of the largest.
fn pages(mut left: &[u8], chunk: &Chunk, budget: &mut Budget) -> Result<usize, String> {
    let mut largest = 0;
    while !left.is_empty() {
        let (mut unpacked, mut packed, mut values) = (0, 0, 0);
        let header = walk(left, &mut |path, value| {
            match (path, value) {
                (field::PAGE_UNPACKED, Value::Int(number)) => unpacked = number,
                (field::PAGE_PACKED, Value::Int(number)) => packed = number,
                (path, Value::Int(number)) if field::PAGE_VALUES.contains(&path) => values = number,
                _ => {}
            }
            Ok(())
        })?;
        if !(0..=MOST_PAGE_BYTES).contains(&unpacked) || !(0..=chunk.values.max(unpacked)).contains(&values) {
            return Err(format!(
                "a page would unpack to {unpacked} bytes and {values} values, more than its column has or hilt reads"
            ));
        }
        budget.take(unpacked.unsigned_abs())?;
        let next = usize::try_from(packed).ok().and_then(|packed| header.checked_add(packed));
        left = next
            .and_then(|next| left.get(next..))
            .ok_or_else(|| format!("a page has {packed} bytes, {} are left", left.len() - header))?;
        largest = largest.max(unpacked as usize);
    }
    Ok(largest)
}
