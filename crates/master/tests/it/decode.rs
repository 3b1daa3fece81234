//! The decoder against datagrams of the ZLAC8030L quick start guide V1.00 and of CiA 301.

use can::Frame;
use canopen::NodeId;
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use devices::model;
use master::core::PdoMap;
use master::decode::{Decoded, Decoder};
use master::pdo::PdoConfig;

const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

fn lines(decoder: &mut Decoder, frames: &[&str]) -> Vec<String> {
    frames.iter().map(|text| decoder.decode(&text.parse::<Frame>().unwrap()).to_string()).collect()
}

#[test]
fn single_frame_services_are_reported_in_words() {
    let shown = lines(
        &mut Decoder::new(),
        &["000#0104", "000#8000", "080#", "704#00", "704#05", "084#1021020000000000", "184#R4", "000#01", "6FF#01"],
    );
    assert_eq!(
        shown,
        [
            "NMT start, node 4",
            "NMT enter pre-operational, all nodes",
            "SYNC",
            "boot-up node 4",
            "heartbeat node 4: operational",
            "EMCY node 4: 2110h (current, CANopen device input side), error register 02h",
            "remote request for TPDO1 of node 4",
            "malformed NMT command",
            "unknown",
        ]
    );
}

/// ZLAC8030L, 603Fh: 0001h to 0080h lie in the class "error reset or no error" of CiA 301, table 26.
#[test]
fn a_fault_of_a_zl_drive_is_never_called_no_error() {
    let over_voltage = "084#0100050000000000";
    assert_eq!(
        lines(&mut Decoder::new(), &[over_voltage, "084#0000000000000000"]),
        [
            "EMCY node 4: 0001h (a code of the maker's), error register 05h",
            "EMCY node 4: 0000h (error reset), error register 00h"
        ]
    );
    let mut decoder = Decoder::new();
    decoder.set_model(NodeId::new(4).unwrap(), model("zlac8030l").unwrap());
    assert_eq!(lines(&mut decoder, &[over_voltage]), ["EMCY node 4: 0001h (over-voltage), error register 05h"]);
    for name in ["zlac8030l", "zlim42c"] {
        let profile = model(name).unwrap();
        for fault in profile.faults.table {
            let [low, high] = fault.emcy.0.to_le_bytes();
            let frame = format!("084#{low:02X}{high:02X}{:02X}0000000000", fault.error_register | 1);
            for mut decoder in [Decoder::new(), decoder.clone()] {
                let shown = lines(&mut decoder, &[&frame]);
                assert!(!shown[0].contains("no error") && !shown[0].contains("reset"), "{name}: {}", shown[0]);
            }
        }
    }
}

#[test]
fn sdo_requests_and_answers_show_object_and_value() {
    let shown = lines(
        &mut Decoder::new(),
        &["604#4041600000000000", "584#4B41600037020000", "604#2B4060000F000000", "584#6040600000000000"],
    );
    assert_eq!(
        shown,
        [
            "SDO node 4: read 6041h:00 statusword",
            "SDO node 4: 6041h:00 statusword = 0237h (Operation enabled)",
            "SDO node 4: write 6040h:00 controlword = 000Fh (enable operation)",
            "SDO node 4: done: write 6040h:00 controlword",
        ]
    );
    let shown = lines(&mut Decoder::new(), &["604#4002650000000000", "584#8002650000000206"]);
    assert_eq!(
        shown[1],
        "SDO node 4: the drive aborts 6502h:00 supported_drive_modes: 0602 0000h (object does not exist in the object dictionary)"
    );
}

#[test]
fn segmented_transfers_are_put_together() {
    let shown = lines(
        &mut Decoder::new(),
        &[
            "602#4008100000000000",
            "582#4108100009000000",
            "602#6000000000000000",
            "582#0046657272616E61",
            "602#7000000000000000",
            "582#1B74610000000000",
        ],
    );
    assert_eq!(shown[1], "SDO node 2: segmented transfer of 1008h:00 manufacturer_device_name, 9 bytes");
    assert_eq!(shown[5], "SDO node 2: 1008h:00 manufacturer_device_name = \"Ferranata\"");
}

