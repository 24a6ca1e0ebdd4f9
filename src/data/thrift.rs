//! Thrift's compact protocol, read only as far as to know that every length fits into what is there: Parquet's metadata and page headers
//! are written in it, and a decoder that believes a length allocates it.

/// Structs within structs: Parquet has 6.
const MOST_DEPTH: usize = 12;
/// Field numbers from the outside in: a column's size is \[4, 1, 3, 7\] of a file. Elements of a list have the path of the list.
type Path = Vec<i16>;

/// What is shown the fields, by their paths.
type See<'a> = dyn FnMut(&[i16], Value) -> Result<(), String> + 'a;

/// What stands at a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    /// A whole number.
    Int(i64),
    /// A list of so many elements, before them.
    List(usize),
    /// A struct, before its fields.
    Struct,
}

/// Reads one struct from the beginning of `bytes`; shows `see` what it holds; returns its length.
///
/// # Errors
/// Says where a length does not fit, and what `see` says.
pub(super) fn walk(bytes: &[u8], see: &mut See) -> Result<usize, String> {
    let mut walker = Walker { bytes, at: 0, path: Path::new(), see };
    walker.fields()?;
    Ok(walker.at)
}

struct Walker<'a> {
    bytes: &'a [u8],
    at: usize,
    path: Path,
    see: &'a mut See<'a>,
}

impl Walker<'_> {
    fn fields(&mut self) -> Result<(), String> {
        if self.path.len() > MOST_DEPTH {
            return Err(format!("its metadata is nested more than {MOST_DEPTH} deep"));
        }
        let mut id = 0i16;
        loop {
            let header = self.byte()?;
            if header == 0 {
                return Ok(());
            }
            let step = i16::from(header >> 4);
            id = if step == 0 { self.integer()? as i16 } else { id.wrapping_add(step) };
            self.path.push(id);
            self.value(header & 15, false)?;
            self.path.pop();
        }
    }

    /// A value of a type by the protocol's number; a flag is a byte within a list, and none as a field.
    fn value(&mut self, kind: u8, in_list: bool) -> Result<(), String> {
        match kind {
            1 | 2 if in_list => self.skip(1),
            1 | 2 => Ok(()),
            3 => self.skip(1),
            4..=6 => {
                let number = self.integer()?;
                (self.see)(&self.path, Value::Int(number))
            }
            7 => self.skip(size_of::<f64>()),
            8 => {
                let length = self.length()?;
                self.skip(length)
            }
            9 | 10 => self.list(),
            11 => self.map(),
            12 => {
                (self.see)(&self.path, Value::Struct)?;
                self.fields()
            }
            13 => self.skip(16), // a UUID
            other => Err(format!("its metadata has a field of type {other}, which there is not")),
        }
    }

    fn list(&mut self) -> Result<(), String> {
        let header = self.byte()?;
        let count = if header >> 4 == 15 { self.length()? } else { usize::from(header >> 4) };
        if count > self.bytes.len() - self.at {
            return Err(format!("its metadata has a list of {count} entries in {} bytes", self.bytes.len() - self.at));
        }
        (self.see)(&self.path, Value::List(count))?;
        (0..count).try_for_each(|_| self.value(header & 15, true))
    }

    fn map(&mut self) -> Result<(), String> {
        let count = self.length()?;
        if count == 0 {
            return Ok(());
        }
        let kinds = self.byte()?;
        (0..count).try_for_each(|_| {
            self.value(kinds >> 4, true)?;
            self.value(kinds & 15, true)
        })
    }

    fn byte(&mut self) -> Result<u8, String> {
        let byte = *self.bytes.get(self.at).ok_or("its metadata ends too early")?;
        self.at += 1;
        Ok(byte)
    }

    fn skip(&mut self, length: usize) -> Result<(), String> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.bytes.len());
        self.at = end.ok_or_else(|| format!("its metadata wants {length} bytes, {} are left", self.bytes.len() - self.at))?;
        Ok(())
    }

    /// Seven bits a byte, the lowest first.
    fn varint(&mut self) -> Result<u64, String> {
        let mut number = 0u64;
        for shift in (0..u64::BITS).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(number);
            }
        }
        Err("its metadata has a number of more than 64 bits".into())
    }

    /// A signed number: the sign is the lowest bit.
    fn integer(&mut self) -> Result<i64, String> {
        let coded = self.varint()?;
        Ok((coded >> 1) as i64 ^ -((coded & 1) as i64))
    }

    fn length(&mut self) -> Result<usize, String> {
        let length = self.varint()?;
        usize::try_from(length).map_err(|_| format!("its metadata has a length of {length}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(bytes: &[u8]) -> Result<Vec<(Vec<i16>, Value)>, String> {
        let mut found = Vec::new();
        walk(bytes, &mut |path, value| {
            found.push((path.to_vec(), value));
            Ok(())
        })?;
        Ok(found)
    }

    #[test]
    fn numbers_lists_and_structs_are_found_at_their_paths() {
        // 1: i32 -3; 2: list of two structs { 1: i64 300 }, 3: text "ab"
        let bytes = [0x15, 0x05, 0x19, 0x2c, 0x16, 0xd8, 0x04, 0, 0x16, 0xd8, 0x04, 0, 0x18, 2, b'a', b'b', 0];
        let expected = [
            (vec![1], Value::Int(-3)),
            (vec![2], Value::List(2)),
            (vec![2], Value::Struct),
            (vec![2, 1], Value::Int(300)),
            (vec![2], Value::Struct),
            (vec![2, 1], Value::Int(300)),
        ];
        assert_eq!(seen(&bytes).expect("whole"), expected);
        for cut in 0..bytes.len() {
            assert!(seen(&bytes[..cut]).is_err(), "cut at {cut}");
        }
    }

    #[test]
    fn a_length_that_does_not_fit_is_refused_before_anything_is_allocated() {
        for bytes in [
            vec![0x19, 0xf5, 0xff, 0xff, 0xff, 0xff, 0x0f], // a list of 2^32 - 1 numbers
            vec![0x18, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f], // a text of terabytes
            vec![0x1c; 1000],                               // structs in structs
            vec![0x16, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1], // a number without an end
            vec![0x1b, 0xff, 0xff, 0xff, 0x7f, 0x88],       // a map of many texts
            vec![0x1e, 0],
        ] {
            assert!(seen(&bytes).is_err(), "{bytes:?}");
        }
    }
}
