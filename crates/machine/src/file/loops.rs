//! Where a described servo has its gains, in a machine file: `loops`. CiA 402 leaves them to the maker, and an EDS does not say what
//! its objects are for.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use canopen::Mux;
use canopen::od::Access;
use canopen::pdo::{Direction, PdoId, PdoNumber};
use cia402::object::{PROFILE_ACCELERATION, PROFILE_DECELERATION};
use devices::{AxisDescription, Description, Integral, Loops, Quantity, Scale};
use master::pdo::record_of;

use super::configuration::time;
use words::document::Problem;
use words::document::reader::{Field, Table};
use words::object::object;

/// The key of a drive that is read here.
pub(super) const KEY: &str = "loops";

const LOOPS: &str = "a table, e.g. { speed_proportional = \"2100:01\", speed_integral = \"2100:02\", current = 2.5 }";
const OBJECT: &str = "an object by name or number, e.g. \"2100:01\"";
const SCALED: &str = "a table, e.g. { object = \"2100:03\", per_count = 1e-6 }";
const WORTH: &str = "what one count is worth, above 0";
const CONSTANT: &str = "N·m for each A of the demand, above 0";
const SPEED: &str = "a speed of its motor at which it can be measured, in r/min, above 0";
const CURRENT: &str = "what its speed loop may ask for while it is measured, in A, above 0";
const WITHOUT_RAMPS: &str = "a table of objects and values, e.g. { 6083 = 1000000 }";

const KEYS: [&str; 11] = [
    "speed_proportional",
    "speed_integral",
    "speed_integral_time",
    "speed_filter",
    "position_proportional",
    "demand",
    "torque_constant",
    "period",
    "speed",
    "current",
    "without_ramps",
];

/// Torque demand, and rated torque and current (CiA 402-2).
const TORQUE_DEMAND: Mux = Mux::new(0x6074, 0);
const RATED: [Mux; 2] = [Mux::new(0x6076, 0), Mux::new(0x6075, 0)];

/// A slow loop: a faster one keeps more phase than is reckoned with.
const USUAL_PERIOD: Duration = Duration::from_micros(500);
const USUAL_RPM: f64 = 200.0;

/// Descriptions that were made so, for the life of the program: the same words give the same one.
static KEPT: Mutex<Vec<(&'static Description, Loops, &'static Description)>> = Mutex::new(Vec::new());

/// The model with the gains that the table of its drive names; the model itself where it names none.
pub(super) fn named(drive: &Table<'_>, model: &'static Description) -> Result<&'static Description, Problem> {
    let Some(field) = drive.get(KEY) else { return Ok(model) };
    let Some(axis) = model.first_axis() else {
        return Err(field.problem(format!("a {} is not a drive: it has no loops", model.name)));
    };
    if axis.loops.is_some() || axis.open_loop.is_some() {
        let title = model.title;
        return Err(field.problem(format!("how a {title} is set is known: this is for servos by CiA 402")));
    }
    let loops = Reader { model, table: field.table("the loops", LOOPS)?, field }.loops()?;
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((.., known)) = kept.iter().find(|(of, with, _)| std::ptr::eq(*of, model) && *with == loops) {
        return Ok(known);
    }
    let mut axes = model.axes.to_vec();
    axes[0] = AxisDescription { loops: Some(loops), ..axes[0] };
    let described: &'static Description = Box::leak(Box::new(Description { axes: axes.leak(), ..*model }));
    kept.push((model, loops, described));
    Ok(described)
}

/// The table of a model.
struct Reader<'a> {
    model: &'static Description,
    field: Field<'a>,
    table: Table<'a>,
}

