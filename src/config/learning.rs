//! The settings of learning alone, for a dataset that has neither a task of hilt nor a simulator behind it.

use super::load::{extended, put};
use super::pipeline_file::{ROBOT, TASK, lay_over, read_table};
use super::train::MOST_AUTO_UPDATES;
use super::{ConvertSettings, FeatureSet, Pipeline, Preset, PretrainSettings, ProjectFile, Stage, TrainSettings, Updates, check};
use crate::error::{Error, Result};
use crate::task::built_in;
use crate::words::shown;
use std::path::Path;

/// What learning from a dataset of another program reads of a pipeline.
#[derive(Clone, Debug, PartialEq)]
pub struct LearningSettings {
    /// Of which only the split counts.
    pub convert: ConvertSettings,
    /// The dynamics network.
    pub pretrain: PretrainSettings,
    /// The policy.
    pub train: TrainSettings,
    /// Which of [`SIZED`] somebody has set: those stay as they are.
    said: [bool; SIZED.len()],
}

/// What follows the number of demos unless it is set: presets are made for some hundred.
const SIZED: [(&str, &str); 3] = [("pretrain", "batch_rows"), ("train", "warm_start_updates"), ("train", "min_updates")];
/// Passes of a warm start over the demos: over demos of hilt's own the presets make 150 to 380, and with few demos ten times as many teach
/// a policy its demos by heart (docs/notes.md).
const WARM_START_PASSES: u64 = 300;
/// Updates of an epoch of pretraining, for which a batch is smaller where there are few transitions.
const EPOCH_UPDATES: usize = 32;
/// A smaller batch is all noise.
const LEAST_BATCH: usize = 32;

/// Where the rows of a dataset are all that is known: no kinematics, and nothing that runs them again.
const KNOWN: &str = "pretrain.features = \"raw\"\npretrain.structure = \"plain\"\npretrain.reexecute = 0\ntrain.features = \"raw\"\n\
                     train.select_episodes = 0\n";
/// What may be set.
const ALLOWED: &str = "convert.train_per_validation, pretrain.KEY and train.KEY";

impl LearningSettings {
    /// Defaults < `preset`, with features raw and nothing executed again < `file` < `project` < `sets`, as [`Pipeline::load`] has it. What a file says of
    /// a task, a robot and a scene is for another use of it.
    ///
    /// # Errors
    /// As [`Pipeline::load`]; [`Error::Usage`] for what asks for kinematics or a simulator.
    pub fn load(preset: Preset, file: Option<&Path>, project: Option<&ProjectFile>, sets: &[String]) -> Result<Self> {
        let origin = file.map_or_else(|| format!("preset {}", preset.name()), |path| path.display().to_string());
        let mut own = file.map(read_table).transpose()?.unwrap_or_default();
        let base = own.remove("extends").unwrap_or_else(|| preset.name().into());
        // Presets differ by task; that of none is what a preset does for a task that it does not know.
        let mut table = extended(toml::Table::from_iter([("extends".into(), base), (TASK.into(), "".into())]), &origin)?;
        lay_over(&mut table, KNOWN.parse().expect("these lines are TOML"));
        lay_over(&mut own, project.map(|project| project.settings.clone()).unwrap_or_default());
        let set_here = |section: &str, key: &str| {
            let in_sets =
                || sets.iter().any(|set| set.split('=').next().is_some_and(|said| said.trim() == format!("{section}.{key}")));
            own.get(section).is_some_and(|section| section.get(key).is_some()) || in_sets()
        };
        let said = SIZED.map(|(section, key)| set_here(section, key));
        lay_over(&mut table, own);
        table.remove(ROBOT);
        table.remove("scene");
        // Settings are checked as a whole; what is said of this task is not taken over.
        table.insert(TASK.into(), built_in::names()[0].into());
        let mut pipeline = check::resolve(table.clone(), &origin)?;
        for set in sets {
            let origin = format!("--set {}", shown(set));
            let section = set.split(['.', '=']).next().unwrap_or_default().trim();
            if pipeline.to_table()?.contains_key(section) && !["convert", "pretrain", "train"].contains(&section) {
                return Err(Error::Usage(format!("{origin}: a dataset of another program has no {section}; allowed: {ALLOWED}")));
            }
            put(&mut table, set, &origin)?;
            pipeline = check::resolve(table.clone(), &origin)?;
        }
        let Pipeline { convert, pretrain, train, .. } = pipeline;
        let settings = LearningSettings { convert, pretrain, train, said };
        settings.needs_nothing_else()?;
        Ok(settings)
    }

