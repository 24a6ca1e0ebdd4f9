//! Experiments that cannot be: refused before anything is made.

use crate::sweep::{Sweep, TINY};

#[test]
fn a_wrong_file_is_refused_with_what_is_meant() {
    let variation = "[[variation]]\nname = \"plain\"\n";
    let again = "[[variation]]\nname = \"same\"\n\n[[variation]]\nname = \"plain\"\n";
    let cases: [(&str, &str, &[&str]); 21] = [
        ("[\"hil\", \"bc\"]", "[\"hil\", \"bv\"]", &["unknown method \"bv\"; did you mean bc?"]),
        ("[\"pick-up\"]", "[\"pick_up\"]", &["unknown task \"pick_up\"; did you mean pick-up?"]),
        ("seeds =", "sedes =", &["unknown key \"sedes\"; did you mean seeds?"]),
        ("[11, 12]", "[]", &["seeds are empty"]),
        ("[11, 12]", "0", &["seeds", "such as \"0-4,9\", or a list"]),
        ("[11, 12]", "[11, 11]", &["seed 11 is there twice"]),
        ("[11, 12]", "\"0-99999999\"", &["seeds 0-99999999 are more than"]),
        ("[11, 12]", "\"4-2\"", &["seeds 4-2", "lower end"]),
        ("[\"hil\", \"bc\"]", "[]", &["methods are empty"]),
        ("train.rho=0.6", "train.roh=0.6", &["variation \"rho-0.6\"", "unknown key train.roh", "train.rho"]),
        ("train.rho=0.6", "train.rho=6", &["variation \"rho-0.6\"", "train.rho"]),
        ("methods = [\"hil\"]\n", "", &["changes nothing of method bc"]),
        ("methods = [\"hil\"]\n", "methods = [\"sc\"]\n", &["method sc is none of the experiment's"]),
        ("episodes = 2", "episodes = 2\nmethod_set = { bv = [] }", &["method_set: unknown method \"bv\"; did you mean bc?"]),
        (
            "episodes = 2",
            "episodes = 2\nmethod_set = { bc = [\"train.rho=1\"] }",
            &["\"train.rho=1\" changes nothing of method bc"],
        ),
        (
            "methods = [\"hil\"]\n",
            "methods = [\"hil\"]\nmethod_set.hil = [\"plan.episodes=3\"]\n",
            &["method_set: \"plan.episodes=3\" of hil; allowed: settings of train"],
        ),
        (variation, "[[variation]]\nname = \"rho-0.6\"\n", &["variations: \"rho-0.6\" is there twice"]),
        (variation, again, &["variations \"same\" and \"plain\" come to the same settings of pick-up, hil"]),
        (variation, "[[variation]]\nname = \"../up\"\n", &["\"../up\" is no name of a directory"]),
        ("episodes = 2", "episodes = 2\npresets = [\"besst\"]", &["unknown preset \"besst\"; did you mean best?"]),
        ("episodes = 2", "episodes = 2\ndataset = \"nowhere/{task}\"", &["nowhere/pick-up/train: does not exist"]),
    ];
    for (from, to, says) in cases {
        assert!(TINY.contains(from), "{from}");
        Sweep::new(&TINY.replacen(from, to, 1)).refuses(&[], says);
    }
    Sweep::new("tasks = [").refuses(&[], &["tiny.toml: not valid TOML"]);
    Sweep::new("").refuses(&[], &["tiny.toml", "missing field `tasks`"]);
}

#[test]
fn a_wrong_command_line_is_refused() {
    let sweep = Sweep::new(TINY);
    sweep.refuses(&["--seeds", "a"], &["seeds \"a\" are no list of numbers"]);
    sweep.refuses(&["--jobs", "0"], &["0"]);
    sweep.refuses(&["--dir", "tiny.toml"], &["is a file"]);
    std::fs::write(sweep.at("notes.txt"), "my own").expect("written");
    sweep.refuses(&["--emit", "snakemake", "--out", "notes.txt"], &["notes.txt: was not made by hilt experiment"]);
}
