//! Log files of every form: what was written is read, and what is damaged costs no more than itself.

use std::io::{Cursor, Seek, Write};

use can::{CanId, Frame, Instant};
use canlog::{
    Content, Direction, Entry, Finding, Format, Interface, LogReader, LogWriter, Place, RawErrorFrame, Record,
};

/// 2023-11-14 22:13:20 and a fraction that every format can say.
const BEGIN: Instant = Instant::from_micros(1_700_000_000_123_456);

/// Frames of every kind, of three buses and both directions, `step` apart.
fn records(count: u32) -> Vec<Record> {
    let record = |i: u32| {
        let data = u64::from(i).wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
        let length = (i % 9) as usize;
        let id =
            if i.is_multiple_of(3) { CanId::extended(i.wrapping_mul(0x0101_0101)) } else { CanId::standard(i as u16) };
        let content = match i % 7 {
            0 => Content::Frame(Frame::remote(id, length as u8)),
            1 => Content::Error(RawErrorFrame { class: 0x88, data }),
            _ => Content::Frame(Frame::new(id, &data[..length])),
        };
        Record {
            at: Some(Instant::from_nanos(BEGIN.as_nanos() + u64::from(i) * 130_000)),
            interface: Interface::numbered((i % 3 + 1) as u16),
            direction: Some(if i.is_multiple_of(2) { Direction::Received } else { Direction::Transmitted }),
            content,
        }
    };
    (0..count).map(record).collect()
}

/// What a format cannot say of a record: candump and pcapng say everything.
fn as_said_by(format: Format, record: &Record) -> Record {
    let mut said = record.clone();
    if let Content::Error(error) = &mut said.content {
        match format {
            Format::Asc => {
                *error = RawErrorFrame::UNSPECIFIED;
                said.direction = None;
            }
            Format::Blf => said.direction = None,
            _ => {}
        }
    }
    said
}

fn written(format: Format, records: &[Record]) -> Vec<u8> {
    let mut writer = LogWriter::new(Cursor::new(Vec::new()), format).unwrap();
    records.iter().for_each(|record| writer.write(record).unwrap());
    writer.finish().unwrap().into_inner()
}

fn read(format: Format, bytes: &[u8]) -> (Vec<Record>, Vec<Finding>) {
    let mut both = (Vec::new(), Vec::new());
    for entry in LogReader::new(bytes, format) {
        match entry.unwrap() {
            Entry::Record(record) => both.0.push(record),
            Entry::Finding(finding) => both.1.push(finding),
        }
    }
    both
}

fn writable() -> impl Iterator<Item = Format> {
    Format::all().filter(|format| format.is_written())
}

#[test]
fn what_is_written_is_read_again() {
    // More than a container of a BLF file holds.
    let records = records(4_000);
    for format in writable() {
        let bytes = written(format, &records);
        assert_eq!(Format::of_content(&bytes[..bytes.len().min(512)]), Some(format));
        let (again, findings) = read(format, &bytes);
        assert_eq!(findings, [], "{format}");
        assert_eq!(again.len(), records.len(), "{format}");
        for (record, again) in records.iter().zip(&again) {
            assert_eq!(*again, as_said_by(format, record), "{format}");
        }
    }
}

#[test]
fn an_empty_log_is_a_log() {
    for format in writable() {
        assert_eq!(read(format, &written(format, &[])), (vec![], vec![]), "{format}");
    }
}

#[test]
fn formats_that_are_only_read_say_what_to_write_instead() {
    for format in [Format::Trc, Format::Pcap] {
        let error = LogWriter::new(Cursor::new(Vec::new()), format).err().unwrap().to_string();
        assert!(error.contains(format.name()) && error.contains(".pcapng"), "{error}");
    }
}

#[test]
fn what_was_flushed_can_be_read_though_the_writer_died() {
    let records = records(50);
    for format in writable() {
        let mut writer = LogWriter::new(Cursor::new(Vec::new()), format).unwrap();
        let mut disk = Vec::new();
        for record in &records[..30] {
            writer.write(record).unwrap();
        }
        writer.flush().unwrap();
        for record in &records[30..] {
            writer.write(record).unwrap();
        }
        // The disk has what was there at the flush: a BLF file's later frames are still in memory.
        let whole = writer.finish().unwrap().into_inner();
        let (at_flush, _) = read(format, &written_until_flush(format, &records[..30], &mut disk));
        assert_eq!(at_flush.len(), 30, "{format}");
        assert_eq!(read(format, &whole).0.len(), 50, "{format}: a flush in between loses nothing");
    }
}

