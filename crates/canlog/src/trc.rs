//! PEAK's trace format (TRC), read in its versions 1.0 to 2.1.
//!
//! Comments of the head (`;$FILEVERSION`, `;$STARTTIME`, `;$COLUMNS`) say what the columns are; then a message a line, with its
//! time in milliseconds since the start time. Bus status, warnings and events say nothing about frames and are left out. The
//! start time has no time zone and is taken for UTC.

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH};

use crate::calendar::of_automation_date;
use crate::record::{Content, Direction, Interface, RawErrorFrame, Record};
use crate::text;

/// What stands in a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TrcColumn {
    /// Message number, a word that says nothing here.
    Number,
    /// Milliseconds since the start.
    Time,
    /// Which bus, counted from 1.
    Bus,
    /// 4 digits, or 8 when extended.
    Id,
    /// `DT`, `RR`, `ER` and so on (2.x).
    Kind,
    /// `Rx` or `Tx`; in 1.x also `Warng` and `Error`.
    Direction,
    /// Nothing so far.
    Reserved,
    /// Number of bytes.
    Length,
    /// Data length code; the number of bytes up to 8.
    Dlc,
    /// All the bytes.
    Data,
}

use TrcColumn::{Bus, Data, Direction as Way, Dlc, Id, Kind, Length, Number, Reserved, Time};

/// The columns of the versions whose files do not name them, "PEAK CAN TRC File Format", 1.0 to 1.3.
const VERSIONS: [(&str, &[TrcColumn]); 4] = [
    ("1.0", &[Number, Time, Id, Length, Data]),
    ("1.1", &[Number, Time, Way, Id, Length, Data]),
    ("1.2", &[Number, Time, Bus, Way, Id, Length, Data]),
    ("1.3", &[Number, Time, Bus, Way, Id, Reserved, Length, Data]),
];

/// What stands for an identifier where there is none, in 1.0: a line about the bus.
const NO_ID: &str = "FFFFFFFF";

/// More columns than there are kinds of them are not read.
const MAX_COLUMNS: usize = 16;

/// What the head of a file said.
#[derive(Debug)]
pub(super) struct Parser {
    start: Instant,
    columns: Vec<TrcColumn>,
}

impl Default for Parser {
    /// A file without a head is of version 1.0.
    fn default() -> Self {
        Self { start: Instant::ZERO, columns: VERSIONS[0].1.to_vec() }
    }
}

/// The words of a line, as the columns say.
#[derive(Default)]
struct Fields<'a> {
    time: &'a str,
    bus: Option<&'a str>,
    id: &'a str,
    kind: Option<&'a str>,
    direction: Option<&'a str>,
    length: &'a str,
    data: Vec<&'a str>,
}

