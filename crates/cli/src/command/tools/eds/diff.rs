//! `ferrodrive eds diff`: in what two files differ.

use canopen::Mux;
use eds::{Difference, diff};
use serde::Serialize;

use super::source;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;
use words::counted;

/// Compare two EDS or DCF files, or one with a model: objects, types, access, defaults, limits, PDOs
///
/// A DCF is compared by its values where it has any. Names are not compared.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive eds diff old.eds new.eds\n  ferrodrive eds diff vendor.eds zlac8030l")]
pub(crate) struct Diff {
    /// EDS or DCF file, or a model
    #[arg(value_name = "FILE|MODEL")]
    first: String,
    /// EDS or DCF file, or a model
    #[arg(value_name = "FILE|MODEL")]
    second: String,
}

/// What differs.
#[derive(Debug, Serialize)]
pub(crate) struct DiffReport {
    first: String,
    second: String,
    differences: Vec<DifferenceRow>,
    /// Files that are wrong in places, where something else is taken: there they may differ without a row.
    #[serde(skip)]
    wrong: Vec<String>,
}

#[derive(Debug, Serialize)]
struct DifferenceRow {
    /// `6040h:00`, or `6040h` for an object as a whole; `None` for the device.
    object: Option<String>,
    name: String,
    aspect: &'static str,
    first: Option<String>,
    second: Option<String>,
}

impl Diff {
    /// Reads both and compares them.
    pub(super) fn run(&self) -> Result<DiffReport, Failure> {
        let ((first, of_first), (second, of_second)) = (source::sheet(&self.first)?, source::sheet(&self.second)?);
        let wrong = [(&self.first, of_first), (&self.second, of_second)];
        let wrong = wrong.into_iter().filter(|(_, errors)| *errors > 0);
        Ok(DiffReport {
            wrong: wrong
                .map(|(name, errors)| {
                    format!(
                        "{name} has {}, where something else is compared: ferrodrive eds lint {name}",
                        counted(errors, "error")
                    )
                })
                .collect(),
            first: self.first.clone(),
            second: self.second.clone(),
            differences: diff(&first, &second).into_iter().map(DifferenceRow::of).collect(),
        })
    }
}

impl DifferenceRow {
    fn of(found: Difference) -> Self {
        let object = found.index.map(|index| match found.sub_index {
            Some(sub_index) => Mux::new(index, sub_index).to_string(),
            None => format!("{index:04X}h"),
        });
        Self { object, name: found.name, aspect: found.aspect, first: found.first, second: found.second }
    }
}

impl Report for DiffReport {
    fn text(&self, paint: Paint) -> String {
        let (first, second) = (plain(&self.first), plain(&self.second));
        let notes: String = self.wrong.iter().map(|wrong| format!("\nnote: {}", plain(wrong))).collect();
        if self.differences.is_empty() {
            return format!("{first} and {second} do not differ{notes}");
        }
        let mut table = Table::new(&["object", "name", "what", "first", "second"]);
        for row in &self.differences {
            let say = |text: &Option<String>| text.as_deref().map_or("-".to_owned(), plain);
            let object = row.object.clone().unwrap_or_else(|| "device".into());
            table.row([object, plain(&row.name), row.aspect.to_owned(), say(&row.first), say(&row.second)]);
        }
        format!("first   {first}\nsecond  {second}\n\n{}{notes}", table.plain(paint))
    }
}
