//! Time of one update: Algorithm 1 on 1 and 16 demos of 150 steps (behavior cloning, state cloning, dynamics fine-tuning; D = 32, 9
//! actions, 3 x 100 tanh, rho .45), and behavior cloning alone on 512 pairs, on one and on two threads.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hilt::config::{PretrainSettings, TrainSettings};
use hilt::demo::Demo;
use hilt::interrupt::Interrupt;
use hilt::learn::{Learner, pretrain_dynamics};
use hilt::robot::READY_Q_RAD;
use hilt::state::{CONTROL_DT_S, JOINTS};
use hilt::tasks::Task;

const STEPS: usize = 150;
const DEMOS: usize = 32;
const RHO: f64 = 0.45;
const LEARNING_RATE: f64 = 1e-6;

/// A demo of smooth joint motions; what it does is of no matter for the time.
fn demo(index: usize) -> Demo {
    let dim = Task::Stack.state_dim();
    let (mut states, mut actions) = (Vec::new(), Vec::new());
    let mut q = READY_Q_RAD;
    for t in 0..=STEPS {
        let wave = |i: usize| 0.3 * ((t as f64 / 20.0) + (i + index) as f64).sin();
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
    Demo::new(Task::Stack, states, actions.clone(), actions).expect("lengths match")
}

fn learner() -> Learner {
    let demos: Vec<Demo> = (0..DEMOS).map(demo).collect();
    let pretrain = PretrainSettings { epochs: 1, ..Default::default() };
    let settings = TrainSettings { rho: RHO, ..Default::default() };
    let (dynamics, _) =
        pretrain_dynamics(&demos, &demos[..1], &pretrain, 0, &mut |_| {}, &Interrupt::default()).expect("the demos are sound");
    Learner::new(&demos, &demos[..1], Some(dynamics), &settings, 0).expect("the demos are sound")
}

fn hil_update(learner: &mut Learner, demos: &[usize], rows: &[usize]) {
    learner.behavior_cloning(rows, demos.len() as f64).expect("finite");
    learner.state_cloning(demos, rows).expect("finite");
    learner.update(0.5, LEARNING_RATE);
    learner.fine_tune(rows).expect("finite");
}

fn updates(criterion: &mut Criterion) {
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        let mut learner = learner();
        let mut group = criterion.benchmark_group("hil_update");
        for size in [1, 16, 32] {
            let demos: Vec<usize> = (0..size).collect();
            let rows = learner.rows_of(&demos);
            pool.install(|| hil_update(&mut learner, &demos, &rows));
            // floating point operations of the matrix products: "elements" per second below
            let flops = learner.flops_per_update(rows.len() as u64, learner.segments().len() as u64);
            group.throughput(Throughput::Elements(flops));
            group.bench_function(format!("B{size}/threads{threads}"), |bencher| {
                pool.install(|| bencher.iter(|| hil_update(&mut learner, &demos, &rows)));
            });
        }
        group.finish();
        let mut group = criterion.benchmark_group("bc_update");
        let rows: Vec<usize> = (0..512).map(|i| i * 7 % (DEMOS * STEPS)).collect();
        group.throughput(Throughput::Elements(learner.bc_flops_per_update(rows.len() as u64)));
        group.bench_function(format!("512/threads{threads}"), |bencher| {
            pool.install(|| {
                bencher.iter(|| {
                    learner.behavior_cloning(&rows, 512.0 / STEPS as f64).expect("finite");
                    learner.update(0.0, LEARNING_RATE);
                });
            });
        });
        group.finish();
    }
}

criterion_group!(benches, updates);
criterion_main!(benches);
