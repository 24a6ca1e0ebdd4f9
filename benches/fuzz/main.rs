//! Mutated inputs for every reader of files, with seals and checksums made anew, so that what lies behind them is reached:
//! `cargo bench --bench fuzz -- --inputs 200000`. Each batch is a process of its own under a limit of memory; a panic, an abort and a hang
//! are counted, not fatal. `--reader plans --one 1234 --keep file` makes one input again.

mod mutate;
mod readers;
mod recordings;
mod sources;
mod structure;

use readers::{NAMES, Reader, Verdict};
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Address space of a batch \[kB\]: 1 GiB.
const LIMIT_KB: u64 = 1 << 20;
/// An input that takes longer counts as a hang.
const HANG: Duration = Duration::from_secs(20);
/// Inputs of a process.
const BATCH: u64 = 2000;
/// How often a batch is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// What a batch keeps in its file, 64-bit numbers one after another.
#[derive(Clone, Copy, Default)]
struct Tally {
    /// The input at work.
    at: u64,
    accepted: u64,
    refused: u64,
    panics: u64,
    slowest_us: u64,
    slowest_at: u64,
    aborts: u64,
    hangs: u64,
}

impl Tally {
    fn bytes(self) -> Vec<u8> {
        let Tally { at, accepted, refused, panics, slowest_us, slowest_at, .. } = self;
        [at, accepted, refused, panics, slowest_us, slowest_at].iter().flat_map(|n| n.to_le_bytes()).collect()
    }

    fn read(path: &Path) -> Tally {
        let bytes = fs::read(path).unwrap_or_default();
        let number = |i: usize| bytes.get(8 * i..8 * i + 8).map_or(0, |b| u64::from_le_bytes(b.try_into().expect("eight bytes")));
        let [at, accepted, refused, panics, slowest_us, slowest_at] = std::array::from_fn(number);
        Tally { at, accepted, refused, panics, slowest_us, slowest_at, ..Tally::default() }
    }

    fn add(&mut self, other: Tally) {
        self.accepted += other.accepted;
        self.refused += other.refused;
        self.panics += other.panics;
        if other.slowest_us > self.slowest_us {
            (self.slowest_us, self.slowest_at) = (other.slowest_us, other.slowest_at);
        }
        self.aborts += other.aborts;
        self.hangs += other.hangs;
    }
}

/// The words behind `--name`.
fn option(name: &str) -> Option<String> {
    let words: Vec<String> = std::env::args().collect();
    words.iter().position(|word| word == name).and_then(|at| words.get(at + 1).cloned())
}

fn count(name: &str, default: u64) -> u64 {
    option(name).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} {text} is no number")))
}

