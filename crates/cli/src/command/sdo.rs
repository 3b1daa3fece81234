//! `ferrodrive read` and `ferrodrive write`: one object of a node by SDO (CiA 301, clause 7.2.4).

use canopen::od::Entry;
use canopen::{Mux, NodeId};
use serde::Serialize;

use crate::context::Context;
use crate::decode::{Decoded, decode};
use crate::failure::Failure;
use crate::output::Report;
use crate::paint::Paint;
use crate::parse::node::node;
use crate::parse::object::{ObjectArg, object};
use crate::parse::value::{typed_value, value};

/// Read an object of a node, decoded with unit and meaning
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Objects are hexadecimal indices or names:\n  6064, 0x6064, 6064h, 2026:01, position_actual_value"
)]
pub(crate) struct Read {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Index, index:sub-index or name
    #[arg(value_parser = object)]
    object: ObjectArg,
}

/// Write an object of a node
#[derive(Debug, clap::Args)]
#[command(after_help = "Values are decimal, 0x.., have a unit where the object has one, or are one of its words:\n  \
    ferrodrive write 4 60FF 60rpm\n  ferrodrive write 4 6060 'profile velocity'\n  ferrodrive write 4 6040 0x0F\n\
    An object that is in no known table takes its type with the value: u16:15")]
pub(crate) struct Write {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Index, index:sub-index or name
    #[arg(value_parser = object)]
    object: ObjectArg,
    /// The value
    #[arg(allow_hyphen_values = true)]
    value: String,
}

/// An object and its value.
#[derive(Debug, Serialize)]
pub(crate) struct ObjectReport {
    node: u8,
    object: String,
    name: Option<&'static str>,
    #[serde(flatten)]
    value: Decoded,
    #[serde(skip)]
    written: bool,
}

impl Read {
    /// Reads and decodes.
    pub(crate) async fn run(&self, context: &Context) -> Result<ObjectReport, Failure> {
        // A number is asked for before the model, so that an absent node is blamed for the object that was wanted.
        let (mux, payload) = match self.object {
            ObjectArg::Mux(mux) => (mux, context.node(self.node).upload(mux).await?),
            ObjectArg::Name(_) => {
                let (mux, _) = resolve(context, self.node, &self.object).await?;
                (mux, context.node(self.node).upload(mux).await?)
            }
        };
        let (_, row) = resolve(context, self.node, &self.object).await?;
        Ok(ObjectReport::new(self.node, mux, row, decode(row, payload.as_bytes()), false))
    }
}

impl Write {
    /// Reads what was typed, and writes it.
    pub(crate) async fn run(&self, context: &Context) -> Result<ObjectReport, Failure> {
        let (mux, row) = resolve(context, self.node, &self.object).await?;
        let (data_type, number) = match row {
            Some(row) => (row.data_type, value(row, &self.value).map_err(Failure::usage)?),
            None => typed_value(&self.value).map_err(Failure::usage)?,
        };
        let bytes = data_type.raw(number).to_le_bytes();
        let bytes = &bytes[..data_type.size()];
        context.node(self.node).download(mux, bytes).await?;
        Ok(ObjectReport::new(self.node, mux, row, decode(row, bytes), true))
    }
}

/// The multiplexor, and the row if the node's model is known and has it.
async fn resolve(
    context: &Context,
    node: NodeId,
    object: &ObjectArg,
) -> Result<(Mux, Option<&'static Entry>), Failure> {
    let model = context.model_of(node).await?;
    object.resolve(model.map(|model| model.table)).map_err(Failure::usage)
}

impl ObjectReport {
    fn new(node: NodeId, mux: Mux, row: Option<&'static Entry>, value: Decoded, written: bool) -> Self {
        Self { node: node.raw(), object: mux.to_string(), name: row.map(|row| row.name), value, written }
    }
}

impl Report for ObjectReport {
    fn text(&self, paint: Paint) -> String {
        let name = self.name.map(|name| format!(" {name}")).unwrap_or_default();
        let verb = if self.written { "written: " } else { "" };
        format!("node {} {}{name} = {verb}{}", self.node, self.object, self.value.text(paint))
    }
}
