//! What can be measured of a drive, by the names that people use, and what one count of it is worth.
//!
//! The short names give demand and actual values in degrees, r/min and A whatever the drive counts in; an object by its own name or
//! number has the unit of the model's table.

use std::fmt;

use canopen::Mux;
use canopen::od::{DataType, Entry};
use cia402::object::{POSITION_ACTUAL_VALUE, TARGET_POSITION};
use devices::{Description, Units};
use master::Drive;
use master::decode::{common_name, common_row};
use recording::ending_of;
use words::failure::Failure;
use words::object::ObjectArg;
use words::unit::split_factor;

/// One quantity of an axis as it is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Its name in a record, with the unit in it: `velocity_rpm`.
    pub name: String,
    /// Its unit as people write it; empty for what has none.
    pub unit: String,
    /// The object that has it.
    pub object: Mux,
    /// How it is read by SDO, and what one count is worth then.
    pub by_sdo: Form,
    /// The same in TPDOs.
    pub by_pdo: Form,
}

/// How bits are a number, and what one is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Form {
    /// The type.
    pub data_type: DataType,
    /// Units in one count.
    pub factor: f64,
}

impl Form {
    /// The value of these bits.
    pub fn value(&self, raw: u32) -> f64 {
        let number = match self.data_type {
            DataType::Real32 => f64::from(f32::from_bits(raw)),
            other => other.value(raw) as f64,
        };
        number * self.factor
    }
}

/// In which unit a short name has its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum QuantityKind {
    /// Degrees of the output.
    Angle,
    /// r/min of the output, by the model's object of the actual velocity.
    Speed,
    /// A, by the model's object of the actual current.
    Current,
    /// As the model's own quantity says.
    Own(&'static str),
}

/// Where the values of a short name are.
enum QuantityPlace {
    Standard(Mux),
    Model(fn(&Units) -> Option<devices::Quantity>),
}

struct Short {
    name: &'static str,
    kind: QuantityKind,
    place: QuantityPlace,
}

const fn standard(name: &'static str, kind: QuantityKind, mux: Mux) -> Short {
    Short { name, kind, place: QuantityPlace::Standard(mux) }
}

const fn of_model(name: &'static str, kind: QuantityKind, place: fn(&Units) -> Option<devices::Quantity>) -> Short {
    Short { name, kind, place: QuantityPlace::Model(place) }
}

/// Demand values and actual ones (CiA 402-2: 607Ah, 6062h, 6064h, 60F4h, 60FFh, 606Bh, 606Ch, 6071h, 6074h, 6077h, or where a model has
/// them).
const SHORT: [Short; 13] = [
    standard("target_position", QuantityKind::Angle, TARGET_POSITION),
    standard("position_demand", QuantityKind::Angle, Mux::new(0x6062, 0)),
    standard("position", QuantityKind::Angle, POSITION_ACTUAL_VALUE),
    standard("following_error", QuantityKind::Angle, Mux::new(0x60F4, 0)),
    of_model("target_velocity", QuantityKind::Speed, |units| units.target_velocity),
    standard("velocity_demand", QuantityKind::Speed, Mux::new(0x606B, 0)),
    of_model("velocity", QuantityKind::Speed, |units| units.actual_velocity),
    of_model("target_current", QuantityKind::Current, |units| units.target_current),
    standard("current_demand", QuantityKind::Current, Mux::new(0x6074, 0)),
    of_model("current", QuantityKind::Current, |units| units.actual_current),
    of_model("supply", QuantityKind::Own("V"), |units| units.bus_voltage),
    of_model("motor_temperature", QuantityKind::Own("°C"), |units| units.motor_temperature),
    of_model("driver_temperature", QuantityKind::Own("°C"), |units| units.driver_temperature),
];

/// The short names, for messages.
pub fn short_names() -> String {
    SHORT.map(|short| short.name).join(", ")
}

impl Quantity {
    /// A quantity of a drive by a short name, or an object by its name or number.
    ///
    /// # Errors
    /// The model does not have it; it is not a number; those of the SDO reads that its scale takes.
    pub async fn named(drive: &Drive, text: &str) -> Result<Self, Failure> {
        let wanted = text.trim().to_ascii_lowercase().replace('-', "_");
        if let Some(short) = SHORT.iter().find(|short| short.name == wanted) {
            return Self::of_short(drive, short).await;
        }
        let id = drive.node().id();
        let advice = || format!("quantities: {}; or an object: ferrodrive objects {id} WORD", short_names());
        let refused = |reason: String| Failure::usage(reason).at_node(id).next(advice());
        let argument: ObjectArg = words::object::object(text).map_err(&refused)?;
        let found = argument.resolve(drive.description().map(|model| model.dictionary));
        let (mux, row) = found.map_err(refused)?;
        Self::of_object(drive, mux, row)
    }

