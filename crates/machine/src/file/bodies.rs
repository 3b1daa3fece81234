//! Machines that drives of a file move together: `[[body]]`.

use plant::coupled::{ArmModel, CommonShaftModel, DifferentialDriveModel, ExternalModel, Link, MOST, Rule};
use sim::{CoupledShaft, Coupling, Place, World};

use words::document::reader::{Field, Table};
use words::document::{BadFile, Located, Problem};

const KIND: &str = "\"differential-drive\", \"common-shaft\", \"arm\" or \"external\"";
const NUMBER: &str = "a number";
const DRIVES: &str = "a list of nodes, e.g. [4, 5], or [\"5.1\", \"5.2\"] for two axes of one";
const VECTOR: &str = "a list of three numbers, [x, y, z]";

/// What a file may say of each kind of body, beside `name`, `kind`, `drives` and `turns`.
const BASE_KEYS: &[&str] = &[
    "mass_kg",
    "yaw_inertia_kg_m2",
    "wheel_base_m",
    "wheel_radius_m",
    "rolling",
    "grip",
    "weight_share",
    "slope_deg",
    "uphill_deg",
];
const SHAFT_KEYS: &[&str] = &["inertia_kg_m2", "coulomb_nm", "viscous_nm_s"];
const ARM_KEYS: &[&str] = &["link", "tool_m", "payload_kg", "gravity_m_s2"];
const EXTERNAL_KEYS: &[&str] = &["rule", "first_deg", "inertia_kg_m2"];
const LINK_KEYS: &[&str] = &["offset_m", "axis", "mass_kg", "center_m", "inertia_kg_m2", "first_deg"];

/// A machine that drives move together.
#[derive(Clone, Debug)]
pub(crate) struct Joined {
    name: String,
    coupling: Coupling,
    shafts: Vec<CoupledShaft>,
    at: Located,
}

