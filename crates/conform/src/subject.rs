//! The device under test, as its model or its EDS describes it.

use canopen::od::{Access, DataType, DefaultValue, Entry, Kind};
use canopen::{Mux, NodeId};
use devices::row::is_parameter;
use devices::{AxisDescription, Departure, Description};

/// A node, and what it is said to be.
#[derive(Clone, Copy, Debug)]
pub struct Subject {
    /// Its node-ID.
    pub node: NodeId,
    /// What it is said to be.
    pub description: &'static Description,
    /// By a maker's manual that is known here, not by a file alone: its departures from the standard are stated.
    pub by_manual: bool,
}

impl Subject {
    /// A device of a model that is known here.
    pub fn of_model(node: NodeId, description: &'static Description) -> Self {
        Self { node, description, by_manual: true }
    }

    /// A device that a file describes: what the file does not have, the device need not have.
    pub fn of_file(node: NodeId, description: &'static Description) -> Self {
        Self { node, description, by_manual: false }
    }

    /// All departures that the manual states.
    pub(crate) fn departures(&self) -> impl Iterator<Item = Departure> {
        let stated = self.by_manual.then(|| self.description.departures(devices::all()));
        stated.into_iter().flatten()
    }

    /// A departure in words, with its place in the manual.
    pub(crate) fn cited(&self, departure: &Departure) -> String {
        let manual = self.description.manual;
        let section = self.description.section_of(departure).map(|section| format!(", {section}")).unwrap_or_default();
        format!("{departure} ({manual}{section})")
    }

    pub(crate) fn axis(&self) -> Option<&'static AxisDescription> {
        self.description.first_axis()
    }

    pub(crate) fn row(&self, index: u16, sub_index: u8) -> Option<&'static Entry> {
        self.description.row(Mux::new(index, sub_index))
    }

    pub(crate) fn rows(&self) -> impl Iterator<Item = &'static Entry> + use<> {
        self.description.dictionary.rows().iter()
    }

    /// The indexes of the communication parameters of the PDOs of one direction: `base` is 1400h or 1800h.
    pub(crate) fn pdos(&self, base: u16) -> impl Iterator<Item = u16> + use<> {
        let rows = self.rows().filter(move |row| row.sub_index == 1 && (base..base + 0x200).contains(&row.index));
        rows.map(|row| row.index)
    }

    /// Objects of the communication profile that can be written without harm, those that change least first.
    pub(crate) fn harmless(&self) -> impl Iterator<Item = &'static Entry> + use<> {
        let subject = *self;
        let first = [0x1017, 0x100D, 0x100C, 0x1006, 0x1015].into_iter().filter_map(move |index| subject.row(index, 0));
        let timers = self.rows().filter(|row| matches!(row.index, 0x1400..=0x15FF | 0x1800..=0x19FF));
        let timers = timers.filter(|row| matches!(row.sub_index, 3 | 5));
        first.chain(timers).filter(|row| row.access == Access::ReadWrite)
    }

    /// A parameter: what it sets is known to be a setting, and writing it back changes nothing.
    pub(crate) fn is_setting(&self, row: &Entry) -> bool {
        let address = self.description.storage.address.contains(&row.mux());
        let standard = matches!(row.index, 0x1000..=0x1F4F | 0x6000..=0x9FFF);
        is_parameter(row) && !address && (standard || self.by_manual) && !self.makes_stores(row.mux())
    }

    fn makes_stores(&self, mux: Mux) -> bool {
        let storage = self.description.storage;
        let writes =
            storage.save.into_iter().chain(storage.restore).chain(storage.save_on_write.map(|(write, _)| write));
        writes.into_iter().any(|write| write.object == mux)
    }

    /// The value of an object as delivered, as an SDO carries it; `None` where the description does not say.
    pub(crate) fn default_of(&self, row: &Entry) -> Option<Vec<u8>> {
        master::parameters::default_of(row, self.node)
    }
}

/// A number as an SDO carries it.
pub(crate) fn bytes_of(data_type: DataType, value: i64) -> Vec<u8> {
    value.to_le_bytes()[..data_type.size().min(8)].to_vec()
}

/// The number that an SDO carries.
pub(crate) fn number_of(data_type: DataType, bytes: &[u8]) -> Option<i64> {
    let size = data_type.size();
    if bytes.len() != size || size > 8 || !matches!(data_type.kind(), Kind::Signed | Kind::Unsigned) {
        return None;
    }
    let negative = data_type.kind() == Kind::Signed && bytes.last().is_some_and(|high| high & 0x80 != 0);
    let mut wide = [if negative { 0xFF } else { 0 }; 8];
    wide[..size].copy_from_slice(bytes);
    Some(i64::from_le_bytes(wide))
}

/// True for a number as delivered, which a file need not say.
pub(crate) fn has_number(row: &Entry) -> bool {
    !matches!(row.default, DefaultValue::Text(_) | DefaultValue::Bytes(_))
}