#[test]
fn pdos_are_split_by_the_mapping_that_went_over_the_bus() {
    let mut decoder = Decoder::new();
    // Quick start guide 6.1: 606Ch into TPDO0, which is TPDO1 of CiA 301.
    let shown = lines(&mut decoder, &["184#01020304"]);
    assert_eq!(shown, ["TPDO1 node 4: 01 02 03 04 (mapping not known)"]);
    lines(
        &mut decoder,
        &[
            "604#2F001A0000000000",
            "584#60001A0000000000",
            "604#23001A0120006C60",
            "584#60001A0100000000",
            "604#2F001A0001000000",
            "584#60001A0000000000",
        ],
    );
    assert_eq!(lines(&mut decoder, &["184#64000000"]), ["TPDO1 node 4: 606Ch:00 velocity_actual_value = 100"]);
    assert_eq!(
        lines(&mut decoder, &["184#6400"]),
        ["TPDO1 node 4: (too short: 2 of 4 bytes, the receiver ignores it)"]
    );
}

/// CiA 301, 7.2.3: bit 7 and node-ID, index, sub-index, four bytes; FFh in sub-index 00h of the mapping is the destination address mode,
/// FEh the source address mode. Names are those of the node that has the object.
#[test]
fn a_multiplexed_pdo_is_shown_with_the_object_that_its_frame_names() {
    let mut decoder = Decoder::new();
    decoder.set_model(NodeId::new(7).unwrap(), model("zlac8030l").unwrap());
    for (count, id) in [("FF", "184"), ("FE", "284")] {
        let mapping = if id == "184" { "001A00" } else { "011A00" };
        lines(&mut decoder, &[&format!("604#2F{mapping}{count}000000"), &format!("584#60{mapping}00000000")]);
    }
    let frames = [
        (
            "184#8740600006000000",
            "TPDO1 node 4, multiplexed, to node 7: 6040h:00 controlword = 0006h (shutdown)",
            Some(7),
        ),
        (
            "184#8040600006000000",
            "TPDO1 node 4, multiplexed, to all nodes: 6040h:00 controlword = 0006h (shutdown)",
            None,
        ),
        (
            "184#8783600064000000",
            "TPDO1 node 4, multiplexed, to node 7: 6083h:00 profile_acceleration = 100 [ms]",
            Some(7),
        ),
        (
            "284#0464600078563412",
            "TPDO2 node 4, multiplexed, of node 4: 6064h:00 position_actual_value = 305419896",
            Some(4),
        ),
        ("284#04002003FFFF0000", "TPDO2 node 4, multiplexed, of node 4: 2000h:03 = 0000FFFFh (65535)", Some(4)),
    ];
    for (frame, text, node) in &frames {
        let decoded = decoder.decode(&frame.parse().unwrap());
        assert_eq!(decoded.to_string(), *text);
        let Decoded::Pdo(pdo) = &decoded else { panic!("{decoded}") };
        assert_eq!((pdo.object_node().map(NodeId::raw), decoded.node()), (*node, NodeId::new(4)), "{frame}");
        assert_eq!(decoded.concerns(NodeId::new(7).unwrap()), node.is_none() || *node == Some(7), "{frame}");
    }
    let short = decoder.decode(&"284#04646000785634".parse().unwrap());
    assert_eq!(short.to_string(), "TPDO2 node 4: (too short: 7 of 8 bytes, the receiver ignores it)");
    // What it may move is the drive that it names.
    let may = |decoder: &mut Decoder, frame: &str| {
        let decoded = decoder.decode(&frame.parse().unwrap());
        decoded.may_move().map(|why| (why, decoded.may_move_node().map(NodeId::raw)))
    };
    assert_eq!(may(&mut decoder, "184#8740600006000000"), Some(("a controlword", Some(7))));
    assert_eq!(may(&mut decoder, "184#80FF600006000000"), Some(("a target", None)));
    assert_eq!(may(&mut decoder, "184#8717100006000000"), None);
    assert!(may(&mut decoder, "284#0464600078563412").is_some_and(|(_, node)| node.is_none()));
    // Mapped again, it is an ordinary one.
    lines(
        &mut decoder,
        &["604#23001A0110004160", "584#60001A0100000000", "604#2F001A0001000000", "584#60001A0000000000"],
    );
    assert!(lines(&mut decoder, &["184#3702"])[0].starts_with("TPDO1 node 4: 6041h:00 statusword = 0237h"));
}

