//! The kernels of every path against plain loops.

use super::path::Path;
use super::tiles::{runs, spans};
use super::*;
use std::cmp::Ordering;

/// Every path that this processor has.
fn paths() -> Vec<Path> {
    Path::available().collect()
}

fn value(i: usize) -> f32 {
    ((i * 37 % 101) as f32 - 50.0) / 40.0
}

fn lanes(n: usize, from: usize) -> Vec<Lanes> {
    (0..n).map(|i| Lanes(std::array::from_fn(|l| value(from + i * LANES + l)))).collect()
}

/// Every size of tile and every remainder, both kinds of coefficients and all starts, on every path.
#[test]
fn products_equal_plain_loops() {
    for path in paths() {
        for panels in 0..=6 {
            for (depth, width) in (1..=25).map(|width| (24, width)).chain([(1, 7), (9, 4), (44, 100), (100, 9), (3, 31)]) {
                let x = lanes(panels * depth, 1);
                let (matrix, bias) = ((0..depth * width).map(value).collect::<Vec<_>>(), lanes(width, 5));
                let bias: Vec<f32> = bias.iter().map(|b| b.0[3]).collect();
                let samples = lanes(depth * width / LANES, 9);
                let before = lanes(panels * width, 2);
                let check = |a: Coefficients, start: Start, at: &dyn Fn(usize, usize) -> f32| {
                    let mut result = before.clone();
                    let of = Product { x: &x, depth, a, start, finish: Finish::Nothing };
                    on::product(path, &mut result, width, of);
                    for (i, l) in (0..panels * width).flat_map(|i| (0..LANES).map(move |l| (i, l))) {
                        let (p, f) = (i / width, i % width);
                        let first = match start {
                            Start::Zero => 0.0,
                            Start::Result => before[i].0[l],
                            Start::Bias(bias) => bias[f],
                        };
                        let sum = first + (0..depth).map(|k| at(k, f) * x[p * depth + k].0[l]).sum::<f32>();
                        let got = result[i].0[l];
                        assert!((got - sum).abs() < 1e-4, "{path:?} {panels} {depth} {width}, {p} {f} {l}: {got}, not {sum}");
                    }
                };
                for start in [Start::Zero, Start::Result, Start::Bias(&bias)] {
                    check(Coefficients::Matrix(&matrix), start, &|k, f| matrix[k * width + f]);
                    if depth % LANES == 0 {
                        let at = |k: usize, f: usize| samples[k / LANES * width + f].0[k % LANES];
                        check(Coefficients::Samples(&samples), start, &at);
                    }
                }
            }
        }
    }
}

/// Who trains on another processor gets the same file: whatever the tiles and however the multiply-add is done, the bits are the same. The
/// numbers are such that products are rounded, sums cancel, and some are infinite, NaN, subnormal or -0.
#[test]
fn all_paths_give_the_same_bits() {
    let fine = |n: usize, from: usize| -> Vec<Lanes> {
        let special = [-0.0, 1e-38, -3e-39, f32::INFINITY, f32::NAN, 0.0, 1e30];
        let number = |i: usize| if i % 997 < 7 { special[i % 997] } else { value(i) * (1.0 + value(i + 13) / 77.7) };
        (0..n).map(|i| Lanes(std::array::from_fn(|l| number(from + i * LANES + l)))).collect()
    };
    let bits = |lanes: &[Lanes]| -> Vec<u32> {
        let canonical = |v: f32| if v.is_nan() { f32::NAN } else { v };
        lanes.iter().flat_map(|lanes| lanes.0).map(|v| canonical(v).to_bits()).collect()
    };
    for (panels, depth, width) in (1..=9).flat_map(|panels| [(panels, 104, 100), (panels, 48, 9), (panels, 8, 31)]) {
        let (x, y, samples) = (fine(panels * depth, 1), fine(panels * width, 20), fine(depth * width / LANES, 9));
        let matrix: Vec<f32> = fine(depth * width / LANES, 40).iter().flat_map(|lanes| lanes.0).collect();
        let run = |path: Path, a: Coefficients, finish: Finish| {
            let mut result = lanes(panels * width, 2);
            on::product(path, &mut result, width, Product { x: &x, depth, a, start: Start::Result, finish });
            let mut turned = vec![Lanes::default(); panels * LANES * (width + 1).div_ceil(LANES)];
            on::transpose(path, &mut turned, &result, width);
            on::tanh(path, &mut turned);
            [bits(&result), bits(&turned)]
        };
        let finishes = [Finish::Nothing, Finish::Tanh, Finish::Relu, Finish::TanhSlope(&y), Finish::ReluSlope(&y)];
        for (i, finish) in finishes.into_iter().enumerate() {
            for a in [Coefficients::Matrix(&matrix), Coefficients::Samples(&samples)] {
                let portable = run(Path::Portable, a, finish);
                for path in paths() {
                    assert!(run(path, a, finish) == portable, "{path:?}: {panels} panels, {depth} x {width}, finish {i}");
                }
            }
        }
    }
}