impl Reader<'_> {
    fn loops(&self) -> Result<Loops, Problem> {
        let table = &self.table;
        table.takes_only(&KEYS)?;
        let positive_or =
            |name, expected, otherwise: f64| table.get(name).map_or(Ok(otherwise), |field| positive(&field, expected));
        let demand = self.demand()?;
        Ok(Loops {
            demand: Some(demand),
            speed_proportional: self.gain(&table.need("speed_proportional", OBJECT)?)?,
            speed_integral: self.integral()?,
            speed_filter: table.get("speed_filter").map(|field| self.scaled(&field, true)).transpose()?,
            position_proportional: table
                .get("position_proportional")
                .map(|field| self.scaled(&field, true))
                .transpose()?,
            current: None,
            period: table.get("period").map_or(Ok(USUAL_PERIOD), |field| time(&field))?,
            stated: None,
            gain_step: 1,
            usual_rpm: positive_or("speed", SPEED, USUAL_RPM)?,
            usual_a: positive(&table.need("current", CURRENT)?, CURRENT)?,
            torque_constant_nm_a: table.get("torque_constant").map(|field| positive(&field, CONSTANT)).transpose()?,
            rated: self.has(&RATED).then_some(RATED),
            // Last: what it keeps for ever is kept by what follows.
            without_ramps: self.without_ramps()?,
        })
    }

    fn has(&self, objects: &[Mux]) -> bool {
        objects.iter().all(|object| self.model.row(*object).is_some())
    }

    fn integral(&self) -> Result<Integral, Problem> {
        match (self.table.get("speed_integral"), self.table.get("speed_integral_time")) {
            (Some(field), None) => self.gain(&field).map(Integral::Gain),
            (None, Some(field)) => self.gain(&field).map(Integral::Time),
            _ => Err(self.field.problem(format!(
                "it needs either 'speed_integral', a gain, or 'speed_integral_time', which divides the proportional one; expected {OBJECT}"
            ))),
        }
    }

    /// What the speed loop asks for, which is sampled by TPDO.
    fn demand(&self) -> Result<Quantity, Problem> {
        let named = self.table.get("demand");
        let demand = match &named {
            Some(field) => self.scaled(field, false)?,
            None if self.has(&[TORQUE_DEMAND, RATED[0], RATED[1]]) => {
                // Thousandths of the rated current, which is in mA.
                let scale = Scale::Rated { rated: RATED[1], per_count: 1e-6 };
                Quantity { object: TORQUE_DEMAND, scale }
            }
            None => {
                let name = self.model.name;
                return Err(self.field.problem(format!(
                    "a {name} has no torque demand (6074h) with rated torque and current (6076h, 6075h): name in 'demand' what shows the current that its speed loop asks for, {SCALED}"
                )));
            }
        };
        let second = PdoId { direction: Direction::Tpdo, number: PdoNumber::at(1).unwrap_or(PdoNumber::FIRST) };
        match record_of(self.model, second, demand.object) {
            Ok(_) => Ok(demand),
            Err(error) => Err(named
                .as_ref()
                .unwrap_or(&self.field)
                .problem(format!("the demand is sampled by PDO: {error}; name another 'demand', {SCALED}"))),
        }
    }

    fn object(&self, field: &Field<'_>, is_allowed: fn(Access) -> bool, what: &str) -> Result<Mux, Problem> {
        let found = object(&field.word(OBJECT)?).and_then(|text| text.resolve(Some(self.model.dictionary)));
        match found.map_err(|reason| field.problem(reason))? {
            (mux, Some(row)) if is_allowed(row.access) => Ok(mux),
            (mux, _) => Err(field.problem(format!("{mux} of a {} cannot be {what}", self.model.name))),
        }
    }

    fn gain(&self, field: &Field<'_>) -> Result<Mux, Problem> {
        self.object(field, Access::is_writable, "written")
    }

    fn scaled(&self, field: &Field<'_>, is_written: bool) -> Result<Quantity, Problem> {
        let table = field.table("an object with its scale", SCALED)?;
        table.takes_only(&["object", "per_count"])?;
        let named = table.need("object", OBJECT)?;
        let object = if is_written { self.gain(&named)? } else { self.object(&named, Access::is_readable, "read")? };
        let per_count = positive(&table.need("per_count", WORTH)?, WORTH)?;
        Ok(Quantity { object, scale: Scale::PerCount(per_count) })
    }

    /// The steepest ramps that the objects hold, unless others are named.
    fn without_ramps(&self) -> Result<&'static [(Mux, i64)], Problem> {
        let values: Vec<(Mux, i64)> = match self.table.get("without_ramps") {
            Some(field) => {
                let ramps = field.table("the ramps", WITHOUT_RAMPS)?;
                let value = |field: Field<'_>| {
                    let found = object(field.name()).and_then(|text| text.resolve(Some(self.model.dictionary)));
                    Ok((found.map_err(|reason| field.problem(reason))?.0, field.whole(WITHOUT_RAMPS)?))
                };
                ramps.fields().map(value).collect::<Result<_, _>>()?
            }
            None => {
                let steepest = |ramp: Mux| {
                    let row = self.model.row(ramp)?;
                    let (_, most) = row.integer_limits().unwrap_or_else(|| row.data_type.range());
                    Some((ramp, most))
                };
                [PROFILE_ACCELERATION, PROFILE_DECELERATION].into_iter().filter_map(steepest).collect()
            }
        };
        let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept.iter().map(|(_, loops, _)| loops.without_ramps).find(|known| *known == &values[..]);
        Ok(known.unwrap_or_else(|| values.leak()))
    }
}

fn positive(field: &Field<'_>, expected: &str) -> Result<f64, Problem> {
    field.number(expected).and_then(|value| if value > 0.0 { Ok(value) } else { Err(field.wrong(expected)) })
}

#[cfg(test)]
mod tests {
    use canopen::NodeId;

    use super::super::Machine;
    use super::*;

    /// 60C5h and 60C6h stand in for a maker's objects: the standard's own servo has none.
    const GAINS: &str = "speed_proportional = '60C5'\nspeed_integral = '60C6'\ncurrent = 2.5\n";

