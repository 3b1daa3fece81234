//! Events of a world ([`sim::events`]) as programs read them, and a filter for them.
//!
//! ```
//! use core::time::Duration;
//! use sim::World;
//! use host::events::{Filter, json};
//! use machine::file::Machine;
//!
//! let mut world = Machine::parse("[[drive]]\nmodel = 'zlac8030l'\nnode = 4")?.build()?;
//! world.watch(true);
//! world.set_power(4, false)?;
//! world.run_for(Duration::from_secs(5));
//! let filter = Filter::new([4], ["power"])?;
//! let event = std::iter::from_fn(|| world.poll_event()).find(|event| filter.takes(event)).ok_or("no event")?;
//! assert_eq!((&json(&event)["node"], &json(&event)["to"]), (&4.into(), &"draining".into()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde_json::{Map, Value, json};
use sim::AxisId;
pub use sim::events::{Event, EventKind, KINDS};

use words::suggest::{did_you_mean, near};

/// Which events are wanted. The default: all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Filter {
    nodes: Vec<u8>,
    kinds: Vec<&'static str>,
}

/// An unknown kind of event.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown kind of event {name:?}{}; expected one of {}", guess(name), names())]
pub struct NoSuchKind {
    /// The name given.
    pub name: String,
}

impl Filter {
    /// Events of these nodes and of these kinds; of all, where none is named.
    ///
    /// # Errors
    /// A kind that is not among [`KINDS`].
    pub fn new<S: AsRef<str>>(
        nodes: impl IntoIterator<Item = u8>,
        kinds: impl IntoIterator<Item = S>,
    ) -> Result<Self, NoSuchKind> {
        let known = |name: S| {
            let found = KINDS.iter().find(|(known, _)| *known == name.as_ref());
            found.map(|(known, _)| *known).ok_or_else(|| NoSuchKind { name: name.as_ref().to_owned() })
        };
        let kinds = kinds.into_iter().map(known).collect::<Result<_, _>>()?;
        Ok(Self { nodes: nodes.into_iter().collect(), kinds })
    }

    /// Whether it is one of them. Every filter passes the note that events are missing.
    pub fn takes(&self, event: &Event) -> bool {
        let of_node = || event.place.is_some_and(|place| self.nodes.contains(&place.node));
        let of_kind = || self.kinds.contains(&event.kind.name());
        matches!(event.kind, EventKind::Missed(_))
            || (self.nodes.is_empty() || of_node()) && (self.kinds.is_empty() || of_kind())
    }
}

fn guess(name: &str) -> String {
    did_you_mean(&near(name, KINDS.map(|(name, _)| name)))
}

fn names() -> String {
    KINDS.map(|(name, _)| name).join(", ")
}

/// An event as an object: `t` in s, `t_ns`, `kind`, `node` and `axis` where it has them, `text` for people, `remedy` where there is one,
/// and what is the kind's own.
pub fn json(event: &Event) -> Value {
    let mut map = Map::new();
    let nanos = event.at.as_nanos();
    map.insert("t".to_owned(), json!(sim::json::rounded(nanos as f64 / 1e9)));
    map.insert("t_ns".to_owned(), json!(nanos));
    map.insert("kind".to_owned(), json!(event.kind.name()));
    if let Some(place) = event.place {
        map.insert("node".to_owned(), json!(place.node));
        if place.axis != AxisId::FIRST {
            map.insert("axis".to_owned(), json!(u16::from(place.axis.0) + 1));
        }
    }
    if let Value::Object(own) = own(&event.kind) {
        map.extend(own);
    }
    map.insert("text".to_owned(), json!(event.kind.to_string()));
    if let Some(remedy) = event.remedy() {
        map.insert("remedy".to_owned(), json!(remedy));
    }
    Value::Object(map)
}

/// Fields of this kind of event only.
fn own(kind: &EventKind) -> Value {
    match kind {
        EventKind::Power(phase) => json!({ "to": phase.word() }),
        EventKind::Nmt { from, to } => json!({ "from": from.map(|from| from.to_string()), "to": to.to_string() }),
        EventKind::State { from, to } => json!({ "from": from.map(|from| from.name()), "to": to.name() }),
        EventKind::Mode(mode) => json!({ "mode": mode.0, "name": mode.name() }),
        EventKind::Fault { code, row } | EventKind::FaultReset { code, row } => {
            json!({ "code": code, "name": row.map(|row| row.name) })
        }
        EventKind::Emcy { emcy, row } => json!({
            "error_code": emcy.code.0,
            "error_register": emcy.error_register,
            "manufacturer": emcy.manufacturer,
            "class": emcy.code.class(),
            "name": row.map(|row| row.name),
        }),
        EventKind::InternalLimit(active) => json!({ "active": active }),
        EventKind::StoreDone { generation } => json!({ "generation": generation }),
        EventKind::BusError { cause, frame, attempt } => {
            json!({ "cause": cause.word(), "frame": frame.to_string(), "attempt": attempt })
        }
        EventKind::BusState { from, to } => json!({ "from": from.word(), "to": to.word() }),
        EventKind::Cable(cut) => json!({ "cut": cut }),
        EventKind::Stimulus { words, by } => json!({ "words": words.as_ref(), "by": by.as_deref() }),
        EventKind::Behind(behind) => json!({ "behind_ms": behind.as_millis() as u64 }),
        EventKind::CaughtUp { worst } => json!({ "worst_ms": worst.as_millis() as u64 }),
        EventKind::Missed(count) => json!({ "count": count }),
        EventKind::Boot | EventKind::TargetReached | EventKind::StoreBegun | EventKind::Damage(_) => Value::Null,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::Instant;
    use sim::stimulus::Place;

    #[test]
    fn a_filter_takes_what_it_names_and_that_something_is_missing() {
        let event = |node, kind| Event { at: Instant::ZERO, place: Some(Place::node(node)), kind };
        let filter = Filter::new([4], ["boot", "fault"]).unwrap();
        assert!(filter.takes(&event(4, EventKind::Boot)));
        assert!(!filter.takes(&event(5, EventKind::Boot)));
        assert!(!filter.takes(&event(4, EventKind::TargetReached)));
        assert!(filter.takes(&Event { place: None, ..event(4, EventKind::Missed(1)) }));
        assert!(Filter::default().takes(&Event { place: None, ..event(4, EventKind::Boot) }));
        let refused = Filter::new([], ["bot"]).unwrap_err().to_string();
        assert!(refused.contains("\"bot\"") && refused.contains("boot") && refused.contains("emcy"), "{refused}");
    }

    #[test]
    fn an_event_has_its_time_exactly_and_for_people() {
        let at = Instant::from_nanos(1_234_567_891);
        let event = Event { at, place: Some("5.2".parse().unwrap()), kind: EventKind::InternalLimit(true) };
        let expected = json!({ "t": 1.234568, "t_ns": 1_234_567_891_u64, "kind": "internal_limit", "node": 5, "axis": 2,
            "active": true, "text": "an internal limit is active" });
        assert_eq!(json(&event), expected);
    }
}
