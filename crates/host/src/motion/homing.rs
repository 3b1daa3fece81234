//! Data of the homing wizard: the methods of a drive and what each does (CiA 402-2, clause 11, or the drive's own),
//! its homing settings, the levels of its switches, and the progress of a run. Reads only; the run is [`Motion::Home`](master::drive::Motion::Home).
//!
//! The sequence of a method is in the description ([`HomingRules::sequence`]); the page draws it from this data.

use canopen::{Mux, NodeId};
use cia402::object::{
    HOME_OFFSET, HOMING_ACCELERATION, SPEED_DURING_SEARCH_FOR_SWITCH, SPEED_DURING_SEARCH_FOR_ZERO, STATUSWORD,
};
use cia402::{Direction, HomingMethod, HomingSequence, HomingSwitch, ModeOfOperation, Statusword, SwitchEdge};
use devices::{AxisDescription, Description, HomingRules, InputSignal, Meaning, Terminals};
use master::units::Rpm;
use master::{Drive, Error};
use serde::Serialize;
use serde_json::{Value, json};

use crate::answer::Answer;
use crate::parameters::object_rows::value_text;
use crate::state::Host;
use crate::work::{Asked, Done, refusal_of, send};

/// Homing settings (CiA 402-2, 11.2): speed to the switch, speed to the edge, acceleration, and home offset.
const SETTINGS: [Mux; 4] =
    [SPEED_DURING_SEARCH_FOR_SWITCH, SPEED_DURING_SEARCH_FOR_ZERO, HOMING_ACCELERATION, HOME_OFFSET];

impl Host {
    /// Reads the data of the wizard from a drive.
    pub(crate) fn look_at_homing(&mut self, node: NodeId, (seq, answer): Asked) {
        let known = self.nodes.get(&node).and_then(|known| known.drive.clone());
        let found = known.and_then(|drive| Some((drive.description()?, drive.axis_description()?, drive)));
        let Some((model, axis, drive)) = found else {
            let text = "its model is unknown: scan the bus, or give it with --model";
            return send(answer, Answer::failed(Some(seq), "no_such_drive", text));
        };
        let Some(rules) = axis.homing else {
            let text = format!("the {} has no homing mode", model.title);
            return send(answer, Answer::failed(Some(seq), "no_such_mode", text));
        };
        if !self.parameters.begin_reading() {
            let text = "too many reads are under way: try again";
            return send(answer, Answer::failed(Some(seq), "busy", text));
        }
        let running = self.running.get(&node).is_some_and(|running| running.what == "homing");
        self.work.push(Box::pin(async move {
            let outcome = Seen::look(&drive, model, axis, rules).await;
            let shown = outcome.map(|seen| seen.to_json(node, running)).map_err(|error| refusal_of(&error));
            Done::Looked((seq, answer), shown)
        }));
    }
}

