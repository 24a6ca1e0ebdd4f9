//! Words for people: the name that a mistyped one was meant to be, and long values cut short.

/// A name is near when it differs in at most this share of its letters, and in one letter at least.
const NEAR: f64 = 0.4;
/// A longer word is no slip of the finger, and takes long to compare.
const LONGEST_WORD: usize = 64;
/// Letters of a value that are shown in an error.
const SHOWN: usize = 80;

/// How many letters two names differ in, whatever the case.
pub fn distance(a: &str, b: &str) -> usize {
    strsim::damerau_levenshtein(&a.to_lowercase(), &b.to_lowercase())
}

/// Whether a name of `letters` letters may have been meant when `distance` of them are wrong.
pub fn near(distance: usize, letters: usize) -> bool {
    distance as f64 <= (NEAR * letters as f64).max(1.0)
}

/// The one of `known` that `word` was meant to be, if one is near.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if word.len() > LONGEST_WORD {
        return None;
    }
    let best = known.into_iter().map(|name| (distance(word, name), name)).min_by_key(|(distance, _)| *distance)?;
    near(best.0, best.1.len()).then_some(best.1)
}

/// `; did you mean stack?`, or nothing.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, known).map_or(String::new(), |name| format!("; did you mean {name}?"))
}

/// The refusal of a name that is none of `known`: `unknown task "stak"; did you mean stack? allowed: pick-up, pick-and-place, stack`.
pub fn unknown(what: &str, word: &str, known: &[&str]) -> String {
    let (hint, allowed) = (did_you_mean(word, known.iter().copied()), known.join(", "));
    let sign = if hint.is_empty() { ";" } else { "" };
    format!("unknown {what} \"{}\"{hint}{sign} allowed: {allowed}", shown(word))
}

/// A value as an error shows it: whole, or its beginning and its length.
pub fn shown(value: &str) -> String {
    match value.char_indices().nth(SHOWN) {
        None => value.into(),
        Some((end, _)) => format!("{}... ({} characters)", &value[..end], value.chars().count()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_offered_whatever_the_case_and_far_ones_are_not() {
        let tasks = ["pick-up", "pick-and-place", "stack"];
        assert_eq!(nearest("stak", tasks), Some("stack"));
        assert_eq!(nearest("Pick_Up", tasks), Some("pick-up"));
        assert_eq!(nearest("juggle", tasks), None);
        assert_eq!(nearest("bv", ["hil", "bc", "sc"]), Some("bc"));
        assert_eq!(nearest(&"s".repeat(100_000), tasks), None);
        assert_eq!(nearest("", tasks), None);
    }

    #[test]
    fn long_values_are_cut() {
        assert_eq!(shown("0.5"), "0.5");
        assert_eq!(shown(&"é".repeat(100_000)), format!("{}... (100000 characters)", "é".repeat(80)));
    }
}
