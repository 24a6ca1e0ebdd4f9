//! Holds the one-way flow between modules: reads every `use crate::` and `crate::` path of the sources.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What any module may use: contracts, errors, randomness, settings.
const EVERYWHERE: [&str; 14] = [
    "config",
    "demo",
    "env",
    "error",
    "guard",
    "interrupt",
    "math",
    "pulse",
    "scene",
    "seed",
    "state",
    "table",
    "tensor",
    "words",
];

/// What else each module may use. A module that is not here is refused, so that a new one gets its place on purpose.
const FLOW: [(&str, &[&str]); 18] = [
    // Contracts know the tasks, because states and conditions depend on them.
    ("state", &["tasks"]),
    ("scene", &["tasks"]),
    ("demo", &["tasks"]),
    ("tasks", &[]),
    ("robot", &[]),
    ("nn", &[]),
    ("config", &["nn", "tasks"]),
    ("plan", &["robot", "tasks"]),
    ("sim", &["plan", "robot", "tasks"]),
    ("data", &["robot", "tasks"]),
    ("learn", &["nn", "robot", "tasks"]),
    ("eval", &["learn", "sim", "tasks"]),
    ("report", &["data", "robot", "tasks"]),
    ("cmd", &["data", "eval", "learn", "plan", "report", "robot", "sim", "tasks"]),
    ("error", &[]),
    ("seed", &[]),
    ("math", &[]),
    ("interrupt", &[]),
];

fn sources(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).expect("the source directory is readable") {
        let path = entry.expect("an entry of the source directory is readable").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The names that follow `crate::` in a text, groups in braces included (`use crate::{a::b, c}`).
fn used_modules(text: &str) -> Vec<String> {
    let code: String = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut names = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        if at > 0 && code[..at].ends_with('$') {
            continue;
        }
        let rest = &code[at + "crate::".len()..];
        let identifier = |s: &str| s.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        if !rest.starts_with('{') {
            names.push(identifier(rest));
            continue;
        }
        let mut depth = 0;
        let mut start = 1;
        for (i, c) in rest.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if (c == ',' && depth == 1) || depth == 0 {
                names.push(identifier(&rest[start..i]));
                start = i + 1;
            }
            if depth == 0 {
                break;
            }
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

fn module_of(path: &Path, root: &Path) -> String {
    let first = path.strip_prefix(root).expect("sources lie below the root").components().next().expect("a source has a name");
    first.as_os_str().to_string_lossy().trim_end_matches(".rs").to_string()
}

#[test]
fn modules_import_only_from_their_left() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let flow: BTreeMap<&str, &[&str]> = FLOW.into_iter().collect();
    let mut wrong = Vec::new();
    for file in &files {
        let module = module_of(file, &root);
        if module == "lib" || module == "main" {
            continue;
        }
        let text = fs::read_to_string(file).expect("a source is readable");
        for used in used_modules(&text) {
            let own = used == module;
            let common = EVERYWHERE.contains(&used.as_str());
            let allowed = flow.get(module.as_str()).is_some_and(|list| list.contains(&used.as_str()));
            let known = EVERYWHERE.contains(&used.as_str()) || flow.contains_key(used.as_str());
            if known && !own && !common && !allowed {
                wrong.push(format!("{} uses crate::{used}", file.strip_prefix(&root).expect("below the root").display()));
            }
        }
        if !flow.contains_key(module.as_str()) && !EVERYWHERE.contains(&module.as_str()) {
            wrong.push(format!("module {module} has no place in the flow: add it to FLOW"));
        }
    }
    assert!(wrong.is_empty(), "imports against the flow:\n{}", wrong.join("\n"));
}

#[test]
fn only_their_homes_know_the_big_crates() {
    let homes: [(&str, &[&str]); 8] = [
        // Normal numbers differ in the last digit by processor unless `seed` draws them.
        ("rand_distr", &["seed"]),
        ("rapier3d", &["sim"]),
        ("mcap", &["data"]),
        ("arrow_array", &["data"]),
        ("parquet", &["data"]),
        ("safetensors", &["data"]),
        ("clap", &["cmd", "main"]),
        ("indicatif", &["cmd"]),
    ];
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    for file in &files {
        let module = module_of(file, &root);
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

#[test]
fn the_reader_of_use_lines_sees_groups_and_paths() {
    let text = "use crate::{error::{Error, Result}, sim};\n// use crate::data;\nfn f() { crate::nn::run() }\n";
    assert_eq!(used_modules(text), ["error", "sim", "nn"]);
}
