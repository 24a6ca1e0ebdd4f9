//! Files of experiments to grids, and grids to workflows.

use super::emit::{self, Site};
use super::estimate::{Estimate, in_words};
use super::state::{State, states};
use super::{Experiment, Grid, Overrides, ReportKind, seeds_of};
use crate::config::Stage;
use crate::error::Error;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const TEXT: &str = r#"
tasks = ["pick-up", "stack"]
methods = ["bc", "hil"]
seeds = "3-4"
episodes = 7

[[variation]]
name = "plain"

[[variation]]
name = "rho-0.6"
set = ["train.rho=0.6"]
methods = ["hil"]

[[variation]]
name = "calm"
set = ["simulate.pulses.probability=0"]
tasks = ["stack"]

[[variation]]
name = "turned"
set = ["scene.yaw=true"]
stages = ["evaluate"]
tasks = ["stack"]
methods = ["hil"]
"#;

fn experiment(text: &str) -> Experiment {
    Experiment::parse(Path::new("some.toml"), text, &Overrides::default()).unwrap_or_else(|why| panic!("{why}"))
}

fn grid(text: &str) -> Grid {
    Grid::expand(&experiment(text), Path::new("out")).unwrap_or_else(|why| panic!("{why}"))
}

#[test]
fn a_task_from_a_file_is_one_like_others() {
    let file = "fixtures/tasks/coffee.toml";
    let grid =
        grid(&format!("tasks = [\"stack\", \"{file}\"]\nmethods = [\"bc\"]\nseeds = \"3\"\npresets = [\"best\", \"paper\"]"));
    let tasks: Vec<&str> = grid.runs.iter().map(|run| run.task.as_str()).collect();
    assert_eq!(tasks, ["stack", "stack", "coffee", "coffee"]);
    let step = |id: &str| grid.steps.iter().find(|step| step.id == id).unwrap_or_else(|| panic!("no step {id}"));
    let (plan, paper) = (step("coffee/seed-3/best/plan"), step("coffee/seed-3/paper/plan"));
    assert!(plan.words.join(" ").starts_with(&format!("plan --task {file} ")), "{:?}", plan.words);
    assert!(paper.words.join(" ").contains(&format!("--task {file} --preset paper")), "{:?}", paper.words);
    // Its own file's settings; under the paper's preset those of stacking. What it is stands in both.
    let of =
        |step: &super::Step| (step.provenance.settings["plan"]["episodes"].clone(), step.provenance.settings["task"].clone());
    assert_eq!((of(plan).0, of(paper).0), (30.into(), 300.into()));
    assert_eq!((of(plan).1["name"].as_str(), of(plan).1), (Some("coffee"), of(paper).1));
}

/// Identities of the steps of seed 3.
fn of_seed_3(grid: &Grid) -> BTreeSet<&str> {
    grid.steps.iter().filter(|step| step.seed == 3).map(|step| step.id.as_str()).collect()
}

#[test]
fn runs_share_the_steps_that_are_the_same() {
    let grid = grid(TEXT);
    // Plain bc and hil, rho hil of both tasks; calm bc and hil, turned hil of stack.
    assert_eq!(grid.runs.len(), 2 * (3 + 6));
    let expected = [
        "pick-up/seed-3/best/convert",
        "pick-up/seed-3/best/plain/bc/evaluate",
        "pick-up/seed-3/best/plain/bc/train",
        "pick-up/seed-3/best/plain/hil/evaluate",
        "pick-up/seed-3/best/plain/hil/train",
        "pick-up/seed-3/best/plan",
        "pick-up/seed-3/best/pretrain",
        "pick-up/seed-3/best/rho-0.6/hil/evaluate",
        "pick-up/seed-3/best/rho-0.6/hil/train",
        "pick-up/seed-3/best/simulate",
        "stack/seed-3/best/calm/bc/evaluate",
        "stack/seed-3/best/calm/bc/train",
        "stack/seed-3/best/calm/convert",
        "stack/seed-3/best/calm/hil/evaluate",
        "stack/seed-3/best/calm/hil/train",
        "stack/seed-3/best/calm/pretrain",
        // The plans are those of the others.
        "stack/seed-3/best/calm/simulate",
        "stack/seed-3/best/convert",
        "stack/seed-3/best/plain/bc/evaluate",
        "stack/seed-3/best/plain/bc/train",
        "stack/seed-3/best/plain/hil/evaluate",
        "stack/seed-3/best/plain/hil/train",
        "stack/seed-3/best/plan",
        "stack/seed-3/best/pretrain",
        "stack/seed-3/best/rho-0.6/hil/evaluate",
        "stack/seed-3/best/rho-0.6/hil/train",
        "stack/seed-3/best/simulate",
        // The policy is that of "plain".
        "stack/seed-3/best/turned/hil/evaluate",
    ];
    assert_eq!(of_seed_3(&grid), BTreeSet::from(expected));
    let turned = grid.steps.iter().find(|step| step.id == "stack/seed-3/best/turned/hil/evaluate").expect("a step");
    assert_eq!(turned.inputs[0].path, PathBuf::from("out/stack/seed-3/best/plain/hil/policy.safetensors"));
}