fn main() -> ExitCode {
    let seed = count("--seed", 0);
    let dir = option("--dir").map_or_else(place, PathBuf::from);
    if let (Some(name), Some(_)) = (option("--reader"), option("--one")) {
        one(&dir, &name, seed, count("--one", 0));
        return ExitCode::SUCCESS;
    }
    if let Some(name) = option("--batch") {
        batch(&dir, &name, seed, count("--from", 0), count("--until", 0));
        return ExitCode::SUCCESS;
    }
    // Among the measurements of speed it has nothing to say.
    if option("--inputs").is_none() {
        println!("fuzz: give a number of --inputs, or run make fuzz");
        return ExitCode::SUCCESS;
    }
    let found = all(&dir, seed, count("--inputs", 0));
    fs::remove_dir_all(&dir).unwrap_or_else(|why| eprintln!("{}: {why}", dir.display()));
    if found { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// A directory of this process in memory, where there is one.
fn place() -> PathBuf {
    let shared = Path::new("/dev/shm");
    let parent = if shared.is_dir() { shared.to_path_buf() } else { std::env::temp_dir() };
    parent.join(format!("hilt-fuzz-{}", std::process::id()))
}

/// Makes one input again, says what its reader says, and keeps it.
fn one(dir: &Path, name: &str, seed: u64, number: u64) {
    let mut reader = Reader::new(name, dir, seed);
    let input = reader.input(number);
    if let Some(keep) = option("--keep") {
        fs::write(&keep, &input).unwrap_or_else(|why| panic!("{keep}: {why}"));
    }
    println!("{}: {:?}", reader.path(number).display(), reader.read(&input, number));
}

/// The inputs from `from` to before `until`, in this process.
fn batch(dir: &Path, name: &str, seed: u64, from: u64, until: u64) {
    let path = tally_path(dir, name, from);
    let file = File::create(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
    let keep = |tally: Tally| file.write_all_at(&tally.bytes(), 0).expect("the tally of a batch can be written");
    let mut tally = Tally { at: from, ..Tally::default() };
    keep(tally);
    let mut reader = Reader::new(name, &dir.join(format!("{name}-{from}")), seed);
    for number in from..until {
        tally.at = number;
        keep(tally);
        let input = reader.input(number);
        let begun = Instant::now();
        let verdict = reader.read(&input, number);
        let took = begun.elapsed().as_micros() as u64;
        match verdict {
            Verdict::Accepted => tally.accepted += 1,
            Verdict::Refused(_) => tally.refused += 1,
            Verdict::Panicked => {
                eprintln!("panic: --reader {name} --one {number} --seed {seed}");
                tally.panics += 1;
            }
        }
        if took > tally.slowest_us {
            (tally.slowest_us, tally.slowest_at) = (took, number);
        }
    }
    keep(tally);
}

fn tally_path(dir: &Path, name: &str, from: u64) -> PathBuf {
    dir.join(format!("{name}-{from}.tally"))
}

/// All readers, as many batches at a time as there are processors; whether anything was found.
fn all(dir: &Path, seed: u64, inputs: u64) -> bool {
    fs::create_dir_all(dir).unwrap_or_else(|why| panic!("{}: {why}", dir.display()));
    let each = inputs.div_ceil(NAMES.len() as u64);
    let batches = |name: &'static str| (0..each).step_by(BATCH as usize).map(move |from| (name, from, each.min(from + BATCH)));
    let waiting: Mutex<Vec<_>> = Mutex::new(NAMES.into_iter().flat_map(batches).collect());
    let tallies = Mutex::new(vec![Tally::default(); NAMES.len()]);
    let work = || {
        while let Some((name, from, until)) = { waiting.lock().expect("no worker panics").pop() } {
            let tally = watched(dir, name, seed, from, until);
            let at = NAMES.iter().position(|n| *n == name).expect("a reader");
            tallies.lock().expect("no worker panics")[at].add(tally);
        }
    };
    std::thread::scope(|scope| {
        let workers = std::thread::available_parallelism().map_or(1, usize::from);
        (0..workers).for_each(|_| drop(scope.spawn(work)));
    });
    print(&tallies.into_inner().expect("no worker panics"))
}

/// A batch in processes of its own, one more after each that ended before its time.
fn watched(dir: &Path, name: &str, seed: u64, mut from: u64, until: u64) -> Tally {
    let mut sum = Tally::default();
    while from < until {
        let mut child = start(dir, name, seed, from, until);
        let whole = wait(&mut child, &tally_path(dir, name, from));
        let tally = Tally::read(&tally_path(dir, name, from));
        sum.add(tally);
        fs::remove_dir_all(dir.join(format!("{name}-{from}"))).unwrap_or_default();
        match whole {
            Some(true) => return sum,
            Some(false) => sum.aborts += 1,
            None => sum.hangs += 1,
        }
        let what = if whole.is_none() { "hang" } else { "abort" };
        eprintln!("{what}: --reader {name} --one {} --seed {seed}", tally.at);
        from = tally.at + 1;
    }
    sum
}

fn start(dir: &Path, name: &str, seed: u64, from: u64, until: u64) -> Child {
    let this = std::env::current_exe().expect("a process knows its program");
    let words = ["--seed".into(), seed.to_string(), "--from".into(), from.to_string(), "--until".into(), until.to_string()];
    Command::new("bash")
        .args(["-c", &format!("ulimit -c 0; ulimit -v {LIMIT_KB}; exec \"$0\" \"$@\"")])
        .arg(this)
        .args(["--batch", name, "--dir"])
        .arg(dir)
        .args(words)
        .spawn()
        .expect("bash starts")
}

/// Whether the process came to its end; `None` when one input took too long.
fn wait(child: &mut Child, tally: &Path) -> Option<bool> {
    let (mut at, mut since) = (0, Instant::now());
    loop {
        if let Some(status) = child.try_wait().expect("a child can be waited for") {
            return Some(status.success());
        }
        let now = Tally::read(tally).at;
        if now != at {
            (at, since) = (now, Instant::now());
        }
        if since.elapsed() > HANG {
            child.kill().and_then(|()| child.wait()).expect("a child can be ended");
            return None;
        }
        std::thread::sleep(LOOK);
    }
}

fn print(tallies: &[Tally]) -> bool {
    println!(
        "{:<12}{:>9}{:>10}{:>9}{:>8}{:>8}{:>7}  slowest",
        "reader", "inputs", "accepted", "refused", "panics", "aborts", "hangs"
    );
    let mut sum = Tally::default();
    for (name, tally) in NAMES.iter().copied().zip(tallies) {
        line(name, *tally);
        sum.add(*tally);
    }
    line("all", sum);
    sum.panics + sum.aborts + sum.hangs > 0
}

fn line(name: &str, tally: Tally) {
    let Tally { accepted, refused, panics, aborts, hangs, slowest_us, slowest_at, .. } = tally;
    let (inputs, slowest_s) = (accepted + refused + panics + aborts + hangs, slowest_us as f64 / 1e6);
    println!(
        "{name:<12}{inputs:>9}{accepted:>10}{refused:>9}{panics:>8}{aborts:>8}{hangs:>7}  {slowest_s:.3} s (input {slowest_at})"
    );
}