    fn read(lines: &str) -> Result<Loops, String> {
        let text = format!("[[drive]]\nmodel = 'cia402'\nnode = 5\n[drive.loops]\n{lines}");
        let machine = Machine::parse(&text).map_err(|bad| bad.to_string())?;
        let (node, model) = machine.models().next().expect("a drive");
        assert_eq!(node, NodeId::new(5).expect("a node-ID"));
        assert!(machine.unused_by_a_master().is_none(), "it is for a master too");
        Ok(model.axes[0].loops.expect("they are named"))
    }

    #[test]
    fn gains_are_those_objects_and_what_is_not_said_is_the_standards() {
        let loops = read(GAINS).expect("it is right");
        assert_eq!((loops.speed_proportional, loops.usual_a), (Mux::new(0x60C5, 0), 2.5));
        assert_eq!(loops.speed_integral, Integral::Gain(Mux::new(0x60C6, 0)));
        // Thousandths of the rated current, which is in mA (CiA 402-2, 6074h and 6075h).
        let scale = Scale::Rated { rated: Mux::new(0x6075, 0), per_count: 1e-6 };
        assert_eq!(loops.demand, Some(Quantity { object: Mux::new(0x6074, 0), scale }));
        assert_eq!(loops.rated, Some([Mux::new(0x6076, 0), Mux::new(0x6075, 0)]));
        let steepest = i64::from(u32::MAX);
        assert_eq!(loops.without_ramps, [(Mux::new(0x6083, 0), steepest), (Mux::new(0x6084, 0), steepest)]);
        assert_eq!((loops.position_proportional, loops.speed_filter, loops.torque_constant_nm_a), (None, None, None));
    }

    #[test]
    fn all_that_may_be_said_is_taken_and_the_same_words_give_the_same_description() {
        let lines = "speed_proportional = 'max_acceleration'\nspeed_integral_time = '60C6'\ncurrent = 2\nspeed = 600\n\
                     speed_filter = { object = '6087', per_count = 1e-6 }\nperiod = '125us'\ntorque_constant = 0.5\n\
                     position_proportional = { object = '60C6', per_count = 0.1 }\nwithout_ramps = { 6083 = 1000 }\n\
                     demand = { object = '6077', per_count = 0.01 }\n";
        let loops = read(lines).expect("it is right");
        assert_eq!(loops.speed_integral, Integral::Time(Mux::new(0x60C6, 0)));
        assert_eq!(
            (loops.usual_rpm, loops.period, loops.torque_constant_nm_a),
            (600.0, Duration::from_micros(125), Some(0.5))
        );
        assert_eq!(loops.demand, Some(Quantity::new(0x6077, 0, 0.01)));
        assert_eq!(loops.without_ramps, [(Mux::new(0x6083, 0), 1000)]);
        let again = read(lines).expect("it is right");
        assert_eq!(loops.without_ramps.as_ptr(), again.without_ramps.as_ptr());
    }

    #[test]
    fn what_is_wrong_is_reported_with_its_place() {
        let says = |lines: &str, line: usize, what: &str| {
            let said = read(lines).expect_err("it is wrong");
            assert!(said.starts_with(&format!("line {line}")) && said.contains(what), "{lines}: {said}");
        };
        says(&format!("{GAINS}gain = 1"), 8, "has no 'gain'");
        says("speed_integral = '60C6'\ncurrent = 1", 4, "needs 'speed_proportional'");
        says("speed_proportional = '60C5'\ncurrent = 1", 4, "either 'speed_integral'");
        says(&format!("{GAINS}speed_integral_time = '60C6'"), 4, "either 'speed_integral'");
        says("speed_proportional = '60C5'\nspeed_integral = '60C6'", 4, "needs 'current'");
        says(&GAINS.replace("2.5", "0"), 7, "in A, above 0");
        says(&GAINS.replace("60C5", "6074"), 5, "cannot be written");
        says(&GAINS.replace("60C5", "2100:01"), 5, "2100");
        says(&format!("{GAINS}demand = '6077'"), 8, "expected a table");
        says(&format!("{GAINS}demand = {{ object = '6075', per_count = 1 }}"), 8, "sampled by PDO");
        says(&format!("{GAINS}speed_filter = {{ object = '60C5', per_count = -1 }}"), 8, "above 0");
        says(&format!("{GAINS}period = 5"), 8, "a time as text");
        says(&format!("{GAINS}without_ramps = {{ 6083 = 'none' }}"), 8, "a table of objects and values");
    }

    #[test]
    fn a_model_whose_loops_are_known_and_one_without_any_are_refused() {
        let refusal = |model: &str| {
            let text = format!("[[drive]]\nmodel = '{model}'\nnode = 4\n[drive.loops]\n{GAINS}");
            Machine::parse(&text).map_or_else(|bad| bad.to_string(), |_| String::new())
        };
        for (model, what) in [("zlac8030l", "is known"), ("zlim42c", "is known"), ("io401", "is not a drive")] {
            let said = refusal(model);
            assert!(said.starts_with("line 4") && said.contains(what), "{said}");
        }
    }
}
