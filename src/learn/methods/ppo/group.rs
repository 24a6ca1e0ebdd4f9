//! Eight worlds share a panel, and act for an iteration without asking anyone else.

use super::advantage::{Credit, advantages};
use super::episodes::{Episodes, Finished};
use super::statistics::{Sums, look};
use crate::env::End;
use crate::error::Result;
use crate::learn::models::Policy;
use crate::math::exp_f32;
use crate::nn::{LANES, Lanes, Mlp, Panels, Pass, kernel, panels_of};
use crate::seed::{normal, stream};
use rand::Rng;
use std::array::from_fn;

/// Who acts, and who says what a state is worth.
#[derive(Clone, Copy)]
pub struct Actors<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// The value network: of the same inputs, in units of [`Credit::value_unit`].
    pub value: &'a Mlp,
    /// How rewards become advantages.
    pub credit: Credit,
    /// The run's seed.
    pub seed: u64,
    /// Number of the iteration.
    pub iteration: u64,
    /// Steps of each world.
    pub steps: usize,
}

/// What eight worlds have brought in an iteration: panel t holds their step t.
#[derive(Default)]
pub struct Record {
    /// Inputs of the networks; one panel more than steps.
    pub inputs: Panels,
    /// Actions, in the policy's units.
    pub actions: Panels,
    /// Logarithm of the density of each action, up to a constant.
    pub log_prob: Vec<Lanes>,
    /// Advantages.
    pub advantages: Vec<Lanes>,
    /// What the value network should have said, in its units.
    pub returns: Vec<Lanes>,
    /// What the value network said, in its units; one panel more than steps.
    pub values: Vec<Lanes>,
    /// Statistics of the states.
    pub sums: Sums,
    /// Episodes that ended.
    pub finished: Vec<Finished>,
}

/// The worlds, and what they need to act.
#[derive(Default)]
pub struct Group {
    /// The worlds, one a lane.
    pub worlds: Vec<Episodes>,
    rewards: Vec<Lanes>,
    ends: Vec<[Option<End>; LANES]>,
    /// Step and lane of the ends of episodes that were cut off, and their last observations.
    cut: Vec<(usize, usize)>,
    cut_off: Vec<f32>,
    state: Vec<Lanes>,
    sigma: Vec<f32>,
    /// Of one world: standard normal numbers, and the action that they make, in the policy's units and in those of the layout.
    eps: Vec<f32>,
    action: Vec<f32>,
    command: Vec<f32>,
    pass: Pass,
    value_pass: Pass,
}

impl Group {
    /// Of eight worlds.
    pub fn new(worlds: Vec<Episodes>) -> Self {
        Group { worlds, ..Group::default() }
    }

    /// Statistics of what the worlds show first, filled into `record.sums`.
    pub fn first_sight(&mut self, policy: &Policy, record: &mut Record) {
        record.inputs.grow(policy.features().width(), 1);
        self.see(policy, 0, LANES, record);
    }

    /// All worlds act for `actors.steps` steps; then their steps are judged. `record.sums` are to be fresh.
    ///
    /// # Errors
    /// What a new episode or `check` returns.
    pub fn act(&mut self, actors: &Actors, check: &(dyn Fn() -> Result<()> + Sync), record: &mut Record) -> Result<()> {
        self.begin(actors, record);
        let mut noise = from_fn::<_, LANES, _>(|lane| {
            let world = &self.worlds[lane];
            stream(actors.seed, "train.ppo.action", actors.iteration * world.worlds + world.place)
        });
        let (net, unit) = (&actors.policy.net, actors.policy.action_scaling());
        self.sigma.clear();
        self.sigma.extend(actors.policy.log_std.iter().map(|log_std| exp_f32(*log_std)));
        let log_sigma: f32 = actors.policy.log_std.iter().sum();
        for t in 0..actors.steps {
            check()?;
            self.see(actors.policy, t, LANES, record);
            self.pass.input.panel_mut(0).copy_from_slice(record.inputs.panel(t));
            net.forward(&mut self.pass, 0..1);
            for (lane, rng) in noise.iter_mut().enumerate() {
                self.draw(lane, rng);
                self.command.clear();
                self.command.extend(self.action.iter().enumerate().map(|(i, action)| unit.undo(i, *action)));
                record.actions.write_row(t * LANES + lane, &self.action);
                record.log_prob[t].0[lane] = -0.5 * self.eps.iter().map(|e| e * e).sum::<f32>() - log_sigma;
                self.step(t, lane, record)?;
            }
        }
        self.see(actors.policy, actors.steps, 0, record);
        self.judge(actors, record);
        Ok(())
    }

