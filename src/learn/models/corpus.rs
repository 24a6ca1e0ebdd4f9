//! All demos side by side: transition r of the corpus is (s_t, a_t, s_{t+1}) of one demo, transitions of a demo are consecutive.

use super::relations::Relating;
use crate::demo::{Demo, LARGEST_NUMBER};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::nn::{LANES, Lanes, Panels, kernel};
use std::array::from_fn;
use std::borrow::Cow;
use std::iter::repeat_n;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Transitions of many demos, which are held once: what is derived from them is worked out for each batch.
pub struct Corpus {
    /// What the rows hold.
    pub layout: Arc<Layout>,
    /// First transition of each demo, and the end of the last.
    pub starts: Vec<usize>,
    demos: Vec<Demo>,
    /// The demo of each transition.
    owners: Vec<u32>,
    changing: usize,
    relating: Relating,
    /// What kinematics derive from each s_t, once it has been asked for: row-major, as wide as the layout has it.
    related: OnceLock<Vec<f32>>,
}

impl Corpus {
    /// Takes `demos`; `what` names them in errors ("training", "validation").
    ///
    /// # Errors
    /// [`Error::Failed`] when there is no demo, layouts are mixed, or a number is beyond all measure: losses would be none.
    pub fn new<'a>(demos: impl Into<Cow<'a, [Demo]>>, what: &str) -> Result<Self> {
        let demos = demos.into().into_owned();
        let Some(first) = demos.first() else {
            return Err(Error::Failed(format!("there is no {what} demo: record more episodes, or look at why all failed")));
        };
        let layout = Arc::clone(first.layout());
        if let Some(other) = demos.iter().find(|d| *d.layout() != layout) {
            let (ours, theirs) = (&layout.name, &other.layout().name);
            return Err(Error::Failed(format!(
                "{what} demos of {ours} and {theirs} are mixed; give those of one task and robot"
            )));
        }
        let mut starts = vec![0];
        for (number, demo) in demos.iter().enumerate() {
            plausible(demo).map_err(|why| Error::Failed(format!("{what} demo {number}: {why}")))?;
            starts.push(starts[number] + demo.len());
        }
        let owners = demos.iter().zip(0..).flat_map(|(demo, i)| repeat_n(i, demo.len())).collect();
        let (changing, relating) = (layout.changing(), Relating::new(&layout));
        Ok(Corpus { layout, starts, demos, owners, changing, relating, related: OnceLock::new() })
    }

    /// Number of transitions.
    pub fn rows(&self) -> usize {
        self.owners.len()
    }

    /// Number of demos.
    pub fn demos(&self) -> usize {
        self.demos.len()
    }

    /// Mean number of transitions of a demo.
    pub fn mean_length(&self) -> f64 {
        self.rows() as f64 / self.demos() as f64
    }

    /// Transitions of a demo.
    pub fn demo(&self, i: usize) -> Range<usize> {
        self.starts[i]..self.starts[i + 1]
    }

    /// Transitions of the longest demo.
    pub fn longest(&self) -> usize {
        (0..self.demos()).map(|i| self.demo(i).len()).max().unwrap_or(0)
    }

    /// Transitions of some demos, one after another, into `rows`.
    pub fn rows_of(&self, demos: &[usize], rows: &mut Vec<usize>) {
        rows.clear();
        rows.reserve(demos.len() * self.longest());
        rows.extend(demos.iter().flat_map(|i| self.demo(*i)));
    }

    /// The demo of transition `r`, and its place there.
    #[inline]
    fn place(&self, r: usize) -> (&Demo, usize) {
        let owner = self.owners[r] as usize;
        (&self.demos[owner], r - self.starts[owner])
    }

    /// s_t of transition `r`.
    #[inline]
    pub fn state(&self, r: usize) -> &[f32] {
        let (demo, t) = self.place(r);
        demo.state(t)
    }

    /// The entries of s_{t+1} that change during an episode, [`Layout::changing`] of them.
    #[inline]
    pub fn next(&self, r: usize) -> &[f32] {
        let (demo, t) = self.place(r);
        &demo.state(t + 1)[..self.changing]
    }

    /// The commanded action of transition `r`.
    #[inline]
    pub fn commanded(&self, r: usize) -> &[f32] {
        let (demo, t) = self.place(r);
        demo.action(t)
    }

    /// The executed action of transition `r`.
    #[inline]
    pub fn executed(&self, r: usize) -> &[f32] {
        let (demo, t) = self.place(r);
        demo.executed_action(t)
    }

    /// What kinematics derive from s_t of transition `r`.
    #[inline]
    pub fn relations(&self, r: usize) -> &[f32] {
        row(self.related.get_or_init(|| self.relate()), self.relating.width(), r)
    }

    fn relate(&self) -> Vec<f32> {
        let width = self.relating.width();
        let (mut all, mut state) = (vec![0.0; self.rows() * width], vec![Lanes::default(); self.layout.state_dim()]);
        let mut panel = Panels::default();
        panel.grow(width, 1);
        for (block, to) in all.chunks_mut(LANES * width).enumerate() {
            kernel::interleave(&mut state, from_fn(|lane| self.state((block * LANES + lane).min(self.rows() - 1))));
            panel.panel_mut(0).copy_from_slice(&self.relating.relations(&state, &self.relating.hand(&state))[..width]);
            panel.read_rows(to);
        }
        all
    }
}

