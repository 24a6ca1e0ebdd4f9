//! The readers, and the inputs that each gets.

use super::mutate::{self, one_in, pick};
use super::{recordings, sources, structure};
use hilt::config::{Pipeline, ProjectFile, Source};
use hilt::data::{ContentHash, dataset, inspect, json_file, live_file, recording, seal, table_file, weights};
use hilt::error::{Error, Result};
use hilt::interrupt::Interrupt;
use hilt::learn::{Checkpoint, Dynamics, Policy};
use hilt::plan::{Plans, from_table};
use hilt::robot::file as robot;
use hilt::robot::file::built_in::paper_robot;
use hilt::seed::stream;
use hilt::table::Table;
use hilt::task::built_in::{pick_up, stack};
use hilt::tensor::NamedTensor;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Every reader.
pub const NAMES: [&str; 12] = [
    "recording",
    "plans",
    "dataset",
    "policy",
    "dynamics",
    "checkpoint",
    "summary",
    "metrics",
    "project",
    "settings",
    "robot",
    "urdf",
];
/// A URDF in so many is drafted from: that takes as long as reading hundreds.
const DRAFTED: u64 = 50;
/// One input in so many is left without a right seal.
const UNSEALED: u32 = 16;
/// Words for `--set`.
const SETS: [&str; 6] = [
    "plan.speed=0.5",
    "scene.spawn_x_m=[0.4, 0.5]",
    "train.alpha=\"adaptive\"",
    "scene.obstacles=[{center_m=[0.4,0.1,0.1],size_m=[0.1,0.1,0.1]}]",
    "pretrain.activation=relu",
    "simulate.pulses.probability=1e-2",
];

/// What came of an input.
#[derive(Debug)]
pub enum Verdict {
    Accepted,
    Refused(#[allow(dead_code, reason = "shown by --one")] String),
    Panicked,
}

/// A reader with the whole artefacts that its inputs are made of.
pub struct Reader {
    name: &'static str,
    dir: PathBuf,
    seed: u64,
    whole: Vec<u8>,
    /// Pieces of another format.
    other: Vec<u8>,
    table: Table,
    network: Option<(Vec<NamedTensor>, Value)>,
    dynamics: Option<Dynamics>,
    /// Files of a dataset by name.
    parts: BTreeMap<String, Vec<u8>>,
}

impl Reader {
    /// The reader of this name, which works in `dir`.
    pub fn new(name: &str, dir: &Path, seed: u64) -> Self {
        let name = NAMES.into_iter().find(|n| *n == name).unwrap_or_else(|| panic!("{name} is none of {NAMES:?}"));
        fs::create_dir_all(dir).unwrap_or_else(|why| panic!("{}: {why}", dir.display()));
        let mut reader = Reader {
            name,
            dir: dir.to_path_buf(),
            seed,
            whole: Vec::new(),
            other: fs::read(sources::fixture("policy.safetensors")).expect("a fixture"),
            table: sources::plan_table(),
            network: None,
            dynamics: ["dynamics", "checkpoint"].contains(&name).then(sources::dynamics),
            parts: BTreeMap::new(),
        };
        reader.make();
        reader
    }

