//! How what listens, and what talks to it, ends.

use crate::servers::{HILT, PATIENCE, Process, Talk, policy_file};
use rustix::process::{Pid, Signal, kill_process};
use std::net::{SocketAddr, TcpListener};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

fn signal(child: &Child, signal: Signal) {
    let id = Pid::from_raw(i32::try_from(child.id()).expect("a process id")).expect("not 0");
    kill_process(id, signal).expect("it runs");
}

/// The exit status, which must be there soon.
fn ended(child: &mut Child) -> ExitStatus {
    let began = Instant::now();
    loop {
        match child.try_wait().expect("a child") {
            Some(status) => return status,
            None if began.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(10)),
            None => panic!("it does not end"),
        }
    }
}

#[test]
fn a_signal_ends_a_server_with_its_code_and_frees_the_port() {
    let policy = policy_file();
    let policy = ["serve", policy.to_str().expect("UTF-8 path")];
    for (arguments, number, code) in [(&policy[..], Signal::INT, 130), (&["serve-env", "--task", "pick-up"], Signal::TERM, 143)] {
        let mut server = Process::new(arguments);
        let address: SocketAddr = server.address.trim_start_matches("ws://").parse().expect("an address");
        let mut open = Talk::with(address, None).expect("a conversation");
        signal(&server.child, number);
        assert_eq!(ended(&mut server.child).code(), Some(code), "{arguments:?}");
        assert!(open.hear().is_none());
        TcpListener::bind(address).expect("the port is free");
    }
}

#[test]
fn a_server_ends_with_the_program_that_started_it() {
    let mut child = Command::new(HILT)
        .args(["serve-env", "--task", "pick-up", "--port", "0", "--end-with-stdin"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("the binary runs");
    thread::sleep(Duration::from_millis(300));
    assert!(child.try_wait().expect("a child").is_none(), "it has ended at once");
    drop(child.stdin.take());
    assert!(ended(&mut child).success());
}

/// It accepts, and says nothing.
#[test]
fn an_evaluation_that_waits_for_a_silent_server_can_be_interrupted() {
    let silent = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", silent.local_addr().expect("known"));
    let dir = tempfile::tempdir().expect("a directory");
    let mut child = Command::new(HILT)
        .args(["evaluate", "--task", "pick-up", "--policy", &address, "--out"])
        .arg(dir.path().join("evaluation.json"))
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary runs");
    let (_open, _) = silent.accept().expect("it calls");
    let began = Instant::now();
    signal(&child, Signal::INT);
    assert_eq!(ended(&mut child).code(), Some(130));
    assert!(began.elapsed() < Duration::from_secs(5));
    assert_eq!(std::fs::read_dir(dir.path()).expect("readable").count(), 0);
}
