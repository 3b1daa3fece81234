//! Sub-index 0 of records and arrays. Source: CiA 301, 7.4.6.

use super::at::finding;
use crate::{Findings, Object, Rule, TypeCode, Value};

pub(super) fn object(object: &Object, findings: &mut Findings) {
    if !object.object_type.has_sub_objects() || object.variables.is_empty() {
        return;
    }
    let Some(count) = object.variable(0) else {
        let what = "no sub-index 0: how many sub-objects there are is not said".to_owned();
        findings.push(finding(Rule::NoCount, object.line, object.index, None, what));
        return;
    };
    if count.data_type != TypeCode::UNSIGNED8 {
        let what = format!("sub-index 0 is {}, by CiA 301 it is UNSIGNED8", count.data_type);
        findings.push(finding(Rule::CountType, count.line, object.index, Some(0), what));
    }
    // In 1003h and 1010h and the like the count may be less than what is described, never more.
    let highest =
        object.variables.iter().map(|variable| variable.sub_index).filter(|sub_index| *sub_index < 0xFF).max();
    if let (Some(Value::Number(number)), Some(highest)) = (&count.default, highest)
        && number.base > i128::from(highest)
    {
        let what = format!("sub-index 0 counts to {}, but the highest sub-index is {highest}", number.base);
        findings.push(finding(Rule::CountTooHigh, count.line, object.index, Some(0), what));
    }
}
