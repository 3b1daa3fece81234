//! The forms of log files: their names, extensions, and what their first bytes look like.

use std::fmt;
use std::path::Path;

use crate::lines::BYTE_ORDER_MARK;

/// A form of log files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// can-utils: `candump -L`, `-l`, and what candump shows on the screen.
    Candump,
    /// Vector ASCII.
    Asc,
    /// Vector binary logging format.
    Blf,
    /// PEAK trace, 1.0 to 2.1.
    Trc,
    /// libpcap's first format.
    Pcap,
    /// Wireshark's format.
    Pcapng,
}

/// One row of the table of formats.
struct FormatRow {
    format: Format,
    name: &'static str,
    extensions: &'static [&'static str],
    /// What the files that this crate writes begin with; `None` if it writes none.
    begin: Option<&'static [u8]>,
}

const ROWS: [FormatRow; 6] = [
    FormatRow { format: Format::Candump, name: "candump", extensions: &["log", "candump", "txt"], begin: Some(b"(") },
    FormatRow { format: Format::Asc, name: "ASC", extensions: &["asc"], begin: Some(b"date ") },
    FormatRow { format: Format::Blf, name: "BLF", extensions: &["blf"], begin: Some(b"LOGG") },
    FormatRow { format: Format::Trc, name: "TRC", extensions: &["trc"], begin: None },
    FormatRow { format: Format::Pcap, name: "pcap", extensions: &["pcap", "cap"], begin: None },
    FormatRow {
        format: Format::Pcapng,
        name: "pcapng",
        extensions: &["pcapng", "ntar"],
        begin: Some(b"\x0A\x0D\x0D\x0A"),
    },
];

/// So many bytes of a file's begin are enough for [`Format::of_content`].
pub(super) const ENOUGH_TO_TELL: usize = 512;

impl Format {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        ROWS.iter().map(|row| row.format)
    }

    fn row(self) -> &'static FormatRow {
        ROWS.iter().find(|row| row.format == self).unwrap_or(&ROWS[0])
    }

    /// The one of a file's extension, in any case.
    pub fn of_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        let is_its = |row: &&FormatRow| row.extensions.iter().any(|known| extension.eq_ignore_ascii_case(known));
        ROWS.iter().find(is_its).map(|row| row.format)
    }

    /// The one whose files begin so; `None` where there is none.
    pub fn of_content(begin: &[u8]) -> Option<Self> {
        match begin {
            [b'L', b'O', b'G', b'G', ..] => return Some(Self::Blf),
            [0x0A, 0x0D, 0x0D, 0x0A, ..] => return Some(Self::Pcapng),
            [0xD4, 0xC3, 0xB2, 0xA1, ..]
            | [0xA1, 0xB2, 0xC3, 0xD4, ..]
            | [0x4D, 0x3C, 0xB2, 0xA1, ..]
            | [0xA1, 0xB2, 0x3C, 0x4D, ..] => return Some(Self::Pcap),
            _ => {}
        }
        let text = String::from_utf8_lossy(begin.strip_prefix(BYTE_ORDER_MARK).unwrap_or(begin));
        let mut lines = text.lines().map(str::trim_start);
        lines.find_map(|line| of_line(&line.to_ascii_lowercase()))
    }

    /// What a file is that is not a log, in a sentence, where its first bytes show it; `by_name` is the form of its extension.
    pub(super) fn foreign(begin: &[u8], by_name: Option<Self>) -> Option<&'static str> {
        if begin.starts_with(b"\x89MCAP") {
            return Some("this is an MCAP file, a record of signals (ferrodrive plot), not a log of frames");
        }
        let is_text = !matches!(by_name, Some(Self::Blf | Self::Pcap | Self::Pcapng));
        (is_text && begin.contains(&0))
            .then_some("its bytes are not text, and do not begin as a BLF, pcap or pcapng file")
    }

    /// Whether logs of this form can be written.
    pub fn is_written(self) -> bool {
        self.row().begin.is_some()
    }

    /// What the files of this form that [`LogWriter`](crate::LogWriter) writes begin with; `None` if it writes none.
    pub fn written_begin(self) -> Option<&'static [u8]> {
        self.row().begin
    }

    /// Its name for people.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        self.row().extensions[0]
    }

    /// The extensions of what can be written, for messages: `.log (candump), .asc (ASC)`.
    pub fn written_extensions() -> String {
        let names =
            ROWS.iter().filter(|row| row.begin.is_some()).map(|row| format!(".{} ({})", row.extensions[0], row.name));
        names.collect::<Vec<_>>().join(", ")
    }
}

/// What a line at the begin of a text says.
fn of_line(line: &str) -> Option<Format> {
    let begins = |words: &[&str]| words.iter().any(|word| line.starts_with(word));
    if begins(&[";$fileversion", ";$starttime", ";##"]) {
        Some(Format::Trc)
    } else if begins(&["date ", "base hex", "base dec", "internal events", "no internal events", "begin triggerblock"])
    {
        Some(Format::Asc)
    } else if begins(&["("]) {
        Some(Format::Candump)
    } else {
        None
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extension_shows_the_format() {
        for format in Format::all() {
            let name = format!("a.b/trace.{}", format.extension().to_uppercase());
            assert_eq!(Format::of_name(Path::new(&name)), Some(format));
        }
        for name in ["trace", "trace.docx", ".log", ""] {
            assert_eq!(Format::of_name(Path::new(name)), None, "{name}");
        }
    }

    #[test]
    fn the_first_bytes_show_the_format() {
        for (begin, format) in [
            (&b"LOGG\x90\0\0\0"[..], Some(Format::Blf)),
            (b"\x0A\x0D\x0D\x0A\x1C\0\0\0", Some(Format::Pcapng)),
            (b"\xD4\xC3\xB2\xA1\x02\0\x04\0", Some(Format::Pcap)),
            (b"\xA1\xB2\x3C\x4D\0\x02\0\x04", Some(Format::Pcap)),
            (b"date Sat Sep 30 15:06:13.191 2017\nbase hex\n", Some(Format::Asc)),
            (b"// made by hand\nBase Dec  timestamps absolute\n", Some(Format::Asc)),
            (b";$FILEVERSION=1.1\r\n;$STARTTIME=37704.5\r\n", Some(Format::Trc)),
            (b"(1700000000.123456) can0 604#40\n", Some(Format::Candump)),
            (b"  can0  604   [1]  40\n", None),
            (b"", None),
            (b"\xFF\xFE", None),
        ] {
            assert_eq!(Format::of_content(begin), format, "{begin:?}");
        }
    }
}