/// The bytes of a log whose writer died behind a flush.
fn written_until_flush(format: Format, records: &[Record], disk: &mut Vec<u8>) -> Vec<u8> {
    let mut writer = LogWriter::new(Tee { inner: Cursor::new(Vec::new()), copy: disk }, format).unwrap();
    records.iter().for_each(|record| writer.write(record).unwrap());
    writer.flush().unwrap();
    drop(writer);
    disk.clone()
}

/// Keeps what was written, though the writer never finishes.
struct Tee<'a> {
    inner: Cursor<Vec<u8>>,
    copy: &'a mut Vec<u8>,
}

impl Write for Tee<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.copy.clone_from(self.inner.get_ref());
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for Tee<'_> {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        self.inner.seek(to)
    }
}

/// A log in each form: written here where that is possible, else put together as the form has it, with that many messages.
fn logs(count: u32) -> Vec<(Format, Vec<u8>)> {
    let records = records(count);
    let mut logs: Vec<_> = writable().map(|format| (format, written(format, &records))).collect();
    logs.extend([(Format::Trc, trc(count)), (Format::Pcap, pcap(count))]);
    logs
}

/// PEAK CAN TRC 1.1: number, offset in ms, direction, identifier, length, bytes.
fn trc(count: u32) -> Vec<u8> {
    let line = |i: u32| {
        format!("{:6}) {:12.1}  Rx         {:04X}  2  {:02X} 04\n", i + 1, f64::from(i) * 1.5, 0x100 + i, i % 256)
    };
    (";$FILEVERSION=1.1\n;$STARTTIME=45000.5\n;\n".to_owned() + &(0..count).map(line).collect::<String>()).into_bytes()
}

/// libpcap's file, version 2.4, of link type 227 (LINKTYPE_CAN_SOCKETCAN): each packet the kernel's 16 bytes of a frame.
fn pcap(count: u32) -> Vec<u8> {
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    let mut file = [words(&[0xA1B2_C3D4]), vec![2, 0, 4, 0], words(&[0, 0, 65_535, 227])].concat();
    for i in 0..count {
        file.extend(words(&[1_700_000_000 + i, 123_456, 16, 16]));
        file.extend((0x100 + i).to_be_bytes());
        file.extend([8, 0, 0, 0]);
        file.extend(u64::from(i).to_le_bytes());
    }
    file
}

#[test]
fn a_log_that_is_cut_anywhere_gives_what_is_before_the_cut() {
    for (format, whole) in logs(40) {
        let complete = read(format, &whole).0;
        let mut most = 0;
        for cut in 0..whole.len() {
            let (again, _) = read(format, &whole[..cut]);
            // The record at the cut may come out shortened where the format has no length: candump's last line.
            let sure = again.len().saturating_sub(1);
            assert_eq!(again[..sure], complete[..sure], "{format} cut at {cut}");
            assert!(again.len() >= most, "{format} cut at {cut}: fewer records of a longer file");
            most = sure.max(most);
        }
        // The last record is whole only in the whole file.
        assert!(complete.len() == 40 && most >= 38, "{format}");
    }
}

#[test]
fn a_damaged_byte_costs_what_it_is_in() {
    for (format, whole) in logs(200).into_iter().filter(|(format, _)| *format != Format::Blf) {
        let complete = read(format, &whole).0.len();
        // In the middle of the third frame from the end of the text, or in a packet's own bytes.
        let mut bytes = whole.clone();
        let place = whole.len() * 3 / 4;
        let end = place + whole[place..].iter().position(|byte| b"#d)".contains(byte)).unwrap_or(0);
        bytes[end] ^= 0x55;
        let (again, _) = read(format, &bytes);
        assert!(again.len() + 1 >= complete, "{format}: {} of {complete}", again.len());
    }
}

