//! Backward against finite differences.

use super::*;
use crate::nn::lanes::panels_of;
use crate::seed::stream;

/// L = sum c_k y_k^2 over all rows; its derivative by finite differences against backward, for parameters and inputs.
#[test]
fn gradients_of_every_layer_equal_finite_differences() {
    for activation in [Activation::Tanh, Activation::Relu] {
        let mut rng = stream(1, "mlp", 0);
        let mut mlp = Mlp::new(&[4, 13, 7, 3], activation, &mut rng);
        // two panels and a bit: the last lanes hold no row
        let (rows, panels) = (21, panels_of(21));
        let mut pass = Pass::new(&mlp, panels);
        for r in 0..rows {
            (0..4).for_each(|i| pass.input.set(r, i, 2.0 * rng.random::<f32>() - 1.0));
        }
        let loss = |mlp: &Mlp, pass: &mut Pass| -> f64 {
            mlp.forward(pass, 0..panels);
            let entries = (0..rows).flat_map(|r| (0..3).map(move |k| (r, k)));
            entries.map(|(r, k)| (1.0 + (r + k) as f64) * f64::from(pass.output.get(r, k)).powi(2)).sum()
        };
        loss(&mlp, &mut pass);
        for (r, k) in (0..rows).flat_map(|r| (0..3).map(move |k| (r, k))) {
            pass.d_output.set(r, k, 2.0 * (1.0 + (r + k) as f32) * pass.output.get(r, k));
        }
        mlp.backward(&mut pass, 0..2);
        mlp.backward(&mut pass, 2..panels);
        mlp.backward_input(&mut pass, 0..panels);
        let mut gradient = vec![0.0; mlp.params().len()];
        mlp.begin_gradient(&mut pass);
        mlp.add_gradient(&mut pass, 0..1);
        mlp.add_gradient(&mut pass, 1..panels);
        mlp.finish_gradient([&mut pass], &mut gradient);
        mlp.begin_gradient(&mut pass);
        mlp.learn(&mut pass, 0..panels);
        let [mut learned, mut added] = [0.0, 0.0].map(|zero| vec![zero; gradient.len()]);
        mlp.finish_gradient([&mut pass], &mut learned);
        mlp.begin_gradient(&mut pass);
        mlp.add_gradient(&mut pass, 0..panels);
        mlp.finish_gradient([&mut pass], &mut added);
        assert_eq!(learned, added);
        let d_input = std::mem::take(&mut pass.d_input);
        pass.grow(&mlp, panels);
        mlp.backward_through(&mut pass, 0..1);
        mlp.backward_through(&mut pass, 1..panels);
        assert_eq!(pass.d_input, d_input);
        let h = 2e-3f32;
        let check = |analytic: f32, plus: f64, minus: f64, what: &str| {
            let numeric = (plus - minus) / f64::from(2.0 * h);
            let error = (numeric - f64::from(analytic)).abs();
            assert!(error < 2e-2 * (1.0 + numeric.abs()), "{what}: {analytic} against {numeric}");
        };
        for (i, analytic) in gradient.iter().enumerate() {
            let mut at = |sign: f32| {
                let kept = mlp.params[i];
                mlp.params_mut()[i] += sign * h;
                let value = loss(&mlp, &mut pass);
                mlp.params_mut()[i] = kept;
                value
            };
            check(*analytic, at(1.0), at(-1.0), &format!("{activation:?} parameter {i}"));
        }
        for (r, i) in (0..rows).flat_map(|r| (0..4).map(move |i| (r, i))) {
            let (kept, analytic) = (pass.input.get(r, i), pass.d_input.get(r, i));
            let mut at = |sign: f32| {
                pass.input.set(r, i, kept + sign * h);
                let value = loss(&mlp, &mut pass);
                pass.input.set(r, i, kept);
                value
            };
            check(analytic, at(1.0), at(-1.0), &format!("{activation:?} row {r}, input {i}"));
        }
    }
}
