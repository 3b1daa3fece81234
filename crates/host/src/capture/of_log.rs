//! A record made of a log of frames: what PDOs carried, by the mapping of each node's model or as it was seen being written.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use can::{Frame, Instant};
use canopen::pdo::Direction;
use canopen::{Mux, NodeId};
use master::decode::{Decoded, Decoder, common_row};
use recording::{Column, Recorded, Series, Subject};
use sim::Place;

use super::quantity::Quantity;

/// Readings of a log that are kept at most.
const MOST: usize = 50_000_000;

/// Of the cycles of SYNC between its first value and its last, and of its values, as many at least are one to one.
const IN_CYCLES: f64 = 0.9;

/// An object of a node as one direction of its PDOs has it: a demand that is sent to it and the same one sent back are two quantities.
type Key = (u8, Mux, bool);

/// A series, and for each of its points how many SYNCs came before.
struct LoggedObject {
    quantity: Quantity,
    series: Series,
    syncs_before: Vec<usize>,
}

/// The record of a log, with times from its first frame on. What comes once in each cycle of SYNC has the time of the SYNC before it, at
/// which a synchronous TPDO was sampled (CiA 301, 7.2.2.2); all else that of its frame.
///
/// # Errors
/// In a sentence: no frame is a PDO whose mapping is known, with what to do about it; there are too many readings.
pub fn record_of_log(
    mut decoder: Decoder,
    frames: impl IntoIterator<Item = (Instant, Frame)>,
) -> Result<Recorded, String> {
    let mut found: BTreeMap<Key, Option<LoggedObject>> = BTreeMap::new();
    let (mut first, mut count, mut unmapped) = (None, 0_usize, 0_usize);
    let mut syncs_s = Vec::new();
    for (at, frame) in frames {
        let at_s = (at - *first.get_or_insert(at)).as_secs_f64();
        let pdo = match decoder.decode(&frame) {
            Decoded::Pdo(pdo) => pdo,
            Decoded::Sync { .. } => {
                syncs_s.push(at_s);
                continue;
            }
            _ => continue,
        };
        unmapped += usize::from(pdo.mapped_bytes.is_none());
        let is_sent = pdo.pdo.direction == Direction::Tpdo;
        let Some(node) = pdo.object_node() else { continue };
        for (record, raw) in &pdo.fields {
            let kept = match found.entry((node.raw(), record.mux, is_sent)) {
                Entry::Occupied(kept) => kept.into_mut(),
                Entry::Vacant(place) => place.insert(series(pdo.model(), node, record.mux, is_sent)),
            };
            let Some(kept) = kept else { continue };
            count += 1;
            if count > MOST {
                return Err(format!(
                    "more than {MOST} readings are in it: cut it, for instance with ferrodrive convert"
                ));
            }
            kept.series.points.push((at_s, kept.quantity.by_pdo.value(*raw as u32)));
            kept.syncs_before.push(syncs_s.len());
        }
    }
    let series: Vec<Series> = found.into_values().flatten().map(|found| found.by_sync(&syncs_s)).collect();
    if series.is_empty() {
        return Err(if unmapped == 0 {
            "no frame in it is a PDO".to_owned()
        } else {
            format!(
                "{unmapped} PDOs are in it, whose mapping is not known: name the models, --model NODE=MODEL or --machine FILE.toml"
            )
        });
    }
    Ok(Recorded { series, marks: Vec::new(), torn: false })
}

impl LoggedObject {
    /// Its series, by the times of SYNC where it comes in their cycles. Of two in one cycle the first is late: the other one belongs to it.
    fn by_sync(mut self, syncs_s: &[f64]) -> Series {
        // What came before the first SYNC of the log belongs to none.
        let begin = self.syncs_before.partition_point(|before| *before == 0);
        let [first, .., last] = self.syncs_before[begin..] else { return self.series };
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (before, (_, value)) in self.syncs_before[begin..].iter().zip(&self.series.points[begin..]) {
            let at_s = syncs_s[before - 1];
            points.pop_if(|point| point.0 == at_s);
            points.push((at_s, *value));
        }
        let (cycles, count) = ((last - first + 1) as f64, self.syncs_before.len() - begin);
        if points.len() as f64 >= IN_CYCLES * cycles.max(count as f64) {
            self.series.points = points;
        }
        self.series
    }
}

/// `None` for what is not a number of at most 32 bits.
fn series(model: Option<&'static devices::Description>, node: NodeId, mux: Mux, is_sent: bool) -> Option<LoggedObject> {
    let row = model.map_or_else(|| common_row(mux), |model| model.row(mux));
    if row.is_some_and(|row| !row.data_type.fits_cell()) {
        return None;
    }
    let quantity = Quantity::of_row(model, mux, row);
    let signal = if is_sent { quantity.name.clone() } else { format!("sent_{}", quantity.name) };
    let subject = Subject::Axis(Place::node(node.raw()));
    let column = Column { subject, signal: signal.into(), unit: quantity.unit.clone().into() };
    Some(LoggedObject { quantity, series: Series { column, points: Vec::new() }, syncs_before: Vec::new() })
}

