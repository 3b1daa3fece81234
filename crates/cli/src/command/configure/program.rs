//! `ferrodrive program`: a program into a node's memory (CiA 302-3).

use std::path::PathBuf;

use canopen::NodeId;
use host::network::program::{ProgramReport, program};
use plot::Paint;
use words::counted;
use words::document::read_bytes;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;

/// Longest program: what one object holds that a master writes.
const MOST: u64 = 1 << 20;

/// Send a program to a node, check it, and start it
///
/// Stops and clears the program (1F51h), sends the file (1F50h), reads back what the node says of it (1F56h and 1F57h), and starts
/// it. A program that is there already by its identification is not sent again, so that the same command goes on where several nodes
/// were to get it. SDO has no place to go on from in the midst of a value: after a cut the same command clears the program and sends
/// all of it, and until then the node starts none. A drive whose motor has power is refused.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 program 5 firmware.bin\n  \
    ferrodrive --bus can0 program 5 bootable.hex --number 2 --json")]
pub(crate) struct Program {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// The program, sent as it is
    file: PathBuf,
    /// Which program of the node: the sub-index of 1F50h
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=254))]
    number: u8,
}

impl Program {
    /// Reads the file, and sends it.
    pub(crate) async fn run(&self, context: &Context) -> Result<ProgramReport, Failure> {
        let path = self.file.display();
        let data = read_bytes(&self.file, MOST).map_err(|reason| {
            let unread = Failure::bad_file(format!("cannot read {path}")).because(reason);
            unread.next("give the path of a program of at most 1 MB")
        })?;
        if data.is_empty() {
            return Err(Failure::bad_file(format!("{path} is empty")).next("check whether this is the right file"));
        }
        Ok(program(&context.network, self.node, self.number, &data, &context.progress).await?)
    }
}

impl Report for ProgramReport {
    fn text(&self, _: Paint) -> String {
        let bytes = counted(self.bytes, "byte");
        let done =
            if self.sent { format!("{bytes} sent") } else { format!("{bytes} are there already, nothing was sent") };
        let check = if self.verified { format!(", CRC-32 {:08X}h read back", self.checksum) } else { String::new() };
        let state = match self.running {
            Some(true) => ", running",
            Some(false) => ", not running",
            None => "",
        };
        let note = self.note.as_ref().map(|note| format!("\n  note    {note}")).unwrap_or_default();
        format!("node {}: program {}: {done}{check}{state}{note}", self.node, self.program)
    }
}