    fn make(&mut self) {
        match self.name {
            "recording" => self.whole = sources::recording(),
            "plans" => self.whole = sources::table(&self.table).expect("plans"),
            "dataset" => {
                sources::dataset(&self.dir.join("dataset"));
                let files =
                    ["meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/episodes/chunk-000/file-000.parquet"];
                for name in files.into_iter().chain(["data/chunk-000/file-000.parquet"]) {
                    self.parts.insert(name.into(), fs::read(self.dir.join("dataset").join(name)).expect("a part"));
                }
            }
            "policy" => {
                let (tensors, meta, _) = weights::read(&sources::fixture("policy.safetensors"), "policy").expect("a fixture");
                self.network = Some((tensors, meta));
            }
            "dynamics" => self.network = self.dynamics.as_ref().map(|d| (d.to_tensors(), d.meta())),
            "checkpoint" => {
                let model = self.dynamics.as_ref().expect("made for it");
                let kept = sources::training(model, None, &Interrupt::default()).expect("trains").pop().expect("kept");
                self.network = Some((kept.tensors, kept.meta));
            }
            "summary" => {
                let made = hilt::data::Provenance::new("evaluate", "pick-up", json!({}), 0);
                let content = json!({ "success_rate": 0.5, "wilson_95": [0.1, 0.9], "failures": { "dropped": 1 } });
                self.whole = json_file::encode(Path::new("summary"), &content, &made).expect("a summary");
            }
            "metrics" => {
                let line =
                    |epoch| live_file::line("hil", [epoch, 9], 20 * epoch, [("l_bc", 0.5), ("l_sc", f64::NAN)].into_iter());
                self.whole = (1..10).map(line).collect::<String>().into_bytes();
            }
            "project" => {
                let text = Pipeline::defaults(&stack()).to_toml(None).expect("TOML");
                let mut table: toml::Table = text.parse().expect("TOML");
                // Its task is a name.
                table.insert("task".into(), "stack".into());
                (self.whole, self.other) = (table.to_string().into_bytes(), text.into_bytes());
            }
            "robot" | "urdf" => {
                for name in ["five.toml", "five.urdf", "wrist.stl"] {
                    fs::write(self.dir.join(name), sources::robot(name)).expect("a file of the robot");
                }
                self.whole = sources::robot(if self.name == "urdf" { "five.urdf" } else { "five.toml" });
                self.other = sources::robot("five.urdf");
            }
            _ => {
                self.whole = Pipeline::defaults(&stack()).to_toml(None).expect("TOML").into_bytes();
                self.other = self.whole.clone();
            }
        }
        if let Some((tensors, meta)) = &self.network {
            self.whole = sources::weights(self.name, tensors, meta).expect("weights");
        }
    }

    fn rng(&self, number: u64) -> ChaCha8Rng {
        stream(self.seed, &format!("fuzz {}", self.name), number)
    }

    /// Where an input is put.
    pub fn path(&self, number: u64) -> PathBuf {
        match self.part(number) {
            Some(part) => self.dir.join("dataset").join(part),
            None if self.name == "urdf" => self.dir.join("five.urdf"),
            None => self.dir.join("input"),
        }
    }

    /// The part of a dataset that an input stands for: the info and the data more often than the rest.
    fn part(&self, number: u64) -> Option<&String> {
        let parts: Vec<&String> = self.parts.keys().collect();
        let weighted = [0, 0, 0, 1, 2, 2, 3, 4];
        (self.name == "dataset").then(|| parts[weighted[number as usize % weighted.len()] % parts.len()])
    }

    /// The bytes of an input: always the same for a number.
    pub fn input(&self, number: u64) -> Vec<u8> {
        let rng = &mut self.rng(number);
        let whole = self.part(number).map_or(&self.whole, |part| &self.parts[part]);
        let plain = |rng: &mut ChaCha8Rng| mutate::bytes(whole.clone(), &self.other, rng);
        let by_structure = match self.name {
            "settings" if number % 2 == 1 => Some(mutate::text(pick::<&str>(&SETS, rng), rng).into_bytes()),
            _ if one_in(3, rng) => None,
            "recording" if one_in(2, rng) => recordings::with_other_messages(whole, rng),
            "recording" => recordings::with_another_chunk(whole, rng),
            "plans" => structure::other_table(&self.table, rng),
            "policy" | "dynamics" | "checkpoint" => self.other_weights(rng),
            "summary" => structure::other_json(whole, rng),
            "dataset" if whole.starts_with(b"{") => structure::other_json(whole, rng),
            "metrics" => structure::other_line(whole, rng),
            "settings" | "project" | "robot" => structure::other_toml(whole, rng),
            "urdf" => structure::other_xml(whole, rng),
            _ => None,
        };
        let bytes = by_structure.unwrap_or_else(|| plain(rng));
        match self.name {
            _ if one_in(UNSEALED, rng) => bytes,
            "recording" => recordings::reseal(bytes),
            _ => seal::reseal(bytes.clone()).unwrap_or(bytes),
        }
    }

    fn other_weights(&self, rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
        let (mut tensors, mut meta) = self.network.clone()?;
        let hit = mutate::below(tensors.len(), rng);
        match rng.random_range(0..8) {
            0..3 => mutate::value(&mut meta, rng),
            3 => tensors[hit].shape.reverse(),
            4 => drop(tensors.remove(hit)),
            5 => {
                let number = mutate::number(rng) as f32;
                tensors[hit].data.iter_mut().for_each(|v| *v = number);
                if !number.is_finite() {
                    return Some(structure::with_bytes(&self.whole, number));
                }
            }
            6 => tensors[hit].name = mutate::text(&tensors[hit].name.clone(), rng),
            _ => return structure::other_header(&self.whole, rng),
        }
        sources::weights(self.name, &tensors, &meta)
    }

