//! `hilt view`, `hilt render --html`, `hilt evaluate --render` and `hilt replay` as processes: what the page holds, replays that come again, bad input.

use assert_cmd::Command;
use base64::Engine as _;
use hilt::data::recording;
use hilt::demo::{Phase, Step};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Recordings that the tests share, made once: the demonstrator in two tasks, of two robots.
struct Made(TempDir);

impl Made {
    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

fn made() -> &'static Made {
    static MADE: OnceLock<Made> = OnceLock::new();
    MADE.get_or_init(|| {
        let made = Made(tempfile::tempdir().expect("temporary directory"));
        let record = |task: &str, robot: &str, dir: &str, more: &[&str]| {
            let words = ["evaluate", "--task", task, "--robot", robot, "--policy", "planner", "--record", dir];
            done(made.0.path(), &[&words[..], more].concat());
        };
        record("stack", "jaco", "stack", &["--episodes", "4"]);
        record("bin", "panda", "bin", &["--episodes", "1"]);
        // Without friction nothing can be held: all fail.
        record(
            "pick-up",
            "jaco",
            "slippery",
            &["--episodes", "3", "--render", "2", "--set", "scene.friction=0.0", "--set", "evaluate.horizon_steps=120"],
        );
        made
    })
}

fn hilt(dir: &Path, words: &[&str]) -> Output {
    let mut command = Command::cargo_bin("hilt").expect("the binary is built with the tests");
    // No desktop: nothing is opened.
    command.args(words).current_dir(dir).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.output().expect("the binary runs")
}

fn done(dir: &Path, words: &[&str]) -> String {
    let output = hilt(dir, words);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words:?}: {stderr}");
    String::from_utf8(output.stdout).expect("words are UTF-8")
}

fn path(path: &Path) -> &str {
    path.to_str().expect("UTF-8 path")
}

/// What a page shows, after a look at the page itself.
fn shown(page: &Path) -> Value {
    // A namespace is a name, nothing is asked there.
    let html = fs::read_to_string(page).expect("a page").replace("http://www.w3.org/2000/svg", "svg");
    for foreign in [
        "http:",
        "https:",
        "//cdn",
        "src=\"",
        "@import",
        "url(",
        "<iframe",
        "<link rel=\"stylesheet",
        "fetch(",
        "XMLHttpRequest",
        "WebSocket",
    ] {
        assert!(!html.contains(foreign), "{foreign} in the page");
    }
    assert!(!html.contains("{{"), "a place is left");
    let (_, rest) = html.split_once("<script type=\"application/json\" id=\"data\">").expect("data");
    let (data, _) = rest.split_once("</script>").expect("the end of the data");
    serde_json::from_str(data).expect("JSON")
}

fn f32s(packed: &Value) -> Vec<f32> {
    let bytes = base64::engine::general_purpose::STANDARD.decode(packed.as_str().expect("text")).expect("base64");
    bytes.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect()
}

/// Joint positions and poses of objects, as the page has them.
fn row(step: &Step) -> Vec<f32> {
    let poses = step.objects.iter().flat_map(|object| object.pose.to_array());
    step.state.q.iter().copied().chain(poses).map(|v| v as f32).collect()
}

#[test]
fn a_page_of_four_episodes_is_small_and_holds_the_recordings_numbers() {
    let (made, out) = (made(), tempfile::tempdir().expect("temporary directory"));
    let page = out.path().join("four.html");
    let said = done(out.path(), &["view", path(&made.at("stack")), "--out", "four.html"]);
    assert_eq!(said.trim(), "four.html");
    let size = fs::metadata(&page).expect("a page").len();
    assert!(size < 1_500_000, "{size} bytes");
    let data = shown(&page);
    assert_eq!(data["robots"].as_array().map(Vec::len), Some(1), "a robot is there once");
    let files = recording::files(&made.at("stack")).expect("recordings");
    assert_eq!(data["episodes"].as_array().map(Vec::len), Some(files.len()));
    for (file, told) in files.iter().zip(data["episodes"].as_array().expect("a list")) {
        let (episode, _) = recording::read(file).expect("a recording");
        let rows: Vec<f32> = episode.steps.iter().chain([&episode.last]).flat_map(row).collect();
        assert_eq!(f32s(&told["rows"]), rows);
        assert_eq!(
            (told["steps"].as_u64(), told["success"].as_bool()),
            (Some(episode.steps.len() as u64), Some(episode.success))
        );
        let phases: Vec<&str> = told["phases"].as_array().expect("phases").iter().filter_map(|span| span[2].as_str()).collect();
        let mut walked: Vec<&str> = episode.steps.iter().filter_map(|step| step.phase).map(Phase::name).collect();
        walked.dedup();
        assert_eq!(phases, walked);
        let marks: Vec<&str> = told["milestones"].as_array().expect("marks").iter().filter_map(|mark| mark[1].as_str()).collect();
        assert_eq!(marks, ["reached", "grasped", "lifted", "on base"]);
        assert!(
            told["touches"].as_array().expect("touches").iter().any(|touch| touch["name"] == "block on base"),
            "{}",
            told["touches"]
        );
    }
    // The same bytes again, by the other command.
    done(out.path(), &["render", path(&made.at("stack")), "--html", "--out", "again.html", "--threads", "1"]);
    assert!(fs::read(&page).expect("a page") == fs::read(out.path().join("again.html")).expect("a page"), "other bytes");
}

