//! The devices that Ferrodrive knows, as people name them.

use std::path::Path;

use canopen::NodeId;
use devices::variant::{NoSuchChoice, Variant};
use eds::keep_of;
use master::Models;
use sim::machine::models;

use crate::data_sheet::{self, Unread};
use crate::suggest::{did_you_mean, near};
use crate::unresolved::Unresolved;

pub use devices::Description;

/// Devices beside drives that are built in, by the data sheets that describe them: inputs and outputs of CiA 401, an encoder of CiA 406.
/// They are what any such file makes, and nobody's product.
const DEVICES: [(&str, &str); 2] =
    [("io401", include_str!("models/io401.eds")), ("encoder406", include_str!("models/encoder406.eds"))];

/// What a MODEL argument means: the name of a model, with choices that come with other objects behind it
/// (`zlac8030l,firmware=2.01`), or an EDS or DCF file that describes one.
///
/// # Errors
/// What of it is not known, and what is.
pub fn resolve(text: &str) -> Result<&'static Description, Unresolved> {
    let Some((name, choices)) = text.split_once(',').filter(|_| !is_file(text)) else {
        return resolve_in(text, Path::new(""));
    };
    let model = resolve_in(name, Path::new(""))?;
    let mut variant = Variant::first_of(model.variations);
    for word in choices.split(',') {
        let (key, choice) = word
            .split_once('=')
            .ok_or_else(|| format!("'{word}' is not a choice; expected KEY=CHOICE after the comma"))?;
        variant.choose(key.trim(), choice.trim()).map_err(|unknown| match unknown {
            NoSuchChoice::Choice(variation) => {
                let known: Vec<_> = variation.choices.iter().map(|choice| choice.name).collect();
                format!("'{choice}' is not a choice for {key} of a {name}; expected one of: {}", known.join(", "))
            }
            NoSuchChoice::Variation => {
                let known: Vec<_> = model.variations.iter().map(|variation| variation.key).collect();
                format!("a {name} has no choice of '{key}'; it has: {}", known.join(", "))
            }
        })?;
    }
    Ok(model.as_chosen(&variant))
}

/// As [`resolve`], with files looked for in `folder`.
///
/// # Errors
/// That it is neither, and what is near.
pub fn resolve_in(text: &str, folder: &Path) -> Result<&'static Description, Unresolved> {
    if is_file(text) {
        return described(&folder.join(text)).map_err(Unresolved::File);
    }
    if let Some(device) = device(text) {
        return device.map_err(Unresolved::File);
    }
    let known = || models().map(|model| model.name).chain(DEVICES.iter().map(|(name, _)| *name));
    models().find(|model| model.name.eq_ignore_ascii_case(text)).ok_or_else(|| {
        let near = near(text, known());
        format!(
            "'{text}' is not a model{}; expected one of: {}, or a file of it (FILE.eds)",
            did_you_mean(&near),
            names()
        )
        .into()
    })
}

/// A device beside drives that is built in.
fn device(text: &str) -> Option<Result<&'static Description, String>> {
    let (name, sheet) = DEVICES.iter().find(|(name, _)| name.eq_ignore_ascii_case(text))?;
    let reading = eds::Eds::load(sheet.as_bytes()).map_err(|refusal| format!("{name}: {refusal}"));
    Some(reading.and_then(|reading| keep_of(&reading.eds, name).map_err(|error| format!("{name}: {error}"))))
}

/// All that are known by name.
pub fn known() -> impl Iterator<Item = &'static Description> {
    models().chain(DEVICES.iter().filter_map(|(name, _)| device(name)?.ok()))
}

