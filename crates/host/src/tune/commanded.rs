//! Tunings that a session commands: held and stopped as test motions are. Gains that were proposed are tried by a command of their own,
//! once a person has seen them.

use canopen::NodeId;
use futures_util::future::Abortable;
use master::Drive;
use master::parameters::Parameters;
use serde::Deserialize;
use serde_json::{Value, json};
use words::failure::Failure;

use super::bench::bytes;
use super::outcome::{TuneOutcome, Tuned};
use super::{
    Excursion, LoadOrder, Order, Request, SAMPLE_PERIODS, find, loops_of, open_loop_of, try_gains, tune_ramps,
};
use crate::capture::commanded::refusal;
use crate::capture::{Restorer, WayBack, not_put_back, with_left};
use crate::command::TuneCommand;
use crate::motion::guarding::{UNGUARDED, expect_guard};
use crate::network::params::journal::default_path;
use crate::network::report;
use crate::parameters::transactions::Refusal;
use crate::parameters::{answer, busy, refuse};
use crate::state::Host;
use crate::test_motion::cyclic;
use crate::work::{Asked, Done};

/// For people: what the drive is doing.
const TUNING: &str = "tuning";

impl Host {
    /// Executes a command about gains or ramps, or starts it.
    pub(crate) fn take_tune(&mut self, node: NodeId, command: TuneCommand, asked: Asked) {
        // The mathematics and what draws are not part of the module of such a page.
        if cfg!(target_arch = "wasm32") {
            let text = "a page without a server finds no gains: `ferrodrive studio` and `ferrodrive tune` do";
            return refuse(asked, ("not_here", text.to_owned()));
        }
        match command {
            TuneCommand::TuneForm {} => answer(asked, self.tune_form(node)),
            TuneCommand::TuneRamps(order) => self.begin_ramps(node, &order, asked),
            TuneCommand::Tune(order) => match self.check_tune(node, &order) {
                Ok((drive, request)) => self.begin_tuning(drive, asked, async move |drive, restorer| {
                    let found = find((drive, restorer), &request, &mut Excursion::default()).await;
                    found.map(|(report, proposed)| Tuned { request, report, proposed })
                }),
                Err(refusal) => refuse(asked, refusal),
            },
            TuneCommand::TryGains {} => match self.check_trial(node) {
                Ok((drive, tuned)) => self.begin_tuning(drive, asked, async move |drive, restorer| {
                    let Tuned { request, report, proposed } = *tuned;
                    let (found, goes_back) = ((report, proposed.clone()), std::future::ready(false));
                    let excursion = &mut Excursion::default();
                    let report = try_gains((drive, restorer), &request, found, excursion, &(), goes_back).await?;
                    Ok(Tuned { request, report, proposed })
                }),
                Err(refusal) => refuse(asked, refusal),
            },
        }
    }

    /// What can be found for a node, and what is usual for its model.
    fn tune_form(&self, node: NodeId) -> Result<Value, Refusal> {
        let (drive, _) = self.known_model(node)?;
        if open_loop_of(&drive).is_some() {
            return Ok(json!({ "node": node.raw(), "finds": "ramps" }));
        }
        let (_, loops) = loops_of(&drive).map_err(|failure| refusal(&failure))?;
        Ok(
            json!({ "node": node.raw(), "finds": "gains", "usual_rpm": loops.usual_rpm, "usual_a": loops.usual_a, "in_cycles": loops.demand.is_some() }),
        )
    }

    /// Computes ramps of a stepper, which is only read.
    fn begin_ramps(&mut self, node: NodeId, order: &LoadOrder, asked: Asked) {
        let known = self.known_model(node).and_then(|(drive, _)| {
            order.request().map(|request| (drive, request)).map_err(|failure| refusal(&failure))
        });
        let (drive, request) = match known {
            Ok(known) => known,
            Err(refusal) => return refuse(asked, refusal),
        };
        if !self.parameters.begin_reading() {
            return refuse(asked, busy("too many reads are under way"));
        }
        self.work.push(Box::pin(async move {
            let report = tune_ramps(&drive, &request, &()).await.map_err(|failure| refusal(&failure));
            Done::Looked(asked, report.map(|report| serde_json::to_value(&report).unwrap_or_default()))
        }));
    }

