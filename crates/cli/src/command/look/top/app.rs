//! What is on the screen, and what each key does to it. Without a terminal, a clock or a bus: keys, states and times go in, messages
//! to the host come out.

use std::sync::Arc;

use can::Instant;
use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use host::{News, NodeView, SessionId, Snapshot};
use serde_json::{Value, json};

use super::hold::{Act, Hold};
use super::samples::{Past, Plotted};

/// Columns and lines in which everything fits.
pub(super) const LEAST: (u16, u16) = (80, 24);

/// Speeds to jog at, r/min.
const JOG_RPM: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// The one that is chosen at the start: slow.
const FIRST_JOG: usize = 3;

/// News that are kept, to be read back.
const MOST_NEWS: usize = 500;

/// How far a page key goes back in the news, lines.
const PAGE: usize = 10;

/// What is shown and chosen.
#[derive(Debug)]
pub(super) struct App {
    /// That of this terminal.
    session: SessionId,
    pub(super) state: Arc<Snapshot>,
    pub(super) past: Past,
    /// Newest last.
    pub(super) news: Vec<News>,
    pub(super) chosen: Option<u8>,
    pub(super) help: bool,
    /// How many lines before the last one the news are read, where they are over everything.
    pub(super) read_back: Option<usize>,
    /// What of an object's name has been typed.
    pub(super) typed: Option<String>,
    /// The object that is plotted beside what is always.
    pub(super) object: Option<Plotted>,
    /// The node that was not moved, since nothing stops it when this program dies: whether it is to be moved nevertheless.
    pub(super) question: Option<u8>,
    /// Neither what a key would move nor what is asked before that can be seen.
    is_too_small: bool,
    jog_step: usize,
    hold: Hold,
    /// Which key is or was held: to which side.
    side: f64,
    /// The node that is being jogged, whatever is chosen since.
    jogged: Option<u8>,
}

/// What a key leads to.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    /// To be said to the host.
    Say(Value),
    /// What was moved from here stops, and the shell has the terminal until it continues this program.
    Suspend,
    /// The end.
    Quit,
}

impl App {
    pub(super) fn new(session: SessionId) -> Self {
        Self {
            session,
            state: Arc::default(),
            past: Past::default(),
            news: Vec::new(),
            chosen: None,
            help: false,
            read_back: None,
            typed: None,
            object: None,
            question: None,
            is_too_small: false,
            jog_step: FIRST_JOG,
            hold: Hold::default(),
            side: 1.0,
            jogged: None,
        }
    }

    /// The host has shown something newer.
    pub(super) fn take(&mut self, state: Arc<Snapshot>) {
        self.past.note(&state);
        if self.object.as_ref().is_some_and(|object| state.node(object.node).is_none()) {
            self.object = None;
        }
        self.state = state;
        let is_there = self.chosen.is_some_and(|node| self.state.node(node).is_some());
        if !is_there {
            // The first drive, else the first node.
            let first = self.state.nodes.iter().find(|node| node.drive.is_some()).or(self.state.nodes.first());
            self.chosen = first.map(|node| node.node);
        }
    }

    /// Something has happened.
    pub(super) fn note(&mut self, news: News) {
        if self.news.len() == MOST_NEWS {
            self.news.remove(0);
        }
        self.news.push(news);
    }

    /// Something to show that is not an event of the bus.
    pub(super) fn report(&mut self, node: Option<u8>, text: impl Into<String>) {
        self.note(News { time_s: self.state.time_s, node, text: text.into() });
    }

    /// What became of a message; true if there is something new to show. What was done shows itself.
    pub(super) fn answered(&mut self, node: Option<u64>, answer: &Value) -> bool {
        let node = node.and_then(|node| u8::try_from(node).ok());
        let before = self.news.len();
        if let Some(error) = answer["error"].as_object() {
            let kind = error.get("kind").and_then(Value::as_str).unwrap_or_default();
            if kind == "unguarded" {
                self.question = node;
                return true;
            }
            // The bus has reported it already, or the key was released.
            if !matches!(kind, "stopped" | "replaced" | "not_held") {
                self.report(node, error.get("message").and_then(Value::as_str).unwrap_or("it was refused"));
            }
        }
        for note in answer["notes"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            self.report(node, note);
        }
        if let Some(findings) = answer["result"]["findings"].as_array() {
            let text = |finding: &Value, part: &str| finding[part].as_str().unwrap_or_default().to_owned();
            let causes: Vec<_> = findings.iter().filter(|finding| finding["cause"] == true).collect();
            for finding in &causes {
                self.report(node, format!("{}. {}", text(finding, "follows"), text(finding, "remedy")));
            }
            if causes.is_empty() {
                self.report(node, "nothing is found that keeps it from moving");
            }
        }
        self.news.len() != before || self.news.len() == MOST_NEWS
    }

