//! A robot that speaks JSON: rates, velocities, limits, and what happens when it falls silent.

use crate::servers::{HILT, host, policy, policy_file, row};
use hilt::interrupt::Interrupt;
use hilt::serve::{Host, LineLink, PolicyOptions};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Cursor, Write};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The answers of a policy to these lines, behind its metadata.
fn talk(options: PolicyOptions, lines: &[Value]) -> Vec<Value> {
    let mut out = Vec::new();
    let input: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let mut link = LineLink::new(Cursor::new(input), &mut out, &Interrupt::default()).expect("a thread");
    host(options).converse(&mut link, 0).expect("no interrupt");
    let text = String::from_utf8(out).expect("text");
    text.lines().skip(1).map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

fn whole(row: &[f32]) -> Value {
    json!({ "state": row })
}

fn actions(answer: &Value) -> Vec<f32> {
    let row = answer["actions"][0].as_array().unwrap_or_else(|| panic!("{answer}"));
    row.iter().map(|v| v.as_f64().expect("a number") as f32).collect()
}

/// Rows along which joint 0 turns by 0.01 rad a row.
fn turning(count: usize) -> Vec<Vec<f32>> {
    let turned = |i: usize| {
        let mut row = row();
        row[0] += 0.01 * i as f32;
        row
    };
    (0..count).map(turned).collect()
}

#[test]
fn an_answer_is_the_policys_action_to_the_last_bit() {
    let answers = talk(PolicyOptions::default(), &[whole(&row()), json!({ "state": [1] }), whole(&row())]);
    assert_eq!(actions(&answers[0]), policy().act(&row()));
    assert!(answers[1]["error"].as_str().is_some_and(|why| why.contains("one row of 25 numbers")), "{}", answers[1]);
    assert_eq!(actions(&answers[2]), actions(&answers[0]));
    assert!(answers[2]["server_timing"]["prev_total_ms"].as_f64().is_some_and(|ms| ms >= 0.0));
}

#[test]
fn a_robot_that_asks_faster_gets_the_action_of_its_period() {
    let rows = turning(11);
    // 50 Hz on 20 Hz: periods begin with observations 0, 3, 5, 8, 10.
    let options = PolicyOptions { robot_rate_hz: Some(50.0), ..Default::default() };
    let answers = talk(options, &rows.iter().map(|row| whole(row)).collect::<Vec<_>>());
    let fresh: Vec<usize> = (0..11).filter(|i| answers[*i].get("held").is_none()).collect();
    assert_eq!(fresh, [0, 3, 5, 8, 10]);
    for (i, answer) in answers.iter().enumerate() {
        let computed = fresh.iter().rfind(|at| **at <= i).expect("the first is computed");
        assert_eq!(actions(answer), policy().act(&rows[*computed]), "answer {i}");
    }
    let slower = PolicyOptions { robot_rate_hz: Some(7.0), ..Default::default() };
    let answers = talk(slower, &rows.iter().map(|row| whole(row)).collect::<Vec<_>>());
    assert!(answers.iter().zip(&rows).all(|(answer, row)| actions(answer) == policy().act(row)));
}

#[test]
fn velocities_are_made_of_positions_where_the_robots_own_are_not_believed() {
    let mut rows = turning(4);
    // Read as an angle within one turn: no jump.
    rows[3][0] -= std::f32::consts::TAU;
    rows.iter_mut().for_each(|row| row[9..18].fill(7.0));
    let options = PolicyOptions { estimate_dq: true, ..Default::default() };
    let answers = talk(options, &rows.iter().map(|row| whole(row)).collect::<Vec<_>>());
    for (i, (answer, row)) in answers.iter().zip(&rows).enumerate() {
        let mut believed = row.clone();
        believed[9..18].fill(0.0);
        believed[9] = if i == 0 { 0.0 } else { 0.2 };
        let (got, expected) = (actions(answer), policy().act(&believed));
        assert!(got.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-3), "answer {i}: {got:?} {expected:?}");
    }
    // Then none need be sent.
    let bare = json!({ "observation.state": row()[..9], "observation.environment_state": row()[18..] });
    let answers = talk(PolicyOptions { estimate_dq: true, ..Default::default() }, &[bare.clone()]);
    assert_eq!(actions(&answers[0]), policy().act(&row()));
    assert!(talk(PolicyOptions::default(), &[bare])[0]["error"].is_string());
}

#[test]
fn commands_stay_within_the_robots_limits_and_say_so() {
    let robot = hilt::robot::file::built_in::paper_robot();
    let limited = (0..robot.joints.len()).find(|i| !robot.joints[*i].continuous).expect("a joint that something stops");
    let mut stuck = row();
    stuck[limited] = robot.joints[limited].limits[1] as f32 + 0.1;
    let mut other = stuck.clone();
    other[limited] = robot.joints[limited].limits[0] as f32 - 0.1;
    let answers = talk(PolicyOptions::default(), &[whole(&stuck), whole(&other)]);
    let asked = [policy().act(&stuck)[limited], policy().act(&other)[limited]];
    let given = [actions(&answers[0])[limited], actions(&answers[1])[limited]];
    assert_eq!(given, [asked[0].min(0.0), asked[1].max(0.0)]);
    let said: Vec<bool> = answers.iter().map(|answer| answer["limited"]["position"] == json!([limited])).collect();
    assert_eq!(said, [asked[0] > 0.0, asked[1] < 0.0]);
    assert!(said[0] || said[1], "the policy asks for neither: {asked:?}");
    for (answer, row) in answers.iter().zip([&stuck, &other]).filter(|(answer, _)| answer.get("limited").is_some()) {
        assert_eq!(answer["unlimited_actions"], json!([policy().act(row)]));
    }
}

#[test]
fn samples_depend_on_seed_and_episode_alone() {
    let ask = |seed, episode| {
        let first = json!({ "state": row(), "episode_index": episode, "frame_index": 0 });
        let options = PolicyOptions { sampling: Some(seed), ..Default::default() };
        talk(options, &[first, whole(&row())]).iter().map(actions).collect::<Vec<_>>()
    };
    assert_eq!(ask(1, 5), ask(1, 5));
    assert!(ask(1, 5) != ask(1, 6) && ask(1, 5) != ask(2, 5));
    assert_ne!(ask(1, 5)[0], ask(1, 5)[1]);
}

#[test]
fn a_robot_that_falls_silent_is_told_to_stand_still_once() {
    let mut child = Command::new(HILT)
        .arg("serve")
        .arg(policy_file())
        .args(["--stdio", "--watchdog", "300"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary runs");
    let mut stdin = child.stdin.take().expect("piped");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let mut hear = || -> Value { serde_json::from_str(&lines.next().expect("a line").expect("readable")).expect("JSON") };
    assert_eq!(hear()["watchdog_ms"], 300);
    // It watches from the first observation on.
    std::thread::sleep(Duration::from_millis(500));
    let began = Instant::now();
    writeln!(stdin, "{}", whole(&row())).expect("written");
    assert_eq!(actions(&hear()), policy().act(&row()));
    let stop = hear();
    assert!(stop["watchdog"] == true && began.elapsed() >= Duration::from_millis(300), "{stop}");
    assert_eq!(actions(&stop), [0.0; 9]);
    std::thread::sleep(Duration::from_millis(500));
    writeln!(stdin, "{}", whole(&row())).expect("written");
    assert_eq!(actions(&hear()), policy().act(&row()));
    drop(stdin);
    assert!(child.wait().expect("ended").success());
}