#[test]
fn robots_and_tasks_may_be_mixed_and_episodes_chosen() {
    let (made, out) = (made(), tempfile::tempdir().expect("temporary directory"));
    let [stack, bin] = ["stack", "bin"].map(|name| made.at(name));
    done(out.path(), &["view", path(&stack), path(&bin), "--episodes", "0", "--no-open"]);
    let data = shown(&out.path().join("stack.html"));
    let names: Vec<&str> = data["episodes"].as_array().expect("a list").iter().filter_map(|e| e["name"].as_str()).collect();
    assert_eq!(names, ["stack episode 0", "bin episode 0"]);
    assert_eq!(data["robots"].as_array().map(Vec::len), Some(2));
    assert_eq!(data["title"], "stack, bin");
}

#[test]
fn an_evaluation_that_fails_gets_an_atlas() {
    let made = made();
    let data = shown(&made.at("slippery.html"));
    let atlas = &data["atlas"];
    assert_eq!(atlas["outcomes"].as_array().map(Vec::len), Some(3), "every episode is on the map");
    let classes: Vec<u64> =
        atlas["classes"].as_array().expect("classes").iter().filter_map(|class| class["count"].as_u64()).collect();
    assert_eq!((classes[0], classes.iter().sum::<u64>()), (0, 3), "all fail: {atlas}");
    let (episode, _) = recording::read(&made.at("slippery/episode-00001.mcap")).expect("a recording");
    let [x, y, _] = episode.scene.objects[0].pose.position_m;
    let at: Vec<f64> = atlas["maps"][0]["at"][1].as_array().expect("x and y").iter().filter_map(Value::as_f64).collect();
    assert!((at[0] - x).abs() < 1e-4 && (at[1] - y).abs() < 1e-4, "{at:?}");
    for told in data["episodes"].as_array().expect("a list") {
        let picture = told["picture"].as_str().expect("a picture").strip_prefix("data:image/png;base64,").expect("PNG");
        let png = base64::engine::general_purpose::STANDARD.decode(picture).expect("base64");
        assert!(png.starts_with(b"\x89PNG"));
    }
}

#[test]
fn a_replay_by_the_same_controller_and_seed_is_the_recording() {
    let (made, out) = (made(), tempfile::tempdir().expect("temporary directory"));
    let file = made.at("stack/episode-00001.mcap");
    let replay = |words: &[&str]| -> Value {
        let said = done(out.path(), &[&["replay", "--from", path(&file), "--policy", "planner", "--json"], words].concat());
        serde_json::from_str(&said).expect("JSON")
    };
    let same = replay(&[]);
    assert_eq!((&same["same"], &same["restored_apart"], &same["step"]), (&true.into(), &0.0.into(), &0.into()));
    let (original, _) = recording::read(&file).expect("a recording");
    let (again, made_by) = recording::read(&out.path().join("episode-00001-replay.mcap")).expect("a recording");
    assert!(again == original, "another episode");
    assert_eq!(made_by.stage, "replay");
    // From a later moment: the same until then, to the bit; then the planner plans anew.
    let later = replay(&["--at", "1.0", "--out", "later.mcap"]);
    assert_eq!((&later["step"], &later["restored_apart"]), (&20.into(), &0.0.into()));
    let (later, _) = recording::read(&out.path().join("later.mcap")).expect("a recording");
    assert!(later.steps[..20] == original.steps[..20] && later.steps[20].state == original.steps[20].state);
    assert!(later.success, "{:?}", later.failure);
    // With other noise the moment is the same, what follows is not.
    let noisy = replay(&["--at", "0.5", "--seed", "9", "--out", "noisy.mcap"]);
    assert_eq!(noisy["same"], false);
    let (noisy, _) = recording::read(&out.path().join("noisy.mcap")).expect("a recording");
    assert!(noisy.steps[..10] == original.steps[..10]);
    assert_ne!(noisy.steps[10].executed, original.steps[10].executed);
    // A replay can be replayed, and looked at.
    let again =
        done(out.path(), &["replay", "--from", "noisy.mcap", "--at", "0.7", "--policy", "planner", "--out", "again.mcap"]);
    assert!(again.contains("restored exactly"), "{again}");
    done(out.path(), &["view", path(&file), "noisy.mcap", "again.mcap", "--no-open"]);
}

