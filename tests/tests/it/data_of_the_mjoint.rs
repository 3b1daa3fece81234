//! The data files of the M joint agree with themselves, with CiA 301 and with CiA 402, before they judge a drive.

use std::collections::HashSet;

use ferrodrive_tests::mjoint::{datagrams, figures, objects, situations};

#[test]
fn the_modbus_registers_lie_side_by_side_without_a_gap() {
    let mut registers: Vec<_> =
        objects().iter().filter_map(|it| it.registers.map(|place| (place, it.row.size))).collect();
    registers.sort_unstable();
    let mut next = 0;
    for ((first, words), size) in registers {
        assert_eq!(first, next, "register {first:#04X}");
        assert_eq!(usize::from(words), size.div_ceil(2), "register {first:#04X}");
        next = first + words;
    }
    assert_eq!(next, 0x27, "26h, the homing method, is the last");
}

#[test]
fn every_mapping_names_an_object_and_fills_the_printed_frame() {
    let objects = objects();
    let default = |index, sub| {
        let found = objects.iter().find(|it| (it.row.index, it.row.sub) == (index, sub));
        found.and_then(|it| it.row.default).expect("a default")
    };
    // 5.08.2 and 5.08.3 print the data length of each frame.
    let frames =
        [(0x1600, 7), (0x1601, 8), (0x1602, 7), (0x1603, 4), (0x1A00, 6), (0x1A01, 6), (0x1A02, 6), (0x1A03, 6)];
    for (index, length) in frames {
        let count = u8::try_from(default(index, 0)).expect("a count");
        let entries: Vec<_> = (1..=count).map(|sub| default(index, sub)).collect();
        assert_eq!(entries.iter().map(|entry| (entry & 0xFF) / 8).sum::<i64>(), length, "{index:04X}h");
        for entry in entries {
            let target = objects.iter().find(|it| i64::from(it.row.index) == entry >> 16).expect("an object");
            assert!(target.row.pdo_mappable, "{target:?}");
        }
    }
}

#[test]
fn the_manual_leaves_out_the_bytes_of_a_request_that_carry_nothing() {
    for (_, data) in datagrams().iter().filter_map(|it| it.request.as_ref()).filter(|(cob, _)| *cob == 0x601) {
        let short = if data[0] == 0x40 { 4 } else { 8 - usize::from(data[0] >> 2 & 3) };
        assert_eq!(data.len(), short, "{data:02X?}");
    }
}

#[test]
fn every_receive_pdo_is_answered_by_the_transmit_pdo_of_its_number_and_node() {
    let pdos: Vec<_> = datagrams()
        .into_iter()
        .filter(|it| matches!(it.request, Some((cob, _)) if (0x181..0x580).contains(&cob)))
        .collect();
    assert_eq!(pdos.len(), 11);
    for it in pdos {
        let ((request, _), (response, data)) =
            (it.request.clone().expect("filtered"), it.response.clone().expect("TPDO"));
        assert_eq!(response, request - 0x80, "{it:?}");
        assert_eq!((data.len(), it.answer.len()), (6, 6), "{it:?}");
        assert!(data.iter().zip(&it.answer).all(|(byte, known)| known.is_none_or(|known| known == *byte)), "{it:?}");
    }
}

#[test]
fn the_statusword_mirrors_the_controlword_and_gives_all_five_printed_values() {
    let mut printed = HashSet::new();
    for it in situations() {
        let bits = [
            (0x0003, it.controlword & 0x01 != 0),
            (0x0004, it.output_enabled),
            (0x0008, it.alarm != 0),
            (0x0010, it.live),
            (0x0020, it.controlword & 0x04 != 0),
            (0x0400, it.reached),
            (0x1000, it.homing == "attained"),
            (0x2000, it.homing == "failed"),
        ];
        let expected = bits.iter().filter(|(_, set)| *set).fold(0, |word, (bit, _)| word | bit);
        assert_eq!(it.statusword, expected, "{it:?}");
        assert!(!it.live || it.output_enabled, "{it:?}");
        let energised = it.controlword & 0x02 != 0 || it.mode == 6;
        assert!(energised || !it.live, "{it:?}");
        if it.printed {
            printed.insert(it.statusword);
        }
    }
    assert_eq!(printed, HashSet::from([0x0404, 0x0014, 0x1414, 0x0037, 0x0437]));
    let in_datagrams = datagrams().into_iter().filter_map(|it| it.response).filter_map(|(_, data)| match data[..] {
        [0x4B, 0x41, 0x60, 0, low, high, ..] | [_, _, _, _, low, high] => Some(u16::from_le_bytes([low, high])),
        _ => None,
    });
    assert_eq!(in_datagrams.collect::<HashSet<_>>(), printed);
}

#[test]
fn the_models_agree_with_their_own_figures() {
    let figures = figures();
    let value = |group: &str, parameter: &str| {
        let found = figures.iter().find(|it| it.group == group && it.parameter == parameter);
        found.unwrap_or_else(|| panic!("no {parameter}")).values
    };
    assert_eq!(value("overall", "Output torque after deceleration"), value("reducer", "Output rated torque"));
    assert_eq!(value("reducer", "Reduction ratio"), [50.0, 80.0, 50.0, 80.0]);
    let (rated, greatest) = (value("motor", "Rated speed"), value("motor", "Maximum rotational speed"));
    let (torque, ratio) = (value("motor", "Torque"), value("reducer", "Reduction ratio"));
    for model in 0..4 {
        assert!(rated[model] < greatest[model]);
        let efficiency = value("reducer", "Output rated torque")[model] / (torque[model] * ratio[model]);
        assert!((0.5..=1.0).contains(&efficiency), "the reducer cannot add power: {efficiency}");
    }
}
