//! Time of one update: Algorithm 1 on 1, 16 and 32 demos of 150 steps (behavior cloning, state cloning, dynamics fine-tuning; D = 32, 9
//! actions, 3 x 100 tanh, rho .45), and behavior cloning alone on 512 pairs, on one and on two threads; beside it, the share of the
//! processor's f32 peak, measured here by loops of fused multiplications and additions in its widest registers. Only the matrix products
//! of the two networks count as operations: not tanh, features, losses or Adam, nor idle lanes, nor the first steps that the pass over
//! the demos' states has already done. Prints a table in Markdown.

#[allow(dead_code, reason = "the other benches use more of it")]
mod common;

use hilt::config::{Alpha, PretrainSettings, TrainSettings};
use hilt::demo::Demo;
use hilt::interrupt::Interrupt;
use hilt::learn::{Hil, Inputs, pretrain_dynamics};
use hilt::math::sin_cos;
use hilt::nn::kernel;
use hilt::robot::file::built_in::paper_robot;
use hilt::state::CONTROL_DT_S;
use hilt::task::built_in::stack;
use std::collections::HashMap;
use std::time::Instant;

const STEPS: usize = 150;
const DEMOS: usize = 32;
const RHO: f64 = 0.45;
const LEARNING_RATE: f64 = 1e-6;

/// A demo of smooth joint motions; what it does is of no matter for the time.
fn demo(index: usize) -> Demo {
    let dim = stack().layout(&paper_robot()).state_dim();
    let (mut states, mut actions) = (Vec::new(), Vec::new());
    let mut q = paper_robot().ready;
    for t in 0..=STEPS {
        let wave = |i: usize| 0.3 * sin_cos((t as f64 / 20.0) + (i + index) as f64).0;
        let mut state = vec![0.0f32; dim];
        for i in 0..JOINTS {
            (state[i], state[JOINTS + i]) = (q[i] as f32, wave(i) as f32);
            q[i] += CONTROL_DT_S * wave(i);
        }
        state[18..25].copy_from_slice(&[0.45, 0.01 * index as f32, 0.025 + 1e-3 * t as f32, 0.0, 0.0, 0.0, 1.0]);
        state[25..32].copy_from_slice(&[0.45, 0.27, 0.025, 0.0, 0.0, 0.0, 1.0]);
        states.extend(state);
        if t < STEPS {
            actions.extend((0..JOINTS).map(|i| wave(i) as f32));
        }
    }
    Demo::new(&stack().layout(&paper_robot()), states, actions.clone(), actions).expect("lengths match")
}

fn method() -> Hil {
    let demos: Vec<Demo> = (0..DEMOS).map(demo).collect();
    let pretrain = PretrainSettings { epochs: 1, ..Default::default() };
    let settings = TrainSettings { rho: RHO, batch: DEMOS, ..Default::default() };
    let (dynamics, _) =
        pretrain_dynamics(&demos, &demos[..1], &pretrain, 0, &mut |_, _| {}, &Interrupt::default()).expect("the demos are sound");
    let inputs = Inputs::new(&demos, &demos[..1]).expect("the demos are sound");
    Hil::new(inputs, Some(dynamics), Alpha::Fixed(0.5), &settings, 0).expect("the settings are sound")
}

/// Joints of the Jaco.
const JOINTS: usize = 9;
/// Registers of the loops below: enough that no multiplication waits for the one before it.
const CHAINS: usize = 12;
const PEAK_ROUNDS: usize = 1_000_000;

/// Most f32 operations per second of one core: fused multiplications and additions in registers of each width that it has \[floats\].
fn peak_flops() -> Vec<(usize, f64)> {
    let once = |width: usize, multiply_add: &dyn Fn(f32) -> f32| {
        let start = Instant::now();
        std::hint::black_box(multiply_add(std::hint::black_box(0.5)));
        (PEAK_ROUNDS * CHAINS * width * 2) as f64 / start.elapsed().as_secs_f64()
    };
    let best = |width, multiply_add: &dyn Fn(f32) -> f32| (width, (0..20).map(|_| once(width, multiply_add)).fold(0.0, f64::max));
    let mut peaks = Vec::new();
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the processor has AVX2 and FMA.
            peaks.push(best(8, &|factor| unsafe { multiply_add_256(factor) }));
        }
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has AVX-512F.
            peaks.push(best(16, &|factor| unsafe { multiply_add_512(factor) }));
        }
    }
    if peaks.is_empty() {
        peaks.push(best(8, &multiply_add));
    }
    peaks
}

