//! `ferrodrive eds show`: what a file says.

use canopen::Mux;
use eds::{Commissioning, Eds, Object, Value, Variable};
use serde::Serialize;

use super::source;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;
use words::object::{ObjectArg, object};

/// Show the device and the objects of an EDS or DCF file
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive eds show vendor.eds\n  ferrodrive eds show vendor.eds 6040 velocity")]
pub(crate) struct Show {
    /// EDS or DCF file, or a model
    #[arg(value_name = "FILE|MODEL")]
    file: String,
    /// Show only objects with this index, or with this word in the name
    #[arg(value_name = "OBJECT")]
    search: Vec<String>,
}

/// What the file says.
#[derive(Debug, Serialize)]
pub(crate) struct ShowReport {
    file: String,
    description: String,
    vendor: String,
    vendor_number: Option<u32>,
    product: String,
    product_number: Option<u32>,
    revision_number: Option<u32>,
    bit_rates_kbit_s: Vec<u16>,
    rpdos: Option<u16>,
    tpdos: Option<u16>,
    lss: bool,
    granularity: u8,
    /// The one device that a DCF is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    commissioning: Option<Commissioned>,
    objects: Vec<ObjectRow>,
    #[serde(skip)]
    is_dcf: bool,
}

#[derive(Debug, Serialize)]
struct Commissioned {
    node: Option<u8>,
    name: String,
    bit_rate_kbit_s: Option<u16>,
}

#[derive(Debug, Serialize)]
struct ObjectRow {
    object: String,
    line: u32,
    name: String,
    kind: &'static str,
    data_type: String,
    access: &'static str,
    mappable: bool,
    default: Option<String>,
    low: Option<String>,
    high: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<String>,
}

impl Show {
    /// Reads the file and picks the objects.
    pub(super) fn run(&self) -> Result<ShowReport, Failure> {
        let (eds, _) = source::sheet(&self.file)?;
        let wanted =
            |object: &Object, variable: &Variable| self.search.iter().all(|word| matches(object, variable, word));
        let of_object = |object: &Object| -> Vec<ObjectRow> {
            object.variables.iter().filter(|one| wanted(object, one)).map(|one| ObjectRow::of(object, one)).collect()
        };
        let objects: Vec<ObjectRow> = eds.objects.iter().flat_map(of_object).collect();
        if objects.is_empty() && !self.search.is_empty() {
            let words = self.search.join(" ");
            return Err(Failure::new(format!("no object of {} matches '{words}'", self.file)).next(format!(
                "ferrodrive eds show {} lists all {}",
                self.file,
                eds.variables().count()
            )));
        }
        Ok(ShowReport::of(self.file.clone(), &eds, objects))
    }
}

fn matches(of: &Object, variable: &Variable, word: &str) -> bool {
    if let Ok(ObjectArg::Mux(mux)) = object(word)
        && mux.index == of.index
        && (!word.contains(':') || mux.sub_index == variable.sub_index)
    {
        return true;
    }
    let word = word.to_lowercase();
    [&of.name, &variable.name].into_iter().any(|name| name.to_lowercase().contains(&word))
}

impl ShowReport {
    fn of(file: String, eds: &Eds, objects: Vec<ObjectRow>) -> Self {
        let device = &eds.device;
        let commissioned = |of: &Commissioning| Commissioned {
            node: of.node_id,
            name: of.node_name.clone(),
            bit_rate_kbit_s: of.bit_rate,
        };
        Self {
            file,
            description: eds.file.description.clone(),
            vendor: device.vendor_name.clone(),
            vendor_number: device.vendor_number,
            product: device.product_name.clone(),
            product_number: device.product_number,
            revision_number: device.revision_number,
            bit_rates_kbit_s: device.bit_rates.clone(),
            rpdos: device.rpdos,
            tpdos: device.tpdos,
            lss: device.lss,
            granularity: device.granularity,
            commissioning: eds.commissioning.as_ref().map(commissioned),
            is_dcf: eds.is_dcf(),
            objects,
        }
    }

    fn head(&self) -> Vec<String> {
        let hex = |number: Option<u32>| number.map(|number| format!(" ({number:X}h)")).unwrap_or_default();
        let revision = self.revision_number.map(|number| format!(", revision {number:X}h")).unwrap_or_default();
        let count = |count: Option<u16>| count.map_or("?".to_owned(), |count| count.to_string());
        let rates: Vec<String> = self.bit_rates_kbit_s.iter().map(ToString::to_string).collect();
        let mut lines = vec![
            format!("vendor     {}{}", self.vendor, hex(self.vendor_number)),
            format!("product    {}{}{revision}", self.product, hex(self.product_number)),
            format!("bit rates  {} kbit/s", rates.join(", ")),
            format!(
                "PDOs       {} to the device, {} from it; granularity {}; LSS {}",
                count(self.rpdos),
                count(self.tpdos),
                self.granularity,
                if self.lss { "yes" } else { "no" }
            ),
        ];
        if let Some(device) = &self.commissioning {
            let node = device.node.map_or("?".to_owned(), |node| node.to_string());
            let rate = device.bit_rate_kbit_s.map(|rate| format!(", {rate} kbit/s")).unwrap_or_default();
            lines.push(format!("device     node {node}{rate} {}", device.name));
        }
        lines
    }
}

impl ObjectRow {
    fn of(object: &Object, variable: &Variable) -> Self {
        let text = |value: &Option<Value>| value.as_ref().map(|value| value.in_file(object.index, variable.data_type));
        let name = match variable.name.as_str() {
            _ if object.variables.len() == 1 && !object.object_type.has_sub_objects() => object.name.clone(),
            name => format!("{}: {name}", object.name),
        };
        Self {
            object: Mux::new(object.index, variable.sub_index).to_string(),
            line: variable.line,
            name,
            kind: object.object_type.name(),
            data_type: variable.data_type.to_string(),
            access: variable.access.name(),
            mappable: variable.pdo_mapping,
            default: text(&variable.default),
            low: text(&variable.low),
            high: text(&variable.high),
            value: text(&variable.value),
        }
    }

    fn limits(&self) -> String {
        match (&self.low, &self.high) {
            (None, None) => String::new(),
            (Some(low), None) => format!("from {low}"),
            (None, Some(high)) => format!("to {high}"),
            (Some(low), Some(high)) => format!("{low} to {high}"),
        }
    }
}

impl Report for ShowReport {
    fn text(&self, paint: Paint) -> String {
        let headings = ["object", "name", "type", "access", "default", "accepts", "value"];
        let mut table = Table::new(if self.is_dcf { &headings } else { &headings[..6] });
        for row in &self.objects {
            let access = format!("{}{}", row.access, if row.mappable { " pdo" } else { "" });
            let default = row.default.clone().unwrap_or_default();
            let mut cells =
                vec![row.object.clone(), row.name.clone(), row.data_type.clone(), access, default, row.limits()];
            if self.is_dcf {
                cells.push(row.value.clone().unwrap_or_default());
            }
            table.row(cells.iter().map(|cell| plain(cell)));
        }
        let head: Vec<String> = self.head().iter().map(|line| plain(line).trim_end().to_owned()).collect();
        format!("{}\n\n{}", head.join("\n"), table.plain(paint))
    }
}
