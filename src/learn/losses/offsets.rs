//! How far what the policy sees while it learns from demos is off (`[train.randomise]`).

use crate::config::RandomiseSettings;
use crate::error::{Error, Result};
use crate::layout::{POINT_DIM, POSE_DIM};
use crate::learn::models::Features;
use crate::nn::Panels;
use crate::seed::normal;
use rand::Rng;
use std::ops::Range;

/// Normal numbers to be added to some of the policy's inputs.
pub struct Offsets {
    /// The inputs, each with the standard deviation in its own unit.
    inputs: Vec<(usize, f32)>,
    /// Those of the last draw, rows x inputs.
    drawn: Vec<f32>,
}

impl Offsets {
    /// For a policy with these features, none drawn yet.
    ///
    /// # Errors
    /// [`Error::Usage`] when there is nothing of what is to be off.
    pub fn new(settings: &RandomiseSettings, features: &Features) -> Result<Self> {
        let layout = features.layout();
        let fingers = layout.fingers().map(|joint| layout.positions().start + joint).collect::<Vec<_>>();
        let turns = layout.objects().flat_map(|(_, at)| at + POINT_DIM..at + POSE_DIM).collect::<Vec<_>>();
        for (key, value, entries) in
            [("fingers_rad", settings.fingers_rad, &fingers), ("objects_rad", settings.objects_rad, &turns)]
        {
            if value > 0.0 && entries.is_empty() {
                let what = format!("train.randomise.{key} is {value}, but what the demos hold names none");
                return Err(Error::Usage(format!("{what}: set it to 0, or learn from demos of hilt's own layout")));
            }
        }
        let rad = |i: &usize| (*i, settings.fingers_rad as f32 * layout.state_unit(*i).unwrap_or(1.0));
        // A small turn moves a unit quaternion by half its angle; what it adds along the quaternion itself is of no account.
        let turned = |i: &usize| (*i, settings.objects_rad as f32 / 2.0);
        let all = fingers.iter().map(rad).chain(turns.iter().map(turned)).filter(|(_, std)| *std > 0.0);
        let place = |entry: usize| features.kept().iter().position(|kept| *kept == entry);
        let unit = |entry: usize| features.state_scaling().std[entry];
        Ok(Offsets { inputs: all.filter_map(|(i, std)| Some((place(i)?, std / unit(i)))).collect(), drawn: Vec::new() })
    }

    /// Draws those of `rows` states.
    pub fn draw(&mut self, rows: usize, rng: &mut impl Rng) -> &Self {
        self.drawn.clear();
        let deviations = (0..rows).flat_map(|_| &self.inputs);
        self.drawn.extend(deviations.map(|(_, std)| std * normal(rng) as f32));
        self
    }

    /// Adds those of some rows of the last draw to their inputs, the first of which is in the first lane.
    pub fn add(&self, rows: Range<usize>, to: &mut Panels) {
        let width = self.inputs.len();
        if width == 0 {
            return;
        }
        for (slot, drawn) in self.drawn[rows.start * width..rows.end * width].chunks(width).enumerate() {
            for ((input, _), offset) in self.inputs.iter().zip(drawn) {
                to.set(slot, *input, to.get(slot, *input) + offset);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::FeatureSet;
    use crate::layout::Layout;
    use crate::learn::models::{Corpus, Scaling};
    use crate::learn::tests::testing::{Toy, demo};
    use crate::seed::stream;

    #[test]
    fn only_fingers_and_the_turns_of_what_moves_are_off_and_by_as_much_as_is_asked_for() {
        let corpus = Corpus::new(&[demo(Toy::Stack, 400, 1)], "training").expect("a demo");
        let features = Features::fit(&corpus, FeatureSet::FkNear, true);
        let settings = RandomiseSettings { fingers_rad: 0.1, objects_rad: 0.06 };
        let mut offsets = Offsets::new(&settings, &features).expect("fingers and a block");
        let rows: Vec<usize> = (0..corpus.rows()).collect();
        let inputs = |offsets: Option<&Offsets>| {
            let mut panels = Panels::default();
            panels.grow(features.width(), crate::nn::panels_of(rows.len()));
            features.write_transitions(&corpus, rows.len(), |i| rows[i], &mut panels);
            offsets.inspect(|offsets| offsets.add(0..rows.len(), &mut panels));
            panels
        };
        let (plain, off) = (inputs(None), inputs(Some(offsets.draw(rows.len(), &mut stream(0, "test", 0)))));
        let spread = |input: usize| {
            let sum: f32 = (0..rows.len()).map(|r| (off.get(r, input) - plain.get(r, input)).powi(2)).sum();
            (sum / rows.len() as f32).sqrt()
        };
        let unit = &features.state_scaling().std;
        for (input, (entry, name)) in features.kept().iter().zip(features.names()).enumerate() {
            let expected = match name.as_str() {
                _ if corpus.layout.fingers().any(|joint| joint == *entry) => 0.1 / unit[*entry],
                "block.3" | "block.4" | "block.5" | "block.6" => 0.03 / unit[*entry],
                _ => 0.0,
            };
            assert!((spread(input) - expected).abs() <= 0.15 * expected, "{name}: {} against {expected}", spread(input));
        }
        let derived = features.kept().len()..features.width();
        assert!(derived.clone().count() > 0 && derived.into_iter().all(|input| spread(input) == 0.0));
    }

    #[test]
    fn nothing_is_drawn_where_nothing_is_off() {
        let corpus = Corpus::new(&[demo(Toy::Stack, 20, 1)], "training").expect("a demo");
        let features = Features::fit(&corpus, FeatureSet::Raw, false);
        let (mut offsets, mut rng) =
            (Offsets::new(&RandomiseSettings::default(), &features).expect("nothing"), stream(0, "test", 0));
        offsets.draw(20, &mut rng);
        assert_eq!(rng, stream(0, "test", 0));
    }

    #[test]
    fn what_the_demos_do_not_have_cannot_be_off() {
        let layout = Layout { state: vec![], action: vec![], aims: vec![], arm: None, ..(*Toy::Stack.layout()).clone() };
        let features = Features::from_scaling(&layout.into(), FeatureSet::Raw, false, Scaling::default(), Scaling::default());
        let settings = RandomiseSettings { fingers_rad: 0.1, objects_rad: 0.0 };
        let said = Offsets::new(&settings, &features).err().expect("refused").to_string();
        assert!(said.contains("train.randomise.fingers_rad is 0.1, but what the demos hold names none: set it to 0"), "{said}");
    }
}
