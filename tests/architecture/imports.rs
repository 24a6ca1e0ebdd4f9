//! Reads the sources: which file imports which, through re-exports, groups and paths in the code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A module's place: `["nn", "kernel"]`.
pub type Module = Vec<String>;

/// All modules below `src` but the two roots, with what each imports of the others.
pub struct Imports {
    files: BTreeMap<Module, PathBuf>,
    /// Where a name that a module hands on comes from.
    reexports: BTreeMap<(Module, String), Module>,
    /// Importer and imported.
    pub edges: BTreeMap<Module, BTreeSet<Module>>,
}

pub fn sources(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).expect("the source directory is readable") {
        let path = entry.expect("an entry of the source directory is readable").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The module of a file.
pub fn module_of(path: &Path, root: &Path) -> Module {
    let below = path.strip_prefix(root).expect("sources lie below the root").with_extension("");
    let mut names: Module = below.iter().map(|name| name.to_string_lossy().into_owned()).collect();
    names.pop_if(|last| last == "mod");
    names
}

/// The code of a file, without comments and without its tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source is readable");
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    let code = lines.collect::<Vec<_>>().join("\n");
    code.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().to_string()
}

/// The paths of a tree of imports: `a::{b, c::{self, d}}` has three.
fn expand(tree: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    let (mut depth, mut start) = (0, 0);
    let ends = tree.char_indices().chain([(tree.len(), ',')]);
    for (at, c) in ends {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if c != ',' || depth > 0 {
            continue;
        }
        let part = tree[start..at].trim();
        start = (at + 1).min(tree.len());
        let (head, rest) = part.split_once('{').unwrap_or((part, ""));
        let head = head.split(" as ").next().unwrap_or_default();
        let head: Vec<String> = head.split("::").map(str::trim).filter(|n| !n.is_empty()).map(String::from).collect();
        if !part.contains('{') {
            paths.extend((!head.is_empty()).then_some(head));
            continue;
        }
        let inner = &rest[..rest.rfind('}').unwrap_or(rest.len())];
        paths.extend(expand(inner).into_iter().map(|path| [head.clone(), path].concat()));
    }
    paths
}

/// The statements that import, each whether it hands on, and its tree; and the code without them.
fn statements(code: &str) -> (Vec<(bool, &str)>, String) {
    let (mut found, mut rest, mut done) = (Vec::new(), String::new(), 0);
    for (at, _) in code.match_indices("use ") {
        let before = code[code[..at].rfind('\n').map_or(0, |n| n + 1)..at].trim();
        if at < done || !(before.is_empty() || before.starts_with("pub")) {
            continue;
        }
        let end = code[at..].find(';').map_or(code.len(), |n| at + n);
        found.push((before.starts_with("pub"), &code[at + "use ".len()..end]));
        rest.push_str(&code[done..at]);
        done = end;
    }
    rest.push_str(&code[done..]);
    (found, rest)
}

/// The paths in the code itself: `super::kernel::choose`, `tiles::product`.
fn paths_in(code: &str) -> Vec<Vec<String>> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let words = code.split(|c| !is_name(c)).filter(|word| word.contains("::"));
    words.map(|word| word.split("::").filter(|n| !n.is_empty()).map(String::from).collect()).collect()
}