    /// The node that keys are about.
    pub(super) fn node(&self) -> Option<&NodeView> {
        self.state.node(self.chosen?)
    }

    /// What a jog turns at.
    pub(super) const fn jog_rpm(&self) -> f64 {
        JOG_RPM[self.jog_step]
    }

    /// A jog goes on.
    pub(super) const fn is_jogging(&self) -> bool {
        self.hold.is_held()
    }

    /// Whether this terminal may move drives.
    pub(super) fn has_control(&self) -> bool {
        self.state.controller == Some(self.session)
    }

    /// A key.
    pub(super) fn key(&mut self, key: KeyEvent, now: Instant) -> Vec<Action> {
        let side = match key.code {
            // A letter of a name.
            _ if self.typed.is_some() => None,
            KeyCode::Left | KeyCode::Char('h') => Some(-1.0),
            KeyCode::Right | KeyCode::Char('l') => Some(1.0),
            _ => None,
        };
        if key.kind == KeyEventKind::Release {
            let act = side.filter(|side| *side == self.side).and_then(|_| self.hold.release());
            return self.jog(act);
        }
        if self.is_too_small {
            return match key.code {
                KeyCode::Esc | KeyCode::Char(' ' | 'q' | 'c') => self.other_key(key, now),
                _ => Vec::new(),
            };
        }
        if let Some(node) = self.question {
            let given_up = self.hold.give_up(now);
            return [self.jog(given_up), self.answer(node, key, now)].concat();
        }
        let mut actions = Vec::new();
        // Any other key lets go of what was held.
        if side != Some(self.side) {
            let given_up = self.hold.give_up(now);
            actions.extend(self.jog(given_up));
            if side.is_some() {
                self.hold = Hold::Free;
            }
        }
        if let Some(side) = side {
            self.side = side;
            if !self.help && self.read_back.is_none() {
                let act = self.hold.press(now);
                actions.extend(self.jog(act));
            }
            return actions;
        }
        actions.extend(self.other_key(key, now));
        actions
    }

    /// A key while the question is on the screen.
    fn answer(&mut self, node: u8, key: KeyEvent, now: Instant) -> Vec<Action> {
        // The key that led to it may still be held.
        if matches!(key.code, KeyCode::Left | KeyCode::Right | KeyCode::Char('h' | 'l')) {
            return Vec::new();
        }
        self.question = None;
        match key.code {
            KeyCode::Char('y') => vec![Action::Say(json!({ "do": "accept_unguarded", "node": node }))],
            KeyCode::Esc | KeyCode::Char(' ' | 'q' | 'c') => self.other_key(key, now),
            _ => Vec::new(),
        }
    }

