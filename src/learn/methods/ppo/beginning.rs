//! Networks and worlds before the first iteration.

use super::episodes::Episodes;
use super::group::{Group, Record};
use super::objective::Work;
use super::statistics::{Sight, Statistics};
use super::{Ppo, sums_for};
use crate::config::TrainSettings;
use crate::env::Env;
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::learn::limits::affordable;
use crate::learn::models::{Policy, Scaling};
use crate::math::ln;
use crate::nn::{Adam, LANES, Mlp};
use crate::seed::stream;
use rand::Rng;
use std::sync::Arc;

/// The last layer of the policy starts this small: the first actions are noise around standing still.
const FIRST_ACTIONS: f32 = 0.01;
/// The random stream of the weights.
const INIT: &str = "train.ppo.init";

impl Ppo {
    /// Networks, and worlds at the beginning of their first episodes; `make` gives a world whose episodes are cut off after so many steps.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range, [`Error::Failed`] when a world is of another layout, or the layout does not say how large an
    /// action may be; what a first episode returns.
    pub fn new(
        layout: &Arc<Layout>,
        settings: &TrainSettings,
        seed: u64,
        make: impl Fn(u32) -> Result<Box<dyn Env>>,
    ) -> Result<Self> {
        check_settings(settings)?;
        let (dim, limits) = (layout.action_dim(), &layout.action_limits);
        if limits.len() != dim {
            return Err(Error::Failed(format!("{} does not say how large its actions may be, which PPO explores", layout.name)));
        }
        let ppo = &settings.ppo;
        let sight = Sight { layout: Arc::clone(layout), set: settings.features, mask_dq: settings.mask_dq };
        let std = limits.iter().map(|limit| (ppo.action_unit * limit) as f32).collect();
        let action = Scaling { mean: vec![0.0; dim], std };
        let statistics = Statistics::new(&sight);
        let mut rng = stream(seed, INIT, 0);
        let mut policy = Policy::with_scalings(statistics.features(&sight), action, ppo.horizon_steps, settings, &mut rng);
        policy.log_std.fill(ln(ppo.initial_std.max(settings.std_floor)) as f32);
        let (weights, biases) = policy.net.layer_ranges(policy.net.layers() - 1);
        policy.net.params_mut()[weights.start..biases.end].iter_mut().for_each(|w| *w *= FIRST_ACTIONS);
        let mut learning = Self::of(policy, settings, seed, &mut rng, make)?;
        learning.statistics = Some(statistics);
        learning.see_first();
        Ok(learning)
    }

    /// The same for a policy that learns elsewhere first: its horizon and the scalings of its inputs stay, and with them what it does.
    ///
    /// # Errors
    /// As [`Ppo::new`].
    pub fn going_on(
        policy: Policy,
        settings: &TrainSettings,
        seed: u64,
        make: impl Fn(u32) -> Result<Box<dyn Env>>,
    ) -> Result<Self> {
        check_settings(settings)?;
        Self::of(policy, settings, seed, &mut stream(seed, INIT, 0), make)
    }

    fn of(
        policy: Policy,
        settings: &TrainSettings,
        seed: u64,
        rng: &mut impl Rng,
        make: impl Fn(u32) -> Result<Box<dyn Env>>,
    ) -> Result<Self> {
        let ppo = settings.ppo.clone();
        let mut widths = policy.net.widths().to_vec();
        widths[settings.hidden_layers + 1] = 1;
        let value = Mlp::new(&widths, settings.activation, rng);
        Ok(Ppo {
            records: (0..ppo.worlds / LANES).map(|_| Record::default()).collect(),
            groups: worlds_in_groups(policy.layout(), ppo.worlds, || make(policy.horizon_steps()))?,
            policy_adam: Adam::new(policy.net.params().len()),
            std_adam: Adam::new(policy.log_std.len()),
            value_adam: Adam::new(value.params().len()),
            std_floor: settings.std_floor,
            settings: ppo,
            seed,
            sight: Sight { layout: Arc::clone(policy.layout()), set: settings.features, mask_dq: settings.mask_dq },
            statistics: None,
            policy,
            value,
            iteration: 0,
            updates: 0,
            work: Work::default(),
        })
    }

    /// Takes these weights, and this standard deviation of the actions in the policy's units.
    pub fn take_up(&mut self, weights: &Policy, std: f64) {
        self.policy.net.params_mut().copy_from_slice(weights.net.params());
        self.policy.log_std.fill(ln(std.max(self.std_floor)) as f32);
    }

    /// The first observations of all worlds are the first statistics.
    fn see_first(&mut self) {
        for (group, record) in self.groups.iter_mut().zip(&mut self.records) {
            record.sums = sums_for(&self.statistics);
            group.first_sight(&self.policy, record);
        }
        self.take_in();
    }
}

fn check_settings(settings: &TrainSettings) -> Result<()> {
    settings.validate()?;
    let keys = "train.ppo.minibatch or train.hidden_units";
    affordable(settings.ppo.minibatch, settings.hidden_layers, settings.hidden_units, keys)
}

fn worlds_in_groups(layout: &Layout, worlds: usize, make: impl Fn() -> Result<Box<dyn Env>>) -> Result<Vec<Group>> {
    let world = |place: usize| {
        let env = make()?;
        let (seen, asked) = (env.observation_len(), env.action_len());
        let (sees, gives, name) = (layout.state_dim(), layout.action_dim(), &layout.name);
        if (seen, asked) != (sees, gives) {
            return Err(Error::Failed(format!(
                "a world shows {seen} numbers and takes {asked}, but a policy of {name} sees {sees} and gives {gives}"
            )));
        }
        Episodes::new(env, place as u64, worlds as u64)
    };
    let groups = (0..worlds).step_by(LANES);
    groups.map(|first| Ok(Group::new((first..first + LANES).map(world).collect::<Result<_>>()?))).collect()
}