/// True for what has the ending of a file that describes a device.
fn is_file(text: &str) -> bool {
    let ending = Path::new(text).extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    ["eds", "dcf"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// The device that a file describes.
fn described(path: &Path) -> Result<&'static Description, String> {
    let shown = path.display();
    let reading = data_sheet::reading(path).map_err(|unread| match unread {
        Unread::File(error) => format!("cannot read {shown}: {error}"),
        Unread::Refused(refusal) => format!("{shown}: {refusal}"),
    })?;
    keep_of(&reading.eds, &shown.to_string()).map_err(|error| format!("{shown}: {error}"))
}

/// True for a device that a data sheet describes: what one count of an object is worth, no data sheet says.
pub fn is_from_file(model: &Description) -> bool {
    !models().any(|known| model.is_edition_of(known))
}

/// The path of the file that describes a device, as it was given; `None` for a model that is built in.
pub fn file_of(model: &'static Description) -> Option<&'static str> {
    let path = model.manual.strip_prefix("the file ").filter(|_| is_from_file(model))?;
    Some(path.strip_suffix(", without its modules").unwrap_or(path))
}

/// The models known, and those of `given` that come from files.
pub fn with_files(given: impl Iterator<Item = &'static Description>) -> Models {
    given.filter(|model| is_from_file(model)).fold(Models::default(), |known, model| known.with(model))
}

/// The drives on the embedded virtual bus and their node-IDs: one of each kind that is delivered with a node-ID, at that
/// node-ID or the next one that is free.
pub fn embedded() -> Vec<(NodeId, &'static Description)> {
    let mut drives: Vec<(NodeId, &'static Description)> = Vec::new();
    for model in models() {
        let Some(delivered) = model.node_id.filter(|_| !drives.iter().any(|(_, other)| model.same_objects(other)))
        else {
            continue;
        };
        let free = |node: &NodeId| !drives.iter().any(|(taken, _)| taken == node);
        if let Some(node) = NodeId::all().skip_while(|node| *node < delivered).find(free) {
            drives.push((node, model));
        }
    }
    drives
}

/// The names of all models, for messages.
pub fn names() -> String {
    models().map(|model| model.name).chain(DEVICES.iter().map(|(name, _)| *name)).collect::<Vec<_>>().join(", ")
}

/// How the user says which of `models` a node is.
pub fn how_to_say(node: NodeId, models: &[&str]) -> String {
    let (first, others) = models.split_first().unwrap_or((&"MODEL", &[]));
    let others = if others.is_empty() { String::new() } else { format!(" (or {})", others.join(", ")) };
    format!("--model {node}={first}{others}, or a machine file (--machine FILE)")
}

/// The advice to name the model of a node, which may be one of `models`.
pub fn name_its_model(node: NodeId, models: &[&str]) -> String {
    format!("name its model: {}", how_to_say(node, models))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_behind_a_model_gives_the_objects_that_come_with_it() {
        let has = |text: &str, index, sub| resolve(text).unwrap().row(canopen::Mux::new(index, sub)).is_some();
        assert!(!has("zlac8030l", 0x202F, 6) && has("ZLAC8030L,firmware=2.01", 0x202F, 6));
        assert!(!has("m8025e25b80", 0x1006, 0) && has("m8025e25b80,firmware=1.66", 0x1006, 0));
        assert!(std::ptr::eq(resolve("zlac8030l,motor=fast").unwrap(), resolve("zlac8030l").unwrap()));
        let refusal = |text: &str| resolve(text).unwrap_err().to_string();
        assert!(refusal("zlac8030l,firmware=3").contains("expected one of: 1.00, 2.01"));
        assert!(refusal("zlac8030l,colour=red").contains("it has: firmware, motor"));
        assert!(refusal("zlac8030l,firmware").contains("KEY=CHOICE"));
        assert!(!is_from_file(resolve("zlac8030l,firmware=2.01").unwrap()));
    }

    #[test]
    fn devices_beside_drives_are_built_in_and_their_sheets_have_no_finding() {
        for (name, sheet) in DEVICES {
            let reading = eds::Eds::load(sheet.as_bytes()).unwrap();
            assert!(reading.findings.is_empty(), "{name}: {:?}", reading.findings);
            let device = resolve(&name.to_uppercase()).unwrap();
            assert!(device.name == name && device.axes.is_empty() && device.lss, "{name}");
            assert!(std::ptr::eq(device, resolve(name).unwrap()));
            assert_eq!(file_of(device), Some(name), "what a MODEL argument takes");
            assert!(names().contains(name));
        }
        assert!(resolve("io40").unwrap_err().to_string().contains("did you mean io401?"));
    }

    #[test]
    fn the_embedded_bus_has_one_of_each_kind_at_different_nodes() {
        let drives: Vec<_> = embedded().into_iter().map(|(node, model)| (node.raw(), model.name)).collect();
        assert_eq!(drives[..3], [(4, "zlac8030l"), (1, "m4230e17b50"), (2, "zlim42c")]);
        let mut nodes: Vec<u8> = drives.iter().map(|(node, _)| *node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        assert_eq!(nodes.len(), drives.len(), "{drives:?}");
    }
}