/// CiA 301, 7.3.3: the identifiers of node 4 by their function codes; and that of a PDO once it has been moved.
#[test]
fn the_identifiers_of_a_node_are_the_predefined_ones_and_those_of_its_moved_pdos() {
    let mut decoder = Decoder::new();
    let node = NodeId::new(4).unwrap();
    let ids = |decoder: &Decoder| {
        let mut ids: Vec<u32> = decoder.ids_of(node).map(can::CanId::raw).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    };
    let predefined = [0, 0x84, 0x184, 0x204, 0x284, 0x304, 0x384, 0x404, 0x484, 0x504, 0x584, 0x604, 0x704];
    assert_eq!(ids(&decoder), predefined);
    lines(
        &mut decoder,
        &["604#23001801BB020000", "584#6000180100000000", "604#2F001A0000000000", "584#60001A0000000000"],
    );
    let more: Vec<u32> = ids(&decoder).into_iter().filter(|id| !predefined.contains(id)).collect();
    assert_eq!(more, [0x2BB]);
}

#[test]
fn a_joint_is_put_into_its_own_words() {
    let mut decoder = Decoder::new();
    decoder.set_model(NodeId::new(1).unwrap(), &devices::mjoint::M4230E17B50);
    // "M Robot Joint Motor CanOpen Manual", 5.10.1: 0404h idle; 5.11.1: heartbeat 05h, and 04h in alarm; 606Ch is
    // INTEGER16 of 0.1 r/min by SDO (5.04) and INTEGER32 of r/min in TPDO3 (5.08).
    let shown = lines(
        &mut decoder,
        &[
            "581#4B41600004040000",
            "581#4B41600037000000",
            "701#05",
            "701#04",
            "581#4B6C600090E80000",
            "381#A8FDFFFF3704",
        ],
    );
    assert_eq!(
        shown,
        [
            "SDO node 1: 6041h:00 statusword = 0404h (output enabled, target reached)",
            "SDO node 1: 6041h:00 statusword = 0037h (follows its host, output enabled, power stage live, no quick stop)",
            "heartbeat node 1: operational",
            "heartbeat node 1: in alarm (04h; it does not mean stopped)",
            "SDO node 1: 606Ch:00 velocity_actual_value = -6000 [0.1 r/min]",
            "TPDO3 node 1: 606Ch:00 velocity_actual_value = -600 [r/min], 6041h:00 statusword = 0437h (follows its host, \
             output enabled, power stage live, no quick stop, target reached)",
        ]
    );
}

#[test]
fn a_joint_is_known_by_its_device_type_and_a_zl_drive_is_not() {
    let mut decoder = Decoder::new();
    let shown = lines(
        &mut decoder,
        &[
            "601#4000100000000000",
            "581#4300100092010200",
            "581#4B41600004040000",
            "701#04",
            "584#4300100092010400",
            "704#04",
        ],
    );
    assert_eq!(shown[2], "SDO node 1: 6041h:00 statusword = 0404h (output enabled, target reached)");
    assert_eq!(shown[3], "heartbeat node 1: in alarm (04h; it does not mean stopped)");
    assert_eq!(shown[5], "heartbeat node 4: stopped");
}

#[test]
fn a_pdo_has_the_number_of_cia_301_and_that_of_its_manual_where_it_differs() {
    let mut decoder = Decoder::new();
    decoder.set_model(NodeId::new(4).unwrap(), model("zlac8030l").unwrap());
    decoder.set_model(NodeId::new(1).unwrap(), model("m4230e17b50").unwrap());
    let shown = lines(&mut decoder, &["284#00", "381#0A0000003704"]);
    // "ZLAC8030L quick start guide V1.00", 6: 1801h is TPDO1; "M Robot Joint Motor CanOpen Manual", 5.08: 1802h is TPDO3.
    assert_eq!(shown[0].split(" node").next(), Some("TPDO2 (in the manual TPDO1)"));
    assert_eq!(shown[1].split(" node").next(), Some("TPDO3"));
}

