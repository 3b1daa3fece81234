//! Runs that need not be made: where nothing is random, all seeds give the run of one.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use super::Sweep;
use crate::Outcome;

/// Settings that are kept: the seed changes first from run to run, so that those which are under way are near each other.
const MOST_KEPT: usize = 64;

/// Outcomes of settings of the parameters in which nothing is random. May be shared by threads.
#[derive(Debug, Default)]
pub struct Alike(Mutex<BTreeMap<u64, Outcome>>);

impl Alike {
    /// The outcome of the run of this number, if it is known from another seed.
    pub fn of(&self, sweep: &Sweep, number: u64) -> Option<Outcome> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = known.get(&sweep.setting(number))?;
        Some(Outcome { seed: sweep.point(number).seed, ..outcome.clone() })
    }

    /// Keeps the outcome of a run for the other seeds, if nothing in it was random.
    pub fn keep(&self, sweep: &Sweep, number: u64, outcome: &Outcome) {
        if outcome.is_random || sweep.seeds_of_a_setting() == 1 {
            return;
        }
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(sweep.setting(number), outcome.clone());
        while known.len() > MOST_KEPT {
            known.pop_first();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Scenario;

    /// A wheel that starts, two settings and three seeds; `random` is a further key of the machine or a step.
    fn sweep(random: &str) -> Sweep {
        let text = format!(
            "end = '2s'\n[parameters]\nrpm = 1\n[sweep]\nrpm = [30, 60]\n[[host]]\ndo = '4 velocity {{rpm}}rpm no-wait'\n\
             [machine]\ndrive = [{{ model = 'zlac8030l', node = 4 }}]\n{random}"
        );
        let scenario = Scenario::parse(&text, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
        Sweep::new(scenario, 1..=3).expect("a sweep")
    }

    #[test]
    fn a_run_in_which_nothing_is_random_gives_those_of_other_seeds_and_of_no_other_value() {
        let sweep = sweep("timing = 'ideal'");
        let alike = Alike::default();
        assert_eq!(alike.of(&sweep, 0), None);
        alike.keep(&sweep, 0, &sweep.run(0).expect("a run"));
        for number in 0..3 {
            assert_eq!(alike.of(&sweep, number), sweep.run(number).ok(), "run {number}");
        }
        assert_eq!(alike.of(&sweep, 3), None);
    }

    #[test]
    fn a_run_in_which_anything_is_random_gives_nothing_for_another() {
        let sources = [
            "realism = 'full'\ntiming = 'ideal'",
            "timing = 'device'",
            "timing = 'ideal'\n[[step]]\nat = '0s'\ndo = 'bus corrupt 0.5'",
            "timing = 'ideal'\n[[step]]\nat = '0s'\ndo = '4 bus late 5 20'",
        ];
        for source in sources {
            let sweep = sweep(source);
            let outcome = sweep.run(0).expect("a run");
            assert_ne!(Some(outcome.digest), sweep.run(1).ok().map(|other| other.digest), "{source}");
            let alike = Alike::default();
            alike.keep(&sweep, 0, &outcome);
            assert_eq!(alike.of(&sweep, 1), None, "{source}");
        }
    }
}
