//! A robot that speaks JSON: rates, velocities, limits, and what happens when it falls silent.

use crate::servers::{HILT, Served, host, policy, policy_file, row};
use hilt::data::weights;
use hilt::interrupt::Interrupt;
use hilt::learn::Policy;
use hilt::robot::file::built_in::paper_robot;
use hilt::serve::{Host, LineLink, PolicyHost, PolicyOptions};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Cursor, Write};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The answers of a policy to these lines, behind its metadata.
fn talk(options: PolicyOptions, lines: &[Value]) -> Vec<Value> {
    talk_to(&host(options), lines)
}

fn talk_to(host: &PolicyHost, lines: &[Value]) -> Vec<Value> {
    let mut out = Vec::new();
    let input: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let mut link = LineLink::new(Cursor::new(input), &mut out, &Interrupt::default()).expect("a thread");
    host.converse(&mut link, 0).expect("no interrupt");
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
    let answers = talk(PolicyOptions { estimate_dq: true, ..Default::default() }, std::slice::from_ref(&bare));
    assert_eq!(actions(&answers[0]), policy().act(&row()));
    assert!(talk(PolicyOptions::default(), &[bare])[0]["error"].is_string());
}

#[test]
fn commands_stay_within_the_robots_limits_and_say_so() {
    let robot = paper_robot();
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
fn an_action_that_is_no_number_becomes_a_stop() {
    let (mut tensors, meta, _) = weights::read(&policy_file(), "policy").expect("weights");
    for tensor in tensors.iter_mut().filter(|t| ["policy.action.std", "policy.layer_4.bias"].contains(&t.name.as_str())) {
        tensor.data.fill(1e38);
    }
    let policy = Policy::from_tensors(&tensors, &meta).expect("a policy");
    assert!(policy.act(&row()).iter().any(|v| !v.is_finite()));
    let host = PolicyHost::new(policy, Some(&paper_robot()), PolicyOptions::default(), Default::default()).expect("the robot's");
    let answers = talk_to(&host, &[whole(&row())]);
    assert_eq!((actions(&answers[0]), &answers[0]["command_not_finite"]), (vec![0.0; 9], &json!(true)));
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
fn the_command_in_the_documentation_is_answered() {
    let docs = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/serve.md")).expect("readable");
    let command =
        docs.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).find(|block| block.contains("--stdio"));
    let command = command.expect("a command").replace("policy.safetensors", policy_file().to_str().expect("UTF-8 path"));
    let output =
        Command::new("bash").args(["-c", &command.replace("hilt serve", &format!("{HILT} serve"))]).output().expect("bash");
    let lines: Vec<Value> = output.stdout.split(|b| *b == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect();
    assert_eq!((lines.len(), lines[0]["kind"].as_str()), (2, Some("policy")), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(actions(&lines[1]).len(), 9);
    // Every key that is sent has its words there.
    for key in lines[1].as_object().expect("an answer").keys().chain(["limited", "held", "watchdog"].map(String::from).iter()) {
        assert!(docs.contains(&format!("`{key}`")), "docs/serve.md does not say what {key} is");
    }
}

/// Regression: the end of a silence began another episode than that which the robot had named, and its first action was to stand still.
#[test]
fn over_a_websocket_the_next_answer_after_a_silence_is_to_stand_still_unless_it_begins_an_episode() {
    // Longer than a busy machine takes for an answer.
    let silence = Duration::from_millis(600);
    let server = Served::with(PolicyOptions { watchdog: Some(silence), sampling: Some(7), ..Default::default() });
    let mut talk = server.talk();
    let first = talk.ask_at(Some(5));
    assert_ne!(first, talk.ask_at(Some(6)), "episodes have random numbers of their own");
    assert_eq!(talk.ask_at(Some(5)), first);
    std::thread::sleep(2 * silence);
    assert_eq!(talk.ask(), [0.0; 9]);
    assert_eq!(talk.ask(), first, "what comes next begins the episode anew");
    std::thread::sleep(2 * silence);
    assert_eq!(talk.ask_at(Some(5)), first);
    server.end();
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
