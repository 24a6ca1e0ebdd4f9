//! Sine and cosine as hilt computes them. ONNX's own differ in the seventh digit from it and from runtime to runtime, which a network that was
//! trained on the last millimetres makes 1e-4 rad/s of.

use crate::data::onnx::{Graph, Op, Value};
use crate::learn::models::{COS, HALF_PI, SIN, Series};
use std::f32::consts::FRAC_2_PI;

/// Names what belongs to one angle.
struct Angle<'a> {
    graph: &'a mut Graph,
    name: &'a str,
}

/// Sine and cosine of each number.
pub fn sin_cos(graph: &mut Graph, angle: &str, name: &str) -> [Value; 2] {
    let of = &mut Angle { graph, name };
    let scaled = of.with(Op::Mul, angle, FRAC_2_PI, "in_quarter_turns");
    let turns = of.apply(Op::Round, &[&scaled], "quarter_turns");
    let [high, low] = [(0, "high"), (1, "low")].map(|(part, what)| of.with(Op::Mul, &turns, HALF_PI[part], what));
    let rest = of.apply(Op::Sub, &[angle, &high], "less_high");
    let rest = of.apply(Op::Sub, &[&rest, &low], "rest");
    let square = of.apply(Op::Mul, &[&rest, &rest], "square");
    let sin = of.series(&SIN, &square, "sin_series");
    let sin = of.apply(Op::Mul, &[&rest, &sin], "sin_of_rest");
    let cos = of.series(&COS, &square, "cos_of_rest");
    // A quarter turn makes (cos, -sin) of (sin, cos); all numbers here are small integers, so that nothing is rounded.
    let (halves, odd) = of.halves(&turns, "quarter_turns");
    let one = of.number(1.0, "one");
    let even = of.apply(Op::Sub, &[&one, &odd], "even");
    let next = of.apply(Op::Add, &[&halves, &odd], "halves_of_next");
    [("sin", [&sin, &cos], halves), ("cos", [&cos, &sin], next)].map(|(name, [of_even, of_odd], halves)| {
        let [even, odd] = [(of_even, &even, "even"), (of_odd, &odd, "odd")]
            .map(|(value, chosen, when)| of.apply(Op::Mul, &[value, chosen], &format!("{name}.if_{when}")));
        let size = of.apply(Op::Add, &[&even, &odd], &format!("{name}.unsigned"));
        let (_, negative) = of.halves(&halves, &format!("{name}.turned"));
        let twice = of.with(Op::Mul, &negative, 2.0, &format!("{name}.twice"));
        let sign = of.apply(Op::Sub, &[&one, &twice], &format!("{name}.sign"));
        of.apply(Op::Mul, &[&size, &sign], name)
    })
}

impl Angle<'_> {
    fn apply(&mut self, op: Op, inputs: &[&str], what: &str) -> Value {
        self.graph.apply(op, inputs, &format!("{}.{what}", self.name))
    }

    fn number(&mut self, number: f32, what: &str) -> Value {
        self.graph.constant(&format!("{}.{what}", self.name), &[1], &[number])
    }

    /// An operator whose second input is a number.
    fn with(&mut self, op: Op, value: &str, number: f32, what: &str) -> Value {
        let number = self.number(number, &format!("{what}.number"));
        self.apply(op, &[value, &number], what)
    }

    fn series(&mut self, series: &Series, x: &str, what: &str) -> Value {
        let mut sum = self.with(Op::Div, x, series.last, &format!("{what}.last"));
        for (i, term) in series.terms.iter().enumerate().rev() {
            let name = if i == 0 { what.to_string() } else { format!("{what}.from_{i}") };
            if i + 1 < series.terms.len() {
                sum = self.apply(Op::Mul, &[&sum, x], &format!("{what}.times_{}", i + 1));
            }
            sum = self.with(Op::Add, &sum, *term, &name);
        }
        sum
    }

    /// Half of each integer, rounded down, and 1 where that left something.
    fn halves(&mut self, integers: &str, what: &str) -> (Value, Value) {
        let half = self.with(Op::Mul, integers, 0.5, &format!("{what}.half"));
        let halves = self.apply(Op::Floor, &[&half], &format!("{what}.halves"));
        let twice = self.with(Op::Mul, &halves, 2.0, &format!("{what}.twice_halves"));
        let odd = self.apply(Op::Sub, &[integers, &twice], &format!("{what}.odd"));
        (halves, odd)
    }
}
