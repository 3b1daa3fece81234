//! Modes of operation (6060h) as people type them.

use cia402::ModeOfOperation;

/// The abbreviations of CiA 402-2.
pub const ABBREVIATIONS: [(&str, ModeOfOperation); 9] = [
    ("pp", ModeOfOperation::PROFILE_POSITION),
    ("vl", ModeOfOperation::VELOCITY),
    ("pv", ModeOfOperation::PROFILE_VELOCITY),
    ("tq", ModeOfOperation::PROFILE_TORQUE),
    ("hm", ModeOfOperation::HOMING),
    ("ip", ModeOfOperation::INTERPOLATED_POSITION),
    ("csp", ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION),
    ("csv", ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY),
    ("cst", ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE),
];

/// A mode of operation by its number, its abbreviation or its name: `3`, `pv`, `profile velocity`.
///
/// # Errors
/// What is expected.
pub fn mode(text: &str) -> Result<ModeOfOperation, String> {
    let spelled = |words: &str| words.to_lowercase().replace([' ', '_'], "-");
    let said = spelled(text);
    let named = || (i8::MIN..=i8::MAX).map(ModeOfOperation).filter_map(|mode| Some((mode, spelled(mode.name()?))));
    let by_abbreviation = || ABBREVIATIONS.iter().find(|(short, _)| *short == said).map(|(_, mode)| *mode);
    let by_name = || named().find(|(_, name)| *name == said).map(|(mode, _)| mode);
    text.parse().ok().map(ModeOfOperation).or_else(by_abbreviation).or_else(by_name).ok_or_else(|| {
        let short = ABBREVIATIONS.map(|(short, _)| short).join(", ");
        let names: Vec<_> = named().map(|(_, name)| name).collect();
        format!(
            "'{text}' is not a mode of operation; expected its number (6060h), or one of: {short}, {}",
            names.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_has_a_number_an_abbreviation_and_a_name() {
        for text in ["3", "pv", "PV", "profile velocity", "profile-velocity", "Profile_Velocity"] {
            assert_eq!(mode(text), Ok(ModeOfOperation::PROFILE_VELOCITY), "{text}");
        }
        assert_eq!(mode("-1"), Ok(ModeOfOperation(-1)));
        let error = mode("fast").unwrap_err();
        assert!(error.contains("'fast'") && error.contains("csp") && error.contains("homing"), "{error}");
    }
}
