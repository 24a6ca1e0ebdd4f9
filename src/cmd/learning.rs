//! What `hilt pretrain` and `hilt train` learn from: demos of a task of hilt, or a dataset that another program wrote.

use super::Console;
use super::common::{Flag, RUNS, SettingsArgs, path_or};
use super::fits::{FOREIGN, read_network, same_layout, same_task};
use crate::config::{LearningSettings, Pipeline, PretrainSettings, Stage, TrainSettings};
use crate::data::dataset::foreign::{self, Choice, Source};
use crate::data::origin::Kind;
use crate::data::{ContentHash, Provenance, dataset, weights};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::layout::Span;
use crate::learn::Dynamics;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Which columns of a dataset of another program count.
#[derive(Debug, clap::Args)]
pub struct ColumnArgs {
    /// Columns that make a state, in this order; for a dataset of another program [default: observation.state, then observation.environment_state]
    #[arg(long, value_name = "COLUMN,...", value_delimiter = ',')]
    state: Vec<String>,
    /// Column of the actions; for a dataset of another program [default: action]
    #[arg(long, value_name = "COLUMN")]
    action: Option<String>,
}

/// What is learned from.
pub struct Learning {
    subject: Subject,
    /// Directory of the demos.
    pub dataset: PathBuf,
}

enum Subject {
    /// Demos of a task of hilt.
    Task(Box<Pipeline>),
    /// A dataset of another program.
    Dataset(Box<ForeignDataset>),
}

struct ForeignDataset {
    settings: LearningSettings,
    source: Source,
}

/// What is learned from, and on what it is judged.
pub struct Demos {
    pub train: Vec<Demo>,
    pub validation: Vec<Demo>,
    /// Of both datasets, as they were read.
    pub content: ContentHash,
}

impl Learning {
    /// From the flags: a dataset of another program where `dataset` is one, else demos of a task. `flags` as [`SettingsArgs::resolve`] has them.
    ///
    /// # Errors
    /// As [`SettingsArgs::resolve`]; [`Error::Usage`] for flags that do not go together; what is wrong with a dataset of another program.
    pub fn of(settings: &SettingsArgs, columns: &ColumnArgs, dataset: Option<&Path>, flags: &[Flag]) -> Result<Self> {
        if let Some(dir) = dataset.filter(|dir| foreign::is_foreign(dir)) {
            let settings = settings.resolve_for_dataset(dir, flags)?;
            let source = foreign::open(dir, &Choice { state: columns.state.clone(), action: columns.action.clone() })?;
            return Ok(Learning {
                subject: Subject::Dataset(Box::new(ForeignDataset { settings, source })),
                dataset: dir.into(),
            });
        }
        if !columns.state.is_empty() || columns.action.is_some() {
            let message =
                "--state and --action choose columns of a dataset of another program; the columns of hilt's own are known";
            return Err(Error::Usage(message.into()));
        }
        let pipeline = settings.resolve_from(dataset.map(|dir| (dir, Kind::Datasets)), flags)?;
        let dataset = path_or(dataset, &pipeline, "dataset");
        Ok(Learning { subject: Subject::Task(Box::new(pipeline)), dataset })
    }

    /// The task and all about it; `None` for a dataset of another program.
    pub fn pipeline(&self) -> Option<&Pipeline> {
        match &self.subject {
            Subject::Task(pipeline) => Some(pipeline),
            Subject::Dataset(_) => None,
        }
    }

    /// The same for what needs a simulator; `what` says which flag or setting does.
    ///
    /// # Errors
    /// [`Error::Usage`] for a dataset of another program.
    pub fn simulated(&self, what: &str) -> Result<&Pipeline> {
        let why =
            || format!("{what} needs the task's simulator, which a dataset of another program has not; allowed: hil, bc and sc");
        self.pipeline().ok_or_else(|| Error::Usage(why()))
    }

    /// Settings of the dynamics network.
    pub fn pretrain_settings(&self) -> &PretrainSettings {
        match &self.subject {
            Subject::Task(pipeline) => &pipeline.pretrain,
            Subject::Dataset(foreign) => &foreign.settings.pretrain,
        }
    }

    /// Settings of the policy.
    pub fn train_settings(&self) -> &TrainSettings {
        match &self.subject {
            Subject::Task(pipeline) => &pipeline.train,
            Subject::Dataset(foreign) => &foreign.settings.train,
        }
    }

    /// The given path, or where an artefact of this name goes unless a flag says otherwise.
    pub fn path_or(&self, given: Option<&Path>, name: &str) -> PathBuf {
        match &self.subject {
            Subject::Task(pipeline) => path_or(given, pipeline, name),
            Subject::Dataset(foreign) => {
                given.map_or_else(|| Path::new(RUNS).join(&foreign.source.layout.name).join(name), Path::to_path_buf)
            }
        }
    }

