//! `hilt report` as a process: pages of a tiny experiment in every form, whole, in part, refused.

#[path = "../experiment/files.rs"]
mod files;

use files::{contents, text};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// Two seeds of three runs, recorded. The variations have the names of the paper's Table 2.
const TINY: &str = r#"
description = "Tiny <experiment> & its \"runs\""
notes = """
Nothing is learned: `train.epochs=1`.

A second paragraph."""
tasks = ["pick-up"]
methods = ["hil", "bc"]
seeds = [11, 12]
episodes = 2
record = true
set = [
    "plan.episodes=4", "pretrain.epochs=2", "pretrain.hidden_units=16", "train.hidden_units=16", "train.warm_start_updates=10",
    "train.epochs=1", "train.min_updates=0", "evaluate.horizon_steps=40",
]

[[variation]]
name = "adaptive"

[[variation]]
name = "alpha-0.6"
extends = "adaptive"
set = ["train.alpha=0.6"]
methods = ["hil"]
"#;

struct Place(TempDir);

impl Place {
    /// With the experiment's file.
    fn new() -> Self {
        let place = Place(tempfile::tempdir().expect("temporary directory"));
        place.edit(TINY);
        place
    }

    fn edit(&self, text: &str) {
        fs::write(self.at("tiny.toml"), text).expect("written");
    }

