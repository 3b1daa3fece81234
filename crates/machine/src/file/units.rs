//! What stands behind the shaft of a drive, in a machine file: `units`. A master counts by it; to the simulator a drive is the
//! same with it.

use master::Gear;
use master::units::parse_length;

use words::document::Problem;
use words::document::reader::{Field, Table};

/// The key of a drive that is read here.
pub(super) const KEY: &str = "units";

const UNITS: &str = "a table of gear_ratio and feed_constant, e.g. { gear_ratio = 50, feed_constant = \"10mm\" }";
const RATIO: &str =
    "turns of the drive's shaft for one turn of the output: a number, or both as [shaft, output], e.g. [160, 3]";
const FEED: &str = "the way for one turn of the output as text, e.g. \"10mm\"";

/// The gear of a drive; [`Gear::DIRECT`] of one whose table says nothing of it.
pub(super) fn gear(drive: &Table<'_>) -> Result<Gear, Problem> {
    let Some(field) = drive.get(KEY) else { return Ok(Gear::DIRECT) };
    let table = field.table("the units", UNITS)?;
    table.takes_only(&["gear_ratio", "feed_constant"])?;
    let mut gear = Gear::DIRECT;
    if let Some(field) = table.get("gear_ratio") {
        gear = Gear::new(ratio(&field)?).map_err(|error| field.problem(error.to_string()))?;
    }
    if let Some(field) = table.get("feed_constant") {
        let metres = parse_length(&field.words(FEED)?).map_err(|error| field.problem(error.to_string()))?;
        gear = gear.with_feed(metres).map_err(|error| field.problem(error.to_string()))?;
    }
    Ok(gear)
}

fn ratio(field: &Field<'_>) -> Result<f64, Problem> {
    if !field.is_list() {
        return field.number(RATIO);
    }
    let both = field.list(RATIO)?;
    let [shaft, output] = &both[..] else { return Err(field.wrong(RATIO)) };
    Ok(shaft.number(RATIO)? / output.number(RATIO)?)
}

#[cfg(test)]
mod tests {
    use canopen::NodeId;

    use super::super::Machine;
    use super::*;

    const DRIVE: &str = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\n";

    fn read(line: &str) -> Result<Gear, String> {
        let machine = Machine::parse(&format!("{DRIVE}{line}")).map_err(|bad| bad.to_string())?;
        Ok(machine.gear(NodeId::new(2).expect("a node-ID")))
    }

    #[test]
    fn ratio_and_feed_are_read_in_each_way_that_they_may_be_written() {
        assert_eq!(read(""), Ok(Gear::DIRECT));
        assert_eq!(read("units = {}"), Ok(Gear::DIRECT));
        assert_eq!(read("units = { gear_ratio = 50 }"), Ok(Gear::new(50.0).unwrap()));
        let planetary = Gear::new(160.0 / 3.0).unwrap().with_feed(0.01).unwrap();
        assert_eq!(read("[drive.units]\ngear_ratio = [160, 3]\nfeed_constant = '1cm'"), Ok(planetary));
        assert_eq!(read("units = { feed_constant = '10 mm' }"), Ok(Gear::DIRECT.with_feed(0.01).unwrap()));
    }

    #[test]
    fn what_is_not_a_gear_is_reported_with_its_place() {
        let says = |line: &str, what: &str| {
            let said = read(line).expect_err("it is wrong");
            assert!(said.starts_with("line 4") && said.contains(what), "{line}: {said}");
        };
        says("units = 50", "expected a table of gear_ratio and feed_constant");
        says("units = { ratio = 50 }", "has no 'ratio'");
        says("units = { gear_ratio = 0 }", "a gear ratio of 0 is out of range");
        says("units = { gear_ratio = -3 }", "polarity (607Eh)");
        says("units = { gear_ratio = [1, 0] }", "a gear ratio of inf is out of range");
        says("units = { gear_ratio = [1, 2, 3] }", "both as [shaft, output]");
        says("units = { gear_ratio = '50' }", "turns of the drive's shaft");
        says("units = { feed_constant = 10 }", "as text, e.g. \"10mm\"");
        says("units = { feed_constant = '10deg' }", "a length such as 10mm");
        says("units = { feed_constant = '1km' }", "a length such as 10mm");
    }
}