    fn other_key(&mut self, key: KeyEvent, now: Instant) -> Vec<Action> {
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            // What stops comes first, whatever is on the screen.
            KeyCode::Esc | KeyCode::Char(' ') => {
                self.typed = None;
                vec![Action::Say(json!({ "do": "stop_all" }))]
            }
            KeyCode::Char('c') if control => vec![Action::Quit],
            KeyCode::Char('z') if control => self.suspend(now),
            _ if self.typed.is_some() => self.type_on(key),
            KeyCode::Char('q') => vec![Action::Quit],
            _ if self.read_back.is_some() => self.turn_page(key),
            KeyCode::Char('w') => {
                self.read_back = Some(0);
                Vec::new()
            }
            KeyCode::Char('o') => {
                self.typed = Some(String::new());
                Vec::new()
            }
            KeyCode::Char('?') => {
                self.help = !self.help;
                Vec::new()
            }
            _ if self.help => {
                self.help = false;
                Vec::new()
            }
            KeyCode::Up | KeyCode::Char('k') => self.choose(-1),
            KeyCode::Down | KeyCode::Char('j') => self.choose(1),
            KeyCode::Char('+' | '=') => self.faster(1),
            KeyCode::Char('-') => self.faster(-1),
            KeyCode::Char('e') => self.say("enable"),
            KeyCode::Char('d') => self.say("disable"),
            KeyCode::Char('s') => self.say("stop"),
            KeyCode::Char('r') => self.say("reset_fault"),
            KeyCode::Char('x') => self.say("explain"),
            KeyCode::Char('n') => vec![Action::Say(json!({ "do": "scan" }))],
            KeyCode::Char('t') => vec![Action::Say(json!({ "do": "take_control" }))],
            _ => {
                self.report(None, "this key does nothing here; ? shows those that do");
                Vec::new()
            }
        }
    }

    /// Time has passed.
    pub(super) fn look(&mut self, now: Instant) -> Vec<Action> {
        let act = self.hold.look(now);
        let mut actions = self.jog(act);
        actions.extend(self.object.as_mut().and_then(|object| object.ask(now)).map(Action::Say));
        actions
    }

    /// The shell is to have the terminal.
    pub(super) fn suspend(&mut self, now: Instant) -> Vec<Action> {
        let mut actions = self.lose_focus(now);
        actions.push(Action::Suspend);
        actions
    }

    /// A key while the name of an object is typed.
    fn type_on(&mut self, key: KeyEvent) -> Vec<Action> {
        let Some(typed) = &mut self.typed else { return Vec::new() };
        match key.code {
            KeyCode::Char(letter) => typed.push(letter),
            KeyCode::Backspace => drop(typed.pop()),
            KeyCode::Enter => {
                let name = std::mem::take(typed);
                self.typed = None;
                self.object = self.chosen.filter(|_| !name.is_empty()).map(|node| Plotted::new(node, name));
            }
            _ => self.typed = None,
        }
        Vec::new()
    }

    /// A key while the news are read back.
    fn turn_page(&mut self, key: KeyEvent) -> Vec<Action> {
        let at = self.read_back.unwrap_or(0);
        let most = self.news.len().saturating_sub(1);
        self.read_back = match key.code {
            KeyCode::Up | KeyCode::Char('k') => Some((at + 1).min(most)),
            KeyCode::Down | KeyCode::Char('j') => Some(at.saturating_sub(1)),
            KeyCode::PageUp => Some((at + PAGE).min(most)),
            KeyCode::PageDown => Some(at.saturating_sub(PAGE)),
            KeyCode::Home => Some(most),
            KeyCode::End => Some(0),
            _ => None,
        };
        Vec::new()
    }

    /// What became of a reading of an object; another one may be plotted by now.
    pub(super) fn object_read(&mut self, node: Option<u64>, name: &str, answer: &Value, now: Instant) {
        let is_plotted = |object: &&mut Plotted| node == Some(object.node.into()) && object.name == name;
        let Some(object) = self.object.as_mut().filter(is_plotted) else { return };
        if let Err(why) = object.take(answer, (now, self.state.time_s)) {
            let (node, name) = (object.node, object.name.clone());
            self.object = None;
            self.report(Some(node), format!("{name} is not plotted: {why}"));
        }
    }

    /// The terminal has this size.
    pub(super) fn resize(&mut self, columns: u16, lines: u16, now: Instant) -> Vec<Action> {
        self.is_too_small = columns < LEAST.0 || lines < LEAST.1;
        if self.is_too_small { self.lose_focus(now) } else { Vec::new() }
    }

    /// The terminal has lost the keyboard.
    pub(super) fn lose_focus(&mut self, now: Instant) -> Vec<Action> {
        let act = self.hold.give_up(now);
        self.jog(act)
    }

    fn jog(&mut self, act: Option<Act>) -> Vec<Action> {
        let Some(act) = act else { return Vec::new() };
        if act == Act::Begin {
            let asks = |node: &NodeView| self.has_control() && node.goes_on && !node.accepted;
            self.question = self.node().filter(|node| asks(node)).map(|node| node.node);
            self.jogged = if self.question.is_some() { None } else { self.chosen };
        }
        let Some(node) = self.jogged else { return Vec::new() };
        let message = match act {
            Act::Begin => json!({ "do": "jog", "node": node, "rpm": self.side * self.jog_rpm() }),
            Act::Renew => json!({ "do": "jog_hold", "node": node }),
            Act::End => json!({ "do": "jog_end", "node": node }),
        };
        vec![Action::Say(message)]
    }

    fn say(&mut self, command: &str) -> Vec<Action> {
        let Some(node) = self.chosen else {
            self.report(None, "no node has been heard: n scans the bus");
            return Vec::new();
        };
        vec![Action::Say(json!({ "do": command, "node": node }))]
    }

    fn choose(&mut self, by: isize) -> Vec<Action> {
        let at = self.state.nodes.iter().position(|node| Some(node.node) == self.chosen).unwrap_or(0);
        let last = self.state.nodes.len().saturating_sub(1);
        let to = at.saturating_add_signed(by).min(last);
        self.chosen = self.state.nodes.get(to).map(|node| node.node);
        Vec::new()
    }

    fn faster(&mut self, by: isize) -> Vec<Action> {
        self.jog_step = self.jog_step.saturating_add_signed(by).min(JOG_RPM.len() - 1);
        Vec::new()
    }
}
