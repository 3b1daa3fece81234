//! A drive to simulate, `MODEL@NODE,key=value,...`, and which model a node is, `NODE=MODEL`.

use std::path::Path;

use can::Bitrate;
use canopen::{Mux, NodeId};
use devices::variant::{NoSuchChoice, Preset, Variant, VariationKind};
use sim::Fidelity;
use sim::machine::{Order, TimingMode};

use super::node::node;
use super::object;
use super::suggest::{did_you_mean, near};
use super::unresolved::Unresolved;
use crate::models::{Description, resolve, resolve_in};

/// A drive to put on a virtual bus.
#[derive(Clone, Debug)]
pub struct DriveSpec {
    /// Which drive.
    pub model: &'static Description,
    /// Its node-ID at the first start.
    pub node: NodeId,
    /// Whether it takes the time that such a drive takes, where it is given.
    pub timing: Option<TimingMode>,
    /// How much of it is computed, where it is given.
    pub fidelity: Option<Fidelity>,
    /// Whether it waits for LSS (CiA 305) to give it a node-ID; `node` is what the world calls it until then.
    pub unconfigured: bool,
    variant: Variant,
    presets: Vec<Preset>,
}

impl DriveSpec {
    /// A drive as delivered.
    pub fn new(model: &'static Description, node: NodeId) -> Self {
        let variant = Variant::first_of(model.variations);
        Self { model, node, timing: None, fidelity: None, unconfigured: false, variant, presets: Vec::new() }
    }

    /// What to order for a bus of this rate.
    pub fn order(&self, bitrate: Bitrate) -> Order {
        let Self { node, variant, unconfigured, .. } = *self;
        let fidelity = self.fidelity.unwrap_or_default();
        Order { node, bitrate, variant, presets: self.presets.clone(), unconfigured, fidelity, speed_worth: None }
    }

    /// What was chosen for it.
    pub const fn variant(&self) -> Variant {
        self.variant
    }

    /// What the drive is with what was chosen: some choices come with other objects.
    pub fn description(&self) -> &'static Description {
        self.model.as_chosen(&self.variant)
    }

    /// The values that objects have at power-on besides.
    pub fn presets(&self) -> &[Preset] {
        &self.presets
    }

    /// Takes one option: a choice of the model's (`firmware=2.01`, `reading=Z050:prose` or `Z050=prose`), the value that an
    /// object has at power-on (`6060=3`, `2030:02=9`), `timing=ideal`, `fidelity=mechanical`, or `node-id=none`.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        let (key, value) = match key {
            "reading" => value.split_once(':').ok_or_else(|| {
                format!("'reading={value}' is incomplete; expected reading=PLACE:CHOICE, e.g. {}", self.an_example())
            })?,
            "timing" => {
                self.timing =
                    Some(value.parse().map_err(|reason| format!("timing of a {}: {reason}", self.model.name))?);
                return Ok(());
            }
            "fidelity" => {
                self.fidelity =
                    Some(value.parse().map_err(|reason| format!("fidelity of a {}: {reason}", self.model.name))?);
                return Ok(());
            }
            "node-id" if value != "none" => {
                return Err(format!(
                    "'node-id={value}': the node-ID belongs after the @; node-id=none is a device that waits for LSS"
                ));
            }
            "node-id" if !self.model.lss => {
                let name = self.model.name;
                return Err(format!(
                    "a {name} has no LSS (CiA 305) by its manual or its file, so it could not be given a node-ID"
                ));
            }
            "node-id" => {
                self.unconfigured = true;
                return Ok(());
            }
            _ => (key, value),
        };
        match self.variant.choose(key, value) {
            Ok(()) => Ok(()),
            Err(NoSuchChoice::Choice(variation)) => {
                let known: Vec<_> = variation.choices.iter().map(|choice| choice.name).collect();
                Err(format!(
                    "'{value}' is not a choice for {key} of a {}; expected one of: {}",
                    self.model.name,
                    known.join(", ")
                ))
            }
            Err(NoSuchChoice::Variation) => {
                let object = self.object(key).ok_or_else(|| self.unknown(key))?;
                let number = number(value)
                    .ok_or_else(|| format!("'{value}' is not a value for {object}; expected a whole number or 0x.."))?;
                self.presets.push(Preset { object, value: number });
                Ok(())
            }
        }
    }

    /// An object of the model by its name or number. The choice that brings it may come behind it, so that every edition of
    /// the model is asked; whether what is chosen in the end has the object is known when it is ordered.
    fn object(&self, text: &str) -> Option<Mux> {
        let others = self.model.editions.iter().map(|edition| edition.description);
        [self.description(), self.model].into_iter().chain(others).find_map(|model| object_of(model, text))
    }

    fn an_example(&self) -> String {
        let mut readings = self.model.variations.iter().filter(|variation| variation.kind == VariationKind::Reading);
        let known = readings.find_map(|variation| Some((variation.key, variation.choices.last()?.name)));
        known.map_or("none for this model".into(), |(key, choice)| format!("reading={key}:{choice}"))
    }

    fn unknown(&self, key: &str) -> String {
        let keys = self.model.variations.iter().map(|variation| match variation.kind {
            VariationKind::Reading => format!("reading={}:CHOICE", variation.key),
            VariationKind::Build => format!("{}=CHOICE", variation.key),
        });
        let known = keys
            .chain(["timing=device or ideal".to_owned(), "fidelity=full or mechanical".to_owned()])
            .chain(self.model.lss.then(|| "node-id=none".to_owned()))
            .chain(["OBJECT=VALUE, e.g. 6060=3".to_owned()])
            .collect::<Vec<_>>()
            .join("; ");
        let near = near(key, self.model.variations.iter().map(|variation| variation.key));
        format!("a {} takes no '{key}'{}; it takes: {known}", self.model.name, did_you_mean(&near))
    }
}