#[test]
#[should_panic(expected = "a matrix is 3 x 2")]
fn a_matrix_of_another_size_is_refused() {
    let (x, a) = (&lanes(3, 0), Coefficients::Matrix(&[0.0; 5]));
    product(&mut lanes(2, 0), 2, Product { x, depth: 3, a, start: Start::Zero, finish: Finish::Nothing });
}

#[test]
fn tanh_is_close_everywhere_and_keeps_nan() {
    let xs: Vec<f32> = (-120_000..=120_000).map(|i| i as f32 * 1e-4).chain([-0.0, 1e-30, 50.0, -1e30, f32::INFINITY]).collect();
    for path in paths() {
        for x in xs.chunks(LANES) {
            let mut y = [Lanes(std::array::from_fn(|i| x[i % x.len()]))];
            on::tanh(path, &mut y);
            for (x, y) in x.iter().zip(y[0].0) {
                assert!((f64::from(y) - libm::tanh(f64::from(*x))).abs() < 3e-7, "{path:?}: tanh({x}) = {y}");
            }
        }
        let mut y = [Lanes::splat(f32::NAN)];
        on::tanh(path, &mut y);
        assert!(y[0].0.iter().all(|v| v.is_nan()));
    }
}

/// A finish is what a plain product and a loop over its result give, in every tile and on every path.
#[test]
fn finishes_are_functions_of_the_plain_product() {
    for path in paths() {
        for (panels, width) in [(1, 4), (1, 13), (2, 6), (3, 100), (4, 9)] {
            let (depth, y) = (5, lanes(panels * width, 20));
            let (x, matrix) = (lanes(panels * depth, 1), (0..depth * width).map(value).collect::<Vec<_>>());
            let run = |finish: Finish| {
                let mut result = vec![Lanes::default(); panels * width];
                let of = Product { x: &x, depth, a: Coefficients::Matrix(&matrix), start: Start::Zero, finish };
                on::product(path, &mut result, width, of);
                result
            };
            let plain = run(Finish::Nothing);
            let check = |finish: Finish, expected: &dyn Fn(f32, f32) -> f32| {
                let got = run(finish);
                for (i, l) in (0..plain.len()).flat_map(|i| (0..LANES).map(move |l| (i, l))) {
                    let (expected, got) = (expected(plain[i].0[l], y[i].0[l]), got[i].0[l]);
                    assert!((got - expected).abs() < 1e-5, "{path:?} {panels} {width}, {i} {l}: {got}, not {expected}");
                }
            };
            check(Finish::Tanh, &|s, _| libm::tanhf(s));
            check(Finish::Relu, &|s, _| s.max(0.0));
            check(Finish::TanhSlope(&y), &|s, y| s * (1.0 - y * y));
            check(Finish::ReluSlope(&y), &|s, y| if y > 0.0 { s } else { 0.0 });
        }
    }
}