/// The values read from a drive.
struct Seen {
    model: &'static Description,
    rules: HomingRules,
    /// Value of 6098h.
    method: i64,
    settings: Vec<Value>,
    /// Name, function and level of each input.
    inputs: Vec<(&'static str, Option<InputSignal>, Option<bool>)>,
    /// For a drive in mode 6.
    statusword: Option<Statusword>,
    /// Which way the shaft turns; `None` of one at rest.
    heading: Option<Direction>,
}

/// A method as the page draws it.
#[derive(Debug, PartialEq, Serialize)]
struct MethodView {
    method: i8,
    /// Its entry in the drive's table.
    title: &'static str,
    /// Nothing moves: the present position becomes home.
    here: bool,
    /// The switch that it searches for.
    switch: Option<&'static str>,
    search: Option<&'static str>,
    reverses_at_limit: bool,
    /// The switch goes on or off at the home position.
    edge: Option<&'static str>,
    crossing: Option<&'static str>,
    /// The index pulse that it searches for then, or alone.
    index: Option<&'static str>,
    /// Switches that it needs and no input is configured as; empty where the inputs are unknown.
    missing: Vec<&'static str>,
    /// Limit switches that would reverse the search and are missing.
    no_turn: Vec<&'static str>,
}

impl Seen {
    async fn look(
        drive: &Drive,
        model: &'static Description,
        axis: &AxisDescription,
        rules: HomingRules,
    ) -> Result<Self, Error> {
        let method = number(drive, model, rules.method).await?.unwrap_or_default();
        let mut settings = Vec::new();
        for mux in SETTINGS.map(|mux| axis.object(mux)) {
            let Some(row) = model.row(mux) else { continue };
            let Some(bytes) = bytes(drive, mux).await? else { continue };
            let limits = drive.limits(mux).await.ok().map(|limits| limits.to_string());
            settings.push(json!({
                "object": mux.to_string(),
                "name": row.name,
                "title": row.title,
                "unit": row.unit,
                "value": row.data_type.value(raw(&bytes)).to_string(),
                "text": value_text(model, mux, &bytes),
                "takes": limits,
            }));
        }
        let inputs = inputs(drive, model, axis, &rules.switches).await?;
        let mode = number(drive, model, axis.mode_display).await?;
        let in_homing = mode == Some(i64::from(ModeOfOperation::HOMING.0));
        let statusword = number(drive, model, axis.object(STATUSWORD)).await?.filter(|_| in_homing);
        let velocity_rpm = match axis.units.actual_velocity {
            Some(quantity) => drive.read_quantity(quantity).await.ok(),
            None => None,
        };
        let turning = velocity_rpm.filter(|rpm| !drive.stands_at(Rpm(*rpm)));
        let heading = turning.map(|rpm| if rpm < 0.0 { Direction::Negative } else { Direction::Positive });
        let statusword = statusword.map(|word| Statusword(word as u16));
        Ok(Self { model, rules, method, settings, inputs, statusword, heading })
    }

    fn to_json(&self, node: NodeId, running: bool) -> Value {
        let row = self.model.row(self.rules.method);
        // A table of values, or a range; numbers without a meaning are omitted.
        let offered = (i8::MIN..=i8::MAX).filter(|number| {
            row.is_some_and(|row| {
                let (low, high) = row.limits_at(1);
                let number = i64::from(*number);
                (low..=high).contains(&number) && (row.values.is_empty() || row.meaning(number).is_some())
            })
        });
        let methods = offered.filter_map(|number| {
            let title = row.and_then(|row| row.meaning(number.into())).unwrap_or_default();
            Some(self.method(number, title, self.rules.sequence(HomingMethod(number))?))
        });
        let methods: Vec<_> = methods.collect();
        let inputs = self.inputs.iter().map(
            |(name, signal, active)| json!({ "name": name, "signal": signal.map(InputSignal::name), "active": active }),
        );
        let inputs: Vec<_> = inputs.collect();
        let running_sequence =
            i8::try_from(self.method).ok().and_then(|number| self.rules.sequence(HomingMethod(number)));
        let ended = self.statusword.filter(|_| !running).and_then(|word| {
            let (attained, failed) = (self.rules.attained.matches(word), self.rules.failed.matches(word));
            if attained { Some("attained") } else { failed.then_some("failed") }
        });
        json!({
            "node": node.raw(),
            "method": self.method,
            "methods": methods,
            "settings": self.settings,
            "inputs": inputs,
            "remark": self.rules.remark,
            "running": running,
            "phase": running_sequence.filter(|_| running).map(|sequence| self.phase(sequence)),
            "ended": ended,
        })
    }

    fn method(&self, method: i8, title: &'static str, sequence: HomingSequence) -> MethodView {
        let row = sequence.switch;
        let lacks = |switch: &HomingSwitch| self.has(*switch) == Some(false);
        let limits = [HomingSwitch::NegativeLimit, HomingSwitch::PositiveLimit];
        let turns = row.filter(|row| row.reverses_at_limit);
        MethodView {
            method,
            title,
            here: row.is_none() && sequence.index.is_none(),
            switch: row.map(|row| signal_of(row.switch).name()),
            search: row.map(|row| direction(row.search)),
            reverses_at_limit: turns.is_some(),
            edge: row.map(|row| if row.edge == SwitchEdge::Rising { "on" } else { "off" }),
            crossing: row.map(|row| direction(row.crossing)),
            index: sequence.index.map(direction),
            missing: row
                .map(|row| row.switch)
                .filter(lacks)
                .map(|switch| signal_of(switch).name())
                .into_iter()
                .collect(),
            no_turn: turns
                .into_iter()
                .flat_map(|_| limits.into_iter().filter(lacks))
                .map(|switch| signal_of(switch).name())
                .collect(),
        }
    }