impl Parser {
    /// Reads a line; `None` for comments and for what is not a message.
    pub(super) fn line(&mut self, line: &str) -> Result<Option<Record>, &'static str> {
        let line = line.trim();
        if let Some(comment) = line.strip_prefix(';') {
            return self.head(comment.trim()).map(|()| None);
        }
        if line.is_empty() {
            return Ok(None);
        }
        let fields = self.fields(line);
        let direction = match fields.direction {
            Some("Rx") => Some(Direction::Received),
            Some("Tx") => Some(Direction::Transmitted),
            _ => None,
        };
        let content = match (fields.kind, fields.direction) {
            (Some("DT"), _) => fields.data_frame()?,
            (Some("RR"), _) => fields.remote_frame()?,
            (Some("FD" | "FB" | "FE" | "BI"), _) => Content::FdFrame { id: fields.id()?, length: fields.fd_length()? },
            (Some("ER"), _) | (None, Some("Error")) => Content::Error(RawErrorFrame::UNSPECIFIED),
            (Some("ST" | "EC" | "EV"), _) | (None, Some("Warng" | "Event")) => return Ok(None),
            (Some(_), _) => return Err("unknown type of message, expected DT, FD, FB, FE, BI, RR, ST, ER, EC, EV"),
            (None, None) if fields.id == NO_ID => return Ok(None),
            (None, Some("Rx" | "Tx") | None) => fields.data_frame()?,
            (None, Some(_)) => return Err("expected Rx or Tx before the identifier"),
        };
        let at = self.time(fields.time).ok_or("the time is not a number of milliseconds, such as 1059.9")?;
        let interface = match fields.bus {
            Some(bus) => bus.parse().map(Interface::numbered).map_err(|_| "the bus is not a number")?,
            None => Interface::default(),
        };
        Ok(Some(Record { at: Some(at), interface, direction, content }))
    }

    fn head(&mut self, comment: &str) -> Result<(), &'static str> {
        let Some((key, value)) = comment.strip_prefix('$').and_then(|comment| comment.split_once('=')) else {
            return Ok(());
        };
        match key {
            "FILEVERSION" => {
                let known = VERSIONS.iter().find(|(version, _)| *version == value);
                // From 2.0 on the file names the columns.
                self.columns = known.map(|(_, columns)| columns.to_vec()).unwrap_or_default();
                if self.columns.is_empty() && !value.starts_with("2.") {
                    return Err("unsupported version of the file, expected 1.0 to 2.1");
                }
            }
            "STARTTIME" => {
                let days = value.parse().ok().and_then(of_automation_date);
                self.start = days.ok_or("the start time is not a number of days since 1899-12-30")?;
            }
            "COLUMNS" => {
                let columns: Option<Vec<TrcColumn>> =
                    value.split(',').take(MAX_COLUMNS).map(|name| column(name.trim())).collect();
                self.columns = columns.ok_or("unknown columns, expected some of N, O, T, B, I, d, R, l, L, D")?;
            }
            _ => {}
        }
        Ok(())
    }

    fn fields<'a>(&self, line: &'a str) -> Fields<'a> {
        let mut fields = Fields::default();
        let mut words = line.split_ascii_whitespace();
        for column in &self.columns {
            if *column == Data {
                fields.data = words.by_ref().collect();
                continue;
            }
            let word = words.next().unwrap_or("");
            match column {
                Time => fields.time = word,
                Bus => fields.bus = Some(word),
                Id => fields.id = word,
                Kind => fields.kind = Some(word),
                Way => fields.direction = Some(word),
                Length | Dlc => fields.length = word,
                Number | Reserved | Data => {}
            }
        }
        fields
    }

    fn time(&self, word: &str) -> Option<Instant> {
        // Milliseconds with up to six decimals: a thousandth of seconds with three decimals more.
        let (whole, decimals) = word.split_once('.').unwrap_or((word, ""));
        if decimals.len() > 6 || whole.is_empty() {
            return None;
        }
        let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let millis: u64 = whole.parse().ok().filter(|_| digits(whole) && digits(decimals))?;
        let below = decimals.bytes().chain(std::iter::repeat(b'0')).take(6);
        let below = below.fold(0, |value, digit| value * 10 + u64::from(digit - b'0'));
        let nanos = millis.checked_mul(1_000_000)?.checked_add(below)?;
        self.start.as_nanos().checked_add(nanos).map(Instant::from_nanos)
    }
}

fn column(name: &str) -> Option<TrcColumn> {
    Some(match name {
        "N" => Number,
        "O" => Time,
        "T" => Kind,
        "B" => Bus,
        "I" => Id,
        "d" => Way,
        "R" => Reserved,
        "l" => Length,
        "L" => Dlc,
        "D" => Data,
        _ => return None,
    })
}

