//! Pairs of episodes, and what is none.

use super::*;
use crate::data::Provenance;
use crate::table::Table;
use std::path::PathBuf;

/// An evaluation whose episodes end with these classes, "" for success.
pub fn evaluated(name: &str, seed: u64, first: i64, ends: &[&str]) -> Evaluated {
    let n = ends.len();
    let solved: Vec<bool> = ends.iter().map(|end| end.is_empty()).collect();
    let steps = (0..n as i64).map(|i| 100 + i * (1 + i64::from(name == "b"))).collect();
    let episodes = Table::default()
        .with("episode", "", Values::I64((first..first + n as i64).collect()))
        .with("success", "", Values::Bool(solved.clone()))
        .with("failure", "", Values::Text(ends.iter().map(|end| end.to_string()).collect()))
        .with("steps", "", Values::I64(steps))
        .with("reward", "", Values::F64(vec![0.0; n]))
        .with("hit_obstacle", "", Values::Bool(vec![false; n]))
        .with("block.x_m", "", Values::F64((first..first + n as i64).map(|i| 0.1 * i as f64 + seed as f64).collect()))
        .with("condition.lifted", "", Values::Bool(solved));
    let made = Provenance::new("evaluate", "lift", json!({ "evaluate": { "episodes": n } }), seed);
    Evaluated { name: name.into(), method: None, path: PathBuf::from(name), made, trained: None, episodes }
}

#[test]
fn episodes_of_the_same_start_are_pairs_and_every_change_is_named() {
    let (a, b) =
        (evaluated("a", 3, 0, &["", "", "dropped", "", "timeout"]), evaluated("b", 3, 0, &["", "dropped", "", "", "dropped"]));
    let found = compare(&a, &b);
    assert_eq!(found.apart, None);
    assert_eq!(found.pairs, Pairs { both: 2, only_first: 1, only_second: 1, neither: 1 });
    assert_eq!((found.only(), found.changes.len()), ([vec![1], vec![2]], 3));
    assert_eq!(found.changes[2], Change { episode: 4, first: "timeout".into(), second: "dropped".into() });
    // Both solved episodes 0 and 3: 100 and 103 steps against 100 and 106, the lower of two is the nearest rank.
    assert_eq!((found.steps[0].p95, found.steps[1].p95), (103, 106));
    assert_eq!(found.conditions, [("lifted".to_string(), [3, 3])]);
    assert_eq!(found.failures["dropped"], [1, 2]);
    assert_eq!((found.difference, found.mcnemar), (0.0, Some(1.0)));
    assert_eq!((found.interval, found.mcnemar), (found.pairs.newcombe_95(), Some(found.pairs.mcnemar_exact())));
    for width in [40, 80, 200] {
        let long: Vec<String> =
            found.to_text(Some(width)).lines().filter(|l| l.chars().count() > width).map(String::from).collect();
        assert_eq!(long, [] as [&str; 0], "at {width}");
    }
}

#[test]
fn fewer_episodes_of_one_are_paired_as_far_as_they_go() {
    let (a, b) = (evaluated("a", 3, 0, &["", "", "dropped"]), evaluated("b", 3, 1, &["", "dropped", "", ""]));
    let found = compare(&a, &b);
    assert_eq!((found.apart.clone(), found.pairs.all()), (None, 2));
}

#[test]
fn others_are_not_paired_and_it_says_why() {
    let a = evaluated("a", 3, 0, &["", "", "dropped", ""]);
    let why = |b: &Evaluated| compare(&a, b).apart.expect("not paired");
    assert_eq!(why(&evaluated("b", 4, 0, &["", ""])), "the seeds of the evaluations are 3 and 4");
    assert_eq!(why(&evaluated("b", 3, 9, &["", ""])), "they have no episode in common");
    let mut moved = evaluated("b", 3, 0, &["", "", "", ""]);
    if let Some(Values::F64(x)) = moved.episodes.columns.iter_mut().find(|c| c.name == "block.x_m").map(|c| &mut c.values) {
        x[2] += 1e-9;
    }
    assert_eq!(why(&moved), "episode 2 begins otherwise: block.x_m is not the same");
    moved.made.task = "place".into();
    assert_eq!(why(&moved), "the tasks are not the same: lift and place");
    let b = evaluated("b", 4, 0, &["dropped", ""]);
    let found = compare(&a, &b);
    assert_eq!((found.interval, found.mcnemar, found.pairs), (newcombe_95((3, 4), (1, 2)), None, Pairs::default()));
    assert!(found.to_text(None).contains("not paired: the seeds of the evaluations are 3 and 4"));
}
