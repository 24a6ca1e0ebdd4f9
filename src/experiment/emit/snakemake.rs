//! A workflow for Snakemake 8 and newer, which runs it on this machine, on Slurm or on Kubernetes by executors of its own.

use super::super::results::RESULTS;
use super::super::runs::Grid;
use super::super::step::{Output, Step};
use super::super::wording::TAKES;
use super::{MARK, Site, line};
use std::fmt::Write;
use std::path::Path;

/// The Snakefile: a rule a step, and one that collects the results.
pub fn snakemake(grid: &Grid, site: &Site) -> String {
    let name = site.name;
    let mut text = format!(
        "# {MARK} {name} --emit snakemake. In the directory where that was done: snakemake --cores 2 --snakefile FILE\n\
         # Other machines: --executor slurm or kubernetes (plugins of Snakemake); HILT names the binary there.\n\
         import os\n\n\
         HILT = os.environ.get(\"HILT\", {})\n\n\n",
        literal(site.hilt)
    );
    let results = literal_path(&site.dir.join(RESULTS));
    write!(text, "rule all:\n    input:\n        {results},\n    localrule: True\n\n\n").expect(TAKES);
    for (i, step) in grid.steps.iter().enumerate() {
        rule(&mut text, i, step, site.threads);
    }
    text += "rule collect:\n    input:\n";
    for run in &grid.runs {
        writeln!(text, "        {},", literal_path(grid.steps[run.evaluate].artefact())).expect(TAKES);
    }
    let collect = shell(&line(site.collect));
    write!(text, "    output:\n        {results},\n    localrule: True\n    shell:\n        {collect}\n").expect(TAKES);
    text
}

fn rule(text: &mut String, number: usize, step: &Step, threads: usize) {
    write!(text, "rule {}_{number}:\n    # {}\n", step.stage.name(), step.id).expect(TAKES);
    if !step.inputs.is_empty() {
        text.push_str("    input:\n");
    }
    for input in &step.inputs {
        writeln!(text, "        {},", literal_path(&input.path)).expect(TAKES);
    }
    text.push_str("    output:\n");
    for output in &step.outputs {
        writeln!(text, "        {},", output_of(output)).expect(TAKES);
    }
    let marker = "THREADS-OF-THE-RULE";
    let command = escaped(&line(&step.command(marker))).replace(marker, "{threads}");
    let command = literal(&format!("{{HILT:q}} {command} > /dev/null"));
    let log = literal_path(&step.log);
    write!(text, "    log:\n        {log},\n    threads: {threads}\n    shell:\n        {command}\n\n\n").expect(TAKES);
}

fn output_of(output: &Output) -> String {
    let path = literal_path(&output.path);
    if output.is_directory() { format!("directory({path})") } else { path }
}

/// A command without names of Snakemake in it.
fn shell(line: &str) -> String {
    literal(&format!("{{HILT:q}} {}", escaped(line)))
}

/// Braces in a name would be a wildcard.
fn literal_path(path: &Path) -> String {
    literal(&escaped(&path.display().to_string()))
}

/// Braces that are none of Snakemake's.
fn escaped(text: &str) -> String {
    text.replace('{', "{{").replace('}', "}}")
}

/// A text as Python writes it: as JSON does.
fn literal(text: &str) -> String {
    serde_json::to_string(text).expect("a text has a form in JSON")
}
