//! How finely contact physics is solved. The defaults are what recordings and evaluations are made with; `cargo bench --bench study --
//! simulator` sets others beside them.

use crate::state::CONTROL_DT_S;
use rapier3d::prelude::{IntegrationParameters, Real, SpringCoefficients};
use serde::{Deserialize, Serialize};

/// Into what a control step is divided.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grain {
    /// Physics steps in a control step; each finds the contacts anew.
    pub steps: usize,
    /// Substeps of a physics step; each rebuilds and factors the arm's mass matrix, which is most of its cost.
    pub substeps: usize,
    /// Sweeps over all constraints in a substep: the rows of motors and friction start from zero in each.
    pub sweeps: usize,
}

/// Settings of the contact physics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Physics {
    /// While the robot is near anything, or an object moves. Default: substeps of 6.25 ms (measured under noise of 0.1 rad/s, ten times
    /// the paper's variance: stacks 90 of 100; with 3 substeps 64) and 6 sweeps (8 stack as many and cost a fifth more time; 2 lose one
    /// grasp in seven).
    pub near: Grain,
    /// While nothing can touch the robot within a control step and the objects rest. Default: the same.
    pub free: Grain,
    /// Sweeps that take out the velocity with which penetration was pushed out.
    pub relaxations: usize,
    /// Natural frequency of the contact spring \[Hz\]; with its damping ratio, penetration is below 1 mm under a grasp (rapier's 30 Hz: 5 mm).
    pub contact_hz: f64,
    /// Damping ratio of the contact spring.
    pub contact_damping: f64,
    /// Contacts of a pair that moved less than this are kept \[m\].
    pub recycle_m: f64,
    /// Contacts are found from this distance on \[m\].
    pub prediction_m: f64,
    /// Whether what moves fast is stopped at what is fixed.
    pub continuous: bool,
}

impl Default for Physics {
    fn default() -> Self {
        let grain = Grain { steps: 2, substeps: 4, sweeps: 6 };
        Physics {
            near: grain,
            free: grain,
            relaxations: 1,
            contact_hz: 200.0,
            contact_damping: 2.0,
            recycle_m: 0.002,
            prediction_m: 0.02,
            continuous: true,
        }
    }
}

impl Physics {
    /// The same in rapier's words.
    pub(super) fn parameters(&self, grain: Grain) -> IntegrationParameters {
        let softness = SpringCoefficients::new(self.contact_hz as Real, self.contact_damping as Real);
        IntegrationParameters {
            dt: (CONTROL_DT_S / grain.steps as f64) as Real,
            num_solver_iterations: grain.substeps,
            num_internal_pgs_iterations: grain.sweeps,
            num_internal_stabilization_iterations: self.relaxations,
            contact_softness: softness,
            static_contact_softness: softness,
            friction_in_bias_pass: false,
            normalized_contact_recycle_distance: self.recycle_m as Real,
            normalized_prediction_distance: self.prediction_m as Real,
            max_ccd_substeps: usize::from(self.continuous),
            ..IntegrationParameters::default()
        }
    }
}