impl Imports {
    /// Of all sources below `root`.
    pub fn read(root: &Path) -> Imports {
        let mut paths = Vec::new();
        sources(root, &mut paths);
        let files: BTreeMap<Module, PathBuf> = paths.into_iter().map(|path| (module_of(&path, root), path)).collect();
        let mut imports = Imports { files, reexports: BTreeMap::new(), edges: BTreeMap::new() };
        imports.files.retain(|module, _| *module != ["lib"]);
        let codes: Vec<(Module, String)> = imports.files.iter().map(|(module, path)| (module.clone(), code(path))).collect();
        for (module, code) in &codes {
            let handed_on = statements(code).0.into_iter().filter(|(hands_on, _)| *hands_on);
            for path in handed_on.flat_map(|(_, tree)| expand(tree)) {
                if let (Some(from), Some(name)) = (imports.absolute(module, &path), path.last()) {
                    imports.reexports.insert((module.clone(), name.clone()), from);
                }
            }
        }
        for (module, code) in &codes {
            let (imported, rest) = statements(code);
            // What a module hands on of its own children is no import; of another room it is.
            let is_own = |path: &Vec<String>| imports.absolute(module, path).is_none_or(|to| to.first() == module.first());
            let trees = |(hands_on, tree): (bool, &str)| {
                let paths = expand(tree).into_iter();
                paths.filter(|path| !(hands_on && is_own(path))).collect::<Vec<_>>()
            };
            let known: Vec<Vec<String>> = imported.into_iter().flat_map(trees).chain(paths_in(&rest)).collect();
            let homes = known.iter().filter_map(|path| imports.home(imports.absolute(module, path)?, 0));
            let edges = homes.filter(|home| home != module).collect();
            imports.edges.insert(module.clone(), edges);
        }
        imports
    }

    /// A path as it is from the crate's root; `None` for what is none of this crate's.
    fn absolute(&self, module: &Module, path: &[String]) -> Option<Module> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            // The binary sees the library from outside.
            "hilt" if *module == ["main"] => Some(path[1..].to_vec()),
            "self" => Some([module, &path[1..]].concat()),
            "super" => Some([&module[..module.len().checked_sub(ups)?], &path[ups..]].concat()),
            first => self.files.contains_key(&[module.as_slice(), &[first.into()]].concat()).then(|| [module, path].concat()),
        }
    }

    /// The file that an absolute path leads to, through what modules hand on.
    fn home(&self, path: Module, hops: usize) -> Option<Module> {
        let module = (1..=path.len()).rev().map(|n| &path[..n]).find(|module| self.files.contains_key(*module))?;
        match path.get(module.len()).and_then(|name| self.reexports.get(&(module.to_vec(), name.clone()))) {
            Some(from) if hops < 9 => self.home([from, &path[module.len() + 1..]].concat(), hops + 1),
            _ => Some(module.to_vec()),
        }
    }

    /// Files that import each other, directly or by way of others; empty when there are none.
    pub fn circle(&self) -> Vec<Module> {
        let mut left = self.edges.clone();
        loop {
            // what imports nothing that is left is in no circle
            let done: Vec<Module> =
                left.iter().filter(|(_, to)| !to.iter().any(|m| left.contains_key(m))).map(|(m, _)| m.clone()).collect();
            if done.is_empty() {
                return left.into_keys().collect();
            }
            done.iter().for_each(|module| drop(left.remove(module)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_and_names_of_names_are_seen() {
        let paths = expand("crate::{error::{self, Result}, sim, nn::Mlp as Net}");
        let joined: Vec<String> = paths.iter().map(|path| path.join("::")).collect();
        assert_eq!(joined, ["crate::error::self", "crate::error::Result", "crate::sim", "crate::nn::Mlp"]);
    }

    #[test]
    fn a_circle_through_a_name_that_is_handed_on_is_found() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let write = |name: &str, text: &str| {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().expect("a parent")).expect("created");
            fs::write(path, text).expect("written");
        };
        write("lib.rs", "pub mod a;\npub mod b;\n");
        write("a/mod.rs", "mod deep;\npub use deep::Deep;\n");
        write("a/deep.rs", "// use crate::c;\npub struct Deep;\n");
        write("b.rs", "use crate::a::Deep;\nfn f() { crate::a::deep::g(); }\n");
        let read = || Imports::read(dir.path());
        assert_eq!(read().edges[&vec!["b".to_string()]], BTreeSet::from([vec!["a".into(), "deep".into()]]));
        assert_eq!(read().circle(), [] as [Module; 0]);
        write("a/deep.rs", "pub struct Deep;\nfn g() { crate::b::f() }\n");
        assert_eq!(read().circle(), [vec!["a".to_string(), "deep".into()], vec!["b".into()]]);
    }
}
