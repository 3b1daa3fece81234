//! Program download (CiA 302-3): devices from a data sheet that have 1F50h, 1F51h, 1F56h and 1F57h, and `host::network::program`, which
//! sends them programs.

use std::time::Duration;

use can::Bitrate;
use canopen::{AbortCode, Mux, NodeId};
use cia402::PowerState;
use devices::Description;
use devices::servo::CIA402;
use eds::Sheet;
use host::network::program::{ProgramReport, program};
use master::{Drive, Network, Node};
use sim::machine::{Order, order};
use sim::{World, block_on};
use words::failure::Failure;

const DATA: Mux = Mux::new(0x1F50, 1);
const CONTROL: Mux = Mux::new(0x1F51, 1);
const IDENTIFICATION: Mux = Mux::new(0x1F56, 1);
const STATUS: Mux = Mux::new(0x1F57, 1);

/// CiA 302-3: 0 stop, 1 start, 3 clear.
const STOP: u8 = 0;
const START: u8 = 1;
const CLEAR: u8 = 3;

/// What a device as delivered has, by its file.
const DELIVERED: u32 = 0x1234_5678;
/// 1F57h: there is not a valid program.
const NO_PROGRAM: u32 = 2;

/// The check value of the catalogue of CRCs: CRC-32 of "123456789".
const NINE: &[u8] = b"123456789";
const SUM_OF_NINE: u32 = 0xCBF4_3926;

/// The objects of one program.
fn program_objects() -> String {
    let array = |index: &str, name: &str, data_type: &str, access: &str, default: &str| {
        format!(
            "[{index}]\nParameterName={name}\nObjectType=8\nSubNumber=2\n[{index}sub0]\nParameterName=n\nDataType=5\n\
             AccessType=ro\nDefaultValue=1\n[{index}sub1]\nParameterName={name} 1\nDataType={data_type}\nAccessType={access}\n\
             DefaultValue={default}\n"
        )
    };
    [
        array("1F50", "Program data", "0xF", "wo", ""),
        array("1F51", "Program control", "5", "rw", "0"),
        array("1F56", "Program software identification", "7", "ro", "0x12345678"),
        array("1F57", "Flash status identification", "7", "ro", "0"),
    ]
    .concat()
}

fn description(sheet: &str) -> &'static Description {
    let read = eds::Eds::load(format!("{sheet}\n{}", program_objects()).as_bytes()).expect("it is read");
    eds::keep(&read.eds).expect("it makes a description")
}

struct Bench {
    world: World,
    network: Network,
    node: Node,
}

impl Bench {
    /// Node 9 of this sheet and the objects of a program.
    fn of(sheet: &str) -> Self {
        let model = description(sheet);
        let mut world = World::new(Bitrate::M1, 1);
        let network = Network::new();
        world.add_station(network.clone());
        let id = NodeId::new(9).unwrap();
        world.add_drive(9, order(model, &Order::new(model, id, Bitrate::M1)).unwrap()).unwrap();
        world.run_for(Duration::from_secs(1));
        let node = network.node(id);
        Self { world, network, node }
    }

