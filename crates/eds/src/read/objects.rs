//! Objects, put together from their sections.

use super::fields::Fields;
use super::places::{ObjectSection, Role};
use super::reader::{AS_IT_STANDS, Reader, shortened};
use crate::Rule;
use crate::document::{Entry, Section};
use crate::{Object, ObjectType, Refusal, TypeCode, Value, Variable};

/// Most values of a file, those of compact sub-objects counted.
const MOST_VARIABLES: usize = 60_000;
/// Most bytes of text that compact sub-objects repeat.
const MOST_REPEATED: usize = 8 << 20;

impl Reader {
    /// All objects, from their sections in order.
    pub(super) fn objects(&mut self, parts: &[ObjectSection<'_>]) -> Result<(), Refusal> {
        self.eds.objects.reserve(parts.iter().filter(|part| part.key.role == Role::Object).count());
        for of_one in parts.chunk_by(|a, b| a.key.index == b.key.index) {
            if let Some(object) = self.object(of_one)? {
                self.eds.objects.push(object);
            }
        }
        Ok(())
    }

    /// One object from its sections, the one with its index first.
    fn object(&mut self, parts: &[ObjectSection<'_>]) -> Result<Option<Object>, Refusal> {
        let parts = self.without_doubles(parts);
        let (first, rest) = parts.split_first().ok_or_else(|| Refusal::new(0, "an object without a section", ""))?;
        let index = first.key.index;
        if first.key.role != Role::Object {
            return self.orphans(index, &parts);
        }
        let section = first.section;
        let fields = self.fields(section);
        let subs: Vec<ObjectSection<'_>> =
            rest.iter().copied().filter(|part| matches!(part.key.role, Role::Sub(_))).collect();
        let compact =
            fields.compact_sub_obj.and_then(|entry| self.count::<u8>(section, entry)).filter(|count| *count > 0);
        let object_type = self.object_type(section, &fields, !subs.is_empty() || compact.is_some());
        let name = self.name(section, &fields);
        let flags = fields.obj_flags.and_then(|entry| self.count(section, entry)).unwrap_or(0);
        let mut object = Object {
            line: section.line(),
            index,
            name,
            object_type,
            list: None,
            flags,
            compact,
            variables: Vec::new(),
        };
        if !subs.is_empty() {
            if compact.is_some() {
                self.found_in(
                    Rule::CompactAndSections,
                    section,
                    "CompactSubObj and sections of sub-objects",
                    "the sections",
                );
                object.compact = None;
            }
            object.variables = self.subs(&subs)?;
            self.check_sub_number(section, &fields, &object);
        } else if let Some(count) = compact {
            self.take(section, usize::from(count) + 1)?;
            self.repeat(section, usize::from(count))?;
            object.variables = self.compact_variables(section, &fields, &object.name, count, rest);
        } else {
            self.take(section, 1)?;
            self.single(section, &fields, &mut object);
        }
        Ok(Some(object))
    }

    /// Counts values, so that a few lines cannot ask for all memory.
    fn take(&mut self, section: Section<'_>, count: usize) -> Result<(), Refusal> {
        self.take_values(section.line(), count)
    }

    /// The same of values that a line asks for.
    pub(super) fn take_values(&mut self, line: u32, count: usize) -> Result<(), Refusal> {
        self.variables += count;
        if self.variables <= MOST_VARIABLES {
            return Ok(());
        }
        let reason = format!("more than {MOST_VARIABLES} objects and sub-objects");
        Err(Refusal::new(line as usize, reason, "a device has some thousand: is this the right file?"))
    }

    /// Counts the text of a section that is repeated in `count` compact sub-objects.
    fn repeat(&mut self, section: Section<'_>, count: usize) -> Result<(), Refusal> {
        self.repeated += count * section.entries().map(|entry| entry.value.len()).sum::<usize>();
        if self.repeated <= MOST_REPEATED {
            return Ok(());
        }
        let reason = "compact sub-objects repeat texts of megabytes";
        Err(Refusal::new(section.line() as usize, reason, "shorten the texts of this object"))
    }

    /// The first of each section that stands twice.
    fn without_doubles<'a>(&mut self, parts: &[ObjectSection<'a>]) -> Vec<ObjectSection<'a>> {
        let mut kept: Vec<ObjectSection<'a>> = Vec::with_capacity(parts.len());
        for part in parts {
            match kept.last() {
                Some(first) if first.key == part.key => {
                    self.section_twice(part.section, first.section.line());
                }
                _ => kept.push(*part),
            }
        }
        kept
    }

    /// Sub-objects of an index that has no section of its own.
    fn orphans(&mut self, index: u16, parts: &[ObjectSection<'_>]) -> Result<Option<Object>, Refusal> {
        let section = parts[0].section;
        let subs: Vec<ObjectSection<'_>> =
            parts.iter().copied().filter(|part| matches!(part.key.role, Role::Sub(_))).collect();
        if subs.is_empty() {
            self.found_in(Rule::SubWithoutObject, section, format!("there is no section [{index:04X}]"), "nothing");
            return Ok(None);
        }
        self.found_in(
            Rule::SubWithoutObject,
            section,
            format!("there is no section [{index:04X}]"),
            "a RECORD without a name",
        );
        Ok(Some(Object {
            line: section.line(),
            index,
            name: String::new(),
            object_type: ObjectType::Record,
            list: None,
            flags: 0,
            compact: None,
            variables: self.subs(&subs)?,
        }))
    }

    fn object_type(&mut self, section: Section<'_>, fields: &Fields<'_>, has_subs: bool) -> ObjectType {
        let inferred = if has_subs { ObjectType::Record } else { ObjectType::Var };
        let Some(entry) = fields.object_type.filter(|entry| !entry.value.is_empty()) else {
            // Without the key it is a VAR (CiA 306-1).
            if has_subs {
                self.found_in(
                    Rule::ObjectType,
                    section,
                    "no ObjectType, which makes a VAR, but sub-objects",
                    inferred.name(),
                );
            }
            return inferred;
        };
        let Some(kind) = self.count::<u16>(section, entry).and_then(ObjectType::of) else {
            self.found(
                Rule::ObjectType,
                section,
                entry,
                format!("expected a type of object, got {:?}", shortened(entry.value)),
                inferred.name(),
            );
            return inferred;
        };
        if has_subs && !kind.has_sub_objects() && kind != ObjectType::DefType {
            self.found(
                Rule::ObjectType,
                section,
                entry,
                format!("a {} has no sub-objects, but there are some", kind.name()),
                "RECORD",
            );
            return ObjectType::Record;
        }
        kind
    }

    /// Without one the file is still clear.
    pub(super) fn name(&mut self, section: Section<'_>, fields: &Fields<'_>) -> String {
        match fields.parameter_name {
            Some(entry) => entry.value.to_owned(),
            None => {
                self.found_in(Rule::Name, section, "no ParameterName", AS_IT_STANDS);
                String::new()
            }
        }
    }

    fn subs(&mut self, subs: &[ObjectSection<'_>]) -> Result<Vec<Variable>, Refusal> {
        let mut variables = Vec::with_capacity(subs.len());
        for part in subs {
            let Role::Sub(sub_index) = part.key.role else { continue };
            self.take(part.section, 1)?;
            let fields = self.fields(part.section);
            let kind = self.object_type(part.section, &fields, false);
            if kind.has_sub_objects() {
                self.found_in(
                    Rule::ObjectType,
                    part.section,
                    format!("a sub-object cannot be a {}", kind.name()),
                    "VAR",
                );
            }
            let name = self.name(part.section, &fields);
            variables.push(self.variable(part.section, &fields, kind == ObjectType::Domain, sub_index, name));
        }
        Ok(variables)
    }

    /// An object without sub-objects.
    fn single(&mut self, section: Section<'_>, fields: &Fields<'_>, object: &mut Object) {
        if matches!(object.object_type, ObjectType::DefType | ObjectType::DefStruct) && fields.data_type.is_none() {
            return;
        }
        if object.object_type.has_sub_objects() {
            let what = format!("a {} without sub-objects", object.object_type.name());
            if fields.data_type.is_none() {
                self.found_in(Rule::NoSubObjects, section, what, "an object without values");
                return;
            }
            self.found_in(Rule::NoSubObjects, section, what, "VAR");
            object.object_type = ObjectType::Var;
        }
        let is_domain = object.object_type == ObjectType::Domain;
        object.variables = vec![self.variable(section, fields, is_domain, 0, object.name.clone())];
    }

    /// A value with all that is said of it.
    pub(super) fn variable(
        &mut self,
        section: Section<'_>,
        fields: &Fields<'_>,
        is_domain: bool,
        sub_index: u8,
        name: String,
    ) -> Variable {
        let data_type = self.data_type(section, fields, is_domain);
        let mut value = |entry| self.value(section, entry, data_type);
        let default = fields.default_value.and_then(&mut value);
        let low = fields.low_limit.and_then(&mut value);
        let high = fields.high_limit.and_then(&mut value);
        let parameter_value = fields.parameter_value.and_then(&mut value);
        let mut variable = Variable {
            line: section.line(),
            sub_index,
            name,
            is_domain: is_domain || data_type == TypeCode::DOMAIN,
            data_type,
            access: self.access(section, fields, is_domain),
            default,
            low,
            high,
            pdo_mapping: fields.pdo_mapping.is_some_and(|entry| self.flag(section, entry)),
            flags: fields.obj_flags.and_then(|entry| self.count(section, entry)).unwrap_or(0),
            value: parameter_value,
            denotation: text(fields.denotation),
            upload_file: text(fields.upload_file),
            download_file: text(fields.download_file),
        };
        self.check_limits(section, [fields.low_limit, fields.high_limit], &mut variable);
        self.check_value(section, fields.parameter_value, &variable);
        variable
    }

    /// Limits that contradict each other or the default are not taken: the device is delivered with its default.
    /// `at` are the entries to name for the low and the high limit.
    pub(super) fn check_limits(&mut self, section: Section<'_>, at: [Option<Entry<'_>>; 2], variable: &mut Variable) {
        if let Some(entry) = at[0]
            && is_above(&variable.low, &variable.high)
        {
            self.found(Rule::LimitsCrossed, section, entry, "the low limit lies above the high limit", "no limits");
            (variable.low, variable.high) = (None, None);
            return;
        }
        if let Some(entry) = at[0]
            && is_above(&variable.low, &variable.default)
        {
            self.found(
                Rule::DefaultOutside,
                section,
                entry,
                "the low limit lies above the default value",
                "no low limit",
            );
            variable.low = None;
        }
        if let Some(entry) = at[1]
            && is_above(&variable.default, &variable.high)
        {
            self.found(
                Rule::DefaultOutside,
                section,
                entry,
                "the high limit lies below the default value",
                "no high limit",
            );
            variable.high = None;
        }
    }

    /// The value of a DCF is what the user wants, within the limits or not: the device accepts or refuses it.
    pub(super) fn check_value(&mut self, section: Section<'_>, at: Option<Entry<'_>>, variable: &Variable) {
        let Some(entry) = at else { return };
        if is_above(&variable.low, &variable.value) || is_above(&variable.value, &variable.high) {
            self.found(Rule::ValueOutside, section, entry, "the value lies outside of the limits", AS_IT_STANDS);
        }
    }

    fn check_sub_number(&mut self, section: Section<'_>, fields: &Fields<'_>, object: &Object) {
        let Some(entry) = fields.sub_number else {
            self.found_in(Rule::SubNumber, section, "no SubNumber", AS_IT_STANDS);
            return;
        };
        let Some(said) = self.count::<usize>(section, entry) else { return };
        let there = object.variables.len();
        if said != there {
            self.found(
                Rule::SubNumber,
                section,
                entry,
                format!("SubNumber is {said}, but there are {there} sub-objects"),
                there.to_string(),
            );
        }
    }
}

fn text(entry: Option<Entry<'_>>) -> String {
    entry.map(|entry| entry.value.to_owned()).unwrap_or_default()
}

/// Both are numbers, and the one is larger than the other whatever the node-ID is: what depends on it does so by a sum, so that
/// the smallest and the largest node-ID decide.
fn is_above(one: &Option<Value>, other: &Option<Value>) -> bool {
    [1, 127].into_iter().all(|node_id| {
        let of = |value: &Option<Value>| match value.as_ref()? {
            Value::Number(number) => Some(number.at_node(node_id) as f64),
            Value::Real(real) => Some(*real),
            Value::Text(_) => None,
        };
        of(one).zip(of(other)).is_some_and(|(one, other)| one > other)
    })
}
