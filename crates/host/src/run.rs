//! The loop: handles requests, deadlines and ended work, and publishes the state.

use std::time::Duration;

use can::{Bitrate, Instant};
use futures_util::StreamExt;

use crate::answer::Answer;
use crate::session::DeadMan;
use crate::session::authority::SessionId;
use crate::session::handle::{Request, StateUpdate};
use crate::snapshot::{BusView, Snapshot};
use crate::state::{Host, PRESENCE_SPAN, TICK};
use crate::work::{LineOf, send};
use can::BusFrame;

/// Period of the state while a page is connected, and while none is.
const STATE_INTERVAL: Duration = Duration::from_millis(50);
const UNSEEN_INTERVAL: Duration = Duration::from_millis(500);

/// Most sessions at once; a further one is refused.
const MAX_SESSIONS: usize = 256;

impl Host {
    /// Serves until every handle is dropped. `passed` returns the frames since its last call.
    pub async fn run(mut self, mut passed: impl FnMut() -> Option<BusFrame>) {
        self.begin_scan(None);
        let mut tick = self.network.sleep(TICK);
        loop {
            tokio::select! {
                biased;
                stop = self.inbox.stops.changed() => match stop {
                    Ok(()) => self.stop_everything("stopped by a press of stop"),
                    Err(_) => return,
                },
                Some(session) = self.lifelines.next(), if !self.lifelines.is_empty() => self.leave(session),
                // Before requests: a flood of requests must not delay a dead man.
                () = &mut tick => {
                    tick = self.network.sleep(TICK);
                    self.tick(&mut passed);
                }
                request = self.inbox.requests.recv() => match request {
                    Some(request) => self.take(request),
                    None => return,
                },
                Some(done) = self.work.next(), if !self.work.is_empty() => self.finish(done),
            }
        }
    }

    fn tick(&mut self, passed: &mut impl FnMut() -> Option<BusFrame>) {
        let now = self.network.now();
        self.stop_what_is_not_held(now);
        while let Some(passed) = passed() {
            self.meter.note(&passed.frame);
            self.heard_ids.note(&passed.frame, passed.at);
            self.inbox.trace.append(passed);
            if !passed.own {
                self.listening.iter_mut().for_each(|listening| listening.heard.note(&passed.frame, passed.at));
            }
        }
        self.meter.look(now);
        self.explain_what_was_heard(now);
        self.hear_events();
        while let Some(text) = self.setting.wire.take_news() {
            self.send_news(None, &text);
        }
        let interval = if self.authority.sessions() > 0 { STATE_INTERVAL } else { UNSEEN_INTERVAL };
        if now - self.shown_at >= interval {
            self.shown_at = now;
            self.show(now);
        }
    }

    fn take(&mut self, request: Request) {
        match request {
            Request::Join { liveness, welcome } => {
                if self.authority.sessions() == MAX_SESSIONS {
                    return;
                }
                let session = self.authority.join();
                // A session that disconnected before its welcome ends at once.
                let _ = welcome.send(session);
                self.lifelines.push(Box::pin(async move {
                    let _ = liveness.await;
                    session
                }));
            }
            Request::Do { session, seq, command, answer } => {
                if let Err(refusal) = self.authority.accept(session, seq) {
                    send(answer, Answer::failed(Some(seq), refusal.kind(), refusal.to_string()));
                    return;
                }
                if self.authority.controller() == Some(session) {
                    self.presence = Some(DeadMan::new(PRESENCE_SPAN, self.network.now()));
                }
                self.take_command(session, seq, command, answer);
            }
        }
    }

    fn leave(&mut self, session: SessionId) {
        self.speed_limits.remove(&session);
        self.leave_lines(LineOf::Session(session));
        if self.authority.leave(session) {
            (self.presence, self.held_by) = (None, None);
            self.accepted.clear();
            self.tuned.clear();
            self.stop_moved("the page that moved it has disconnected");
        }
    }

    /// Publishes the state of everything.
    fn show(&mut self, now: Instant) {
        self.states += 1;
        let snapshot = Snapshot {
            number: self.states,
            time_s: (now - Instant::ZERO).as_secs_f64(),
            bus: BusView {
                name: self.setting.bus.clone(),
                bitrate: self.setting.bitrate.map(Bitrate::bits_per_second),
                frames_per_s: self.meter.frames_per_s(),
                load_percent: self.meter.load_percent(),
                health: self.setting.wire.health(),
            },
            scanning: self.scanning,
            sessions: self.authority.sessions(),
            controller: self.authority.controller(),
            asking: self.authority.asking(),
            speed_limit_rpm: self.authority.controller().and_then(|session| self.speed_limits.get(&session).copied()),
            happenings: self.inbox.timeline.revision(),
            stops: self.stops,
            logs_saved: self.inbox.trace.logs_saved(),
            changes: self.changes.count(),
            nodes: self.nodes.iter().map(|(id, node)| self.view(*id, node, now)).collect(),
        };
        // There may be no receiver.
        let _ = self.inbox.states.send(StateUpdate::from(snapshot));
    }
}
