//! A script for Slurm: a job array a stage, each after the one before.

use super::super::runs::Grid;
use super::super::step::Step;
use super::super::wording::TAKES;
use super::{MARK, Site, line, quoted};
use crate::config::Stage;
use std::fmt::Write;

/// Most jobs of an array, as Slurm comes (MaxArraySize 1001).
const ARRAY: usize = 1000;

/// Before the steps. An artefact appears whole or not at all, so one that is there is done.
const HEAD: &str = r#"set -eu
cd -- "${SLURM_SUBMIT_DIR:-.}"

# step OUTPUT... -- ARGUMENT...
step() {
    local done=yes
    while [ "$1" != -- ]; do
        [ -e "$1" ] || done=
        shift
    done
    shift
    [ -n "$done" ] || exec "$HILT" "$@" > /dev/null
}
"#;

/// Behind the steps. A step whose input is missing fails by itself, and the others go on.
const TAIL: &str = r#"
if [ "${1:-}" = --run ]; then
    "$2" $(($3 + ${SLURM_ARRAY_TASK_ID:-0}))
    exit
fi
after=
# submit STAGE COUNT [OPTION OF SBATCH...]
submit() {
    local stage=$1 count=$2 offset=0 ids= id last array
    shift 2
    while [ "$offset" -lt "$count" ]; do
        last=$((count - offset < ARRAY ? count - offset - 1 : ARRAY - 1))
        array=$([ "$stage" = collect ] || echo "--array=0-$last")
        id=$(sbatch --parsable --job-name="$NAME-$stage" --cpus-per-task="$THREADS" --output="$DIR/logs/slurm-%x-%j.out" \
            $array ${after:+"--dependency=afterany$after"} "$@" "$0" --run "$stage" "$offset")
        ids="$ids:${id%%;*}"
        offset=$((offset + ARRAY))
    done
    after=$ids
    echo "$stage: job${ids//:/ }"
}
mkdir -p "$DIR/logs"
"#;

/// The script: without arguments, or with options for sbatch, it submits all that is not done.
pub fn slurm(grid: &Grid, site: &Site) -> String {
    let (name, threads) = (site.name, site.threads);
    let (hilt, dir) = (quoted(site.hilt), quoted(&site.dir.display().to_string()));
    let mut text = format!(
        "#!/usr/bin/env bash\n# {MARK} {name} --emit slurm. In the directory where that was done: bash FILE [OPTION OF SBATCH...]\n\
         # HILT names the binary on the nodes; what is done is left alone.\n\
         HILT=${{HILT:-{hilt}}} NAME={name} DIR={dir} THREADS={threads} ARRAY={ARRAY}\n{HEAD}"
    );
    let stages = Stage::ALL.map(|stage| (stage, grid.steps.iter().filter(move |step| step.stage == stage).collect::<Vec<_>>()));
    for (stage, steps) in stages.iter().filter(|(_, steps)| !steps.is_empty()) {
        cases(&mut text, *stage, steps);
    }
    writeln!(text, "\ncollect() {{\n    exec \"$HILT\" {}\n}}", line(site.collect)).expect(TAKES);
    text += TAIL;
    for (stage, steps) in stages.iter().filter(|(_, steps)| !steps.is_empty()) {
        writeln!(text, "submit {} {} \"$@\"", stage.name(), steps.len()).expect(TAKES);
    }
    text += "submit collect 1 \"$@\"\n";
    text
}

fn cases(text: &mut String, stage: Stage, steps: &[&Step]) {
    write!(text, "\n{}() {{\n    case $1 in\n", stage.name()).expect(TAKES);
    for (number, step) in steps.iter().enumerate() {
        let outputs: Vec<String> = step.outputs.iter().map(|output| output.path.display().to_string()).collect();
        let marker = "THREADS-OF-THE-JOB";
        let command = line(&step.command(marker)).replace(marker, "\"${SLURM_CPUS_PER_TASK:-$THREADS}\"");
        writeln!(text, "        {number}) step {} -- {command} ;;", line(&outputs)).expect(TAKES);
    }
    text.push_str("    esac\n}\n");
}