    /// The settings for so many transitions to learn from.
    pub fn sized(mut self, transitions: usize) -> Self {
        let [batch, warm_start, least] = self.said;
        if !batch {
            let fitting = transitions.div_ceil(EPOCH_UPDATES).max(LEAST_BATCH);
            self.pretrain.batch_rows = self.pretrain.batch_rows.min(fitting);
        }
        if !warm_start {
            let most = match self.train.warm_start_updates {
                Updates::Auto => MOST_AUTO_UPDATES,
                Updates::Exactly(updates) => updates,
            };
            let passes = WARM_START_PASSES * self.train.updates_of_a_pass(transitions);
            self.train.warm_start_updates = most.min(passes).into();
        }
        if !least {
            self.train.min_updates = 0;
        }
        self
    }

    /// Refuses what the rows alone cannot give.
    fn needs_nothing_else(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Usage(format!("{what} for a dataset of another program")));
        for (key, set) in [("pretrain.features", self.pretrain.features), ("train.features", self.train.features)] {
            if set != FeatureSet::Raw {
                return refuse(format!("{key} needs the kinematics of a robot, which are not known; it must be \"raw\""));
            }
        }
        for (key, count) in
            [("pretrain.reexecute", self.pretrain.reexecute), ("train.select_episodes", self.train.select_episodes)]
        {
            if count != 0 {
                return refuse(format!("{key} = {count} needs a simulator of the task; it must be 0"));
            }
        }
        Ok(())
    }

    /// The settings that `stage` reads, as they go into the provenance of what it writes.
    ///
    /// # Errors
    /// [`Error::Failed`] when a setting has no form in JSON.
    pub fn to_json(&self, stage: Stage) -> Result<serde_json::Value> {
        let split = serde_json::json!({ "train_per_validation": self.convert.train_per_validation });
        let (key, own) = match stage {
            Stage::Pretrain => ("pretrain", serde_json::to_value(&self.pretrain)),
            _ => ("train", serde_json::to_value(&self.train)),
        };
        let own = own.map_err(|e| Error::Failed(format!("settings cannot be written as JSON: {e}")))?;
        Ok(serde_json::json!({ "convert": split, (key): own }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(preset: Preset, sets: &[&str]) -> Result<LearningSettings> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        LearningSettings::load(preset, None, None, &sets)
    }

    #[test]
    fn every_preset_learns_from_the_raw_state_and_overrides_count() {
        for preset in Preset::ALL {
            let settings = load(preset, &["train.epochs=3", "convert.train_per_validation=4"]).expect("settings");
            assert_eq!((settings.train.features, settings.pretrain.features), (FeatureSet::Raw, FeatureSet::Raw));
            assert_eq!((settings.train.epochs, settings.convert.train_per_validation), (3, 4));
            assert_eq!((settings.pretrain.reexecute, settings.train.select_episodes), (0, 0));
        }
        let best = load(Preset::Best, &[]).expect("settings");
        assert_eq!(best.train.warm_start_updates, TrainSettings::default().warm_start_updates);
    }

    #[test]
    fn few_demos_are_passed_over_as_often_as_many_unless_it_is_said() {
        let of = |transitions: usize, sets: &[&str]| {
            let settings = load(Preset::Best, sets).expect("settings").sized(transitions);
            (settings.pretrain.batch_rows, settings.train.warm_start(transitions), settings.train.min_updates)
        };
        assert_eq!(of(360, &[]), (32, 300, 0));
        assert_eq!(of(6200, &[]), (194, 3900, 0));
        assert_eq!(of(100_000, &[]), (512, 58_800, 0));
        assert_eq!(of(1_000_000, &[]), (512, 100_000, 0));
        let said = ["pretrain.batch_rows=400", "train.warm_start_updates = 9000", "train.min_updates=2000"];
        assert_eq!(of(360, &said), (400, 9000, 2000));
    }

    #[test]
    fn what_needs_kinematics_or_a_simulator_is_refused() {
        for (set, said) in [
            ("train.features=\"fk\"", "train.features needs the kinematics"),
            ("pretrain.reexecute=1", "pretrain.reexecute = 1 needs a simulator"),
            ("train.select_episodes=10", "train.select_episodes = 10 needs a simulator"),
            ("scene.yaw=true", "--set scene.yaw=true: a dataset of another program has no scene; allowed: convert"),
            ("train.epoch=3", "did you mean train.epochs?"),
        ] {
            let why = load(Preset::Best, &[set]).expect_err(set).to_string();
            assert!(why.contains(said), "{why}");
        }
    }
}
