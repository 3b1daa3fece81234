//! `ferrodrive top`: drives in a terminal, for an SSH session on the robot.
//!
//! It is a page of the studio without a browser: the same [`Host`] owns the bus and everything that moves, and this terminal is one of
//! its sessions. [`hold`] detects a held key, [`app`] what keys mean, [`screen`] draws; this file joins them to a terminal.

mod app;
mod hold;
mod samples;
mod screen;
mod suspend;
#[cfg(test)]
mod tests;

use std::io::{IsTerminal, stdin, stdout};
use std::pin::pin;
use std::time::Duration;

use crossterm::event::{
    DisableFocusChange, EnableFocusChange, Event, KeyboardEnhancementFlags, PopKeyboardEnhancementFlags,
    PushKeyboardEnhancementFlags,
};
use crossterm::{execute, terminal};
use host::{Host, LocalClient, Shown};
use master::drive::Stopped;
use ratatui::DefaultTerminal;
use recording::Channels;
use serde_json::Value;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::studio::setting;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Format;
use crate::recording::{HostViewers, ViewerOptions};
use app::{Action, App};
use samples::READING;
use screen::Look;

/// Show and move drives in this terminal: states, plots, faults, keys to jog and stop
///
/// Works over SSH in 80 columns and 24 lines. A drive is jogged only while its key is held, which is detected by the
/// key's repeats: a press alone moves nothing. What was moved from here stops when this command ends, however it ends.
/// Without --bus it shows a virtual machine whose time follows the clock.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive top\n  ferrodrive --bus can0 --machine machine.toml top\n\n\
    Keys: ? shows them. SPACE and Esc stop every drive.")]
pub(crate) struct Top {
    #[command(flatten)]
    viewers: ViewerOptions,
}

/// How often time is looked at: what is no longer held ends so much later at most.
const TICK: Duration = Duration::from_millis(10);

/// How often the host gets a sign of life of this terminal. It waits for 3 s.
const ALIVE: Duration = Duration::from_millis(500);

/// Keys that may wait. People type no faster; what finds no room was held up on its way.
const KEYS: usize = 64;

/// How often the terminal's thread looks whether it is still wanted.
const KEY_POLL: Duration = Duration::from_millis(100);

impl Top {
    /// Shows until `q`, or until the terminal or the bus is gone.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        if !stdin().is_terminal() || !stdout().is_terminal() {
            return Err(Failure::usage("not a terminal that can be drawn on")
                .next("ferrodrive watch NODE OBJECT .. --json prints what changes, a line each")
                .next("ferrodrive studio serves the same as a page and as /api/state"));
        }
        let server = self.viewers.start(Channels::exact(&[]), |note| context.note(note))?;
        context.progress.clear();
        context.traffic.listen();
        let (host, app) = Host::new(context.network.clone(), setting(context));
        let viewers = HostViewers::new(server);
        let showing = viewers.serve(&app);
        let mut host = pin!(host.run(|| viewers.note(context.traffic.take())));
        tokio::select! {
            ended = show(context, app, format) => ended?,
            () = &mut host => {}
            never = showing => match never {},
        }
        stop(context).await
    }
}

/// Stops what was moved from here, before the bus is left.
async fn stop(context: &Context) -> Result<(), Failure> {
    let stopped = context.network.stop_and_release().await;
    stopped.into_iter().try_for_each(|Stopped { node, outcome, .. }| match outcome {
        Ok(_) => Ok(()),
        Err(error) => Err(Failure::from(error).because(format!("node {node} was moving, and may still be"))),
    })
}

/// The terminal, given back as it was when this is dropped.
struct Screen {
    terminal: DefaultTerminal,
    tells_releases: bool,
}

impl Screen {
    /// Whether it tells releases is asked for where that is not known: not beside a thread that waits for keys, which would hear the
    /// answer.
    fn take(tells_releases: Option<bool>) -> std::io::Result<Self> {
        let terminal = ratatui::try_init()?;
        let tells_releases =
            tells_releases.unwrap_or_else(|| terminal::supports_keyboard_enhancement().unwrap_or(false));
        let _ = execute!(stdout(), EnableFocusChange);
        if tells_releases {
            let _ = execute!(stdout(), PushKeyboardEnhancementFlags(KeyboardEnhancementFlags::REPORT_EVENT_TYPES));
        }
        Ok(Self { terminal, tells_releases })
    }
}

