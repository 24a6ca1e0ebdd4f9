//! Training allocates nothing in its loop: after two updates, updates on other demos and segments find all the room that they need.

use hilt::config::{ActionChoice, Alpha, PretrainSettings, TrainSettings};
use hilt::demo::Demo;
use hilt::interrupt::Interrupt;
use hilt::learn::{Hil, Inputs, pretrain_dynamics};
use hilt::robot::file::built_in::paper_robot;
use hilt::task::built_in::pick_up;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, with a count of what each thread asks of it.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    ALLOCATIONS.with(|n| n.set(n.get() + 1));
}

// SAFETY: all is handed to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's; so below.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = ALLOCATIONS.with(Cell::get);
    work();
    ALLOCATIONS.with(Cell::get) - before
}

const DEMOS: usize = 12;
const BATCH: usize = 4;

/// A demo of 40 steps and more; what it does is of no matter here.
fn demo(index: usize) -> Demo {
    let layout = pick_up().layout(&paper_robot());
    let (dim, steps) = (layout.state_dim(), 40 + 7 * index);
    let value = |i: usize| (((i + index) * 37 % 101) as f32 - 50.0) / 100.0;
    let states = (0..(steps + 1) * dim).map(value).collect();
    let actions: Vec<f32> = (0..steps * 9).map(value).collect();
    Demo::new(&layout, states, actions.clone(), actions).expect("lengths match")
}

/// One update of Algorithm 1 on four demos that depend on `i`.
fn update(hil: &mut Hil, i: usize) {
    let demos: [usize; BATCH] = std::array::from_fn(|k| (5 * i + 3 * k) % DEMOS);
    hil.update(&demos, 1e-5, None).expect("finite");
}

#[test]
fn updates_allocate_nothing() {
    let demos: Vec<Demo> = (0..DEMOS).map(demo).collect();
    let go = Interrupt::default();
    let pretrain = PretrainSettings { epochs: 1, ..Default::default() };
    let (dynamics, _) = pretrain_dynamics(&demos, &demos[..1], &pretrain, 0, &mut |_, _| {}, &go).expect("the demos are sound");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread starts");
    for action in [ActionChoice::Mean, ActionChoice::Sample] {
        let settings = TrainSettings { batch: BATCH, bc_batch: 128, rho: 0.3, action, ..Default::default() };
        let inputs = Inputs::new(&demos, &demos[..1]).expect("the demos are sound");
        let mut hil = Hil::new(inputs, Some(dynamics.clone()), Alpha::Fixed(0.5), &settings, 0).expect("the settings are sound");
        pool.install(|| {
            // the test can fail: the first updates make room
            assert!(allocations(|| (0..2).for_each(|i| update(&mut hil, i))) > 0);
            assert_eq!(allocations(|| (2..22).for_each(|i| update(&mut hil, i))), 0, "{action:?}");
        });
    }
}
