//! What commands remember from one call to the next, for people at a terminal: which nodes a bus had, for completion, and what has been
//! said already. A file in the user's cache; a program whose output goes elsewhere neither reads nor writes it, and nothing but comfort
//! is lost with it.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use canopen::NodeId;
use serde::{Deserialize, Serialize};

use crate::output::has_reader;

/// Buses that are remembered; the one that was used longest ago goes first.
const MAX_BUSES: usize = 32;

/// Messages that are remembered as shown; the oldest is forgotten first, and is shown again.
const MAX_SAID: usize = 256;

/// This program writes no larger file.
const MAX_BYTES: u64 = 1 << 20;

/// See the [module](self).
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Remembered {
    /// By the bus's name, the one that was used last at the end.
    #[serde(default)]
    buses: Vec<RememberedBus>,
    /// Keys of messages, the last at the end.
    #[serde(default)]
    said: Vec<String>,
    #[serde(skip)]
    path: Option<PathBuf>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct RememberedBus {
    name: String,
    /// Nodes, and their models as far as they are certain.
    nodes: BTreeMap<u8, Option<String>>,
}

impl Remembered {
    /// What is remembered where a person reads what the program says; nothing, and nothing is kept, where not.
    pub(crate) fn by_people() -> Self {
        if has_reader() { Self::of(path()) } else { Self::default() }
    }

    /// What is remembered, for a shell that completes a line.
    pub(crate) fn for_completion() -> Self {
        Self::of(path())
    }

    /// A file that is not there, cannot be read or is not of this program counts as empty.
    fn of(path: Option<PathBuf>) -> Self {
        let text = path.as_ref().and_then(|path| {
            let small = fs::metadata(path).is_ok_and(|file| file.is_file() && file.len() <= MAX_BYTES);
            small.then(|| fs::read_to_string(path).ok()).flatten()
        });
        let remembered: Self = text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
        Self { path, ..remembered }
    }

    /// True the first time for this key.
    pub(crate) fn is_new(&mut self, key: &str) -> bool {
        if self.said.iter().any(|said| said == key) {
            return false;
        }
        self.said.push(key.to_owned());
        let beyond = self.said.len().saturating_sub(MAX_SAID);
        self.said.drain(..beyond);
        self.keep();
        true
    }

    /// These nodes have been heard on a bus; a model that is not said stays as it was.
    pub(crate) fn heard(&mut self, bus: &str, nodes: impl Iterator<Item = (NodeId, Option<&'static str>)>) {
        let place = self.buses.iter().position(|known| known.name == bus);
        let mut known = match place {
            Some(place) => self.buses.remove(place),
            None => RememberedBus { name: bus.to_owned(), ..RememberedBus::default() },
        };
        for (node, model) in nodes {
            let entry = known.nodes.entry(node.raw()).or_default();
            *entry = model.map(str::to_owned).or(entry.take());
        }
        if known.nodes.is_empty() {
            return;
        }
        self.buses.push(known);
        let beyond = self.buses.len().saturating_sub(MAX_BUSES);
        self.buses.drain(..beyond);
        self.keep();
    }

    /// The nodes that a bus had, and their models.
    pub(crate) fn nodes(&self, bus: &str) -> impl Iterator<Item = (u8, Option<&str>)> {
        let bus = self.buses.iter().find(|known| known.name == bus);
        bus.into_iter().flat_map(|bus| &bus.nodes).map(|(node, model)| (*node, model.as_deref()))
    }

    /// The buses that were used, the last first.
    pub(crate) fn buses(&self) -> impl Iterator<Item = &str> {
        self.buses.iter().rev().map(|bus| bus.name.as_str())
    }

    /// Writes it; a reader meanwhile has the old file or the new one. A disk that takes nothing does not matter here.
    fn keep(&self) {
        let Some(path) = &self.path else { return };
        let Some(folder) = path.parent() else { return };
        let Ok(text) = serde_json::to_string(self) else { return };
        let fresh = folder.join(format!("remembered.{}.tmp", std::process::id()));
        let _ = fs::create_dir_all(folder);
        if fs::write(&fresh, text).and_then(|()| fs::rename(&fresh, path)).is_err() {
            let _ = fs::remove_file(&fresh);
        }
    }
}

/// The file in the user's cache (XDG Base Directory Specification).
fn path() -> Option<PathBuf> {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
    Some(cache.join("ferrodrive/remembered.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).expect("1 to 127")
    }

    #[test]
    fn what_was_said_and_heard_is_there_in_the_next_call_and_no_more_than_fits() {
        let scratch = processes::scratch("remembered");
        let path = scratch.join("cache/remembered.json");
        let mut first = Remembered::of(Some(path.clone()));
        assert!(first.is_new("a guess") && !first.is_new("a guess"));
        first.heard("can0", [(node(4), Some("zlac8030l")), (node(2), None)].into_iter());
        let mut second = Remembered::of(Some(path.clone()));
        assert!(!second.is_new("a guess") && second.is_new("another"));
        // A call that does not know the model does not forget it.
        second.heard("can0", [(node(4), None)].into_iter());
        assert_eq!(
            Remembered::of(Some(path.clone())).nodes("can0").collect::<Vec<_>>(),
            [(2, None), (4, Some("zlac8030l"))]
        );
        for number in 0..400 {
            second.is_new(&format!("message {number}"));
            second.heard(&format!("can{number}"), [(node(1), None)].into_iter());
        }
        let last = Remembered::of(Some(path.clone()));
        assert_eq!((last.said.len(), last.buses.len(), last.buses().next()), (MAX_SAID, MAX_BUSES, Some("can399")));
        let left = fs::read_dir(path.parent().expect("a folder")).expect("it is there").count();
        assert_eq!(left, 1, "nothing is left of the writing");
    }

    #[test]
    fn a_file_that_is_none_of_ours_is_an_empty_one_and_a_folder_that_takes_none_is_no_matter() {
        let scratch = processes::scratch("remembered-foreign");
        let path = scratch.join("remembered.json");
        for text in ["", "[1, 2]", "{\"buses\": 5}", "\u{0}\u{1}"] {
            fs::write(&path, text).expect("it can be written");
            assert_eq!(Remembered::of(Some(path.clone())).buses().count(), 0, "{text:?}");
        }
        let mut nowhere = Remembered::of(Some(PathBuf::from("/dev/null/cache/remembered.json")));
        assert!(nowhere.is_new("a guess") && !nowhere.is_new("a guess"));
    }
}
