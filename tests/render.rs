//! Pictures of a hand-made episode.

use hilt::demo::{Body, Contacts, Episode, Phase, Step};
use hilt::interrupt::Interrupt;
use hilt::joints::Joints;
use hilt::report::render::{GifOptions, RgbImage, frame, write_gif, write_png_sheet};
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::{Obstacle, Placed, Scene};
use hilt::state::{Pose, State};
use hilt::task::built_in::{of_the_paper, pick_and_place, pick_up, stack};
use hilt::tasks::Task;
use std::sync::Arc;

const SIZE: (u32, u32) = (480, 360);

/// Tool path from the ready pose down to the block and up again, found by steps along the Jacobian.
fn reach(mut q: Joints, target: [f64; 3]) -> Joints {
    let arm = paper_robot();
    for _ in 0..200 {
        let (tool, jacobian) = arm.tool_jacobian(&q);
        let turn = -tool.rotation.scaled_axis();
        let gap = nalgebra::Vector3::from(target) - tool.translation.vector;
        let wanted = nalgebra::Vector6::new(gap.x, gap.y, gap.z, turn.x, turn.y, turn.z);
        let damped: nalgebra::Matrix6<f64> = &jacobian * jacobian.transpose() + nalgebra::Matrix6::identity() * 1e-4;
        let dq = jacobian.transpose() * damped.try_inverse().unwrap() * wanted;
        (0..6).for_each(|i| q[i] += 0.5 * dq[i]);
    }
    q
}

fn episode(task: &Arc<Task>, steps: usize) -> Episode {
    let block = Pose::from_yaw([0.50, -0.06, 0.025], 0.3);
    let placed = |pose| Placed { pose, friction: 1.0, mass_kg: 0.1 };
    let mut scene = Scene {
        robot: paper_robot(),
        task: Arc::clone(task),
        objects: vec![placed(block)],
        goals: Vec::new(),
        obstacles: Vec::new(),
        finger_friction: 1.0,
    };
    if *task == pick_and_place() {
        scene.goals = vec![[0.40, 0.12, 0.025]];
        scene.obstacles = vec![Obstacle { center_m: [0.62, 0.22, 0.06], size_m: [0.06, 0.10, 0.12] }];
    }
    if *task == stack() {
        scene.objects.push(placed(Pose::from_yaw([0.45, 0.27, 0.025], 0.0)));
    }
    let above = reach(paper_robot().ready, [0.50, -0.06, 0.03]);
    let target = scene.target_m(0);
    let end = reach(above, target);
    let mix = |a: Joints, b: Joints, s: f64| Joints::from_fn(9, |i| a[i] + (b[i] - a[i]) * s);
    let step = |t: usize| {
        let share = 2.0 * t as f64 / steps as f64;
        let (mut q, block) = if share < 1.0 {
            (mix(paper_robot().ready, above, share), block)
        } else {
            let q = mix(above, end, share - 1.0);
            (q, Pose::from_isometry(&paper_robot().tool_pose(&q)))
        };
        q[6..].fill(0.4 + 0.5 * share.min(1.0));
        let mut state = State { q, ..scene.start() };
        state.objects[0] = block;
        Step {
            objects: state.objects.iter().map(|pose| Body { pose: *pose, speed_m_s: 0.0 }).collect(),
            state,
            commanded: Joints::zeros(9),
            executed: Joints::zeros(9),
            contacts: Contacts::none(3, scene.objects.len()),
            reward: 0.0,
            conditions: Vec::new(),
            phase: Some(if share < 1.0 { Phase::Approach } else { Phase::Carry }),
        }
    };
    let (moments, last) = ((0..steps).map(step).collect(), step(steps));
    Episode { index: 0, scene, steps: moments, last, success: true, failure: None }
}

fn pixel(image: &RgbImage, x: u32, y: u32) -> [u8; 3] {
    let at = ((y * image.width + x) * 3) as usize;
    image.data[at..at + 3].try_into().unwrap()
}

/// Middle of the pixels that look orange, and how many there are.
fn orange(image: &RgbImage) -> ([f64; 2], usize) {
    let is_orange = |[r, g, b]: [u8; 3]| r > 110 && f64::from(r) > 1.5 * f64::from(g) && g > b + 20;
    let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    let found: Vec<_> = all.filter(|(x, y)| is_orange(pixel(image, *x, *y))).collect();
    let mean = |pick: fn(&(u32, u32)) -> u32| found.iter().map(|p| f64::from(pick(p))).sum::<f64>() / found.len() as f64;
    ([mean(|p| p.0), mean(|p| p.1)], found.len())
}

#[test]
fn the_block_appears_where_it_stands_and_moves_with_it() {
    let mut at = episode(&pick_up(), 2);
    let mut seen = |y_m: f64| {
        at.steps[0].objects[0].pose = Pose::from_yaw([0.5, y_m, 0.025], 0.0);
        let (middle, count) = orange(&frame(&at, 0, SIZE));
        assert!(count > 150, "only {count} orange pixels with the block at y = {y_m} m");
        middle
    };
    let (right, left) = (seen(-0.15), seen(0.15));
    assert!(right[0] + 10.0 < left[0] || left[0] + 10.0 < right[0], "{right:?} {left:?}");
    at.steps[0].objects[0].pose = Pose::from_yaw([5.0, 50.0, -90.0], 0.0);
    assert_eq!(orange(&frame(&at, 0, SIZE)).1, 0, "no block, no orange");
}