#[test]
fn a_refused_mapping_changes_nothing() {
    let mut decoder = Decoder::new();
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]);
    decoder.set_pdo(NodeId::new(4).unwrap(), &PdoConfig::new(TPDO1, map), 0x184);
    lines(&mut decoder, &["604#2F001A0000000000", "584#80001A0022000008"]);
    assert_eq!(lines(&mut decoder, &["184#3702"]), ["TPDO1 node 4: 6041h:00 statusword = 0237h (Operation enabled)"]);
}

#[test]
fn random_frames_never_panic() {
    let mut decoder = Decoder::new();
    let mut seed = 0x2545_F491_u32;
    let mut next = move || {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed
    };
    for _ in 0..50_000 {
        let data: Vec<u8> = (0..next() % 9).map(|_| next() as u8).collect();
        // Mostly the SDO of one node, so that transfers come about.
        let id = if next() % 4 == 0 { next() as u16 } else { [0x584, 0x604][next() as usize % 2] };
        let _ = decoder.decode(&Frame::new(can::CanId::standard(id), &data)).to_string();
    }
}

#[test]
fn an_object_that_all_models_name_alike_is_named_without_its_unit_whatever_its_length() {
    let mut decoder = Decoder::new();
    // 606Ch: INTEGER16 of 0.1 r/min, INTEGER32 of 0.1 r/min, INTEGER32 of r/min.
    let shown = lines(&mut decoder, &["584#4B6C6000C4FF0000", "584#436C6000C4FFFFFF", "584#4F6C6000C4000000"]);
    assert_eq!(
        shown,
        [
            "SDO node 4: 606Ch:00 velocity_actual_value = -60",
            "SDO node 4: 606Ch:00 velocity_actual_value = -60",
            "SDO node 4: 606Ch:00 velocity_actual_value = C4h (196)",
        ]
    );
}

/// Frames laid out by CiA 301, 7.2.4.3.9 to 7.2.4.3.16: "123456789", whose checksum 31C3h the standard gives, in two segments.
#[test]
fn block_transfers_are_put_together_and_attributed_to_their_object() {
    let download = [
        "604#C608100009000000", // initiate, with checksum and size
        "584#A40810007F000000",
        "604#0131323334353637",
        "604#823839FFFFFFFFFF", // the last of all: five bytes mean nothing
        "584#A2027F0000000000",
        "604#D5C3310000000000", // end: n = 5
        "584#A100000000000000",
        "604#4008100000000000", // the next request is not a part of it
    ];
    assert_eq!(
        lines(&mut Decoder::new(), &download),
        [
            "SDO node 4: block transfer of 1008h:00 manufacturer_device_name, 9 bytes",
            "SDO node 4: agreed: block transfer of 1008h:00 manufacturer_device_name",
            "SDO node 4: block segment 1 of 1008h:00 manufacturer_device_name, 7 bytes so far",
            "SDO node 4: block segment 2 of 1008h:00 manufacturer_device_name, 14 bytes so far",
            "SDO node 4: confirmed up to block segment 2 of 1008h:00 manufacturer_device_name",
            "SDO node 4: write 1008h:00 manufacturer_device_name = \"123456789\"",
            "SDO node 4: done: write 1008h:00 manufacturer_device_name",
            "SDO node 4: read 1008h:00 manufacturer_device_name",
        ]
    );
    let upload = [
        "604#A408100014000000",
        "584#C608100009000000",
        "604#A300000000000000",
        "584#0131323334353637",
        "584#823839FFFFFFFFFF",
        "604#A201140000000000", // the second segment was lost,
        "584#813839FFFFFFFFFF", // and comes again as the first of the next block
        "604#A201140000000000",
        "584#D5C3310000000000",
        "604#A100000000000000",
    ];
    let shown = lines(&mut Decoder::new(), &upload);
    assert_eq!(shown[8], "SDO node 4: 1008h:00 manufacturer_device_name = \"123456789\"");
    assert_eq!(shown[6], "SDO node 4: block segment 1 of 1008h:00 manufacturer_device_name, 14 bytes so far");
}

