//! Writes a log of any form that can be written.

use std::io::{self, Seek, Write};

use crate::blf_writer::BlfWriter;
use crate::format::Format;
use crate::pcapng::PcapngWriter;
use crate::record::Record;
use crate::{asc, candump};

/// Writes a log. What was written before a [`flush`](Self::flush) can be read, whatever happens to the program behind it.
#[derive(Debug)]
pub struct LogWriter<W> {
    output: W,
    form: FormWriter,
    line: Vec<u8>,
}

#[derive(Debug)]
enum FormWriter {
    Candump,
    Asc(asc::AscWriter),
    Blf(BlfWriter),
    Pcapng(PcapngWriter),
}

/// A format that is only read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{format} is read and not written; expected a file with the extension {}", Format::written_extensions())]
pub struct NotWritten {
    /// The format.
    pub format: Format,
}

impl<W: Write + Seek> LogWriter<W> {
    /// A writer to the begin of `output`.
    ///
    /// # Errors
    /// [`NotWritten`] of a format that is only read.
    pub fn new(output: W, format: Format) -> Result<Self, NotWritten> {
        let form = match format {
            Format::Candump => FormWriter::Candump,
            Format::Asc => FormWriter::Asc(asc::AscWriter::default()),
            Format::Blf => FormWriter::Blf(BlfWriter::default()),
            Format::Pcapng => FormWriter::Pcapng(PcapngWriter::default()),
            Format::Trc | Format::Pcap => return Err(NotWritten { format }),
        };
        Ok(Self { output, form, line: Vec::new() })
    }

    /// Writes a record. A CAN FD frame, whose data was not kept, becomes a comment, or is left out in binary formats.
    ///
    /// # Errors
    /// That of the output.
    pub fn write(&mut self, record: &Record) -> io::Result<()> {
        match &mut self.form {
            FormWriter::Candump => {
                self.line.clear();
                candump::emit_line(record, &mut self.line);
                self.output.write_all(&self.line)
            }
            FormWriter::Asc(writer) => writer.write(&mut self.output, record),
            FormWriter::Blf(writer) => writer.write(&mut self.output, record),
            FormWriter::Pcapng(writer) => writer.write(&mut self.output, record),
        }
    }

    /// Passes everything written on to the system, in a form that can be read.
    ///
    /// # Errors
    /// That of the output.
    pub fn flush(&mut self) -> io::Result<()> {
        if let FormWriter::Blf(writer) = &mut self.form {
            writer.flush(&mut self.output)?;
        }
        self.output.flush()
    }

    /// Writes what stands at the end, and gives the output back.
    ///
    /// # Errors
    /// That of the output.
    pub fn finish(mut self) -> io::Result<W> {
        match &mut self.form {
            FormWriter::Candump => {}
            FormWriter::Asc(writer) => writer.finish(&mut self.output)?,
            FormWriter::Blf(writer) => writer.finish(&mut self.output)?,
            FormWriter::Pcapng(writer) => writer.begin(&mut self.output)?,
        }
        self.output.flush()?;
        Ok(self.output)
    }
}