    /// The next action of a world.
    fn draw(&mut self, lane: usize, rng: &mut impl Rng) {
        self.eps.clear();
        self.eps.extend(self.sigma.iter().map(|_| normal(rng) as f32));
        let entries = self.sigma.iter().zip(&self.eps).enumerate();
        self.action.clear();
        self.action.extend(entries.map(|(i, (sigma, eps))| self.pass.output.get(lane, i) + sigma * eps));
    }

    fn begin(&mut self, actors: &Actors, record: &mut Record) {
        let steps = actors.steps;
        record.inputs.grow(actors.policy.features().width(), steps + 1);
        record.actions.grow(actors.policy.log_std.len(), steps);
        for lanes in [&mut record.log_prob, &mut record.advantages, &mut record.returns, &mut self.rewards] {
            lanes.resize(steps, Lanes::default());
        }
        record.finished.clear();
        self.ends.resize(steps, [None; LANES]);
        self.pass.grow(&actors.policy.net, 1);
        self.value_pass.grow(actors.value, steps + 1);
        self.cut.clear();
        self.cut_off.clear();
    }

    /// Writes what the policy sees before step `t`; the first `lanes` worlds count in the statistics.
    fn see(&mut self, policy: &Policy, t: usize, lanes: usize, record: &mut Record) {
        self.state.resize(policy.layout().state_dim(), Lanes::default());
        kernel::interleave(&mut self.state, from_fn(|lane| self.worlds[lane].observation.as_slice()));
        look(policy.features(), &self.state, record.inputs.panel_mut(t), &mut record.sums, lanes);
    }

    fn step(&mut self, t: usize, lane: usize, record: &mut Record) -> Result<()> {
        let world = &mut self.worlds[lane];
        let (reward, ended) = world.step(&self.command);
        self.rewards[t].0[lane] = reward;
        self.ends[t][lane] = ended.map(|(end, _)| end);
        let Some((end, finished)) = ended else { return Ok(()) };
        record.finished.push(finished);
        if end == End::Truncated {
            self.cut.push((t, lane));
            self.cut_off.extend(&world.observation);
        }
        world.begin()
    }

    /// Values, advantages and returns of the steps.
    fn judge(&mut self, actors: &Actors, record: &mut Record) {
        let panels = 0..actors.steps + 1;
        self.value_pass.input.span_mut(&panels).copy_from_slice(record.inputs.span(&panels));
        actors.value.forward(&mut self.value_pass, panels.clone());
        record.values.clear();
        record.values.extend_from_slice(self.value_pass.output.span(&panels));
        self.promise(actors);
        let (to, returns) = (&mut record.advantages, &mut record.returns);
        advantages(&record.values, &self.rewards, &self.ends, actors.credit, to, returns);
    }

    /// Adds to the reward of a step that cut an episode off what its last observation promises.
    fn promise(&mut self, actors: &Actors) {
        let rows: Vec<&[f32]> = self.cut_off.chunks_exact(self.state.len()).collect();
        let mut unseen = Sums::default();
        self.value_pass.grow(actors.value, panels_of(rows.len()));
        for (p, rows) in rows.chunks(LANES).enumerate() {
            kernel::interleave(&mut self.state, from_fn(|lane| rows[lane.min(rows.len() - 1)]));
            look(actors.policy.features(), &self.state, self.value_pass.input.panel_mut(p), &mut unseen, 0);
        }
        actors.value.forward(&mut self.value_pass, 0..panels_of(rows.len()));
        for (row, (t, lane)) in self.cut.iter().enumerate() {
            let promised = actors.credit.value_unit() * self.value_pass.output.get(row, 0);
            self.rewards[*t].0[*lane] += actors.credit.gamma * promised;
        }
    }
}
