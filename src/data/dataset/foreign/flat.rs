//! Arrow columns of any nesting as plain numbers, row after row.

use crate::data::dataset::cells::{Cells, Kind};
use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef};
use arrow_schema::DataType;
use std::sync::Arc;

/// Appends the numbers of a column, `width` in a row, to `cells`. `Err` has the row at fault, where one is, and what is wrong.
pub(super) fn append(column: &ArrayRef, width: usize, cells: &mut Cells) -> Result<(), (Option<usize>, String)> {
    let flat = flattened(column, width)?;
    if let Some(row) =
        flat.as_primitive_opt::<UInt64Type>().and_then(|array| array.values().iter().position(|v| i64::try_from(*v).is_err()))
    {
        return Err((Some(row / width.max(1)), format!("has a whole number above {}", i64::MAX)));
    }
    let other = || (None, format!("has type {}, meta/info.json says other", column.data_type()));
    match (cells, flat.data_type()) {
        (Cells::Bool(to), DataType::Boolean) => to.extend(flat.as_boolean().values()),
        (Cells::F32(to), kind) => {
            let (from, mut too_large) = (to.len(), None);
            let take = |v: f64| {
                let single = v as f32;
                if v.is_finite() && single.is_infinite() {
                    too_large.get_or_insert((to.len() - from, v));
                }
                to.push(single);
            };
            floats(&flat, kind, take).ok_or_else(other)?;
            if let Some((at, value)) = too_large {
                let what = format!("has {value:e}, single precision holds at most {:e} either way", f32::MAX);
                return Err((Some(at / width.max(1)), what));
            }
        }
        (Cells::F64(to), kind) => floats(&flat, kind, |v| to.push(v)).ok_or_else(other)?,
        (Cells::I64(to), kind) => integers(&flat, kind, |v| to.push(v)).ok_or_else(other)?,
        _ => return Err(other()),
    }
    Ok(())
}

/// Numbers of no row.
pub(super) fn none_of(kind: Kind) -> Cells {
    Cells::of_bytes(kind, &[])
}

/// The innermost values, when every row has `width` of them and none is empty.
fn flattened(column: &ArrayRef, width: usize) -> Result<ArrayRef, (Option<usize>, String)> {
    let (mut array, rows) = (Arc::clone(column), column.len());
    // Where each row begins among the values of `array`, and the end.
    let mut bounds: Vec<usize> = (0..=rows).collect();
    loop {
        if array.null_count() > 0 {
            let at = (0..array.len()).find(|i| array.is_null(*i)).unwrap_or(0);
            return Err((Some(bounds.partition_point(|b| *b <= at).saturating_sub(1)), "has an empty cell".into()));
        }
        array = if let Some(list) = array.as_fixed_size_list_opt() {
            let n = list.value_length() as usize;
            bounds.iter_mut().for_each(|b| *b *= n);
            Arc::clone(list.values())
        } else if let Some(list) = array.as_list_opt::<i32>() {
            let offsets = list.offsets();
            let from = offsets[0] as usize;
            bounds.iter_mut().for_each(|b| *b = offsets[*b] as usize - from);
            list.values().slice(from, offsets[list.len()] as usize - from)
        } else if let Some(list) = array.as_list_opt::<i64>() {
            let offsets = list.offsets();
            let from = offsets[0] as usize;
            bounds.iter_mut().for_each(|b| *b = offsets[*b] as usize - from);
            list.values().slice(from, offsets[list.len()] as usize - from)
        } else {
            break;
        };
    }
    match bounds.windows(2).position(|row| row[1] - row[0] != width) {
        Some(row) => Err((Some(row), format!("has {} values, meta/info.json says {width}", bounds[row + 1] - bounds[row]))),
        None => Ok(array),
    }
}

fn each<T: ArrowPrimitiveType>(array: &ArrayRef, take: impl FnMut(T::Native)) {
    array.as_primitive::<T>().values().iter().copied().for_each(take);
}