    /// Whether a measurement can begin.
    fn check_tune(&self, node: NodeId, order: &Order) -> Result<(Drive, Request), Refusal> {
        let (drive, _) = self.known_model(node)?;
        self.check_can_test(node)?;
        let (_, loops) = loops_of(&drive).map_err(|failure| refusal(&failure))?;
        // A virtual bus ends with the program, and nothing is left to go back to.
        let journal = self.setting.journals.is_some().then(|| default_path(node));
        let request = order.request(
            loops.usual_rpm,
            cyclic(order.period_ms.unwrap_or(SAMPLE_PERIODS[0].as_secs_f64() * 1e3)),
            journal,
        );
        request.map(|request| (drive, request)).map_err(|failure| refusal(&failure))
    }

    /// Whether a trial can begin: it takes what was proposed.
    fn check_trial(&mut self, node: NodeId) -> Result<(Drive, Box<Tuned>), Refusal> {
        let (drive, _) = self.known_model(node)?;
        self.check_can_test(node)?;
        let tuned = self.tuned.remove(&node);
        tuned.map(|tuned| (drive, tuned)).ok_or_else(|| {
            let text = format!("nothing is proposed for node {node}, or it was tried already: measure it first");
            ("nothing_proposed", text)
        })
    }

    /// Begins a motion of its own: what its future does last is to bring the drive to rest and to put everything back.
    fn begin_tuning(
        &mut self,
        drive: Drive,
        asked: Asked,
        tuning: impl AsyncFnOnce(&Drive, &Restorer) -> Result<Tuned, Failure> + 'static,
    ) {
        let node = drive.node().id();
        let way_back = WayBack::in_network(&self.setting.ways_back);
        let restorer = way_back.of(&drive).clone();
        let accepted = self.accepted.contains(&node);
        let (generation, registration) = self.note_tested(node, TUNING);
        self.work.push(Box::pin(async move {
            let moving = async {
                if !accepted {
                    expect_guard(&drive).await?;
                }
                tuning(&drive, &restorer).await.map_err(|failure| refusal(&failure))
            };
            // A stop drops what sends its set-points.
            let tuned = Abortable::new(moving, registration).await;
            let outcome = tuned.unwrap_or_else(|_| Err(("stopped", "it was stopped".to_owned())));
            let left = restorer.restore().await;
            way_back.remove_if_done();
            Done::Tuned(asked, Box::new(TuneOutcome { node, generation, drive, outcome, left }))
        }));
    }

    /// A measurement or a trial has ended, and everything was put back that is not to stay, or could not be.
    pub(crate) fn conclude_tuning(&mut self, asked: Asked, ended: TuneOutcome) {
        let TuneOutcome { node, generation, drive, outcome, left } = ended;
        self.captures.remove(&node);
        self.conclude_test_motion(node, generation);
        self.parameters.note_mapped(node);
        self.learn_pdos(node);
        let not_back = not_put_back(node, &left).map(|failure| refusal(&with_left(failure, &left)).1);
        let outcome = match outcome {
            Ok(tuned) => {
                let Tuned { report: found, proposed, .. } = &tuned;
                if found.applied {
                    let before = proposed.gains.iter();
                    let values = before.map(|gain| (gain.object, bytes(&drive, gain.object, gain.before))).collect();
                    self.parameters.keep(node, Parameters { node: Some(node), values, ..Parameters::default() });
                }
                let mut value = serde_json::to_value(found).unwrap_or_default();
                if let Ok(tuning) = report::Tuning::deserialize(&value) {
                    self.tunings.insert(node, report::Tuning { picture: found.picture.to_svg(), ..tuning });
                }
                value["curves"] = serde_json::to_value(&found.curves).unwrap_or_default();
                // The page has all that it draws in one place.
                value["curves"]["response"] = value["response"].take();
                value["lacks"] = not_back.into_iter().collect();
                // What was tried is not tried again.
                if found.drive_error.is_none() {
                    self.tuned.insert(node, Box::new(tuned));
                }
                Ok(value)
            }
            Err((kind, text)) => Err((kind, not_back.into_iter().fold(text, |text, lacks| format!("{text}; {lacks}")))),
        };
        if let Err((kind, text)) = &outcome
            && !matches!(*kind, "usage" | UNGUARDED)
        {
            self.send_news(Some(node), text);
        }
        answer(asked, outcome);
    }
}
