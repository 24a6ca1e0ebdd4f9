//! alpha of Eq. 1, and what balances the two gradients that it weighs.

use crate::config::{Alpha, TrainSettings};
use crate::learn::run::past::within;
use crate::math;
use serde::{Deserialize, Serialize};

/// alpha of Eq. 1 from update to update.
pub struct Mixing {
    alpha: Alpha,
    cap: f64,
    /// Share of the past in the average; 0 follows d_conv at once.
    keep: f64,
    /// What goes on from epoch to epoch.
    pub averages: Averages,
    /// Whether the gradient of L_SC is scaled to the length of that of L_BC.
    balance: bool,
}

/// What of [`Mixing`] goes on from epoch to epoch.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Averages {
    /// Of d_conv.
    d_conv: Option<f64>,
    /// Mean of the logarithm of the ratio of the two gradients' lengths, over the last epochs.
    log_ratio: Option<f64>,
}

impl Averages {
    /// Refuses averages that no training leaves behind.
    ///
    /// # Errors
    /// Says which is out of its limits.
    pub fn check(self) -> Result<(), String> {
        within("average of d_conv", self.d_conv, 0.0, 1.0)?;
        within("average of the gradients' ratio", self.log_ratio, -LARGEST_LOG, LARGEST_LOG)
    }
}

/// The logarithm of a ratio of two positive numbers of double precision is no longer.
const LARGEST_LOG: f64 = 1500.0;

/// Share of the past in the mean ratio of the gradients' lengths, which is measured once an epoch.
const RATIO_KEEP: f64 = 0.8;

impl Mixing {
    /// At the beginning of Algorithm 1.
    pub fn new(alpha: Alpha, settings: &TrainSettings, updates_per_epoch: u64) -> Self {
        let keep = if settings.alpha_average { 1.0 - 1.0 / updates_per_epoch.max(1) as f64 } else { 0.0 };
        Mixing { alpha, cap: settings.alpha_max, keep, averages: Averages::default(), balance: settings.sc.balance }
    }

    /// Whether L_SC can get a weight.
    pub fn has_sc(&self) -> bool {
        self.alpha != Alpha::Fixed(0.0)
    }

    /// Takes in the lengths of the gradients of L_BC and L_SC at an epoch's first update.
    pub fn see_norms(&mut self, bc: f64, sc: f64) {
        let now = math::ln(bc / sc);
        if now.is_finite() {
            let past = self.averages.log_ratio;
            self.averages.log_ratio = Some(past.map_or(now, |past| RATIO_KEEP * past + (1.0 - RATIO_KEEP) * now));
        }
    }

    /// Factor of L_SC.
    pub fn sc_scale(&self) -> f64 {
        if self.balance { self.averages.log_ratio.map_or(1.0, math::exp) } else { 1.0 }
    }

    /// alpha of this update: alpha_e = d_conv, averaged and capped as the settings say. No gradient goes through it.
    pub fn weight(&mut self, d_conv: f64) -> f64 {
        match self.alpha {
            Alpha::Fixed(alpha) => alpha,
            Alpha::Adaptive => {
                let now = d_conv.clamp(0.0, 1.0);
                let average = self.averages.d_conv.map_or(now, |past| self.keep * past + (1.0 - self.keep) * now);
                self.averages.d_conv = Some(average);
                average.min(self.cap)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ScSettings;

    #[test]
    fn alpha_follows_d_conv_within_its_bounds() {
        let mut settings = TrainSettings { alpha_max: 0.6, alpha_average: false, ..Default::default() };
        let mut mixing = Mixing::new(Alpha::Adaptive, &settings, 10);
        assert_eq!([0.2, 0.9, 7.0].map(|d| mixing.weight(d)), [0.2, 0.6, 0.6]);
        settings.alpha_average = true;
        let mut mixing = Mixing::new(Alpha::Adaptive, &settings, 10);
        assert_eq!(mixing.weight(0.0), 0.0);
        assert!((mixing.weight(1.0) - 0.1).abs() < 1e-12);
        assert_eq!(Mixing::new(Alpha::Fixed(0.3), &settings, 10).weight(1.0), 0.3);
    }

    #[test]
    fn l_sc_is_scaled_to_the_gradient_of_l_bc() {
        let settings = TrainSettings { sc: ScSettings { balance: true, ..Default::default() }, ..Default::default() };
        let mut mixing = Mixing::new(Alpha::Adaptive, &settings, 10);
        assert_eq!(mixing.sc_scale(), 1.0);
        mixing.see_norms(0.2, 20.0);
        assert!((mixing.sc_scale() - 0.01).abs() < 1e-12);
        mixing.see_norms(0.2, f64::NAN);
        mixing.see_norms(0.2, 2.0);
        assert!((math::log10(mixing.sc_scale()) + 1.8).abs() < 1e-12, "{}", mixing.sc_scale());
    }
}