impl Joined {
    pub(super) fn parse(field: &Field<'_>) -> Result<Self, Problem> {
        let table = field.table("a body", "a table of its own for each body, begun by [[body]]")?;
        let kind = table.need("kind", KIND)?;
        // First what is misspelt, else it would be missing.
        let takes = |own: &[&str]| table.takes_only(&[&["name", "kind", "drives", "turns"], own].concat());
        let coupling = match kind.text(KIND)? {
            "differential-drive" => takes(BASE_KEYS).and_then(|()| base(&table)).map(Coupling::DifferentialDrive)?,
            "common-shaft" => takes(SHAFT_KEYS).and_then(|()| shaft(&table)).map(Coupling::CommonShaft)?,
            "arm" => takes(ARM_KEYS).and_then(|()| arm(&table)).map(|arm| Coupling::Arm(Box::new(arm)))?,
            "external" => takes(EXTERNAL_KEYS).and_then(|()| external(&table)).map(Coupling::External)?,
            _ => return Err(kind.wrong(KIND)),
        };
        let name = table.need("name", "a name without blanks, e.g. \"base\"")?;
        let text = name.text("a name")?;
        if text.is_empty() || text.contains(char::is_whitespace) {
            return Err(name.wrong("a name without blanks, e.g. \"base\""));
        }
        let at = field.problem("").locate(table.text());
        Ok(Self { name: text.to_owned(), coupling, shafts: shafts(&table)?, at })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// A base on two wheels: what it is, and its nodes, the left one first, each with the turns of the wheel for one of the drive.
    pub(super) fn differential_drive(&self) -> Option<(&DifferentialDriveModel, [(u8, f64); 2])> {
        let (Coupling::DifferentialDrive(model), [left, right]) = (&self.coupling, &self.shafts[..]) else {
            return None;
        };
        Some((model, [left, right].map(|shaft| (shaft.place.node, shaft.turns))))
    }

    /// An arm: what it is, and the shafts of its joints.
    pub(super) fn arm(&self) -> Option<(&ArmModel, &[CoupledShaft])> {
        let Coupling::Arm(model) = &self.coupling else { return None };
        Some((model, &self.shafts))
    }

    /// Joins the drives, which are in the world already.
    pub(super) fn couple(&self, world: &mut World) -> Result<(), BadFile> {
        let refused = |error| BadFile::one(self.at.saying(format!("body {:?}: {error}", self.name)));
        world.couple(&self.name, &self.coupling, &self.shafts).map_err(refused)
    }
}

fn shafts(table: &Table<'_>) -> Result<Vec<CoupledShaft>, Problem> {
    let drives = table.need("drives", DRIVES)?.list(DRIVES)?;
    let places = drives.iter().map(|drive| {
        let word = drive.word(DRIVES)?;
        word.parse::<Place>().map_err(|()| drive.wrong(DRIVES))
    });
    let places = places.collect::<Result<Vec<_>, _>>()?;
    let Some(field) = table.get("turns") else { return Ok(places.into_iter().map(CoupledShaft::direct).collect()) };
    let expected = "a list of turns of the body per turn of each drive, e.g. [1, -1]";
    let turns = field.list(expected)?.iter().map(|turns| turns.number(expected)).collect::<Result<Vec<_>, _>>()?;
    if turns.len() != places.len() {
        return Err(field.problem(format!("{} turns for {} drives", turns.len(), places.len())));
    }
    Ok(places.into_iter().zip(turns).map(|(place, turns)| CoupledShaft { place, turns }).collect())
}

fn number(table: &Table<'_>, name: &str, otherwise: f64) -> Result<f64, Problem> {
    table.get(name).map_or(Ok(otherwise), |field| field.number(NUMBER))
}

fn needed(table: &Table<'_>, name: &str) -> Result<f64, Problem> {
    table.need(name, NUMBER)?.number(NUMBER)
}

fn vector(table: &Table<'_>, name: &str, otherwise: [f64; 3]) -> Result<[f64; 3], Problem> {
    let Some(field) = table.get(name) else { return Ok(otherwise) };
    let parts = field.list(VECTOR)?.iter().map(|part| part.number(VECTOR)).collect::<Result<Vec<_>, _>>()?;
    <[f64; 3]>::try_from(parts).map_err(|_| field.wrong(VECTOR))
}

fn base(table: &Table<'_>) -> Result<DifferentialDriveModel, Problem> {
    let (mass_kg, wheel_base_m) = (needed(table, "mass_kg")?, needed(table, "wheel_base_m")?);
    Ok(DifferentialDriveModel {
        mass_kg,
        // By default: a square plate as wide as the wheels are apart.
        yaw_inertia_kg_m2: number(table, "yaw_inertia_kg_m2", mass_kg * wheel_base_m * wheel_base_m / 6.0)?,
        wheel_base_m,
        wheel_radius_m: needed(table, "wheel_radius_m")?,
        rolling: number(table, "rolling", 0.0)?,
        grip: table.get("grip").map(|field| field.number(NUMBER)).transpose()?,
        weight_share: number(table, "weight_share", 1.0)?,
        slope_rad: number(table, "slope_deg", 0.0)?.to_radians(),
        uphill_rad: number(table, "uphill_deg", 0.0)?.to_radians(),
    })
}

fn shaft(table: &Table<'_>) -> Result<CommonShaftModel, Problem> {
    Ok(CommonShaftModel {
        inertia_kg_m2: number(table, "inertia_kg_m2", 0.0)?,
        coulomb_nm: number(table, "coulomb_nm", 0.0)?,
        viscous_nm_s: number(table, "viscous_nm_s", 0.0)?,
    })
}

fn arm(table: &Table<'_>) -> Result<ArmModel, Problem> {
    let expected = "one to seven links, each begun by [[body.link]]";
    let field = table.need("link", expected)?;
    let links = field.list(expected)?.iter().map(link).collect::<Result<Vec<_>, _>>()?;
    let many = format!("{} links; an arm has one to {MOST}", links.len());
    let mut model = ArmModel::new(&links).ok_or_else(|| field.problem(many))?;
    model.tool_m = vector(table, "tool_m", model.tool_m)?;
    model.payload_kg = number(table, "payload_kg", 0.0)?;
    model.gravity_m_s2 = vector(table, "gravity_m_s2", model.gravity_m_s2)?;
    Ok(model)
}

fn external(table: &Table<'_>) -> Result<ExternalModel, Problem> {
    let drives = table.need("drives", DRIVES)?;
    let count = drives.list(DRIVES)?.len();
    let rule = match table.get("rule") {
        None => Rule::default(),
        Some(field) => field.text(Rule::NAMES)?.parse().map_err(|()| field.wrong(Rule::NAMES))?,
    };
    let (first_deg, inertia) = (numbers(table, "first_deg", count)?, numbers(table, "inertia_kg_m2", count)?);
    let joints: Vec<_> = first_deg.into_iter().map(f64::to_radians).zip(inertia).collect();
    ExternalModel::new(rule, &joints)
        .ok_or_else(|| drives.problem(format!("{count} drives; an external body has one to {MOST}")))
}

/// A number for each of so many drives, 0 where nothing is said.
fn numbers(table: &Table<'_>, name: &str, count: usize) -> Result<Vec<f64>, Problem> {
    let expected = "a list of numbers, one for each drive";
    let Some(field) = table.get(name) else { return Ok(vec![0.0; count]) };
    let numbers = field.list(expected)?.iter().map(|number| number.number(expected)).collect::<Result<Vec<_>, _>>()?;
    if numbers.len() == count { Ok(numbers) } else { Err(field.wrong(expected)) }
}

fn link(field: &Field<'_>) -> Result<Link, Problem> {
    let table = field.table("a link", "a table of its own for each link, begun by [[body.link]]")?;
    table.takes_only(LINK_KEYS)?;
    table.need("axis", VECTOR)?;
    Ok(Link {
        offset_m: vector(&table, "offset_m", [0.0; 3])?,
        axis: vector(&table, "axis", [0.0; 3])?,
        mass_kg: needed(&table, "mass_kg")?,
        center_m: vector(&table, "center_m", [0.0; 3])?,
        inertia_kg_m2: vector(&table, "inertia_kg_m2", [0.0; 3])?,
        first_rad: number(&table, "first_deg", 0.0)?.to_radians(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::Machine;

    const DRIVES: &str = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n[[drive]]\nmodel = 'zlac8030l'\nnode = 5\n";

    fn refusal(text: &str) -> String {
        Machine::parse(text).and_then(|machine| machine.build()).map_or_else(|bad| bad.to_string(), |_| String::new())
    }

    #[test]
    fn bodies_of_each_kind_are_joined_and_seen() {
        let base = "[[body]]\nname = 'base'\nkind = 'differential-drive'\ndrives = [4, 5]\nturns = [1, -1]\n\
                    mass_kg = 40\nwheel_base_m = 0.5\nwheel_radius_m = 0.08\ngrip = 0.7\nslope_deg = 3\n";
        let shaft = "[[body]]\nname = 'axle'\nkind = 'common-shaft'\ndrives = [4, 5]\ninertia_kg_m2 = 0.1\n";
        let arm = "[[body]]\nname = 'arm'\nkind = 'arm'\ndrives = [4, '5']\ntool_m = [0.3, 0, 0]\npayload_kg = 1\n\
                   [[body.link]]\naxis = [0, -1, 0]\nmass_kg = 2\ncenter_m = [0.2, 0, 0]\n\
                   [[body.link]]\naxis = [0, -1, 0]\nmass_kg = 1\noffset_m = [0.4, 0, 0]\nfirst_deg = 30\n";
        let external = "[[body]]\nname = 'hands'\nkind = 'external'\ndrives = [4, 5]\nturns = [1, -1]\nrule = 'hold'\n\
                        first_deg = [90, 0]\ninertia_kg_m2 = [0.1, 0.2]\n";
        for (text, name) in [(base, "base"), (shaft, "axle"), (arm, "arm"), (external, "hands")] {
            let machine = Machine::parse(&format!("{DRIVES}{text}")).unwrap_or_else(|bad| panic!("{bad}"));
            let mut world = machine.build().unwrap_or_else(|bad| panic!("{bad}"));
            assert!(world.body(name).is_some() && world.body_of(sim::Place::node(5)).is_some(), "{name}");
        }
        let machine = Machine::parse(&format!("{DRIVES}{base}")).unwrap_or_else(|bad| panic!("{bad}"));
        assert_eq!(machine.unused_by_a_master().as_deref(), Some("body"));
    }

    #[test]
    fn what_is_wrong_with_a_body_is_reported_at_its_place() {
        let with = |lines: &str| refusal(&format!("{DRIVES}[[body]]\nname = 'b'\n{lines}"));
        let shaft = "kind = 'common-shaft'\ndrives = ";
        assert!(
            with("kind = 'boat'").contains("line 9, column 8: 'kind' is \"boat\"; expected \"differential-drive\"")
        );
        assert!(
            with(&format!("{shaft}[4]"))
                .contains("line 7, column 1: body \"b\": a common-shaft has 2 to 7 drives, not 1")
        );
        assert!(with(&format!("{shaft}[4, 9]")).contains("there is no drive 9"));
        assert!(with(&format!("{shaft}[4, 'x']")).contains("expected a list of nodes"));
        assert!(with(&format!("{shaft}[4, 5]\nturns = [1]")).contains("1 turns for 2 drives"));
        assert!(with(&format!("{shaft}[4, 5]\ninertia_kg_m2 = -1")).contains("must be 0 to 1e6"));
        assert!(with(&format!("{shaft}[4, 5]\nwheel_radius_m = 1")).contains("has no 'wheel_radius_m'"));
        assert!(
            with("kind = 'differential-drive'\ndrives = [4, 5]\nmas_kg = 30")
                .contains("has no 'mas_kg'; did you mean mass_kg?")
        );
        assert!(with("kind = 'arm'\ndrives = [4]\nlink = []").contains("0 links; an arm has one to 7"));
        let external = "kind = 'external'\ndrives = ";
        assert!(with(&format!("{external}[]")).contains("0 drives; an external body has one to 7"));
        assert!(with(&format!("{external}[4]\nfirst_deg = [1, 2]")).contains("a list of numbers, one for each drive"));
        assert!(
            with(&format!("{external}[4]\nrule = 'guess'")).contains("expected hold, interpolate, integrate or torque")
        );
        assert!(
            with("kind = 'arm'\ndrives = [4]\n[[body.link]]\naxis = [0, 1]\nmass_kg = 1").contains("three numbers")
        );
        assert!(
            with("kind = 'arm'\ndrives = [4]\n[[body.link]]\naxis = [0, 2, 0]\nmass_kg = 1")
                .contains("axis must be 1, not 2")
        );
    }

    #[test]
    fn loads_of_all_kinds_hang_on_a_shaft() {
        let load = "load = { torque_nm = 0.5, gear = { ratio = 10, backlash_deg = 0.5 }, \
                    friction = { coulomb_nm = 0.2, static_nm = 0.3 }, pulley = { mass_kg = 2, radius_m = 0.05 }, \
                    spring = { stiffness_nm_rad = 5 }, stop = { range = [-5000, 'max'], stiffness_nm_rad = 1000 }, \
                    fan = { torque_nm = 2, speed_rpm = 300 } }";
        let drive = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";
        assert_eq!(refusal(&format!("{drive}{load}")), "");
        let with = |load: &str| refusal(&format!("{drive}load = {{ {load} }}"));
        assert!(with("fan = { torque_nm = 2 }").contains("needs 'speed_rpm'"));
        assert!(with("pulley = { mass_kg = -2, radius_m = 1 }").contains("'load pulley -2 1' cannot be done"));
        assert!(with("stop = { range = [5, 9] }").contains("beyond these stops"));
        assert!(with("spring = 5").contains("'spring' is 5; expected a table of stiffness_nm_rad, rest_deg"));
    }
}