fn multiply_add(factor: f32) -> f32 {
    let mut sums = [[0.0f32; 8]; CHAINS];
    (0..PEAK_ROUNDS).for_each(|_| sums.as_flattened_mut().iter_mut().for_each(|sum| *sum = *sum * factor + 1.0));
    sums.as_flattened().iter().sum()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn multiply_add_256(factor: f32) -> f32 {
    use std::arch::x86_64::{_mm256_cvtss_f32, _mm256_fmadd_ps, _mm256_set1_ps};
    let (mut sums, factor, one) = ([_mm256_set1_ps(0.0); CHAINS], _mm256_set1_ps(factor), _mm256_set1_ps(1.0));
    for _ in 0..PEAK_ROUNDS {
        for sum in &mut sums {
            *sum = _mm256_fmadd_ps(*sum, factor, one);
        }
    }
    sums.iter().map(|sum| _mm256_cvtss_f32(*sum)).sum()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn multiply_add_512(factor: f32) -> f32 {
    use std::arch::x86_64::{_mm512_cvtss_f32, _mm512_fmadd_ps, _mm512_set1_ps};
    let (mut sums, factor, one) = ([_mm512_set1_ps(0.0); CHAINS], _mm512_set1_ps(factor), _mm512_set1_ps(1.0));
    for _ in 0..PEAK_ROUNDS {
        for sum in &mut sums {
            *sum = _mm512_fmadd_ps(*sum, factor, one);
        }
    }
    sums.iter().map(|sum| _mm512_cvtss_f32(*sum)).sum()
}

/// Repetitions whose fastest is compared with the peak: other programs only ever slow it down.
const REPETITIONS: usize = 60;

/// What a repetition is compared with.
#[derive(Default)]
struct Yardstick {
    /// Most operations per second of one core seen so far, in the fastest of its registers: a slow minute must not flatter what is
    /// measured in it.
    peak: f64,
    /// Operations per second of each work on the first number of threads.
    rates: HashMap<String, f64>,
}

impl Yardstick {
    /// Prints the row of `work`, which returns its operations: its fastest repetition, how close that comes to `threads` cores' peak, and
    /// how much faster it is than on the first number of threads.
    fn report(&mut self, name: &str, threads: usize, mut work: impl FnMut() -> u64) {
        self.peak = peak_flops().into_iter().map(|(_, rate)| rate).fold(self.peak, f64::max);
        let once = |_| {
            let start = Instant::now();
            let flops = work();
            (start.elapsed().as_secs_f64(), flops as f64)
        };
        let repetitions = (0..REPETITIONS).map(once);
        let (seconds, flops) = repetitions.max_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0))).expect("repetitions");
        let rate = flops / seconds;
        let gain = rate / *self.rates.entry(name.into()).or_insert(rate);
        let (time, share) = (1e3 * seconds, 100.0 * rate / (self.peak * threads as f64));
        println!("| {name} | {threads} | {time:.3} | {:.0} | {share:.0} % | {gain:.2} |", rate / 1e9);
    }
}

fn main() {
    kernel::choose().expect("HILT_KERNEL names a kernel of this processor");
    println!("kernel: {}", kernel::describe());
    for (width, peak) in peak_flops() {
        println!("peak of one core in registers of {} bits: {:.1} GFLOP/s", 32 * width, peak / 1e9);
    }
    println!();
    common::head(&["update", "threads", "ms", "GFLOP/s in matrix products", "of the peak", "times one thread"]);
    let mut yardstick = Yardstick::default();
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        pool.install(|| updates(threads, &mut yardstick));
    }
}

fn updates(threads: usize, yardstick: &mut Yardstick) {
    let mut method = method();
    for size in [1, 16, 32] {
        let demos: Vec<usize> = (0..size).collect();
        yardstick.report(&format!("HIL, {size} demos"), threads, || {
            method.update(&demos, LEARNING_RATE, None).expect("finite");
            method.flops_per_update((size * STEPS) as u64)
        });
    }
    let rows: Vec<usize> = (0..512).map(|i| i * 7 % (DEMOS * STEPS)).collect();
    yardstick.report("BC, 512 pairs", threads, || {
        method.clone_behavior(&rows, LEARNING_RATE).expect("finite");
        method.bc_flops_per_update(rows.len() as u64)
    });
}