/// Names the first number that is beyond [`LARGEST_NUMBER`].
fn plausible(demo: &Demo) -> std::result::Result<(), String> {
    let (dim, action_dim) = (demo.layout().state_dim(), demo.layout().action_dim());
    let arrays =
        [("state", demo.states(), dim), ("action", demo.actions(), action_dim), ("executed action", demo.executed(), action_dim)];
    for (name, values, width) in arrays {
        if let Some(at) = values.iter().position(|v| f64::from(v.abs()) > LARGEST_NUMBER) {
            let (step, entry, value) = (at / width, at % width, values[at]);
            return Err(format!(
                "{name} of step {step}, entry {entry} is {value:e}; none can be larger than {LARGEST_NUMBER:e} (rad, rad/s, m): \
                 record the episode again or leave it out"
            ));
        }
    }
    Ok(())
}

/// Row `r` of a row-major array.
#[inline]
pub fn row(array: &[f32], width: usize, r: usize) -> &[f32] {
    &array[r * width..(r + 1) * width]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::tests::testing::{Toy, demo};

    #[test]
    fn refuses_no_demos_and_mixed_tasks() {
        let message = |demos: &[Demo]| Corpus::new(demos, "training").err().expect("refused").to_string();
        assert!(message(&[]).contains("no training demo"));
        let mixed = [demo(Toy::Stack, 5, 0), demo(Toy::PickUp, 5, 0)];
        assert!(message(&mixed).contains("PickUp"));
    }

    #[test]
    fn transitions_are_those_of_the_demos() {
        let demos = [demo(Toy::Stack, 5, 0), demo(Toy::Stack, 3, 1)];
        let corpus = Corpus::new(&demos, "training").expect("demos");
        assert_eq!((corpus.rows(), corpus.demo(1)), (8, 5..8));
        assert_eq!(corpus.state(6), demos[1].state(1));
        assert_eq!(corpus.next(7), &demos[1].state(3)[..corpus.layout.changing()]);
    }

    #[test]
    fn a_number_beyond_all_measure_is_named_before_it_makes_a_loss_none() {
        let like = demo(Toy::PickUp, 5, 0);
        let mut states = like.states().to_vec();
        states[2 * like.layout().state_dim() + 3] = 3e38;
        let huge = Demo::new(like.layout(), states, like.actions().to_vec(), like.executed().to_vec()).expect("finite");
        let said = Corpus::new(&[like, huge], "validation").err().expect("refused").to_string();
        assert!(said.contains("validation demo 1: state of step 2, entry 3 is 3e38"), "{said}");
    }
}
