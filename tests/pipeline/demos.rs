//! How many demos a dataset holds.

use crate::runs::{Run, hilt};
use hilt::data::dataset;

#[test]
fn convert_takes_as_many_demos_as_asked_for_and_says_when_there_are_fewer() {
    let run = Run::finished();
    let demos = |wanted: &str| {
        let set = ["--set".to_string(), format!("convert.demos={wanted}")];
        let output = hilt(run.words("convert").into_iter().chain(set).collect());
        assert!(matches!(output.status.code(), Some(0 | 3)), "{output:?}");
        let read = |part: &str| dataset::read(&run.at("dataset").join(part)).expect("a dataset").demos.len();
        (read("train") + read("validation"), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(demos("3").0, 3);
    let (all, words) = demos("100");
    assert_eq!(all, 4);
    assert!(words.contains("4 demos where 100 are wanted") && words.contains("plan.episodes"), "{words}");
}