    /// An object in the unit of the model's table.
    ///
    /// # Errors
    /// It is not a number of at most 32 bits.
    pub fn of_object(drive: &Drive, mux: Mux, row: Option<&'static Entry>) -> Result<Self, Failure> {
        let id = drive.node().id();
        let row = if drive.description().is_some() { row } else { common_row(mux) };
        if row.is_some_and(|row| !row.data_type.fits_cell()) {
            return Err(Failure::usage(format!("{mux} is not a number of at most 32 bits, which a record requires"))
                .at_node(id)
                .at_object(mux)
                .next(format!("ferrodrive objects {id} shows the types; ferrodrive read shows such an object once")));
        }
        Ok(Self::of_row(drive.description(), mux, row))
    }

    /// A number of at most 32 bits by the row of its table.
    pub(super) fn of_row(model: Option<&'static Description>, mux: Mux, row: Option<&'static Entry>) -> Self {
        let name = row.map(|row| row.name).or_else(|| common_name(mux));
        let mut name = name.map_or_else(|| format!("object_{:04X}", mux.index), str::to_owned);
        if mux.sub_index != 0 {
            name = format!("{name}_{:02X}", mux.sub_index);
        }
        let (factor, unit) = row.map_or((1.0, ""), |row| factor_of(row.unit));
        let data_type = row.map_or(DataType::Unsigned32, |row| row.data_type);
        let form = model.and_then(|model| model.pdo.mapping.tpdo_form(mux));
        let by_sdo = Form { data_type, factor };
        let by_pdo = form.map_or(by_sdo, |form| Form { data_type: form.data_type, factor: factor_of(form.unit).0 });
        Self { name: name + ending_of(unit), unit: unit.to_owned(), object: mux, by_sdo, by_pdo }
    }

    async fn of_short(drive: &Drive, Short { name, kind, place }: &Short) -> Result<Self, Failure> {
        let id = drive.node().id();
        let Some((model, axis)) = drive.description().zip(drive.axis_description()) else {
            return Err(Failure::new(format!("node {id}: {name} cannot be found on a drive of unknown model"))
                .of_kind("unknown_model")
                .at_node(id)
                .next(words::models::name_its_model(id, &["MODEL"]))
                .next("or name the object by its number"));
        };
        let units = &axis.units;
        let quantity = match place {
            QuantityPlace::Standard(mux) => Some(axis.object(*mux)).filter(|mux| model.row(*mux).is_some()),
            QuantityPlace::Model(of) => of(units).map(|quantity| quantity.object),
        };
        let missing = || {
            let (of, has) = (model.name, had(model, axis).join(", "));
            let failure = Failure::new(format!("a {of} does not have {name}")).of_kind("no_such_quantity").at_node(id);
            failure.next(format!("it has: {has}"))
        };
        let object = quantity.ok_or_else(missing)?;
        let mut found = Self::of_object(drive, object, model.row(object))?;
        // What one count of an object is worth that is scaled as another quantity of the model.
        let scaled = |like: Option<devices::Quantity>| like.map(|like| devices::Quantity { object, ..like });
        let (step, unit) = match kind {
            QuantityKind::Angle => (360.0 / drive.counts_per_turn().await?, "°"),
            QuantityKind::Speed => {
                let like = match place {
                    QuantityPlace::Model(of) => of(units),
                    QuantityPlace::Standard(_) => scaled(units.actual_velocity),
                };
                (drive.step_of(like.ok_or_else(missing)?).await?, "r/min")
            }
            QuantityKind::Current => {
                let like = match place {
                    QuantityPlace::Model(of) => of(units),
                    QuantityPlace::Standard(_) => scaled(units.target_current.or(units.actual_current)),
                };
                (drive.step_of(like.ok_or_else(missing)?).await?, "A")
            }
            QuantityKind::Own(unit) => {
                let QuantityPlace::Model(of) = place else { return Err(missing()) };
                (drive.step_of(of(units).ok_or_else(missing)?).await?, *unit)
            }
        };
        // A TPDO may carry it in another unit: the ratio of the table's factors stays.
        let ratio = if found.by_sdo.factor == 0.0 { 1.0 } else { found.by_pdo.factor / found.by_sdo.factor };
        found.by_sdo.factor = step;
        found.by_pdo.factor = step * ratio;
        (found.name, found.unit) = (format!("{name}{}", ending_of(unit)), unit.to_owned());
        Ok(found)
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.object)
    }
}

/// The short names that an axis has.
pub(super) fn had(model: &devices::Description, axis: &devices::AxisDescription) -> Vec<&'static str> {
    let has = |short: &&Short| match short.place {
        QuantityPlace::Standard(mux) => model.row(axis.object(mux)).is_some(),
        QuantityPlace::Model(of) => of(&axis.units).is_some(),
    };
    SHORT.iter().filter(has).map(|short| short.name).collect()
}

fn factor_of(unit: &'static str) -> (f64, &'static str) {
    if unit.is_empty() { (1.0, "") } else { split_factor(unit) }
}