/// The object that is meant by a name, an index or an index with a sub-index.
fn object_of(model: &Description, text: &str) -> Option<Mux> {
    let (mux, _) = object::object(text).ok()?.resolve(Some(model.dictionary)).ok()?;
    Some(mux)
}

fn number(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// `zlac8030l@4,motor=fast,6060=3`, `vendor.eds@5`.
///
/// # Errors
/// What of it makes no sense, or that the file that it names cannot be used.
pub fn drive_spec(text: &str) -> Result<DriveSpec, Unresolved> {
    drive_spec_in(text, Path::new(""))
}

/// As [`drive_spec`], with files looked for in `folder`.
///
/// # Errors
/// The same.
pub fn drive_spec_in(text: &str, folder: &Path) -> Result<DriveSpec, Unresolved> {
    let mut words = text.split(',');
    let place = words.next().unwrap_or_default();
    let (name, number) = place
        .rsplit_once('@')
        .ok_or_else(|| format!("'{place}' is not a drive; expected MODEL@NODE, e.g. zlac8030l@4"))?;
    let mut spec = DriveSpec::new(resolve_in(name, folder)?, node(number)?);
    for word in words {
        let (key, value) = word
            .split_once('=')
            .ok_or_else(|| format!("'{word}' is not an option of a drive; expected KEY=VALUE after the comma"))?;
        spec.set(key.trim(), value.trim())?;
    }
    Ok(spec)
}

/// `4=zlac8030l`.
///
/// # Errors
/// The same.
pub fn node_model(text: &str) -> Result<(NodeId, &'static Description), Unresolved> {
    let (number, name) =
        text.split_once('=').ok_or_else(|| format!("'{text}' is incomplete; expected NODE=MODEL, e.g. 4=zlac8030l"))?;
    Ok((node(number)?, resolve(name)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        drive_spec(text).err().map(String::from).unwrap_or_default()
    }

    #[test]
    fn drives_are_model_at_node() {
        let spec = drive_spec("zlac8030l@4").ok().unwrap();
        assert_eq!((spec.model.name, spec.node.raw()), ("zlac8030l", 4));
        assert_eq!(node_model("4=ZLAC8030L").ok().unwrap().1.name, "zlac8030l");
    }

    #[test]
    fn an_objects_value_at_power_on_is_given_by_index_or_name() {
        let spec = drive_spec("zlac8030l@4,2014=100,max_current=0x64").ok().unwrap();
        let values: Vec<_> =
            spec.order(Bitrate::K500).presets.iter().map(|preset| (preset.object, preset.value)).collect();
        assert_eq!(values, [(Mux::new(0x2014, 0), 100), (Mux::new(0x2015, 0), 100)]);
    }

    #[test]
    fn a_name_that_only_a_choice_brings_may_stand_before_the_choice() {
        for text in [
            "m4230e17b50@2,communication_cycle_period=5,firmware=1.66",
            "m4230e17b50@2,firmware=1.66,communication_cycle_period=5",
        ] {
            let spec = drive_spec(text).ok().unwrap();
            assert_eq!(spec.presets()[0].object, Mux::new(0x1006, 0), "{text}");
            assert!(spec.description().has_index(0x1006), "{text}");
        }
        assert!(!drive_spec("m4230e17b50@2").ok().unwrap().description().has_index(0x1006));
    }

    #[test]
    fn each_drive_may_take_time_or_none() {
        let timing = |text| drive_spec(text).ok().unwrap().timing;
        assert_eq!(timing("zlac8030l@4"), None);
        assert_eq!(timing("zlac8030l@4,timing=ideal,2014=100"), Some(TimingMode::Ideal));
        assert_eq!(timing("zlac8030l@4,timing=device"), Some(TimingMode::Device));
    }

    #[test]
    fn each_drive_may_be_of_its_own_fidelity() {
        let fidelity = |text| drive_spec(text).ok().unwrap().fidelity;
        assert_eq!(fidelity("zlac8030l@4"), None);
        assert_eq!(fidelity("zlac8030l@4,fidelity=mechanical,2014=100"), Some(Fidelity::Mechanical));
        assert!(refusal("zlac8030l@4,fidelity=fast").contains("fidelity of a zlac8030l: expected full or mechanical"));
    }

    #[test]
    fn an_unknown_option_is_refused_with_those_that_the_model_takes() {
        assert!(refusal("zlac8030l@4,colour=red").contains("a zlac8030l takes no 'colour'"));
        assert!(refusal("zlac8030l@4,colour=red").contains("OBJECT=VALUE"));
        assert!(refusal("zlac8030l@4,fast").contains("KEY=VALUE"));
        assert!(refusal("zlac8030l@4,6060=profile").contains("whole number"));
        assert!(refusal("zlac8030l@4,reading=X9").contains("PLACE:CHOICE"));
        assert!(refusal("zlac8030l@4,timing=fast").contains("timing of a zlac8030l: expected device or ideal"));
    }

    #[test]
    fn wrong_drives_say_what_is_known() {
        assert!(refusal("zlac8030@4").contains("did you mean zlac8030l?"));
        assert!(refusal("zlac8030l").contains("MODEL@NODE"));
        assert!(refusal("zlac8030l@128").contains("1 to 127"));
        assert!(refusal("@4").contains("zlac8030l"));
        assert!(node_model("zlac8030l").err().unwrap().to_string().contains("4=zlac8030l"));
    }
}
