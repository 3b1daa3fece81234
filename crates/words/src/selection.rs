//! Several objects in a word: all sub-indices of an index (`1018:*`), some of them (`1018:1..4`), a range of indices
//! (`1000..1FFF`), or one object.

use canopen::Mux;

use super::object::{ObjectArg, object};

/// Which objects are meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Selection {
    /// One.
    One(ObjectArg),
    /// These sub-indices of an index, first and last; as many as there are of `None`.
    SubIndices(u16, Option<(u8, u8)>),
    /// Every object from one index to another.
    Indices(u16, u16),
}

const EXPECTED: &str =
    "several objects are given as 1018:* (all sub-indices), 1018:1..4 (some) or 1000..1FFF (all indices in between)";

/// Reads a selection.
pub fn selection(text: &str) -> Result<Selection, String> {
    let number = |text: &str| match object(text)? {
        ObjectArg::Mux(mux) => Ok(mux),
        ObjectArg::Name(_) => Err(format!("'{text}' is not an index; {EXPECTED}")),
    };
    if let Some(index) = text.strip_suffix(":*") {
        return Ok(Selection::SubIndices(number(index)?.index, None));
    }
    let Some((first, last)) = text.split_once("..") else { return object(text).map(Selection::One) };
    let last = last.trim_start_matches('=');
    let begin = number(first)?;
    if first.contains(':') {
        let end = number(&format!("{:04X}:{last}", begin.index))?;
        return ordered(text, begin.sub_index, end.sub_index)
            .map(|subs| Selection::SubIndices(begin.index, Some(subs)));
    }
    let Mux { index: end, .. } = number(last)?;
    if last.contains(':') {
        return Err(format!("'{text}' has a sub-index at its end only; {EXPECTED}"));
    }
    let (first, last) = ordered(text, begin.index, end)?;
    Ok(Selection::Indices(first, last))
}

fn ordered<T: PartialOrd>(text: &str, first: T, last: T) -> Result<(T, T), String> {
    if first <= last { Ok((first, last)) } else { Err(format!("'{text}' ends before it begins; {EXPECTED}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn selections_are_one_object_sub_indices_or_indices() {
        assert_eq!(selection("6064"), Ok(Selection::One(ObjectArg::Mux(Mux::new(0x6064, 0)))));
        assert_eq!(selection("statusword"), Ok(Selection::One(ObjectArg::Name("statusword".into()))));
        assert_eq!(selection("1018:*"), Ok(Selection::SubIndices(0x1018, None)));
        assert_eq!(selection("0x1018:1..4"), Ok(Selection::SubIndices(0x1018, Some((1, 4)))));
        assert_eq!(selection("1000..1FFF"), Ok(Selection::Indices(0x1000, 0x1FFF)));
        assert_eq!(selection("1000h..=1FFFh"), Ok(Selection::Indices(0x1000, 0x1FFF)));
    }

    #[test]
    fn what_is_no_selection_is_refused_with_the_forms() {
        for wrong in ["1FFF..1000", "1018:4..1", "status..1000", "1000..", "..1000", "1000..2000:1", "statusword:*"] {
            let error = selection(wrong).unwrap_err();
            assert!(error.contains("e.g. 6064") || error.contains("1018:*"), "{wrong}: {error}");
        }
    }
}