#[cfg(test)]
mod tests {
    use can::CanId;

    use super::*;

    fn frame(id: u16, data: &[u8]) -> Frame {
        Frame::new(CanId::standard(id), data)
    }

    /// 606Ch of a ZLAC8030L counts 0.1 r/min, 6064h counts (quick start guide V1.00, chapter 9). The mapping is written in the log as
    /// CiA 301, 7.2.4.3.3 has it: 23h with four bytes, 2Fh with one.
    #[test]
    fn a_log_is_the_quantities_that_its_pdos_carry_by_the_mapping_that_was_written() {
        let node = NodeId::new(4).expect("a node-ID");
        let mut decoder = Decoder::new();
        decoder.set_model(node, devices::model("zlac8030l").expect("a model"));
        let ms = |ms: u64| Instant::from_nanos(5_000_000_000 + ms * 1_000_000);
        let write = |data: [u8; 8], index: u8, sub: u8| {
            let answer = frame(0x584, &[0x60, index, 0x1A, sub, 0, 0, 0, 0]);
            [(ms(0), frame(0x604, &data)), (ms(0), answer)]
        };
        let log = [
            write([0x23, 0x00, 0x1A, 1, 0x20, 0, 0x6C, 0x60], 0, 1),
            write([0x23, 0x00, 0x1A, 2, 0x20, 0, 0x64, 0x60], 0, 2),
            write([0x2F, 0x00, 0x1A, 0, 2, 0, 0, 0], 0, 0),
            [
                (ms(10), frame(0x184, &[0x58, 2, 0, 0, 0x10, 0, 0, 0])),
                (ms(12), frame(0x184, &[0xA8, 0xFD, 0xFF, 0xFF, 0xF0, 0xFF, 0xFF, 0xFF])),
            ],
        ];
        let recorded = record_of_log(decoder, log.into_iter().flatten()).expect("it has PDOs");
        let series: Vec<(String, &[(f64, f64)])> =
            recorded.series.iter().map(|series| (series.column.name(), series.points.as_slice())).collect();
        assert_eq!(
            series,
            [
                ("4.position_actual_value_counts".to_owned(), &[(0.010, 16.0), (0.012, -16.0)][..]),
                ("4.velocity_actual_value_rpm".to_owned(), &[(0.010, 60.0), (0.012, -60.0)][..]),
            ]
        );
    }

    /// It begins within a cycle; one frame comes behind the next SYNC, one in a cycle of its own is missing.
    #[test]
    fn what_comes_once_in_a_cycle_has_the_time_of_its_sync_also_where_single_frames_do_not() {
        let node = NodeId::new(4).expect("a node-ID");
        let mut decoder = Decoder::new();
        decoder.set_model(node, devices::model("zlac8030l").expect("a model"));
        let us = |us: u64| Instant::from_nanos(us * 1000);
        let write = |data: [u8; 8], index: u8, sub: u8| {
            [(us(0), frame(0x604, &data)), (us(0), frame(0x584, &[0x60, index, 0x1A, sub, 0, 0, 0, 0]))]
        };
        let speed = |at: u64, value: u8| (us(at), frame(0x184, &[value, 0, 0, 0]));
        let mapped =
            [write([0x23, 0x00, 0x1A, 1, 0x20, 0, 0x6C, 0x60], 0, 1), write([0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0], 0, 0)];
        let mut log: Vec<_> = mapped.into_iter().flatten().chain([speed(500, 7)]).collect();
        for cycle in 1..=40_u64 {
            let at = cycle * 1000;
            if cycle == 21 {
                log.push(speed(at + 50, 20));
            }
            log.push((us(at), frame(0x80, &[])));
            log.extend((![20, 30].contains(&cycle)).then(|| speed(at + 200 + 7 * (cycle % 5), cycle as u8)));
        }
        log.sort_by_key(|(at, _)| *at);
        let recorded = record_of_log(decoder, log).expect("it has PDOs");
        let [series] = recorded.series.as_slice() else { panic!("one object") };
        let expected: Vec<(f64, f64)> = (1..=40_u32)
            .filter(|cycle| ![20, 30].contains(cycle))
            .map(|cycle| (f64::from(cycle) * 1e-3, f64::from(cycle) * 0.1))
            .collect();
        assert_eq!(series.points.len(), expected.len());
        for ((at, value), (its, should)) in series.points.iter().zip(&expected) {
            assert!((at - its).abs() < 1e-9 && (value - should).abs() < 1e-9, "{at}: {value}");
        }
    }

    #[test]
    fn a_log_without_a_pdo_that_is_understood_says_what_is_missing() {
        let refused = |frame| record_of_log(Decoder::new(), [(Instant::ZERO, frame)]).expect_err("nothing is in it");
        assert_eq!(refused(frame(0x704, &[5])), "no frame in it is a PDO");
        let unmapped = refused(frame(0x184, &[1, 2]));
        assert!(unmapped.starts_with("1 PDOs are in it") && unmapped.contains("--machine FILE.toml"), "{unmapped}");
    }
}
