//! The state between two iterations as named arrays and a description, and back. A world is kept as what was done in it since its last
//! reset.

use super::Ppo;
use super::episodes::Episodes;
use super::statistics::Statistics;
use crate::learn::methods::optimizer::{push_adam, read_adam};
use crate::learn::models::{Reader, vector};
use crate::learn::run::past::{MOST_UPDATES, at_most};
use crate::tensor::NamedTensor;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

const POLICY: &str = "policy.net";
const STD: &str = "policy.log_std";
const VALUE: &str = "value.net";
const ACTIONS: &str = "worlds.actions";

/// Where a world stands.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Place {
    /// Episodes that it has begun.
    begun: u64,
    /// Steps of the last.
    steps: usize,
}

impl Ppo {
    /// All that changes from iteration to iteration.
    pub fn save(&self) -> (Vec<NamedTensor>, Value) {
        let mut tensors =
            vec![vector(POLICY, self.policy.net.params()), vector(STD, &self.policy.log_std), vector(VALUE, self.value.params())];
        let adams = [(POLICY, &self.policy_adam), (STD, &self.std_adam), (VALUE, &self.value_adam)];
        adams.iter().for_each(|(name, adam)| push_adam(&mut tensors, name, adam));
        let worlds = || self.groups.iter().flat_map(|group| &group.worlds);
        let actions: Vec<f32> = worlds().flat_map(|world| world.actions.iter().copied()).collect();
        tensors.push(vector(ACTIONS, &actions));
        let places: Vec<Place> = worlds().map(|w| Place { begun: w.begun, steps: w.steps() }).collect();
        let meta = json!({
            "iteration": self.iteration,
            "updates": self.updates,
            "adam_steps": adams.map(|(_, adam)| adam.state().2),
            "statistics": self.statistics,
            "worlds": places,
        });
        (tensors, meta)
    }

    /// Puts a fresh one of the same run into the state that [`Ppo::save`] has returned.
    ///
    /// # Errors
    /// Says what is missing or does not fit, or why an episode cannot begin again. The state is of no use then.
    pub fn restore(&mut self, reader: &Reader) -> Result<(), String> {
        self.restore_numbers(reader)?;
        let (places, actions) = self.places(reader)?;
        let worlds = self.groups.iter_mut().flat_map(|group| &mut group.worlds).collect::<Vec<_>>();
        let (mut rest, dim) = (actions.as_slice(), self.policy.log_std.len());
        let parts = worlds.into_iter().zip(places).map(|(world, place)| {
            let (own, others) = rest.split_at(place.steps * dim);
            rest = others;
            (world, place, own)
        });
        let parts: Vec<_> = parts.collect();
        let replay = |(world, place, own): (&mut Episodes, Place, &[f32])| world.replay(place.begun, own);
        let replayed: Vec<_> = parts.into_par_iter().map(replay).collect();
        replayed.into_iter().collect::<crate::error::Result<()>>().map_err(|why| why.to_string())
    }

    fn restore_numbers(&mut self, reader: &Reader) -> Result<(), String> {
        let [policy, std, value]: [u32; 3] = reader.meta("adam_steps")?;
        let statistics: Option<Statistics> = reader.meta("statistics")?;
        if statistics.is_some() != self.statistics.is_some() || statistics.iter().any(|s| !s.fit(&self.sight)) {
            return Err("its statistics are not those of this task's features".into());
        }
        (self.iteration, self.updates) = (reader.meta("iteration")?, reader.meta("updates")?);
        let len = self.policy.net.params().len();
        self.policy.net.params_mut().copy_from_slice(&reader.tensor(POLICY, &[len])?);
        self.policy_adam = read_adam(reader, POLICY, len, policy)?;
        self.policy.log_std = reader.log_std(STD, self.policy.log_std.len())?;
        self.std_adam = read_adam(reader, STD, self.policy.log_std.len(), std)?;
        let len = self.value.params().len();
        self.value.params_mut().copy_from_slice(&reader.tensor(VALUE, &[len])?);
        self.value_adam = read_adam(reader, VALUE, len, value)?;
        statistics.iter().for_each(|known| self.policy.set_features(known.features(&self.sight)));
        self.statistics = statistics;
        Ok(())
    }

    /// Where the worlds stand, and the actions that led there.
    fn places(&self, reader: &Reader) -> Result<(Vec<Place>, Vec<f32>), String> {
        let places: Vec<Place> = reader.meta("worlds")?;
        if places.len() != self.settings.worlds {
            return Err(format!("it has {} worlds, this run {}", places.len(), self.settings.worlds));
        }
        let most = self.policy.horizon_steps() as usize;
        if let Some(wrong) = places.iter().find(|p| p.begun == 0 || p.steps > most) {
            return Err(format!("a world stands in step {} of episode {}; episodes have {most} steps", wrong.steps, wrong.begun));
        }
        places.iter().try_for_each(|place| at_most("episodes of a world", place.begun, MOST_UPDATES))?;
        let steps: usize = places.iter().map(|p| p.steps).sum();
        let actions = reader.tensor(ACTIONS, &[steps * self.policy.log_std.len()])?;
        Ok((places, actions))
    }
}
