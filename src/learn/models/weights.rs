//! Networks and scalings as named tensors, and back with every shape checked.

use super::features::{Features, derived_width};
use super::scaling::Scaling;
use crate::config::{FeatureSet, MOST_LAYERS, MOST_UNITS};
use crate::layout::Layout;
use crate::nn::{Activation, Mlp};
use crate::tensor::NamedTensor;
use crate::words::shown;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use std::sync::Arc;

/// Size of a logarithm whose exponential single precision holds, with room for what it is multiplied with.
const LARGEST_LOG_STD: f32 = 40.0;

/// A one-dimensional tensor.
pub fn vector(name: &str, data: &[f32]) -> NamedTensor {
    NamedTensor { name: name.into(), shape: vec![data.len()], data: data.to_vec() }
}

/// `{name}.mean` and `{name}.std`.
pub fn push_scaling(out: &mut Vec<NamedTensor>, name: &str, scaling: &Scaling) {
    out.push(vector(&format!("{name}.mean"), &scaling.mean));
    out.push(vector(&format!("{name}.std"), &scaling.std));
}

/// The scalings of `features`.
pub fn push_features(out: &mut Vec<NamedTensor>, name: &str, features: &Features) {
    push_scaling(out, &format!("{name}.state"), features.state_scaling());
    push_scaling(out, &format!("{name}.derived"), features.derived_scaling());
}

/// `{name}.layer_1.weight` (inputs x outputs), `{name}.layer_1.bias`, and so on.
pub fn push_network(out: &mut Vec<NamedTensor>, name: &str, net: &Mlp) {
    for layer in 0..net.layers() {
        let (weights, biases) = net.layer_ranges(layer);
        let shape = vec![net.widths()[layer], net.widths()[layer + 1]];
        let data = net.params()[weights].to_vec();
        out.push(NamedTensor { name: format!("{name}.layer_{}.weight", layer + 1), shape, data });
        out.push(vector(&format!("{name}.layer_{}.bias", layer + 1), &net.params()[biases]));
    }
}

/// Tensors and description of a file, read with checks.
pub struct Reader<'a> {
    /// The tensors.
    pub tensors: &'a [NamedTensor],
    /// The description.
    pub meta: &'a Value,
}

