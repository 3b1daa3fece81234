//! A scenario with a host outside of it: its bus is served, and goes with the clock.

use std::collections::VecDeque;
use std::path::Path;

use scenario::{Execution, Outcome, Scenario};
use serve::messages::Messages;
use serve::pacer::{Clock, Pacer, Speed};
use serve::service::{PARTING_PATIENCE, REQUESTS_WAITING, Service, tick};
use serve::world::ServedWorld;
use serve::writing::Pace;
use tokio::sync::mpsc;
use transport::{Hub, HubOptions, ServeSpec, WallClock, run_world};

use super::loaded::unbuildable;
use crate::failure::Failure;
use crate::output::ready_line;
use crate::recording::RecordOptions;
use crate::served::{
    ClockArg, ControlOptions, ServiceRequest, at_the_end, is_typed, listen_to_signals, runtime_of_clients,
};
use crate::session::not_served;

/// Where and how fast a scenario is served.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct ServeOptions {
    /// Serve the scenario's bus to an outside host: socketcand://HOST:PORT or slcan://HOST:PORT; port 0 takes a free
    /// one; may be repeated
    ///
    /// One line that begins with `ready` names every listener. Time begins when the first client has connected, and
    /// follows the clock; the command ends when the scenario does, with its result and exit status.
    #[arg(long = "serve", value_name = "URL")]
    places: Vec<ServeSpec>,
    /// Speed of a served scenario as a multiple of the clock, e.g. 10 or 0.1, or max
    #[arg(long, value_name = "N|max", conflicts_with = "clock", requires = "places")]
    speed: Option<Speed>,
    /// What advances the time of a served scenario: the clock, or `run` on the control connection (manual)
    #[arg(long, value_name = "real|manual", value_enum, default_value = "real")]
    clock: ClockArg,
    #[command(flatten)]
    control: ControlOptions,
}

impl ServeOptions {
    /// A host outside is asked for.
    pub(super) fn is_asked_for(&self) -> bool {
        !self.places.is_empty() || self.control.place().is_some()
    }

    /// Refuses a clock that nothing could advance.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.clock == ClockArg::Manual && self.control.place().is_none() {
            return Err(Failure::usage("the time cannot be advanced with --clock manual")
                .because("that is for a scenario that is served to programs outside")
                .next("give --serve URL, and --control 127.0.0.1:0: its clients advance time with `run 20ms`"));
        }
        Ok(())
    }

    /// Goes through the scenario with a host outside; what came of it, and what ended it if that was not its own end.
    ///
    /// # Errors
    /// That it cannot be begun or served.
    pub(super) fn run(
        &self,
        scenario: &Scenario,
        seed: Option<u64>,
        threads: usize,
        recording: &RecordOptions,
        (file, json): (&Path, bool),
    ) -> Result<(Outcome, Result<(), Failure>), Failure> {
        let (mut world, execution) = Execution::begin(scenario, seed).map_err(|bad| unbuildable(file, bad))?;
        world.set_threads(threads);
        let warnings = Messages::of_warnings();
        let real_time = self.clock == ClockArg::Real && self.speed.is_none();
        let pace = if real_time { Pace::RealTime } else { Pace::Free };
        let record = recording.start(&mut world, pace, warnings.clone())?;
        let pacer = Pacer::new(Clock::from(self.clock), self.speed.unwrap_or(Speed::Times(1.0))).waiting_for_a_client();
        let world = ServedWorld::new(world, pacer, record.is_some(), warnings.clone());
        let answers = Messages::of_answers(warnings.clone());
        let (waiting, by_hand) = (VecDeque::new(), self.clock == ClockArg::Manual);
        let is_typed = is_typed();
        let service = Service { answers, warnings, log: None, record, waiting, quit_in: None, by_hand, is_typed };
        runtime_of_clients()?.block_on(self.serve(world, execution, service, json))
    }

    async fn serve(
        &self,
        mut world: ServedWorld,
        execution: Execution,
        mut service: Service,
        json: bool,
    ) -> Result<(Outcome, Result<(), Failure>), Failure> {
        let clock = WallClock::start();
        let (requests, mut incoming) = mpsc::channel(REQUESTS_WAITING);
        listen_to_signals(requests.clone());
        let options = HubOptions { bitrate: Some(world.bitrate()), zero: clock.unix_zero(), ..HubOptions::default() };
        let mut hub = Hub::bind(&self.places, options, &clock).await.map_err(|error| not_served(&error))?;
        let control = self.control.serve(&mut world, &requests, &service.warnings).await?;
        let (run_is_over, scenario_is_over, full) = (requests.clone(), requests.clone(), requests.clone());
        world.on_run_over(move || run_is_over.try_send(ServiceRequest::RunIsOver).is_ok());
        world.on_full_piece(move || full.try_send(ServiceRequest::PieceIsFull).is_ok());
        world.follow(execution, move || scenario_is_over.try_send(ServiceRequest::ScenarioIsOver).is_ok());
        let places = hub.listeners().iter().map(ToString::to_string);
        let places: Vec<_> = places.chain(control.iter().map(|server| server.place().to_string())).collect();
        service.answers.say(&ready_line(json, &places));
        tokio::spawn(tick(requests.clone(), clock.clone()));
        let serving =
            run_world(&mut world, &mut hub, &clock, &mut incoming, |world, request| service.serve(world, request));
        let ended = serving.await;
        let ended = at_the_end(ended, service.part(&mut world));
        let (mut world, execution) = world.into_course();
        if let Some(control) = control {
            control.part(PARTING_PATIENCE).await;
        }
        let execution = execution
            .ok_or_else(|| Failure::new("the scenario was lost on the way").next("run it again without --serve"))?;
        Ok((execution.conclude(&mut world), ended))
    }
}