#[test]
fn a_block_transfer_that_goes_wrong_is_reported_and_forgotten() {
    let corrupt = ["604#C608100009000000", "584#A40810007F000000", "604#0131323334353637", "604#823838FFFFFFFFFF"];
    let mut decoder = Decoder::new();
    lines(&mut decoder, &corrupt);
    let shown = lines(&mut decoder, &["584#A2027F0000000000", "604#D5C3310000000000", "584#8008100004000405"]);
    assert!(shown[1].contains("and 31C3h was sent"), "{}", shown[1]);
    assert!(shown[2].contains("the drive aborts 1008h:00 manufacturer_device_name"), "{}", shown[2]);
    // Segments without a beginning, an abort in the middle, a client that begins anew.
    let shown = lines(&mut decoder, &["604#0131323334353637", "584#A2027F0000000000"]);
    assert!(shown.iter().all(|line| line.contains("not seen")), "{shown:?}");
    lines(&mut decoder, &corrupt[..3]);
    let shown = lines(&mut decoder, &["604#8008100000000008", "604#4000100000000000"]);
    assert!(shown[0].contains("the master aborts") && shown[1].ends_with("read 1000h:00 device_type"), "{shown:?}");
    lines(&mut decoder, &corrupt[..3]);
    assert!(lines(&mut decoder, &["604#4000100000000000"])[0].ends_with("read 1000h:00 device_type"));
}

#[test]
fn frames_name_their_service_their_node_and_their_objects() {
    let mut decoder = Decoder::new();
    let mut about = |text: &str| {
        let decoded = decoder.decode(&text.parse::<Frame>().unwrap());
        let objects: Vec<_> = decoded.objects().map(|object| object.to_string()).collect();
        (decoded.service().word(), decoded.node().map(NodeId::raw), objects.join(" "))
    };
    assert_eq!(about("604#2111200109000000"), ("sdo", Some(4), "2011h:01".into()));
    assert_eq!(about("604#0031323334353637"), ("sdo", Some(4), "2011h:01".into()));
    assert_eq!(about("704#00"), ("heartbeat", Some(4), String::new()));
    assert_eq!(about("000#8000"), ("nmt", None, String::new()));
    assert_eq!(about("184#R4"), ("pdo", Some(4), String::new()));
    assert_eq!(about("7E5#0400000000000000"), ("lss", None, String::new()));
    assert_eq!(about("7E4#4F00000000000000"), ("lss", None, String::new()));
    assert_eq!(about("6FF#01"), ("other", None, String::new()));
    let all = decoder.decode(&"000#8000".parse().unwrap());
    assert!(all.concerns(NodeId::new(9).unwrap()));
}

/// ZLAC8030L quick start guide V1.00: 606Ch is an INTEGER32 in 0.1 r/min.
#[test]
fn numbers_are_those_of_pdos_and_of_transfers_that_are_done() {
    let mut decoder = Decoder::new();
    decoder.set_model(NodeId::new(4).unwrap(), model("zlac8030l").unwrap());
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010), MappingRecord::from_raw(0x606C_0020)]);
    decoder.set_pdo(NodeId::new(4).unwrap(), &PdoConfig::new(TPDO1, map), 0x184);
    let mut numbers = |frame: &str| -> Vec<_> {
        let decoded = decoder.decode(&frame.parse::<Frame>().unwrap());
        decoded.numbers().iter().map(|number| (number.mux.index, number.value, number.unit)).collect()
    };
    assert_eq!(numbers("184#3702A8FDFFFF"), [(0x6041, 0x0237, ""), (0x606C, -600, "0.1 r/min")]);
    assert_eq!(numbers("604#406C600000000000"), [], "it is only asked for");
    assert_eq!(numbers("584#436C6000A8FDFFFF"), [(0x606C, -600, "0.1 r/min")]);
    assert_eq!(numbers("604#23FF60003C000000"), [], "it may be refused");
    assert_eq!(numbers("584#60FF600000000000"), [(0x60FF, 60, "r/min")]);
    assert_eq!(numbers("704#05"), []);
}
