//! Holds the one-way flow between modules, and that no files import each other in circles.

mod imports;

use imports::{Imports, module_of, sources};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Leaves that any module may use; they use only each other.
const LEAVES: [&str; 9] = ["error", "guard", "interrupt", "joints", "math", "seed", "table", "tensor", "words"];

/// What else each module may use. The order is the house's: a module uses only those above it. One that is not here is refused, so that a
/// new one gets its place on purpose.
const FLOW: [(&str, &[&str]); 22] = [
    ("nn", &[]),
    ("layout", &[]),
    ("task", &[]),
    ("state", &["task"]),
    ("robot", &["layout"]),
    ("scene", &["robot", "state", "task"]),
    ("demo", &["layout", "scene", "state", "task"]),
    ("env", &[]),
    ("config", &["nn", "robot", "scene", "state", "task"]),
    ("pulse", &["config"]),
    ("tasks", &["config", "demo", "layout", "robot", "scene", "state", "task"]),
    ("plan", &["config", "demo", "robot", "scene", "state", "task", "tasks"]),
    ("sim", &["config", "demo", "env", "plan", "pulse", "robot", "scene", "state", "task", "tasks"]),
    ("data", &["config", "demo", "layout", "robot", "scene", "state", "task", "tasks"]),
    ("learn", &["config", "demo", "env", "layout", "nn", "pulse"]),
    ("eval", &["config", "demo", "learn", "scene", "sim", "state", "task", "tasks"]),
    ("export", &["config", "data", "layout", "learn", "nn"]),
    ("serve", &["config", "demo", "eval", "layout", "learn", "robot", "scene", "sim", "state", "task", "tasks"]),
    ("experiment", &["config", "data", "eval", "learn", "plan", "task", "tasks"]),
    ("report", &["config", "data", "demo", "eval", "experiment", "learn", "robot", "scene", "state", "task", "tasks"]),
    (
        "cmd",
        &[
            "config",
            "data",
            "demo",
            "env",
            "eval",
            "experiment",
            "export",
            "layout",
            "learn",
            "nn",
            "plan",
            "report",
            "robot",
            "scene",
            "serve",
            "sim",
            "state",
            "task",
            "tasks",
        ],
    ),
    ("main", &["cmd", "nn"]),
];

fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

#[test]
fn modules_import_only_from_those_before_them() {
    let flow: BTreeMap<&str, &[&str]> = FLOW.into_iter().collect();
    let mut wrong = Vec::new();
    for (at, (module, uses)) in FLOW.iter().enumerate() {
        let later = uses.iter().filter(|used| !FLOW[..at].iter().any(|(before, _)| before == *used));
        wrong.extend(later.map(|used| format!("{module} may use {used}, which does not come before it")));
    }
    for (file, imported) in Imports::read(&root()).edges {
        let module = file[0].as_str();
        let leaf = LEAVES.contains(&module);
        if !leaf && !flow.contains_key(module) {
            wrong.push(format!("module {module} has no place in the flow: add it to FLOW"));
        }
        for other in imported {
            let used = other[0].as_str();
            let allowed = used == module || LEAVES.contains(&used) || flow.get(module).is_some_and(|uses| uses.contains(&used));
            if !allowed {
                wrong.push(format!("{} uses {}", file.join("::"), other.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "against the flow:\n{}", wrong.join("\n"));
}

#[test]
fn no_files_import_each_other_in_circles() {
    let circle: Vec<String> = Imports::read(&root()).circle().iter().map(|module| module.join("::")).collect();
    assert!(circle.is_empty(), "these files are in circles, or use those that are:\n{}", circle.join("\n"));
}

#[test]
fn only_their_homes_know_the_big_crates() {
    let homes: [(&str, &[&str]); 11] = [
        // Normal numbers differ in the last digit by processor unless `seed` draws them.
        ("rand_distr", &["seed"]),
        ("rapier3d", &["sim"]),
        ("mcap", &["data"]),
        ("arrow_array", &["data"]),
        ("parquet", &["data"]),
        ("safetensors", &["data"]),
        ("tungstenite", &["serve"]),
        ("httparse", &["serve"]),
        ("rmp", &["serve"]),
        ("clap", &["cmd", "main"]),
        ("indicatif", &["cmd"]),
    ];
    let root = root();
    let mut files = Vec::new();
    sources(&root, &mut files);
    for file in &files {
        let module = &module_of(file, &root)[0];
        let text = fs::read_to_string(file).expect("a source is readable");
        for (name, allowed) in &homes {
            let imports = text.lines().any(|l| {
                let l = l.trim_start();
                l.starts_with(&format!("use {name}::")) || (!l.starts_with("//") && l.contains(&format!(" {name}::")))
            });
            assert!(!imports || allowed.contains(&module.as_str()), "{} uses {name}; only {allowed:?} may", file.display());
        }
    }
}

/// What is only true of one robot stands in its files, in `robot` and `tasks`. Tests may name one.
#[test]
fn only_their_homes_name_robots() {
    let root = root();
    let mut files = Vec::new();
    sources(&root, &mut files);
    let named = |line: &&str| {
        let words = line.to_lowercase();
        let words: Vec<&str> = words.split(|c: char| !c.is_alphanumeric()).collect();
        ["jaco", "kinova", "franka", "panda", "ur5e", "j2n6s300"].iter().any(|name| words.contains(name))
    };
    for file in &files {
        let module = &module_of(file, &root)[0];
        if ["learn", "nn", "layout", "plan", "sim", "data", "eval", "report", "state", "scene", "demo", "serve"]
            .contains(&module.as_str())
        {
            let text = fs::read_to_string(file).expect("a source is readable");
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            assert_eq!(code.lines().find(named), None, "{}", file.display());
        }
    }
}

/// What is only true of one task stands in its file, in `task` and `tasks`. What the paper says of its three is the report's, tests may name one.
#[test]
fn only_their_homes_name_tasks() {
    let root = root();
    let mut files = Vec::new();
    sources(&root, &mut files);
    let homes = [
        "learn",
        "nn",
        "layout",
        "plan",
        "sim",
        "data",
        "eval",
        "report",
        "state",
        "scene",
        "demo",
        "robot",
        "experiment",
        "serve",
    ];
    let named = |line: &&str| {
        let code = line.split("//").next().unwrap_or_default().to_lowercase();
        [
            "pick-up",
            "pick_up",
            "pickup",
            "pick-and-place",
            "pick_and_place",
            "\"stack\"",
            "stack()",
            "tower",
            "\"sort\"",
            "\"bin\"",
        ]
        .iter()
        .any(|name| code.contains(name))
    };
    for file in &files {
        let module = module_of(file, &root);
        let is_test = module.iter().any(|part| part.contains("tests"));
        if is_test || module == ["report", "paper"] || !homes.contains(&module[0].as_str()) {
            continue;
        }
        let text = fs::read_to_string(file).expect("a source is readable");
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        assert_eq!(code.lines().find(named), None, "{}", file.display());
    }
}