    /// What made an artefact of `stage`, as [`SettingsArgs::provenance`] has it.
    ///
    /// # Errors
    /// [`Error::Failed`] when a setting has no form in JSON.
    pub fn provenance(&self, args: &SettingsArgs, stage: Stage, inputs: &[(&str, ContentHash)]) -> Result<Provenance> {
        let (settings, source) = match &self.subject {
            Subject::Task(pipeline) => return args.provenance(stage, pipeline, inputs),
            Subject::Dataset(foreign) => (&foreign.settings, &foreign.source),
        };
        let mut all = settings.to_json(stage)?;
        let names = |spans: &[Span]| spans.iter().map(|span| span.name.clone()).collect::<Vec<_>>();
        all[FOREIGN] = json!({ "state": names(&source.layout.state), "action": names(&source.layout.action) });
        let made = Provenance::new(stage.name(), &source.layout.name, all, args.seed);
        Ok(inputs.iter().fold(made, |made, (role, content)| made.with_input(role, content)))
    }

    /// Training and validation demos. Settings that follow their number are known from here on.
    ///
    /// # Errors
    /// What reading returns; [`Error::Input`] when there is no validation demo (a dataset of one episode has none), or when one is a training
    /// demo too.
    pub fn demos(&mut self, args: &SettingsArgs, console: &Console) -> Result<Demos> {
        let dir = &self.dataset;
        let (demos, advice) = match &mut self.subject {
            Subject::Task(pipeline) => {
                (own_demos(dir, pipeline)?, "run hilt convert again, over recordings of which none is there twice")
            }
            Subject::Dataset(foreign) => {
                let demos = foreign_demos(&foreign.settings, &foreign.source, args.seed, console)?;
                foreign.settings = foreign.settings.clone().sized(demos.train.iter().map(Demo::len).sum());
                (demos, "drop one (hilt dataset drop --episodes)")
            }
        };
        if let Some((t, v)) = dataset::first_shared(&demos.train, &demos.validation) {
            let message = format!(
                "training episode {t} is validation episode {v}, in every number: what is validated has been learned; {advice}"
            );
            return Err(Error::input(dir, message));
        }
        Ok(demos)
    }

    /// The dynamics network in a file, of the same task or dataset.
    ///
    /// # Errors
    /// What reading returns; [`Error::Input`] for a network of something else.
    pub fn dynamics(&self, path: &Path) -> Result<(Dynamics, ContentHash)> {
        let source = match &self.subject {
            Subject::Task(pipeline) => {
                let (dynamics, _, content) =
                    read_network(path, weights::DYNAMICS, pipeline, Dynamics::from_tensors, |dynamics| dynamics.layout())?;
                return Ok((dynamics, content));
            }
            Subject::Dataset(foreign) => &foreign.source,
        };
        let (tensors, description, made, content) = weights::read_hashed(path, weights::DYNAMICS)?;
        let dynamics = Dynamics::from_tensors(&tensors, &description).map_err(|why| Error::input(path, why))?;
        if **dynamics.layout() != *source.layout {
            let message = format!(
                "was made from {}, whose columns, rate or name are others than those of {}; run hilt pretrain on this dataset",
                made.task, source.layout.name
            );
            return Err(Error::input(path, message));
        }
        Ok((dynamics, content))
    }
}

fn own_demos(dir: &Path, pipeline: &Pipeline) -> Result<Demos> {
    if dataset::provenance(dir).is_ok() {
        let message = "is one dataset, where training and validation are two: hilt dataset split makes them of it";
        return Err(Error::input(dir, message));
    }
    let mut files = BTreeMap::new();
    let mut read = |name: &str| -> Result<Vec<Demo>> {
        let found = dataset::read_for(&dir.join(name), &pipeline.task.name)?;
        same_task(&dir.join(name), &found.provenance, pipeline)?;
        same_layout(&dir.join(name), &found.provenance, &found.layout, pipeline)?;
        files.extend(found.files.into_iter().map(|(file, hash)| (format!("{name}/{file}"), hash)));
        Ok(found.demos)
    };
    let train = read(dataset::TRAIN)?;
    let validation = if dir.join(dataset::VALIDATION).exists() { read(dataset::VALIDATION)? } else { Vec::new() };
    if validation.is_empty() {
        let (count, ratio) = (train.len(), pipeline.convert.train_per_validation);
        return Err(Error::input(
            dir,
            format!(
                "training demos: {count}, validation demos: none; `hilt convert` splits {ratio}:1 by episode and needs at least 2 \
                 that succeeded; raise plan.episodes and run plan, simulate and convert again"
            ),
        ));
    }
    let content = ContentHash::of_directory(files.iter().map(|(name, hash)| (name.as_str(), *hash)));
    Ok(Demos { train, validation, content })
}

fn foreign_demos(settings: &LearningSettings, source: &Source, seed: u64, console: &Console) -> Result<Demos> {
    let layout = &source.layout;
    if !source.pictures.is_empty() {
        console.say(&format!("dataset: skips {}: pictures are not learned from", source.pictures.join(", ")));
    }
    let foreign::Read { train, validation, content } = source.read(settings.convert.train_per_validation, seed)?;
    let names = |spans: &[Span]| spans.iter().map(|span| span.name.as_str()).collect::<Vec<_>>().join(" and ");
    console.say(&format!(
        "dataset: {}: {} training and {} validation episodes, states of {} numbers ({}), actions of {} ({}), {:.4} s a step",
        layout.name,
        train.len(),
        validation.len(),
        layout.state_dim(),
        names(&layout.state),
        layout.action_dim(),
        names(&layout.action),
        layout.period_s,
    ));
    Ok(Demos { train, validation, content })
}