impl Fields<'_> {
    fn id(&self) -> Result<CanId, &'static str> {
        let raw = text::parse_hex(self.id, 8).ok_or("the identifier is not a hexadecimal number")?;
        // 4 digits mean a standard identifier, 8 an extended one, whatever their value.
        match self.id.len() {
            0..=4 if raw <= u32::from(CanId::MAX_STANDARD) => Ok(CanId::standard(raw as u16)),
            5..=8 if raw <= CanId::MAX_EXTENDED => Ok(CanId::extended(raw)),
            _ => Err("the identifier is beyond 07FF, or beyond 1FFFFFFF with 8 digits"),
        }
    }

    fn fd_length(&self) -> Result<u8, &'static str> {
        self.length.parse().ok().filter(|length| *length <= 64).ok_or("the length is not a number from 0 to 64")
    }

    /// Bytes of a classical frame; a length code above 8 means 8 (ISO 11898-1, 8.4.2.4).
    fn length(&self) -> Result<u8, &'static str> {
        let length: u8 =
            self.length.parse().ok().filter(|length| *length <= 15).ok_or("the length is not a number from 0 to 8")?;
        Ok(length.min(MAX_DATA_LENGTH as u8))
    }

    fn remote_frame(&self) -> Result<Content, &'static str> {
        Ok(Content::Frame(Frame::remote(self.id()?, self.length()?)))
    }

    fn data_frame(&self) -> Result<Content, &'static str> {
        if let ["RTR", ..] = self.data.as_slice() {
            return self.remote_frame();
        }
        let length = usize::from(self.length()?);
        let words = self.data.get(..length).ok_or("there are fewer bytes than the length says")?;
        let mut data = [0; MAX_DATA_LENGTH];
        for (byte, word) in data.iter_mut().zip(words) {
            let value = text::parse_hex(word, 2).filter(|_| word.len() == 2);
            *byte = value.ok_or("a byte is not two hexadecimal digits")? as u8;
        }
        Ok(Content::Frame(Frame::new(self.id()?, &data[..length])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(lines: &str) -> Vec<Result<Record, &'static str>> {
        let mut parser = Parser::default();
        lines.lines().filter_map(|line| parser.line(line).transpose()).collect()
    }

    fn frames(lines: &str) -> Vec<String> {
        let records = read(lines).into_iter().map(Result::unwrap);
        records.filter_map(|record| record.frame().map(ToString::to_string)).collect()
    }

    #[test]
    fn every_version_is_read_by_its_columns() {
        let v10 = "     1)      1841  0001  8  00 00 00 00 00 00 00 00 \n     2)      1842  FFFFFFFF  4  00 00 00 08 -- -- -- -- BUSHEAVY\n";
        assert_eq!(frames(v10), ["001#0000000000000000"]);
        let v11 = ";$FILEVERSION=1.1\n;$STARTTIME=37704.5364870833\n;\n\
                   \x20    1)      1059.9  Rx         0300  7  00 00 00 00 04 00 00 \n     2)      1298.9  Tx     00000400  2  00 00 \n\
                   \x20    3)      1323.0  Rx         0300  8  RTR\n     4)   1334416.3  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY\n\
                   \x20    5)      1334522.2  Error        0008  4  00 19 08 08\n";
        assert_eq!(frames(v11), ["300#00000000040000", "00000400#0000", "300#R8"]);
        let v13 = ";$FILEVERSION=1.3\n     1)      1059.900 2  Tx        0300 -  7    00 00 00 00 04 00 00\n";
        let record = read(v13).pop().unwrap().unwrap();
        assert_eq!((record.interface.name(), record.direction), ("can1", Some(Direction::Transmitted)));
        let v20 = ";$FILEVERSION=2.0\n;$COLUMNS=N,O,T,I,d,l,D\n      1      1059.900 DT     0300 Rx 7  00 00 00 00 04 00 00 \n\
                   \x20     2      1283.231 RR     0300 Rx 8\n      3      1298.945 FB     0300 Rx 12 00 01 02 03 04 05 06 07 08 09 0A 0B\n\
                   \x20     4      1334.416 ER          Rx    04 00 02 00 00\n      5      1334.222 ST          Rx    00 00 00 08 \n";
        let records: Vec<Record> = read(v20).into_iter().map(Result::unwrap).collect();
        assert_eq!(records.len(), 4);
        assert_eq!(records[2].content, Content::FdFrame { id: CanId::standard(0x300), length: 12 });
        assert_eq!(records[3].content, Content::Error(RawErrorFrame::UNSPECIFIED));
        let v21 = ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n      1      1059.900 DT 1      0300 Rx -  7    00 00 00 00 04 00 00\n";
        assert_eq!(frames(v21), ["300#00000000040000"]);
    }

    #[test]
    fn times_count_from_the_start() {
        let at = |line: &str| read(line).pop().unwrap().unwrap().at.unwrap();
        assert_eq!(at("1) 1841 0001 0"), Instant::from_millis(1841));
        assert_eq!(at(";$FILEVERSION=1.1\n1) 1059.9 Rx 0300 0"), Instant::from_micros(1_059_900));
        assert_eq!(at("1) 0.000001 0001 0"), Instant::from_nanos(1), "as many decimals as there may be");
        // Day 25569 is 1970-01-01.
        assert_eq!(
            at(";$FILEVERSION=1.1\n;$STARTTIME=25569.5\n1) 0.001 Rx 0300 0"),
            Instant::from_micros(43_200_000_001)
        );
    }

    #[test]
    fn a_line_that_is_torn_says_what_is_missing() {
        for (line, reason) in [
            ("hello", "the length"),
            ("1) 1841 0001", "the length"),
            ("1) 1841 0001 2 00", "fewer bytes"),
            ("1) 1841 0001 1 0", "two hexadecimal digits"),
            ("1) x 0001 0", "milliseconds"),
            ("1) 0.0000001 0001 0", "milliseconds"),
            ("1) 1841 0800 0", "beyond 07FF"),
            (";$FILEVERSION=7.0", "version"),
            (";$STARTTIME=soon", "days since"),
            (";$COLUMNS=N,O,Q", "columns"),
            (";$FILEVERSION=1.1\n1) 1.0 Sideways 0300 0", "Rx or Tx"),
            (";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n1 1.0 XX 1 0300 Rx - 0", "type of message"),
        ] {
            let errors: Vec<_> = read(line).into_iter().filter_map(Result::err).collect();
            assert!(errors.iter().any(|error| error.contains(reason)), "{line}: {errors:?}");
        }
    }
}