    /// The same runs in another form.
    fn shown_as(&self, kind: &str) {
        self.edit(&TINY.replacen("record", &format!("report = \"{kind}\"\nrecord"), 1));
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn hilt(&self, words: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_hilt")).args(words).current_dir(self.0.path()).output().expect("the binary runs")
    }

    fn done(&self, words: &[&str]) -> String {
        let output = self.hilt(words);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", text(&output.stderr));
        text(&output.stderr)
    }

    fn refused(&self, words: &[&str], code: i32, says: &str) {
        let before = contents(self.0.path());
        let output = self.hilt(words);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{words:?}: {stderr}");
        assert!(stderr.contains(says), "should say {says}: {stderr}");
        assert!(contents(self.0.path()) == before, "{words:?} changed files");
    }
}

/// The page is whole, asks for nothing from elsewhere, and has its figures beside it. Ids of the figures.
fn check(dir: &Path) -> Vec<String> {
    let read = |name: &str| fs::read_to_string(dir.join(name)).unwrap_or_else(|why| panic!("{name}: {why}"));
    let (html, markdown) = (read("index.html"), read("report.md"));
    for foreign in ["http:", "https:", "src=", "<script", "@import", "url(", "<iframe", "<object"] {
        assert!(!html.contains(foreign), "{foreign} in the page");
    }
    assert!(!html.contains("NaN") && !html.contains("inf "), "numbers that are none");
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let page = roxmltree::Document::parse_with_options(&html, options).unwrap_or_else(|why| panic!("{why}"));
    let ids: Vec<&str> = page.descendants().filter_map(|n| n.attribute("id")).collect();
    let links = page.descendants().filter(|n| n.has_tag_name("a")).filter_map(|n| n.attribute("href"));
    for link in links {
        assert!(link.strip_prefix('#').is_some_and(|id| ids.contains(&id)), "{link} leads nowhere");
    }
    assert!(ids.iter().enumerate().all(|(i, id)| !ids[..i].contains(id)), "ids are there twice: {ids:?}");
    let figures = page.descendants().filter(|n| n.has_tag_name("figure")).filter_map(|n| n.attribute("id"));
    let figures: Vec<String> = figures.map(String::from).collect();
    for id in &figures {
        let svg = read(&format!("figures/{id}.svg"));
        let picture = roxmltree::Document::parse(&svg).unwrap_or_else(|why| panic!("{id}: {why}"));
        assert!(picture.descendants().any(|n| n.has_tag_name(("http://www.w3.org/2000/svg", "desc"))), "{id} has no words");
        assert!(markdown.contains(&format!("(figures/{id}.svg)")), "{id} is not in report.md");
    }
    assert_eq!(fs::read_dir(dir.join("figures")).map_or(0, Iterator::count), figures.len());
    figures
}

#[test]
fn every_form_of_a_report_is_whole_and_the_same_each_time() {
    let place = Place::new();
    place.done(&["experiment", "tiny.toml"]);
    let forms: [(&str, &[&str], &[&str]); 8] = [
        ("success", &["tiny-success"], &["Too few seeds", "adaptive, hil"]),
        ("table2", &["tiny-success"], &["α = d_conv (HIL)", "75.0", "119"]),
        ("table3", &["tiny-success"], &["ρ = 0.3", "failed"]),
        ("convergence", &["tiny-convergence"], &["half way at epoch"]),
        ("training", &["tiny-epochs", "tiny-time"], &["Time to plateau"]),
        ("paths", &["tiny-pick-up-best"], &["I1 to G1", "steps, up to"]),
        ("ladder", &["tiny-success"], &["against"]),
        ("demos", &["tiny-demos"], &["demos"]),
    ];
    for (kind, figures, words) in forms {
        place.shown_as(kind);
        let said = place.done(&["report", "tiny.toml", "--out", "page", "--threads", "1"]);
        assert!(said.contains("page/index.html: 1 experiments, 6 of 6 runs"), "{said}");
        assert_eq!(check(&place.at("page")), figures, "{kind}");
        let html = fs::read_to_string(place.at("page/index.html")).expect("a page");
        let everywhere =
            ["<code>train.epochs=1</code>", "Tiny &lt;experiment&gt; &amp; its", "A second paragraph.", "6 of 6 runs finished"];
        for part in words.iter().chain(&everywhere) {
            assert!(html.contains(part), "{kind}: {part} is missing");
        }
        place.done(&["report", "tiny.toml", "--out", "again", "--threads", "2"]);
        assert!(contents(&place.at("page")) == contents(&place.at("again")), "{kind}: other bytes");
    }
    let table = text(&place.hilt(&["inspect", "page/tables/tiny/pick-up.parquet"]).stdout);
    assert!(table.contains("rows: 6") && table.contains("success_rate"), "{table}");
    // The runs of a seed that is not shown are no strangers.
    let said = place.done(&["report", "tiny.toml", "--seeds", "12", "--out", "again"]);
    assert!(said.contains("3 of 3 runs"), "{said}");
}

#[test]
fn a_part_is_shown_as_a_part_and_nothing_is_refused() {
    let place = Place::new();
    place.refused(&["report", "tiny.toml"], 1, "no run of tiny is finished; hilt experiment tiny.toml makes them");
    place.refused(&["report"], 1, "no run of an experiment that comes with hilt is finished");
    place.refused(&["report", "tinny"], 2, "no experiment \"tinny\"");
    place.done(&["experiment", "tiny.toml", "--seeds", "11"]);
    place.refused(&["report", "tiny.toml", "tiny.toml"], 2, "tiny: is named twice");
    place.done(&["report", "tiny.toml", "--out", "page"]);
    check(&place.at("page"));
    let html = fs::read_to_string(place.at("page/index.html")).expect("a page");
    assert!(html.contains("3 of 6 runs are there") && html.contains("pick-up, seeds 12: all 3"), "{html}");
    let said = place.done(&["report", "tiny.toml", "--seeds", "11,99", "--out", "page"]);
    assert!(said.contains("3 of 3 runs"), "{said}");
    place.refused(&["report", "tiny.toml", "--seeds", "99", "--out", "page"], 2, "tiny has none of them");
    // A page of somebody's own has the same names.
    fs::create_dir_all(place.at("mine/figures")).expect("made");
    fs::write(place.at("mine/index.html"), "<!DOCTYPE html><title>Me</title>").expect("written");
    place.refused(&["report", "tiny.toml", "--out", "mine"], 2, "no index.html of hilt report");
    place.refused(&["report"], 1, "one of your own is named");
    // What is not a report's is not lost, nor is an older report when the next one cannot be made.
    fs::write(place.at("page/thesis.tex"), "years of work").expect("written");
    place.refused(&["report", "tiny.toml", "--out", "page"], 1, "thesis.tex");
    fs::remove_file(place.at("page/thesis.tex")).expect("removed");
    place.refused(&["report", "tiny.toml", "--episodes", "3", "--out", "page"], 1, "evaluation.json");
    place.refused(&["report", "tiny.toml", "--out", "runs/experiments/page"], 2, "choose another place");
    place.edit(&TINY.replacen("record", "report = \"tabel2\"\nrecord", 1));
    place.refused(&["report", "tiny.toml"], 2, "unknown report \"tabel2\"; did you mean table2?");
}
