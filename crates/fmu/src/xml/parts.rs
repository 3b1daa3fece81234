//! What the descriptions of both versions share.

use std::path::Path;

use crate::config::{Config, DriveConfig};
use crate::variable::Variable;

/// The name of the library in the FMU, without its ending.
pub const MODEL_IDENTIFIER: &str = "ferrodrive_fmu";

/// Units by the exponents of SI's base units (FMI 3.0, 2.4.3).
const UNITS: [(&str, &str); 8] = [
    ("rad", r#"rad="1""#),
    ("rad/s", r#"rad="1" s="-1""#),
    ("s", r#"s="1""#),
    ("N.m", r#"kg="1" m="2" s="-2""#),
    ("kg.m2", r#"kg="1" m="2""#),
    ("A", r#"A="1""#),
    ("V", r#"kg="1" m="2" s="-3" A="-1""#),
    ("degC", r#"K="1" offset="273.15""#),
];

/// That an output is of the last step: no input changes it, so that importers see no loop of torque and motion.
pub(super) const fn dependencies(variable: &Variable) -> &'static str {
    if variable.is_of_last_step { " dependencies=\"\"" } else { "" }
}

/// What messages are about (FMI 2.0.5 and 3.0, 2.2.4).
pub(super) const LOG_CATEGORIES: &str = "  <LogCategories>\n    <Category name=\"logStatusError\"/>\n    <Category \
    name=\"logStatusFatal\"/>\n  </LogCategories>\n";

/// The definitions of [`UNITS`].
pub(super) fn units() -> String {
    let unit = |(unit, exponents)| format!("    <Unit name=\"{unit}\"><BaseUnit {exponents}/></Unit>\n");
    format!("  <UnitDefinitions>\n{}  </UnitDefinitions>\n", UNITS.map(unit).concat())
}

/// What an importer has to hand back at instantiation: another one is of another FMU.
/// The file in `resources` that describes a drive counts.
pub fn token(config: &Config, resources: &Path) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let mut sum = crc32fast::Hasher::new();
    sum.update(config.text().as_bytes());
    if let Some(name) = config.drive().and_then(DriveConfig::file) {
        sum.update(&std::fs::read(resources.join(name)).unwrap_or_default());
    }
    format!("ferrodrive-{version}-{:08x}", sum.finalize())
}