impl Screen {
    /// What was moved from here stops, and the process stands still, its terminal as it was, until the shell continues it.
    async fn left_to_the_shell(self, context: &Context) -> std::io::Result<Self> {
        let stopped = stop(context).await;
        let tells_releases = self.tells_releases;
        drop(self);
        if let Err(failure) = stopped {
            context.note(&failure.to_string());
        }
        suspend::suspend();
        Self::take(Some(tells_releases))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if self.tells_releases {
            let _ = execute!(stdout(), PopKeyboardEnhancementFlags);
        }
        let _ = execute!(stdout(), DisableFocusChange);
        ratatui::restore();
    }
}

/// Events of the terminal, from a thread that waits for them. It ends when the receiver is dropped; so does the channel with the terminal.
fn listen() -> mpsc::Receiver<Event> {
    let (sender, receiver) = mpsc::channel(KEYS);
    std::thread::spawn(move || {
        while !sender.is_closed() {
            match crossterm::event::poll(KEY_POLL) {
                Ok(false) => {}
                Ok(true) => match crossterm::event::read() {
                    // A key that finds no room has been held up: it says nothing of now.
                    Ok(event) => drop(sender.try_send(event)),
                    Err(_) => return,
                },
                Err(_) => return,
            }
        }
    });
    receiver
}

/// What is awaited: the node that it is about, the object if it is a reading of one, and the answer.
type Answers = JoinSet<(Option<u64>, Option<String>, Value)>;

fn say(client: &mut LocalClient, answers: &mut Answers, message: Value) {
    let node = message["node"].as_u64();
    let object = message["objects"][0].as_str().filter(|_| message["do"] == READING).map(str::to_owned);
    let answer = client.say(message);
    answers.spawn(async move { (node, object, answer.await) });
}

async fn show(context: &Context, host: host::HostHandle, format: Format) -> Result<(), Failure> {
    let gone = || Failure::new("the host of the drives has ended");
    let mut client = LocalClient::take(&host).await.ok_or_else(gone)?;
    let cannot = |error: std::io::Error| Failure::new("cannot draw on this terminal").because(error);
    let mut screen = Screen::take(None).map_err(cannot)?;
    let look = Look { colour: format.paint.is_on() };
    let mut events = listen();
    let mut app = App::new(client.id());
    let size = screen.terminal.size().map_err(cannot)?;
    app.resize(size.width, size.height, context.network.now());
    let mut answers = Answers::new();
    say(&mut client, &mut answers, serde_json::json!({ "do": "take_control" }));
    let mut suspensions = suspend::Suspensions::listen();
    let (mut tick, mut alive) = (tokio::time::interval(TICK), tokio::time::interval(ALIVE));
    let mut is_new = true;
    loop {
        if is_new {
            screen.terminal.draw(|frame| screen::draw(frame, &app, look)).map_err(cannot)?;
            is_new = false;
        }
        let now = context.network.now();
        let actions = tokio::select! {
            biased;
            event = events.recv() => {
                is_new = true;
                match event {
                    Some(Event::Key(key)) => app.key(key, now),
                    Some(Event::Resize(columns, lines)) => app.resize(columns, lines, now),
                    Some(Event::FocusLost) => app.lose_focus(now),
                    Some(_) => Vec::new(),
                    // The terminal has gone: what is held by it stops with the session.
                    None => return Ok(()),
                }
            }
            _ = tick.tick() => app.look(context.network.now()),
            _ = alive.tick() => vec![Action::Say(serde_json::json!({ "do": "alive" }))],
            shown = client.shown() => {
                is_new = true;
                match shown {
                    Shown::State(state) => app.take(state),
                    Shown::News(news) => app.note(news),
                    Shown::Missed(missed) => app.report(None, format!("{missed} messages came too fast to be shown")),
                    Shown::Over => return Err(gone()),
                }
                Vec::new()
            }
            Some(Ok((node, object, answer))) = answers.join_next() => {
                match object {
                    Some(object) => app.object_read(node, &object, &answer, context.network.now()),
                    None => is_new |= app.answered(node, &answer),
                }
                Vec::new()
            }
            () = suspensions.next() => app.suspend(now),
        };
        for action in actions {
            match action {
                Action::Quit => return Ok(()),
                Action::Say(message) => say(&mut client, &mut answers, message),
                Action::Suspend => {
                    screen = screen.left_to_the_shell(context).await.map_err(cannot)?;
                    let size = screen.terminal.size().map_err(cannot)?;
                    app.resize(size.width, size.height, context.network.now());
                    is_new = true;
                }
            }
        }
    }
}
