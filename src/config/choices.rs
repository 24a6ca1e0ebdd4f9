//! The readings of the paper that can be chosen: one enum a question, one variant an answer.

use schemars::JsonSchema;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// What a network sees of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureSet {
    /// The state alone, standardised.
    Raw,
    /// Also, by forward kinematics: tool position, hand rotation, block in the hand's frame, goal minus block.
    Fk,
    /// Also the last two at close range: tanh of the distance over 1.5 cm.
    FkNear,
}

/// What the dynamics network knows before learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Structure {
    /// s' = s + network.
    Plain,
    /// q' = q + dt a + network, dq' = a + network, block' = block + network.
    Kinematic,
}

/// The loss of Eq. 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ModelLoss {
    /// Sum of squares in raw units, as printed.
    RawSum,
    /// Mean square, each entry over the standard deviation of what the network must add.
    StandardisedMean,
    /// The same with Huber's function instead of the square: contacts make rare, large changes.
    StandardisedHuber,
}

/// Units and normalisation of L_BC and L_SC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// Sums over a demo in raw units (Eq. 3 and 5), mean over the demos of an update.
    RawSum,
    /// Means over entries and steps, each entry standardised.
    StandardisedMean,
}

/// Which a_t the losses see.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ActionChoice {
    /// The mean; the standard deviation learns from the negative log-likelihood alone.
    Mean,
    /// A reparameterised sample; the gradient reaches the standard deviation through it.
    Sample,
}

/// What d_conv measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Convergence {
    /// p_t = exp(-1/2 mean_i z_i^2), z_i the error of the mean action over tau demo standard deviations.
    Agreement,
    /// p_t = density of the sampled action under the policy, as printed; unbounded, so alpha is cut to \[0, 1\].
    SampledDensity,
}

/// Scale of each state entry in L_SC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StateScale {
    /// The standard deviation of the state.
    State,
    /// The standard deviation of the state's change in one control step.
    Step,
}

/// Which commands of the fingers L_SC teaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FingerCloning {
    /// All.
    All,
    /// Those that the demo's finger followed. A finger that holds the block does not answer to its command, but the dynamics network
    /// believes that it does.
    Following,
    /// All, as if each finger integrated its command: the prediction is the network's, the gradient with respect to a finger's command goes
    /// straight through to the finger (q' = q + dt a), for where a finger holds there is no slope that leads to opening it.
    StraightThrough,
    /// None; L_SC leaves out the fingers' states too.
    None,
}

/// Which pairs enter the buffer B of Algorithm 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pairs {
    /// The prediction, also where the state is then recovered.
    BeforeRecovery,
    /// The state after recovery, as printed: a recovered pair is (s^E, s^E) and teaches nothing.
    AfterRecovery,
}

/// alpha of Eq. 1: a number, or equal to d_conv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// alpha_e = d_conv.
    Adaptive,
    /// alpha_i of Eq. 7, in \[0, 1\].
    Fixed(f64),
}

impl fmt::Display for Alpha {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Alpha::Adaptive => f.write_str("adaptive"),
            Alpha::Fixed(alpha) => write!(f, "{alpha}"),
        }
    }
}

impl FromStr for Alpha {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        match s {
            "adaptive" => Ok(Alpha::Adaptive),
            _ => s.parse().map(Alpha::Fixed).map_err(|_| format!("alpha is \"adaptive\" or a number, not \"{s}\"")),
        }
    }
}

impl Serialize for Alpha {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Alpha::Adaptive => serializer.serialize_str("adaptive"),
            Alpha::Fixed(alpha) => serializer.serialize_f64(*alpha),
        }
    }
}

impl<'de> Deserialize<'de> for Alpha {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AlphaVisitor)
    }
}

/// A number of updates, or as many as the demos ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Updates {
    /// By the number of transitions.
    Auto,
    /// So many.
    Exactly(u64),
}

/// The word for [`Updates::Auto`].
const AUTO: &str = "auto";

impl From<u64> for Updates {
    fn from(updates: u64) -> Self {
        Updates::Exactly(updates)
    }
}

impl Serialize for Updates {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Updates::Auto => serializer.serialize_str(AUTO),
            Updates::Exactly(updates) => serializer.serialize_u64(*updates),
        }
    }
}

impl<'de> Deserialize<'de> for Updates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UpdatesVisitor)
    }
}

struct UpdatesVisitor;

impl Visitor<'_> for UpdatesVisitor {
    type Value = Updates;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"auto\" or a whole number")
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<Updates, E> {
        let auto = (value == AUTO).then_some(Updates::Auto);
        auto.ok_or_else(|| E::invalid_value(de::Unexpected::Str(value), &self))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Updates, E> {
        let updates = u64::try_from(value).map_err(|_| E::invalid_value(de::Unexpected::Signed(value), &self));
        updates.map(Updates::Exactly)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Updates, E> {
        Ok(Updates::Exactly(value))
    }
}

struct AlphaVisitor;

impl Visitor<'_> for AlphaVisitor {
    type Value = Alpha;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"adaptive\" or a number between 0 and 1")
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<Alpha, E> {
        value.parse().map_err(|_| E::invalid_value(de::Unexpected::Str(value), &self))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Alpha, E> {
        Ok(Alpha::Fixed(value))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Alpha, E> {
        Ok(Alpha::Fixed(value as f64))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Alpha, E> {
        Ok(Alpha::Fixed(value as f64))
    }
}