#[test]
fn steps_come_after_what_they_need_and_write_apart() {
    let grid = grid(TEXT);
    for (i, step) in grid.steps.iter().enumerate() {
        assert!(step.needs().all(|from| from < i), "{}", step.id);
        assert!(step.cost_s > 0.0, "{}", step.id);
        assert_eq!(step.inputs.is_empty(), step.stage == Stage::Plan);
    }
    let places: BTreeSet<&PathBuf> = grid.steps.iter().flat_map(|step| &step.outputs).map(|output| &output.path).collect();
    assert_eq!(places.len(), grid.steps.iter().map(|step| step.outputs.len()).sum::<usize>());
    let train = grid.steps.iter().find(|step| step.id == "pick-up/seed-3/best/rho-0.6/hil/train").expect("a step");
    let expected = "train --task pick-up --set train.rho=0.6 --seed 3 --method hil --resume --dataset out/pick-up/seed-3/best/dataset \
                    --dynamics out/pick-up/seed-3/best/dynamics.safetensors --out out/pick-up/seed-3/best/rho-0.6/hil/policy.safetensors";
    assert_eq!(train.words.join(" "), expected);
    // Settings that a stage does not read are not among its words.
    let bc = grid.steps.iter().find(|step| step.id == "pick-up/seed-3/best/plain/bc/train").expect("a step");
    assert!(!bc.words.iter().any(|word| word.contains("evaluate") || word == "--dynamics"), "{:?}", bc.words);
}

#[test]
fn runs_are_in_the_order_of_the_file() {
    let order: Vec<_> =
        grid(TEXT).runs.iter().map(|r| format!("{} {} {} {}", r.task, r.variation, r.method.name(), r.seed)).collect();
    assert_eq!(order[..4], ["pick-up plain bc 3", "pick-up plain bc 4", "pick-up plain hil 3", "pick-up plain hil 4"]);
    assert_eq!(order.last().map(String::as_str), Some("stack turned hil 4"));
}

#[test]
fn an_extended_variation_has_the_settings_of_the_one_before() {
    let text = format!(
        "{TEXT}\n[[variation]]\nname = \"more\"\nextends = \"rho-0.6\"\nset = [\"train.tau=0.4\"]\nmethods = [\"hil\"]\n"
    );
    let experiment = experiment(&text);
    assert_eq!(experiment.variations[4].set, ["train.rho=0.6", "train.tau=0.4"]);
    let wrong = text.replace("extends = \"rho-0.6\"", "extends = \"rho\"");
    let said = Experiment::parse(Path::new("some.toml"), &wrong, &Overrides::default()).expect_err("refused").to_string();
    assert!(said.contains("unknown variation \"rho\"; allowed: plain, rho-0.6, calm, turned"), "{said}");
}

#[test]
fn settings_of_a_method_alone_leave_what_methods_share() {
    let text = TEXT.replace("episodes = 7", "episodes = 7\nmethod_set = { bc = [\"train.warm_start_updates=70\"] }");
    let more = "name = \"more\"\nextends = \"plain\"\nset = [\"train.bc_batch=32\"]\nmethod_set.bc = [\"train.warm_start_updates=90\"]\n";
    let changed = grid(&format!("{text}\n[[variation]]\n{more}"));
    let words =
        |id: &str| changed.steps.iter().find(|step| step.id == id).unwrap_or_else(|| panic!("no step {id}")).words.join(" ");
    let places =
        |grid: &Grid| grid.steps.iter().map(|step| step.id.clone()).filter(|id| !id.contains("/more/")).collect::<BTreeSet<_>>();
    assert_eq!(places(&changed), places(&grid(TEXT)));
    assert!(words("stack/seed-3/best/plain/bc/train").contains("--set train.warm_start_updates=70 --seed"));
    assert!(!words("stack/seed-3/best/plain/hil/train").contains("warm_start"));
    // Over the experiment's for the method, and over the variation's own.
    let own = "--set train.warm_start_updates=70 --set train.bc_batch=32 --set train.warm_start_updates=90 --seed";
    assert!(words("stack/seed-3/best/more/bc/train").contains(own));
    assert!(!words("stack/seed-3/best/more/hil/train").contains("warm_start"));
}