fn floats(array: &ArrayRef, kind: &DataType, mut take: impl FnMut(f64)) -> Option<()> {
    match kind {
        DataType::Float16 => each::<Float16Type>(array, |v| take(v.to_f64())),
        DataType::Float32 => each::<Float32Type>(array, |v| take(f64::from(v))),
        DataType::Float64 => each::<Float64Type>(array, take),
        _ => integers(array, kind, |v| take(v as f64))?,
    }
    Some(())
}

fn integers(array: &ArrayRef, kind: &DataType, mut take: impl FnMut(i64)) -> Option<()> {
    match kind {
        DataType::Int8 => each::<Int8Type>(array, |v| take(i64::from(v))),
        DataType::Int16 => each::<Int16Type>(array, |v| take(i64::from(v))),
        DataType::Int32 => each::<Int32Type>(array, |v| take(i64::from(v))),
        DataType::Int64 => each::<Int64Type>(array, take),
        DataType::UInt8 => each::<UInt8Type>(array, |v| take(i64::from(v))),
        DataType::UInt16 => each::<UInt16Type>(array, |v| take(i64::from(v))),
        DataType::UInt32 => each::<UInt32Type>(array, |v| take(i64::from(v))),
        DataType::UInt64 => each::<UInt64Type>(array, |v| take(v as i64)),
        _ => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::builder::{FixedSizeListBuilder, Float64Builder, ListBuilder};
    use arrow_array::{Float64Array, Int32Array};

    #[test]
    fn lists_of_lists_of_any_kind_become_rows_of_numbers() {
        let mut lists = ListBuilder::new(FixedSizeListBuilder::new(Float64Builder::new(), 2));
        for row in 0..3 {
            for pair in 0..2 {
                lists.values().values().append_slice(&[f64::from(row), f64::from(pair)]);
                lists.values().append(true);
            }
            lists.append(true);
        }
        let column: ArrayRef = Arc::new(lists.finish());
        let mut cells = none_of(Kind::F32);
        append(&column.slice(1, 2), 4, &mut cells).expect("numbers");
        assert_eq!(cells, Cells::F32(vec![1.0, 0.0, 1.0, 1.0, 2.0, 0.0, 2.0, 1.0]));
        let why = append(&column, 3, &mut cells).expect_err("another width");
        assert_eq!(why, (Some(0), "has 4 values, meta/info.json says 3".into()));
    }

    #[test]
    fn integers_may_stand_for_floats_but_not_the_other_way_round_and_empty_cells_are_named() {
        let (mut floats, mut ints) = (none_of(Kind::F64), none_of(Kind::I64));
        append(&(Arc::new(Int32Array::from(vec![7, -1])) as ArrayRef), 1, &mut floats).expect("numbers");
        assert_eq!(floats, Cells::F64(vec![7.0, -1.0]));
        let reals: ArrayRef = Arc::new(Float64Array::from(vec![0.5]));
        assert!(append(&reals, 1, &mut ints).expect_err("refused").1.contains("Float64"));
        let holes: ArrayRef = Arc::new(Float64Array::from(vec![Some(0.5), Some(1.0), None]));
        assert_eq!(append(&holes, 1, &mut floats).expect_err("refused"), (Some(2), "has an empty cell".into()));
        let large: ArrayRef = Arc::new(Float64Array::from(vec![0.5, f64::NEG_INFINITY, -1e39, 1e300]));
        let (row, why) = append(&large, 2, &mut none_of(Kind::F32)).expect_err("no width of two");
        assert_eq!((row, why), (Some(0), "has 1 values, meta/info.json says 2".into()));
        let (row, why) = append(&large, 1, &mut none_of(Kind::F32)).expect_err("too large");
        assert!(row == Some(2) && why.contains("-1e39") && why.contains("3.4028235e38"), "{row:?} {why}");
    }
}