    /// Whether an input is configured as this switch; `None` where the drive does not report it. An input whose function the method
    /// chooses counts for any method that gives it one.
    fn has(&self, switch: HomingSwitch) -> Option<bool> {
        let signal = signal_of(switch);
        if self.inputs.is_empty() {
            return None;
        }
        let by_method = self.rules.switches.inputs.iter().any(|input| match input.meaning {
            Meaning::Chosen { function, signals } => {
                function == self.rules.method && signals.iter().any(|(_, chosen)| *chosen == signal)
            }
            Meaning::Fixed(_) => false,
        });
        Some(by_method || self.inputs.iter().any(|(_, set_to, _)| *set_to == Some(signal)))
    }

    /// The phase of a run, by its switch and the direction in which the shaft turns.
    fn phase(&self, sequence: HomingSequence) -> String {
        let heading = self.heading;
        let moving = heading.map_or_else(|| "at rest".to_owned(), |heading| format!("moving {}ly", direction(heading)));
        let Some(row) = sequence.switch else { return format!("{moving}, searching for the index pulse") };
        let switch = signal_of(row.switch);
        let name = switch.name();
        let state = self.inputs.iter().find(|(_, signal, _)| *signal == Some(switch)).and_then(|(.., active)| *active);
        match state {
            None => format!("{moving}; no input shows the {name}"),
            Some(true) => format!("{moving} on the {name}, to its edge"),
            Some(false) if heading == Some(row.search) => format!("{moving}, searching for the {name}"),
            Some(false) if row.reverses_at_limit => {
                format!("{moving} off the {name}, reversed or returning to its edge")
            }
            Some(false) => format!("{moving} off the {name}, returning to its edge"),
        }
    }
}

/// Function and level of each input.
async fn inputs(
    drive: &Drive,
    model: &'static Description,
    axis: &AxisDescription,
    switches: &Terminals,
) -> Result<Vec<(&'static str, Option<InputSignal>, Option<bool>)>, Error> {
    let Some(levels) = switches.levels.map(|levels| axis.object(levels)).filter(|levels| model.row(*levels).is_some())
    else {
        return Ok(Vec::new());
    };
    let levels = number(drive, model, levels).await?;
    let polarity = match switches.polarity {
        Some(polarity) => number(drive, model, axis.object(polarity)).await?.unwrap_or_default(),
        None => 0,
    };
    let mut seen = Vec::new();
    for input in switches.inputs {
        let function = match input.meaning {
            Meaning::Chosen { function, .. } => number(drive, model, axis.object(function)).await?,
            Meaning::Fixed(_) => None,
        };
        let active = levels.map(|levels| Terminals::is_active(input, levels, polarity));
        seen.push((input.name, input.meaning.signal(function), active));
    }
    Ok(seen)
}

/// A number; `None` where the drive does not have it.
async fn number(drive: &Drive, model: &'static Description, mux: Mux) -> Result<Option<i64>, Error> {
    let Some(row) = model.row(mux) else { return Ok(None) };
    let bytes = bytes(drive, mux).await?.filter(|bytes| bytes.len() == row.data_type.size());
    Ok(bytes.map(|bytes| row.data_type.value(raw(&bytes))))
}

/// The value of an object; `None` if the drive refuses to read it.
async fn bytes(drive: &Drive, mux: Mux) -> Result<Option<Vec<u8>>, Error> {
    match drive.node().upload(mux).await {
        Ok(payload) => Ok(Some(payload.as_bytes().to_vec())),
        Err(error) if error.abort().is_some() => Ok(None),
        Err(error) => Err(error),
    }
}

fn raw(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |raw, byte| raw << 8 | u32::from(*byte))
}

const fn signal_of(switch: HomingSwitch) -> InputSignal {
    match switch {
        HomingSwitch::NegativeLimit => InputSignal::NegativeLimit,
        HomingSwitch::PositiveLimit => InputSignal::PositiveLimit,
        HomingSwitch::Home => InputSignal::Home,
    }
}

const fn direction(direction: Direction) -> &'static str {
    match direction {
        Direction::Negative => "negative",
        Direction::Positive => "positive",
    }
}
