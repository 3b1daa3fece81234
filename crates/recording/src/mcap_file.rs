//! A record as MCAP.
//!
//! Chunks are built in memory and written whole: the file of a program that was killed ends between two of them.

use std::io;

use can::Instant;

use super::channels::{Channels, MESSAGE_ENCODING, SCHEMA_ENCODING, Sink};
use super::mcap_writer::McapWriter;
use super::piece::{Entry, Target};

/// An MCAP file that is being written.
pub(super) struct Mcap {
    writer: McapWriter,
    channels: Channels,
}

impl Sink for McapWriter {
    type Error = io::Error;

    fn message(&mut self, channel: usize, at: Instant, data: &[u8]) -> io::Result<()> {
        // Identifiers count from 1.
        Self::message(self, channel as u16 + 1, at.as_nanos(), data)
    }
}

impl Mcap {
    pub(super) fn begin(target: Box<dyn Target>, channels: Channels) -> io::Result<Self> {
        let mut writer = McapWriter::begin(target, concat!("ferrodrive ", env!("CARGO_PKG_VERSION")))?;
        for channel in channels.list() {
            let schema = writer.schema(&channel.schema_name, SCHEMA_ENCODING, channel.schema.as_bytes())?;
            writer.channel(schema, &channel.topic, MESSAGE_ENCODING)?;
        }
        let mut file = Self { writer, channels };
        // A reader that follows the file sees its topics at once.
        file.flush()?;
        Ok(file)
    }

    pub(super) fn put(&mut self, entry: Entry<'_>) -> io::Result<()> {
        self.channels.encode(entry, &mut self.writer)
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.writer.finish()
    }
}
