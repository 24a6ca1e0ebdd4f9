//! Standardisation: (x - mean) / std, entry by entry, with statistics of the training demos only.

/// A spread below this share of the mean is the rounding of single precision.
const ROUNDING: f32 = 1e-6;

/// Mean and standard deviation of each entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scaling {
    /// Means.
    pub mean: Vec<f32>,
    /// Standard deviations, at least the floor given to [`Scaling::fit`].
    pub std: Vec<f32>,
}

impl Scaling {
    /// Statistics of so many `rows` of `width` numbers, each of which `write` writes twice. A smaller spread of an entry than `floor` has for it
    /// counts as noise and is not blown up; without a floor (0, where the unit is not known) an entry that does not change at all is scaled by its size.
    pub fn fit(rows: usize, width: usize, floor: impl Fn(usize) -> f32, mut write: impl FnMut(usize, &mut [f32])) -> Self {
        let (n, mut row) = (rows.max(1) as f64, vec![0.0; width]);
        let mut mean = vec![0.0f64; width];
        for r in 0..rows {
            write(r, &mut row);
            mean.iter_mut().zip(&row).for_each(|(m, v)| *m += f64::from(*v) / n);
        }
        let mut variance = vec![0.0f64; width];
        for r in 0..rows {
            write(r, &mut row);
            let pairs = variance.iter_mut().zip(row.iter().zip(&mean));
            pairs.for_each(|(s, (v, m))| *s += (f64::from(*v) - m).powi(2) / n);
        }
        let mean: Vec<f32> = mean.iter().map(|m| *m as f32).collect();
        let std = |(i, v): (usize, &f64)| {
            let (std, size) = ((v.sqrt() as f32).max(floor(i)), mean[i].abs());
            match std > ROUNDING * size {
                true => std,
                false if size > 0.0 => size,
                false => 1.0,
            }
        };
        let std = variance.iter().enumerate().map(std).collect();
        Scaling { mean, std }
    }

    /// Number of entries.
    pub fn width(&self) -> usize {
        self.mean.len()
    }

    /// Entry `i` of a row, standardised.
    #[inline]
    pub fn apply(&self, i: usize, value: f32) -> f32 {
        (value - self.mean[i]) / self.std[i]
    }

    /// The inverse of [`Scaling::apply`].
    #[inline]
    pub fn undo(&self, i: usize, value: f32) -> f32 {
        self.mean[i] + self.std[i] * value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_change_and_has_no_floor_is_scaled_by_its_size() {
        let rows = [[0.0, -3.0, 2000.0, 1e-4], [0.0, -3.0, 2000.0001, 3e-4]];
        let scaling = Scaling::fit(2, 4, |_| 0.0, |r, row| row.copy_from_slice(&rows[r]));
        assert_eq!(scaling.std[..3], [1.0, 3.0, 2000.0]);
        assert!((scaling.std[3] - 1e-4).abs() < 1e-9, "{}", scaling.std[3]);
    }

    #[test]
    fn statistics_and_the_floor() {
        let scaling = Scaling::fit(2, 2, |_| 0.1, |r, row| row.copy_from_slice(&[[1.0, 5.0], [3.0, 5.0]][r]));
        assert_eq!(scaling.mean, [2.0, 5.0]);
        assert_eq!(scaling.std, [1.0, 0.1]);
        assert_eq!(scaling.undo(0, scaling.apply(0, 7.0)), 7.0);
    }
}
