//! `CompactSubObj`: many sub-objects of one description. Source: CiA 306-1, clause 4.6.3.4.

use super::fields::Fields;
use super::places::{ObjectSection, Role};
use super::reader::Reader;
use crate::Rule;
use crate::document::{Entry, Section};
use crate::value::Number;
use crate::{AccessType, TypeCode, Value, Variable};

impl Reader {
    /// Sub-index 0 with the count, and `count` variables as the section says, with names and values from the sections
    /// beside it.
    pub(super) fn compact_variables(
        &mut self,
        section: Section<'_>,
        fields: &Fields<'_>,
        name: &str,
        count: u8,
        beside: &[ObjectSection<'_>],
    ) -> Vec<Variable> {
        let one = self.variable(section, fields, false, 1, String::new());
        let mut variables = Vec::with_capacity(usize::from(count) + 1);
        variables.push(Variable {
            sub_index: 0,
            name: "NrOfObjects".into(),
            is_domain: false,
            data_type: TypeCode::UNSIGNED8,
            access: AccessType::ReadOnly,
            default: Some(Value::Number(Number::plain(count.into()))),
            low: None,
            high: None,
            pdo_mapping: false,
            value: None,
            ..one.clone()
        });
        variables.extend((1..=count).map(|sub_index| Variable {
            sub_index,
            name: format!("{name}{sub_index}"),
            ..one.clone()
        }));
        let is_dcf = self.eds.commissioning.is_some();
        for part in beside {
            for entry in self.entries(part.section) {
                let Some(variable) = self.compact_entry(part.section, entry, &mut variables) else { continue };
                match part.key.role {
                    Role::Names => entry.value.clone_into(&mut variable.name),
                    Role::Denotations => entry.value.clone_into(&mut variable.denotation),
                    Role::Values => {
                        let value = self.value(part.section, entry, variable.data_type);
                        // In a DCF they are what the device is to have (CiA 306-1, clause 5).
                        let place = if is_dcf { &mut variable.value } else { &mut variable.default };
                        *place = value.or(place.take());
                        self.check_limits(part.section, [Some(entry); 2], variable);
                        self.check_value(part.section, Some(entry), variable);
                    }
                    Role::Object | Role::Sub(_) => {}
                }
            }
        }
        variables
    }

    /// The variable that an entry `3=..` is about.
    fn compact_entry<'v>(
        &mut self,
        section: Section<'_>,
        entry: Entry<'_>,
        variables: &'v mut [Variable],
    ) -> Option<&'v mut Variable> {
        if entry.key.eq_ignore_ascii_case("NrOfEntries") {
            return None;
        }
        let sub_index = entry.key.parse::<u8>().ok().filter(|sub_index| *sub_index > 0);
        let found = sub_index.and_then(|sub_index| variables.get_mut(usize::from(sub_index)));
        if found.is_none() {
            self.found(Rule::CompactEntry, section, entry, "there is no such compact sub-object", "nothing");
        }
        found
    }
}
