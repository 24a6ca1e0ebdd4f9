//! When pretraining has nothing left to gain.

use crate::config::PretrainSettings;

/// The lowest loss on the validation demos, and how long it has stood.
pub struct Patience {
    /// Epochs that it may stand; 0 = for ever.
    epochs: u64,
    /// An epoch lowers it when its loss lies this share below.
    min_gain: f64,
    lowest: f64,
    stood: u64,
}

impl Patience {
    /// As the settings say.
    pub fn new(settings: &PretrainSettings) -> Self {
        Patience { epochs: settings.patience, min_gain: settings.min_gain, lowest: f64::INFINITY, stood: 0 }
    }

    /// Takes in the loss after an epoch, and says whether it was the last. Small gains add up: each is compared with the loss after the last
    /// epoch that gained enough.
    pub fn ends_after(&mut self, validation_loss: f64) -> bool {
        if validation_loss < self.lowest * (1.0 - self.min_gain) {
            (self.lowest, self.stood) = (validation_loss, 0);
        } else {
            self.stood += 1;
        }
        self.epochs > 0 && self.stood >= self.epochs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn epochs_until_the_end(patience: u64, losses: impl IntoIterator<Item = f64>) -> Option<usize> {
        let mut patience = Patience::new(&PretrainSettings { patience, min_gain: 0.1, ..Default::default() });
        losses.into_iter().position(|loss| patience.ends_after(loss)).map(|at| at + 1)
    }

    #[test]
    fn a_flat_loss_ends_pretraining_and_small_gains_add_up() {
        assert_eq!(epochs_until_the_end(3, [1.0, 0.5, 0.5, 0.48, 0.6, 0.1]), Some(5));
        let slow = |gain: f64| (0..40).map(move |epoch| (1.0 - gain).powi(epoch));
        assert_eq!(epochs_until_the_end(5, slow(0.03)), None, "11 % in four epochs");
        assert_eq!(epochs_until_the_end(5, slow(0.01)), Some(6), "5 % in five epochs");
        assert_eq!(epochs_until_the_end(0, [1.0; 40]), None);
    }
}