    /// Reads an input.
    pub fn read(&mut self, input: &[u8], number: u64) -> Verdict {
        let path = self.path(number);
        fs::write(&path, input).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
        let part = self.part(number).cloned();
        self.note(part.as_deref(), input);
        let verdict = match catch_unwind(AssertUnwindSafe(|| self.taken(&path, input, number))) {
            Ok(Ok(())) => Verdict::Accepted,
            Ok(Err(why)) => Verdict::Refused(why.to_string()),
            Err(_) => Verdict::Panicked,
        };
        let touched = part.into_iter().flat_map(|part| ["meta/info.json".to_string(), part]);
        for name in touched {
            fs::write(self.dir.join("dataset").join(&name), &self.parts[&name]).expect("a part can be restored");
        }
        verdict
    }

    /// Puts the hash of a changed part into the dataset's own list.
    fn note(&self, part: Option<&str>, input: &[u8]) {
        let Some(part) = part.filter(|part| *part != "meta/info.json") else { return };
        let info = String::from_utf8_lossy(&self.parts["meta/info.json"]);
        let hash = |bytes: &[u8]| ContentHash::of(bytes).to_string();
        let noted = info.replace(&hash(&self.parts[part]), &hash(input)).into_bytes();
        let noted = seal::reseal(noted).expect("a list of files has a seal");
        fs::write(self.dir.join("dataset/meta/info.json"), noted).expect("a list of files can be written");
    }

    fn taken(&self, path: &Path, input: &[u8], number: u64) -> Result<()> {
        let misfit = |why| Error::input(path, why);
        match self.name {
            "recording" => recording::read(path)?.0.to_demo().map(drop).map_err(misfit),
            "plans" => {
                let whole =
                    table_file::read(path).and_then(|(table, _)| from_table(&paper_robot(), &pick_up(), &table).map_err(misfit));
                let plans = table_file::Reader::open(path)?;
                let in_pieces = Plans::new(path, (&paper_robot(), &pick_up()), plans.tables()?).collect::<Result<Vec<_>>>();
                if let (Ok(whole), Ok(in_pieces)) = (&whole, &in_pieces) {
                    assert!(whole == in_pieces, "other plans when read in pieces");
                }
                whole.and(in_pieces).map(drop)
            }
            "dataset" => dataset::read(&self.dir.join("dataset")).map(drop),
            "policy" => {
                let (tensors, meta, _) = weights::read(path, "policy")?;
                let policy = Policy::from_tensors(&tensors, &meta).map_err(misfit)?;
                policy.act(&vec![0.1; policy.layout().state_dim()]);
                Ok(())
            }
            "dynamics" => {
                let (tensors, meta, _) = weights::read(path, "dynamics")?;
                Dynamics::from_tensors(&tensors, &meta).map(drop).map_err(misfit)
            }
            "checkpoint" => {
                let (tensors, meta, _) = weights::read(path, weights::CHECKPOINT)?;
                let (stop, model) = (Interrupt::default(), self.dynamics.as_ref().expect("made for it"));
                stop.raise(1);
                match sources::training(model, Some(Checkpoint { tensors, meta }), &stop) {
                    Err(Error::Interrupted) => Ok(()),
                    other => other.map(drop),
                }
            }
            "summary" => inspect(path, &Interrupt::default()).and_then(|_| json_file::read(path)).map(drop),
            "metrics" => live_file::read(path).map(drop),
            "project" => ProjectFile::read(path).map(drop),
            "robot" => robot::read(path).map(drop),
            "urdf" if number.is_multiple_of(DRAFTED) => robot::draft(path, &Interrupt::default()).map(drop),
            "urdf" => robot::read(&self.dir.join("five.toml")).map(drop),
            _ if number % 2 == 1 => {
                let sets = [String::from_utf8_lossy(input).into_owned()];
                Pipeline::load(&Source::BuiltIn(stack().into(), Default::default()), &sets).map(drop)
            }
            _ => Pipeline::load(&Source::File(path.to_path_buf(), None), &[]).map(drop),
        }
    }
}