#[test]
fn interleaving_puts_rows_into_lanes_and_separating_takes_them_out() {
    for path in paths() {
        for entries in [0, 1, 7, 8, 9, 16, 53] {
            let rows: [Vec<f32>; LANES] = std::array::from_fn(|r| (0..entries + 2).map(|i| value(100 * r + i)).collect());
            let mut panel = vec![Lanes::splat(9.0); entries];
            on::interleave(path, &mut panel, std::array::from_fn(|r| rows[r].as_slice()));
            for (i, r) in (0..entries).flat_map(|i| (0..LANES).map(move |r| (i, r))) {
                assert_eq!(panel[i].0[r], rows[r][i], "{path:?}, row {r}, entry {i} of {entries}");
            }
            let mut back = rows.clone().map(|row| vec![9.0; row.len()]);
            on::separate(path, back.each_mut().map(Vec::as_mut_slice), &panel);
            for (row, back) in rows.iter().zip(&back) {
                assert_eq!(
                    (&row[..entries], &back[entries..]),
                    (&back[..entries], &[9.0, 9.0][..]),
                    "{path:?}, {entries} entries"
                );
            }
        }
    }
}

#[test]
fn transposing_turns_entries_into_lanes() {
    for path in paths() {
        for (panels, entries) in [(1, 8), (2, 11), (3, 5), (2, 16)] {
            let from = lanes(panels * entries, 7);
            let samples = panels * LANES;
            let mut to = vec![Lanes::splat(9.0); samples * (entries + 1).div_ceil(LANES)];
            on::transpose(path, &mut to, &from, entries);
            for (r, i) in (0..samples).flat_map(|r| (0..(entries + 1).next_multiple_of(LANES)).map(move |i| (r, i))) {
                let expected = match i.cmp(&entries) {
                    Ordering::Less => from[r / LANES * entries + i].0[r % LANES],
                    Ordering::Equal => 1.0,
                    Ordering::Greater => 0.0,
                };
                assert_eq!(to[i / LANES * samples + r].0[i % LANES], expected, "{path:?}, sample {r}, entry {i}");
            }
        }
    }
}

#[test]
fn runs_cover_a_range_evenly() {
    for (n, most) in [(0, 6), (1, 6), (9, 6), (100, 6), (25, 10)] {
        let parts: Vec<usize> = runs(n, most).flat_map(|(size, count)| std::iter::repeat_n(size, count)).collect();
        assert_eq!((parts.iter().sum::<usize>(), parts.len()), (n, n.div_ceil(most)));
        assert!(parts.iter().all(|size| *size <= most && size + 1 >= n.div_ceil(n.div_ceil(most).max(1))));
    }
    for (panels, most) in (0..12).flat_map(|panels| [(panels, 2), (panels, 4)]) {
        let parts: Vec<usize> = spans(panels, most).flat_map(|(size, times)| std::iter::repeat_n(size, times)).collect();
        assert_eq!(parts.iter().sum::<usize>(), panels);
        assert!(parts.iter().all(|size| (2..=most.max(3)).contains(size) || panels == 1), "{panels} panels in {parts:?}");
    }
}

/// What Adam and the averages do, number by number: wide registers round as narrow ones.
#[test]
fn loops_over_many_numbers_have_the_same_bits_on_every_path() {
    let gradient: Vec<f32> = (0..1003).map(value).collect();
    let run = |path: Path| {
        let (mut params, mut second) = (vec![0.3f32; gradient.len()], vec![1e-3f32; gradient.len()]);
        on::wide(path, || {
            for ((p, v), g) in params.iter_mut().zip(&mut second).zip(&gradient) {
                *v = 0.999 * *v + 0.001 * (g * g);
                *p -= 1e-3 * g / ((*v * 1.7).sqrt() + 1e-8);
            }
        });
        params.into_iter().chain(second).map(f32::to_bits).collect::<Vec<_>>()
    };
    for path in paths() {
        assert_eq!(run(path), run(Path::Portable), "{path:?}");
    }
}
