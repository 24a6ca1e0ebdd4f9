//! The numbers that Algorithm 1 reports for each epoch.

use crate::learn::run::Metric;

/// All of them. What was not computed is NaN.
pub static METRICS: [Metric; 18] = [
    Metric::column("learning_rate", "Learning rate of the epoch's last update"),
    Metric::shown("l_bc", "l_bc", "L_BC (Eq. 3), mean over the epoch's updates"),
    Metric::shown("l_sc", "l_sc", "L_SC (Eq. 5), mean over the epoch's updates; NaN where not computed"),
    Metric::column("l_mix", "L_mix (Eq. 1), mean over the epoch's updates"),
    Metric::shown("d_conv", "d_conv", "Degree of policy convergence (Eq. 4), mean over the epoch's updates"),
    Metric::shown("alpha", "alpha", "Mixing weight, mean over the epoch's updates"),
    Metric::shown("l_model", "l_model", "Loss of the dynamics network (Eq. 6), mean over the epoch's updates"),
    Metric::shown("validation_l_bc", "validation l_bc", "L_BC of the averaged weights on the validation demos"),
    Metric::shown("validation_l_model", "validation l_model", "Loss of the dynamics network on the validation demos"),
    Metric::column("grad_bc", "Norm of the gradient of L_BC alone at the epoch's first update"),
    Metric::column("grad_sc", "Norm of the gradient of L_SC alone at the epoch's first update"),
    Metric::column("skipped_updates", "Updates left out so far because a gradient was not finite"),
    Metric::column("arm_error_opening_rad_s", "Validation RMS error, arm joints, while the demo opens its fingers"),
    Metric::column(
        "finger_error_opening_rad_s",
        "Validation RMS error, fingers (what counts as rad/s where they slide), while the demo opens them",
    ),
    Metric::column("arm_error_still_rad_s", "Validation RMS error, arm joints, while the demo's fingers keep still"),
    Metric::column(
        "finger_error_still_rad_s",
        "Validation RMS error, fingers (what counts as rad/s where they slide), while the demo keeps them still",
    ),
    Metric::column("arm_error_closing_rad_s", "Validation RMS error, arm joints, while the demo closes or holds"),
    Metric::column(
        "finger_error_closing_rad_s",
        "Validation RMS error, fingers (what counts as rad/s where they slide), while the demo closes or holds",
    ),
];