#[test]
fn a_torn_line_is_a_finding_with_its_number() {
    let log = "(1.0) can0 701#00\n\n(1.5) can0 701#0\n can0  702  [1]  05\n(1.7) can0 123##0AABB\n(1.9) can0 703#";
    let (records, findings) = read(Format::Candump, log.as_bytes());
    let frames: Vec<_> = records.iter().filter_map(Record::frame).map(ToString::to_string).collect();
    assert_eq!(frames, ["701#00", "702#05", "703#"]);
    assert_eq!(records[1].at, Some(Instant::from_secs(1)), "a line without a time has that of the line before");
    assert_eq!(records[2].content, Content::FdFrame { id: CanId::standard(0x123), length: 2 });
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!((finding.place, &*finding.text), (Place::Line(3), "(1.5) can0 701#0"));
    assert!(finding.to_string().contains("pairs of hexadecimal digits"), "{finding}");
}

/// A container's head, as the format has it: compression, declared length.
fn container(method: u16, declared: u32, packed: &[u8]) -> Vec<u8> {
    let size = 32 + packed.len();
    let mut bytes = b"LOBJ\x10\0\x01\0".to_vec();
    bytes.extend((size as u32).to_le_bytes());
    bytes.extend(10u32.to_le_bytes());
    bytes.extend(method.to_le_bytes());
    bytes.extend([0; 6]);
    bytes.extend(declared.to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(packed);
    bytes.resize(size + size % 4, 0);
    bytes
}

#[test]
fn a_damaged_blf_container_costs_itself() {
    let good = written(Format::Blf, &records(20));
    let (head, body) = good.split_at(144);
    let mut huge = container(0, 0, b"");
    huge[8..12].copy_from_slice(&1_000_000_000u32.to_le_bytes());
    let unknown = {
        let mut object = b"LOBJ\x20\0\x01\0".to_vec();
        object.extend(32u32.to_le_bytes());
        object.extend(999u32.to_le_bytes());
        object.resize(32, 0);
        container(0, 64, &[object.clone(), object].concat())
    };
    for (bad, reason, behind) in [
        (container(0, 1_000_000_000, b""), "a container declares 1000000000 bytes", 20),
        (container(7, 0, b""), "compressed by method 7", 20),
        (container(2, 100, b"no zlib"), "cannot be unpacked", 20),
        (b"GARBAGE and not an object ".to_vec(), "no object begins here", 20),
        (unknown, "objects of type 999 are not read", 20),
        // It declares that it goes on behind the end of the file.
        (huge, "an object declares 1000000000 bytes", 0),
    ] {
        let bytes = [head, body, &bad, body].concat();
        let (records, findings) = read(Format::Blf, &bytes);
        assert_eq!(records.len(), 20 + behind, "{reason}: {findings:?}");
        let [finding] = &findings[..] else { panic!("{reason}: {findings:?}") };
        assert!(finding.reason.contains(reason), "{finding}");
    }
}

#[test]
fn a_file_of_another_kind_is_one_finding() {
    for format in [Format::Blf, Format::Pcap, Format::Pcapng] {
        let (records, findings) = read(format, b"(1.0) can0 701#00\n(1.0) can0 701#00 and so on, for a hundred bytes");
        assert!(records.is_empty() && findings.len() == 1, "{format}: {findings:?}");
        assert!(findings[0].reason.contains(format.name()), "{}", findings[0]);
    }
}

#[test]
fn a_pcapng_block_that_is_too_large_is_passed_over_and_one_without_a_length_ends_the_log() {
    let good = written(Format::Pcapng, &records(3));
    let mut large = 6u32.to_le_bytes().to_vec();
    large.extend(2_000_000u32.to_le_bytes());
    large.resize(2_000_000, 0);
    let (records, findings) = read(Format::Pcapng, &[&good[..], &large, &good].concat());
    assert_eq!((records.len(), findings.len()), (6, 1));
    assert!(findings[0].reason.contains("declares 2000000 bytes"), "{}", findings[0]);
    let (records, findings) = read(Format::Pcapng, &[&good[..], &[6, 0, 0, 0, 7, 0, 0, 0]].concat());
    assert_eq!((records.len(), findings.len()), (3, 1));
    assert!(findings[0].reason.contains("nothing behind it"), "{}", findings[0]);
}