    /// A node that is not a drive.
    fn new() -> Self {
        Self::of(
            "[DeviceInfo]\nVendorName=None\nProductName=Box\n[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\n\
             DefaultValue=0x00030191\n[1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
             [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n[1018sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n\
             DefaultValue=1\n[1018sub1]\nParameterName=Vendor\nDataType=7\nAccessType=ro\nDefaultValue=7\n",
        )
    }

    fn servo() -> Self {
        Self::of(&eds::write(&Sheet::of(&CIA402).eds()))
    }

    fn read(&mut self, mux: Mux) -> u32 {
        block_on(&mut self.world, self.node.upload(mux)).unwrap().unwrap().raw()
    }

    /// What a write is answered with.
    fn write(&mut self, mux: Mux, data: &[u8]) -> Result<(), AbortCode> {
        let result = block_on(&mut self.world, self.node.download(mux, data)).unwrap();
        result.map_err(|error| error.abort().unwrap_or_else(|| panic!("{error}")))
    }

    /// State, identification, status.
    fn shown(&mut self) -> (u32, u32, u32) {
        (self.read(CONTROL), self.read(IDENTIFICATION), self.read(STATUS))
    }

    fn send(&mut self, data: &[u8]) -> Result<ProgramReport, Failure> {
        let id = self.node.id();
        block_on(&mut self.world, program(&self.network, id, 1, data, &())).unwrap()
    }

    fn power_cycle(&mut self) {
        for state in ["off", "on"] {
            sim::command::answer(&mut self.world, &format!("9 power {state}")).unwrap();
            self.world.run_for(Duration::from_secs(1));
        }
    }
}

#[test]
fn a_program_is_stopped_cleared_sent_and_started_and_is_there_after_a_power_cycle() {
    let mut bench = Bench::new();
    assert_eq!(bench.shown(), (1, DELIVERED, 0), "as delivered it runs");
    assert_eq!(bench.write(DATA, NINE), Err(AbortCode::DEVICE_STATE), "while it runs");
    assert_eq!(bench.write(CONTROL, &[CLEAR]), Err(AbortCode::DEVICE_STATE), "while it runs");
    assert_eq!(bench.write(CONTROL, &[4]), Err(AbortCode::INVALID_VALUE));
    assert_eq!(bench.write(CONTROL, &[STOP]), Ok(()));
    assert_eq!(bench.shown(), (0, DELIVERED, 0));
    assert_eq!(bench.write(CONTROL, &[CLEAR]), Ok(()));
    assert_eq!(bench.shown(), (0, 0, NO_PROGRAM));
    assert_eq!(bench.write(CONTROL, &[START]), Err(AbortCode::DEVICE_STATE), "there is nothing to start");
    bench.power_cycle();
    assert_eq!(bench.shown(), (0, 0, NO_PROGRAM), "it stays cleared");
    assert_eq!(bench.write(DATA, NINE), Ok(()));
    assert_eq!(bench.shown(), (0, SUM_OF_NINE, 0));
    assert_eq!(bench.write(CONTROL, &[START]), Ok(()));
    bench.power_cycle();
    assert_eq!(bench.shown(), (1, SUM_OF_NINE, 0));
}

#[test]
fn a_stopped_program_stays_stopped_by_a_reset_of_communication_and_starts_with_the_node() {
    let mut bench = Bench::new();
    bench.write(CONTROL, &[STOP]).unwrap();
    bench.node.nmt(canopen::NmtCommand::ResetCommunication);
    bench.world.run_for(Duration::from_secs(1));
    assert_eq!(bench.shown(), (0, DELIVERED, 0));
    bench.node.nmt(canopen::NmtCommand::ResetNode);
    bench.world.run_for(Duration::from_secs(1));
    assert_eq!(bench.shown(), (1, DELIVERED, 0));
}

#[test]
fn a_power_failure_in_the_midst_of_the_data_leaves_what_was_stored_before() {
    let mut bench = Bench::new();
    bench.send(NINE).unwrap();
    bench.write(CONTROL, &[STOP]).unwrap();
    let long: Vec<u8> = (0..10_000_u32).map(|at| at as u8).collect();
    let download = bench.node.download(DATA, &long);
    let short = Duration::from_millis(50);
    assert!(sim::block_on_for(&mut bench.world, short, download).is_err(), "it takes longer");
    bench.power_cycle();
    assert_eq!(bench.shown(), (1, SUM_OF_NINE, 0));
}

#[test]
fn what_is_there_already_is_not_sent_again() {
    let mut bench = Bench::new();
    let program: Vec<u8> = (0..20_000_u32).map(|at| ((at * 7) >> 3) as u8).collect();
    let first = bench.send(&program).unwrap();
    assert!(first.sent && first.verified && first.running == Some(true) && first.note.is_none(), "{first:?}");
    assert_eq!((first.identification, first.flash_status), (Some(first.checksum), Some(0)));
    let again = bench.send(&program).unwrap();
    assert!(!again.sent && again.verified && again.running == Some(true), "{again:?}");
    // One that was stopped in between is started.
    bench.write(CONTROL, &[STOP]).unwrap();
    let again = bench.send(&program).unwrap();
    assert!(!again.sent && again.running == Some(true), "{again:?}");
    let other = bench.send(NINE).unwrap();
    assert!(other.sent, "{other:?}");
    assert_eq!(bench.shown(), (1, SUM_OF_NINE, 0));
}

#[test]
fn more_than_the_memory_holds_is_refused_and_the_program_is_cleared() {
    let mut bench = Bench::new();
    let failure = bench.send(&vec![1; 200_000]).unwrap_err();
    assert_eq!(failure.subject.abort, Some(AbortCode::TOO_LONG), "{failure:?}");
    assert_eq!(bench.shown(), (0, 0, NO_PROGRAM));
}

/// No motor moves while its program changes.
#[test]
fn a_drive_that_is_enabled_takes_no_program_and_one_without_its_program_is_not_enabled() {
    let mut bench = Bench::servo();
    let drive = Drive::new(bench.node.clone(), &CIA402);
    block_on(&mut bench.world, drive.enable()).unwrap().unwrap();
    assert_eq!(bench.write(CONTROL, &[STOP]), Err(AbortCode::DEVICE_STATE));
    let failure = bench.send(NINE).unwrap_err();
    assert!(failure.what.contains("has power") && failure.because[0].contains("Operation enabled"), "{failure:?}");
    assert_eq!(bench.shown(), (1, DELIVERED, 0), "nothing was done");
    block_on(&mut bench.world, drive.disable()).unwrap().unwrap();
    bench.write(CONTROL, &[STOP]).unwrap();
    for word in [0x06_u16, 0x07] {
        bench.write(Mux::new(0x6040, 0), &word.to_le_bytes()).unwrap();
    }
    assert_eq!(bench.write(Mux::new(0x6040, 0), &[0x0F, 0]), Err(AbortCode::DEVICE_STATE));
    assert_eq!(
        cia402::Statusword(bench.read(Mux::new(0x6041, 0)) as u16).state(),
        Some(PowerState::SwitchedOn),
        "it was not enabled"
    );
    bench.send(NINE).unwrap();
    block_on(&mut bench.world, drive.enable()).unwrap().unwrap();
}

/// The same command again is the way on: what a cut download has left is cleared, and the whole program is sent.
#[test]
fn a_download_that_was_cut_is_done_by_the_same_command_again() {
    let mut bench = Bench::new();
    let data: Vec<u8> = (0..20_000_u32).map(|at| ((at * 13) >> 4) as u8).collect();
    for ms in [2, 20, 50, 100] {
        let (id, limit) = (bench.node.id(), Duration::from_millis(ms));
        let cut = sim::block_on_for(&mut bench.world, limit, program(&bench.network, id, 1, &data, &()));
        assert!(cut.is_err(), "{ms} ms: it takes longer");
    }
    let report = bench.send(&data).unwrap();
    assert!(report.sent && report.verified && report.running == Some(true), "{report:?}");
    assert_eq!(report.identification, Some(report.checksum));
}
