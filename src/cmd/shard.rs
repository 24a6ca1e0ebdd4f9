//! A share of a stage's work, for one of several machines.

use std::str::FromStr;

/// One of several equal shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shard {
    /// From 1.
    number: u64,
    of: u64,
}

impl Shard {
    /// Whether a piece of work is in this share.
    pub fn takes(self, piece: u64) -> bool {
        piece % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |digits: &str| digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok()).flatten();
        let numbers = text.split_once('/').and_then(|(number_, of)| Some((number(number_)?, number(of)?)));
        match numbers {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Shard { number, of }),
            _ => Err("it must be I/N, share I of N with I from 1 to N, for example 2/8".into()),
        }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_in_one_shard() {
        let shards: Vec<Shard> = (1..=3).map(|i| format!("{i}/3").parse().expect("a shard")).collect();
        assert!((0..10).all(|piece| shards.iter().filter(|shard| shard.takes(piece)).count() == 1));
        assert_eq!(shards[1].to_string(), "2/3");
        for text in ["0/3", "4/3", "3", "1/0", "0/0", "a/b", "1/", "/3", "-1/3", "+1/3", "1/3/5", "1.0/3", " 1/3", ""] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