/// A refusal says what is wrong and leaves everything as it was.
fn refused(dir: &Path, words: &[&str], code: i32, says: &str) {
    let list = || {
        let mut all: Vec<_> = fs::read_dir(dir).expect("readable").map(|entry| entry.expect("an entry").path()).collect();
        all.sort();
        all.into_iter().map(|path| (fs::read(&path).ok(), path)).collect::<Vec<_>>()
    };
    let before = list();
    let output = hilt(dir, words);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{words:?}: {stderr}");
    assert!(stderr.contains(says) && stderr.matches("error: ").count() == 1, "{words:?} should say {says}: {stderr}");
    assert!(output.stdout.is_empty() && list() == before, "{words:?} changed something");
}

#[test]
fn bad_input_is_refused_and_nothing_is_lost() {
    let (made, out) = (made(), tempfile::tempdir().expect("temporary directory"));
    let at = |name: &str| out.path().join(name);
    let (stack, good) = (made.at("stack"), made.at("stack/episode-00000.mcap"));
    fs::create_dir(at("empty")).expect("created");
    fs::write(at("noise.mcap"), b"no recording").expect("written");
    let bytes = fs::read(&good).expect("a recording");
    fs::write(at("short.mcap"), &bytes[..bytes.len() / 2]).expect("written");
    fs::write(at("thesis.html"), "<!DOCTYPE html>\n<p>years of work").expect("written");
    fs::write(at("notes.html"), "years of work").expect("written");
    let mixed = at("mixed");
    fs::create_dir(&mixed).expect("created");
    fs::copy(&good, mixed.join("episode-00000.mcap")).expect("copied");
    fs::copy(made.at("bin/episode-00000.mcap"), mixed.join("episode-00001.mcap")).expect("copied");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let policy = fixtures.join("pick-up/policy.safetensors");
    let good = path(&good);

    let view = |words: &[&str], code: i32, says: &str| refused(out.path(), &[&["view"], words].concat(), code, says);
    view(&[], 2, "<FILE.mcap|DIR|RUN>");
    view(&["missing.mcap"], 1, "missing.mcap: cannot read");
    view(&["noise.mcap"], 1, "is not an MCAP file");
    view(&["short.mcap"], 1, "cut short");
    view(&["empty"], 1, "holds no recordings");
    view(&[good, "--out", "page.txt"], 2, "its name must end in .html");
    view(&[good, "--out", "thesis.html"], 2, "would be lost");
    view(&[good, "--out", "notes.html"], 2, "would be lost");
    view(&[path(&stack), "--out", path(&stack.join("page.html"))], 2, "lies in");
    view(&[path(&stack), "--episodes", "0,77"], 1, "has no episode-00077.mcap");
    view(&[path(&stack), "--episodes", "9-3"], 2, "--episodes");
    view(&[path(&stack), "--atlas", "0"], 2, "--atlas");
    view(&[path(&stack), good, "--atlas", "2"], 2, "one directory of recordings");
    view(&["mixed", "--atlas", "2"], 1, "is of task bin, those before are of stack");
    view(&[good, "--dynamics", path(&policy)], 1, "policy.safetensors");
    refused(out.path(), &["render", good, good, "--gif"], 2, "a picture shows one");
    refused(out.path(), &["render", good, "--gif", "--episodes", "3"], 2, "give --html");

    let replay =
        |words: &[&str], code: i32, says: &str| refused(out.path(), &[&["replay", "--from"], words].concat(), code, says);
    replay(&["noise.mcap", "--policy", "planner"], 1, "is not an MCAP file");
    replay(&["short.mcap", "--policy", "planner"], 1, "cut short");
    replay(&[good, "--policy", "planner", "--at", "99"], 2, "allowed: 0 to");
    replay(&[good, "--policy", "planner", "--at", "-1"], 2, "allowed: 0 to");
    replay(&[good, "--policy", "planner", "--at", "nan"], 2, "allowed: 0 to");
    replay(&[good, "--policy", "planner", "--noise", "-1"], 2, "a variance must be 0 to 1");
    replay(&[good, "--policy", "planner", "--at", "1", "--horizon", "5"], 2, "--horizon 5");
    replay(&[good, "--policy", "planner", "--at", "5"], 2, "the fingers are on block");
    replay(&[good, "--policy", path(&policy)], 1, "was made for task pick-up, but the recording is of task stack\n");
    replay(&[good, "--policy", "missing.safetensors"], 1, "missing.safetensors");
    replay(&[good, "--policy", "planner", "--out", good], 2, "which this command reads");
    replay(&[good, "--policy", "planner", "--out", "noise.mcap"], 2, "noise.mcap");
    let words = ["evaluate", "--task", "stack", "--policy", "planner", "--episodes", "1", "--render", "2"];
    refused(out.path(), &words, 2, "--record");
}