#[test]
fn a_file_says_what_a_report_shows_and_names_what_is_there() {
    let with = |lines: &str| Experiment::parse(Path::new("some.toml"), &format!("{lines}\n{TEXT}"), &Overrides::default());
    assert_eq!(experiment(TEXT).report, ReportKind::Success);
    let ladder = with("report = \"ladder\"\nreference = \"calm\"\nnotes = \"why\"").expect("an experiment");
    assert_eq!((ladder.report, ladder.reference.as_deref(), ladder.notes.as_str()), (ReportKind::Ladder, Some("calm"), "why"));
    let refused = |lines: &str| with(lines).expect_err("refused").to_string();
    assert!(refused("report = \"tabel3\"").contains("unknown report \"tabel3\"; did you mean table3?"));
    assert!(refused("reference = \"plane\"").contains("reference: unknown variation \"plane\"; did you mean plain?"));
}

#[test]
fn what_a_variation_sets_must_be_read_by_its_stages() {
    let text = TEXT.replace("scene.yaw=true", "train.rho=0.1");
    let Err(Error::Usage(said)) = Grid::expand(&experiment(&text), Path::new("out")) else { panic!("refused") };
    assert!(said.contains("variation \"turned\": set \"train.rho=0.1\" is read by none of its stages (evaluate)"), "{said}");
}

#[test]
fn the_command_line_comes_before_the_file() {
    let overrides = Overrides { seeds: Some(vec![9]), episodes: Some(2) };
    let experiment = Experiment::parse(Path::new("some.toml"), TEXT, &overrides).expect("an experiment");
    let grid = Grid::expand(&experiment, Path::new("out")).expect("a grid");
    assert!(grid.steps.iter().all(|step| step.seed == 9));
    let evaluate = grid.steps.iter().find(|step| step.stage == Stage::Evaluate).expect("a step");
    assert_eq!(evaluate.provenance.settings["evaluate"]["episodes"], 2);
    assert_eq!(seeds_of("0-2, 9"), Ok(vec![0, 1, 2, 9]));
}

#[test]
fn every_experiment_that_comes_with_hilt_is_one() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/experiments");
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(root).expect("readable") {
        let path = entry.expect("an entry").path();
        let experiment = Experiment::read(&path, &Overrides { seeds: Some(vec![0]), episodes: None }).expect("an experiment");
        assert!(!experiment.description.is_empty(), "{}", path.display());
        Grid::expand(&experiment, Path::new("out")).unwrap_or_else(|why| panic!("{why}"));
        names.insert(experiment.name);
    }
    let known = ["few-demos", "figure6", "figure7", "figure8", "ladder", "off-track", "smoke", "table2", "table3"];
    assert!(known.iter().all(|name| names.contains(*name)), "{names:?}");
}

#[test]
fn workflows_have_every_command_and_quote_what_needs_it() {
    let text = TEXT.replace("scene.yaw=true", "scene.obstacles=[{center_m=[0.4, 0.3, 0.8], size_m=[0.1, 0.1, 0.1]}]");
    let grid = grid(&text);
    let collect = ["experiment".to_string(), "some.toml".into(), "--collect".into()];
    let site = Site { hilt: "/opt/my hilt", name: "some", dir: Path::new("out"), collect: &collect, threads: 2 };
    let snakefile = emit::snakemake(&grid, &site);
    assert_eq!(snakefile.matches("\nrule ").count(), grid.steps.len() + 2);
    assert!(
        snakefile
            .contains("{HILT:q} plan --task stack --seed 3 --out out/stack/seed-3/best/plans.parquet --threads {threads} --log")
    );
    assert!(snakefile.contains("'scene.obstacles=[{{center_m=[0.4, 0.3, 0.8], size_m=[0.1, 0.1, 0.1]}}]'"), "braces are doubled");
    let script = emit::slurm(&grid, &site);
    assert!(script.contains("HILT=${HILT:-'/opt/my hilt'} NAME=some DIR=out THREADS=2"));
    assert!(script.contains("'scene.obstacles=[{center_m=[0.4, 0.3, 0.8], size_m=[0.1, 0.1, 0.1]}]'"));
    let evaluations = grid.steps.iter().filter(|step| step.stage == Stage::Evaluate).count();
    assert!(script.contains(&format!("submit evaluate {evaluations} \"$@\"")));
    assert_eq!(script.matches(") step ").count(), grid.steps.len());
}

#[test]
fn an_estimate_is_at_least_the_longest_chain_and_less_with_more_jobs() {
    let grid = grid(TEXT);
    let contents = vec![None; grid.steps.len()];
    let states = states(&grid, &contents);
    assert_eq!(states.iter().filter(|state| **state == State::Ready).count(), 4);
    let estimate = Estimate::of(&grid, &states, 2);
    let of = |jobs| estimate.of_all(&grid, &states, jobs).0;
    let chain: f64 = estimate.of_all(&grid, &states, usize::MAX).0;
    assert!(of(1) > of(2) && of(2) >= chain && chain > 0.0, "{} {} {chain}", of(1), of(2));
    assert_eq!([40.0, 600.0, 7200.0].map(in_words), ["40 s", "10 min", "2.0 h"]);
}