#[test]
fn steps_beyond_the_end_show_the_last_state() {
    let e = episode(&stack(), 6);
    assert_eq!(frame(&e, 6, (64, 48)), frame(&e, 99, (64, 48)));
    assert_ne!(frame(&e, 5, (64, 48)), frame(&e, 6, (64, 48)));
}

#[test]
fn an_animation_decodes_back_to_its_pictures_and_is_deterministic() {
    let e = episode(&stack(), 12);
    let options = GifOptions { width: 160, height: 120, every_n_steps: 4, fps: 10 };
    let write = || {
        let mut bytes = Vec::new();
        write_gif(&e, &options, &Interrupt::default(), &mut bytes).unwrap();
        bytes
    };
    let bytes = write();
    assert_eq!(bytes, write());
    let mut decoder = gif::DecodeOptions::new().read_info(&bytes[..]).unwrap();
    let palette = decoder.global_palette().unwrap().to_vec();
    let mut canvas = vec![0_u8; 160 * 120];
    let mut delays = Vec::new();
    while let Some(f) = decoder.read_next_frame().unwrap() {
        delays.push(f.delay);
        for (i, index) in f.buffer.iter().enumerate().filter(|(_, index)| Some(**index) != f.transparent) {
            let (x, y) = (usize::from(f.left) + i % usize::from(f.width), usize::from(f.top) + i / usize::from(f.width));
            canvas[y * 160 + x] = *index;
        }
    }
    assert_eq!(delays, [10, 10, 10, 150], "steps 0, 4, 8 and the end");
    let last = frame(&e, 12, (160, 120));
    let error = |y: usize| -> u64 {
        let row = (0..160).flat_map(|x| (0..3).map(move |c| (y * 160 + x, c)));
        row.map(|(i, c)| u64::from(last.data[3 * i + c].abs_diff(palette[3 * usize::from(canvas[i]) + c]))).sum()
    };
    // The label covers the rows below.
    let mean = (0..100).map(error).sum::<u64>() as f64 / (100.0 * 160.0 * 3.0);
    assert!(mean < 2.5, "the decoded picture is {mean} grey levels off");
}

#[test]
fn a_sheet_decodes_back_and_is_deterministic() {
    let e = episode(&pick_and_place(), 12);
    let write = || {
        let mut bytes = Vec::new();
        write_png_sheet(&e, (3, 2), (160, 120), &Interrupt::default(), &mut bytes).unwrap();
        bytes
    };
    let bytes = write();
    assert_eq!(bytes, write());
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (3 * 160 + 2 * 4, 2 * 120 + 4));
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut data).unwrap();
    let first = frame(&e, 0, (160, 120));
    let (label, row) = (100, 160 * 3);
    for y in 0..label {
        assert_eq!(data[y * 488 * 3..][..row], first.data[y * row..][..row], "row {y}");
    }
}

#[test]
fn impossible_sizes_are_refused() {
    let e = episode(&pick_up(), 2);
    let bad = GifOptions { width: 0, ..GifOptions::default() };
    assert!(write_gif(&e, &bad, &Interrupt::default(), Vec::new()).unwrap_err().to_string().contains("0 x 360"));
    let bad = GifOptions { every_n_steps: 0, ..GifOptions::default() };
    assert!(write_gif(&e, &bad, &Interrupt::default(), Vec::new()).is_err());
    assert!(write_png_sheet(&e, (0, 2), (160, 120), &Interrupt::default(), Vec::new()).is_err());
    let huge = write_png_sheet(&e, (32, 32), (4096, 4096), &Interrupt::default(), Vec::new()).unwrap_err().to_string();
    assert!(huge.contains("at most 100000000"), "{huge}");
}

/// For looking at: `HILT_PICTURES=directory cargo test --release --test render -- --ignored`.
#[test]
#[ignore = "writes pictures into the directory named by HILT_PICTURES"]
fn pictures_to_look_at() {
    let directory = std::path::PathBuf::from(std::env::var("HILT_PICTURES").expect("HILT_PICTURES names a directory"));
    for task in of_the_paper() {
        let e = episode(&task, 80);
        let file = |ending: &str| std::fs::File::create(directory.join(format!("{task}.{ending}"))).unwrap();
        write_png_sheet(&e, (2, 2), SIZE, &Interrupt::default(), file("png")).unwrap();
        let start = std::time::Instant::now();
        write_gif(&e, &GifOptions::default(), &Interrupt::default(), file("gif")).unwrap();
        let whole = start.elapsed();
        let start = std::time::Instant::now();
        (0..20).for_each(|i| drop(frame(&e, 4 * i, SIZE)));
        println!("{task}: gif of 41 pictures {whole:?}, one picture {:?}", start.elapsed() / 20);
    }
}