impl Reader<'_> {
    /// An entry of the description.
    pub fn meta<T: DeserializeOwned>(&self, key: &str) -> Result<T, String> {
        let value = self.meta.get(key).ok_or_else(|| format!("the description has no \"{key}\""))?;
        T::deserialize(value).map_err(|e| {
            let (value, why) = (shown(&value.to_string()), shown(&e.to_string()));
            format!("\"{key}\" of the description is {value}: {why}")
        })
    }

    /// The settings that the network was trained with; `update` makes this version's of an older one's.
    pub fn settings<T: DeserializeOwned>(&self, update: fn(&mut Map<String, Value>) -> Result<(), String>) -> Result<T, String> {
        let mut settings: Value = self.meta("settings")?;
        settings.as_object_mut().map_or(Ok(()), update)?;
        Reader { tensors: self.tensors, meta: &json!({ "settings": settings }) }.meta("settings")
    }

    /// The layout of the network; refuses another kind, and a state size that is not the layout's.
    pub fn layout(&self, kind: &str) -> Result<Arc<Layout>, String> {
        let found: String = self.meta("network")?;
        if found != kind {
            return Err(format!("these are weights of a {} network, but a {kind} network is needed", shown(&found)));
        }
        let layout: Layout = self.meta("layout")?;
        layout.check().map_err(|why| format!("\"layout\" of the description: {why}"))?;
        let (dim, found, name) = (self.meta::<usize>("state_dim")?, layout.state_dim(), shown(&layout.name));
        if dim != found {
            return Err(format!("the network was trained on states of {dim} numbers, but {name} has {found}"));
        }
        Ok(Arc::new(layout))
    }

    /// Refuses a description that has the inputs in another order than they are `computed` in; an older one does not name them.
    pub fn inputs(&self, computed: &[String]) -> Result<(), String> {
        if self.meta.get("inputs").is_none() {
            return Ok(());
        }
        let named: Vec<String> = self.meta("inputs")?;
        if named.len() != computed.len() {
            let (named, computed) = (named.len(), computed.len());
            return Err(format!("\"inputs\" of the description names {named} inputs, but the network has {computed}"));
        }
        match named.iter().zip(computed).position(|(named, computed)| named != computed) {
            None => Ok(()),
            Some(at) => {
                let (named, computed) = (shown(&named[at]), shown(&computed[at]));
                Err(format!("\"inputs\" of the description has \"{named}\" in place {at}, where \"{computed}\" is computed"))
            }
        }
    }

    /// The values of a tensor of this shape.
    pub fn tensor(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, String> {
        let tensor = self.tensors.iter().find(|t| t.name == name).ok_or_else(|| format!("tensor {name} is missing"))?;
        if tensor.shape != shape || tensor.data.len() != shape.iter().product::<usize>() {
            let (got, count) = (shown(&format!("{:?}", tensor.shape)), tensor.data.len());
            return Err(format!("tensor {name} has shape {got} with {count} numbers, but {shape:?} is needed"));
        }
        match tensor.data.iter().position(|v| !v.is_finite()) {
            Some(at) => Err(format!("tensor {name} holds {} at {at}, not a finite number", tensor.data[at])),
            None => Ok(tensor.data.clone()),
        }
    }

    /// What `push_scaling` wrote; refuses a standard deviation that is not positive.
    pub fn scaling(&self, name: &str, width: usize) -> Result<Scaling, String> {
        let mean = self.tensor(&format!("{name}.mean"), &[width])?;
        let std = self.tensor(&format!("{name}.std"), &[width])?;
        match std.iter().find(|v| **v <= 0.0) {
            Some(v) => Err(format!("tensor {name}.std holds {v}; standard deviations are above 0")),
            None => Ok(Scaling { mean, std }),
        }
    }

    /// Logarithms of the standard deviations of an action; refuses one that is out of all proportion.
    pub fn log_std(&self, name: &str, width: usize) -> Result<Vec<f32>, String> {
        let values = self.tensor(name, &[width])?;
        match values.iter().find(|v| v.abs() > LARGEST_LOG_STD) {
            Some(v) => Err(format!("tensor {name} holds {v}; allowed: -{LARGEST_LOG_STD} to {LARGEST_LOG_STD}")),
            None => Ok(values),
        }
    }

    /// What `push_features` wrote.
    pub fn features(&self, name: &str, layout: &Arc<Layout>) -> Result<Features, String> {
        let set: FeatureSet = self.meta("features")?;
        let state = self.scaling(&format!("{name}.state"), layout.state_dim())?;
        let derived = self.scaling(&format!("{name}.derived"), derived_width(layout, set))?;
        Ok(Features::from_scaling(layout, set, self.meta("mask_dq")?, state, derived))
    }

    /// What `push_network` wrote, for a network with these inputs and outputs.
    pub fn network(&self, name: &str, inputs: usize, outputs: usize) -> Result<Mlp, String> {
        let activation: Activation = self.meta("activation")?;
        let hidden: Vec<usize> = self.meta("hidden")?;
        let allowed = 1..=MOST_UNITS as usize;
        if !(1..=MOST_LAYERS as usize).contains(&hidden.len()) || !hidden.iter().all(|units| allowed.contains(units)) {
            let found = shown(&format!("{hidden:?}"));
            return Err(format!(
                "\"hidden\" of the description is {found}: networks have 1 to {MOST_LAYERS} hidden layers of 1 to {MOST_UNITS} units"
            ));
        }
        let widths: Vec<usize> = [inputs].into_iter().chain(hidden).chain([outputs]).collect();
        let mut params = Vec::new();
        for (layer, pair) in widths.windows(2).enumerate() {
            params.extend(self.tensor(&format!("{name}.layer_{}.weight", layer + 1), pair)?);
            params.extend(self.tensor(&format!("{name}.layer_{}.bias", layer + 1), &pair[1..])?);
        }
        Mlp::from_params(&widths, activation, params).ok_or_else(|| format!("{name} needs at least one hidden layer: {widths:?}"))
    }
}
