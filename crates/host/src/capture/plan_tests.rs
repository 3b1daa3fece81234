//! Plans against what the manuals let the drives map.

use super::*;
use canopen::pdo::PdoNumber;
use master::parameters::default_of;

fn node() -> NodeId {
    NodeId::new(4).expect("a node-ID")
}

fn tpdo(number: u16) -> PdoId {
    PdoId { direction: Direction::Tpdo, number: PdoNumber::new(number).expect("a number") }
}

/// The TPDOs of a model as delivered.
fn delivered(model: &'static Description) -> Vec<(PdoConfig, CobId)> {
    let pdos = (1..=4).map(|number| {
        let pdo = tpdo(number);
        let value = |mux: Mux| {
            let bytes = default_of(model.row(mux)?, node())?;
            Some((mux, bytes))
        };
        let objects = (0..=5)
            .map(|sub_index| Mux::new(pdo.parameter_index(), sub_index))
            .chain((0..=8).map(|sub_index| Mux::new(pdo.mapping_index(), sub_index)));
        let values: BTreeMap<Mux, Vec<u8>> = objects.filter_map(value).collect();
        PdoConfig::new(pdo, PdoMap::default()).with_values(CobId(CobId::INVALID), &values, model)
    });
    pdos.collect()
}

fn model(name: &str) -> &'static Description {
    devices::model(name).expect("a model")
}

fn muxes(indices: &[u16]) -> Vec<Mux> {
    indices.iter().map(|index| Mux::new(*index, 0)).collect()
}

struct Asked {
    objects: Vec<Mux>,
    period: Duration,
    bitrate: Bitrate,
    sync: Option<Duration>,
    take: Vec<PdoId>,
}

fn asked(indices: &[u16]) -> Asked {
    let period = Duration::from_millis(1);
    Asked { objects: muxes(indices), period, bitrate: Bitrate::K500, sync: None, take: Vec::new() }
}

impl Asked {
    fn of(&self, name: &str) -> Result<CapturePlan, Failure> {
        let Self { objects, period, bitrate, sync, take } = self;
        let request = Request { objects, period: *period, bitrate: *bitrate, sync: *sync, take };
        plan(model(name), node(), &delivered(model(name)), &request)
    }

    fn refused(&self, name: &str) -> (&'static str, String) {
        let failure = self.of(name).expect_err("it is refused");
        (failure.kind, failure.to_string())
    }
}

fn carried(plan: &CapturePlan) -> Vec<(String, Vec<u16>)> {
    let objects = |config: &PdoConfig| config.map.0.iter().map(|record| record.mux.index).collect();
    plan.pdos.iter().map(|(config, _)| (config.pdo.to_string(), objects(config))).collect()
}

/// The ZLAC8030L comes with nothing in its TPDOs, and its timers count 0.5 ms (quick start guide V1.00, chapters 6 and 9).
#[test]
fn what_is_asked_for_is_packed_into_as_few_spare_tpdos_as_it_takes() {
    let plan = asked(&[0x6041, 0x606C, 0x6077, 0x6064]).of("zlac8030l").expect("it has room");
    assert_eq!(
        carried(&plan),
        [("TPDO1".to_owned(), vec![0x606C, 0x6064]), ("TPDO2".to_owned(), vec![0x6041, 0x6077])]
    );
    assert_eq!((plan.pace, plan.pdos[0].1), (Pace::EventTimer, 0x184));
    // 1 ms is 2 counts; type 255 goes by the timer alone.
    assert_eq!(plan.values[&Mux::new(0x1800, 5)], [2, 0]);
    assert_eq!(plan.values[&Mux::new(0x1800, 2)], [255]);
    // Frames of 8 and 4 bytes have at most 135 and 95 bits (Davis et al., equation 1), in 500 bit times. SYNC is not sent.
    assert!((plan.load - (135.0 + 95.0) / 500.0).abs() < 1e-9, "{}", plan.load);
    // One that others send every 2 ms takes 55 of its bits in 1000 beside a timer that it does not divide.
    let sync = Some(Duration::from_millis(2));
    let beside = Asked { sync, period: Duration::from_micros(1500), ..asked(&[0x6041, 0x606C, 0x6077, 0x6064]) };
    let beside = beside.of("zlac8030l").expect("it has room");
    assert_eq!(beside.pace, Pace::EventTimer);
    assert!((beside.load - (230.0 / 750.0 + 55.0 / 1000.0)).abs() < 1e-9, "{}", beside.load);
}

#[test]
fn tpdos_in_use_are_left_alone_unless_they_are_named() {
    let used = |take: Vec<PdoId>| {
        let model = model("cia402");
        let objects = muxes(&[0x606C, 0x6064, 0x60F4, 0x6062, 0x606B]);
        let request = Request {
            objects: &objects,
            period: Duration::from_millis(5),
            bitrate: Bitrate::M1,
            sync: None,
            take: &take,
        };
        plan(model, node(), &delivered(model), &request)
    };
    // TPDO1 and 2 go on events; 3 and 4 wait for a SYNC that is not on the bus: 128 bits for 160.
    let failure = used(Vec::new()).expect_err("no room");
    let text = failure.to_string();
    assert_eq!(failure.kind, "no_room");
    assert!(text.contains("TPDO1 is in use: it carries 6041h:00, on events"), "{text}");
    assert!(text.contains("--take tpdo1") && text.contains("these have room: 606Ch:00"), "{text}");
    let plan = used(vec![tpdo(1)]).expect("room");
    assert!(carried(&plan).iter().any(|(name, _)| name == "TPDO1"));
    assert!(carried(&plan).iter().all(|(name, _)| name != "TPDO2"));
}

#[test]
fn sync_on_the_bus_is_followed_and_sets_which_rates_there_are() {
    let with_sync = |period_us: u64| {
        let (period, sync) = (Duration::from_micros(period_us), Some(Duration::from_millis(2)));
        Asked { period, sync, ..asked(&[0x606C]) }
    };
    assert_eq!(with_sync(10_000).of("zlac8030l").expect("it fits").pace, Pace::Sync(5));
    // Between two of its SYNCs the drive's own timer counts, in steps of 0.5 ms.
    assert_eq!(with_sync(1500).of("zlac8030l").expect("it fits").pace, Pace::EventTimer);
    let (kind, text) = with_sync(1300).refused("zlac8030l");
    assert_eq!(kind, "no_rate");
    assert!(text.contains("--rate 2ms") && text.contains("--rate 1.5ms"), "{text}");
    // Without one, this master sends it where the drive's timer does not fit.
    let own = Asked { period: Duration::from_micros(1300), ..asked(&[0x606C]) };
    assert_eq!(own.of("zlac8030l").expect("it fits").pace, Pace::OwnSync);
}

#[test]
fn a_bus_too_slow_says_which_rate_it_carries() {
    let slow = Asked { bitrate: Bitrate::K125, ..asked(&[0x606C, 0x6064, 0x6077]) };
    let (kind, text) = slow.refused("zlac8030l");
    assert_eq!(kind, "bus_too_slow");
    // 135 + 75 bits at 125 kbit/s are 1.68 ms: 84 % of 2 ms, and 3 % for SDO and EMCY.
    assert!(text.contains("168 % of 125 kbit/s") && text.contains("--rate 2ms"), "{text}");
    let fits = Asked { period: Duration::from_millis(2), ..slow };
    assert!(fits.of("zlac8030l").is_ok());
}

#[test]
fn what_cannot_be_mapped_is_named_with_the_way_that_is_left() {
    // M4230E17B50 and its siblings, 5.08: the mapping cannot be changed.
    let (kind, text) = asked(&[0x606C]).refused("m4230e17b50");
    assert_eq!(kind, "no_mapping");
    assert!(text.contains("the mapping of a m4230e17b50 is fixed") && text.contains("--sdo"), "{text}");
    let (kind, text) = asked(&[0x606C, 0x1017]).refused("zlac8030l");
    assert_eq!(kind, "no_mapping");
    assert!(text.contains("1017h:00") && !text.contains("606Ch:00"), "{text}");
}

/// Two full TPDOs and SYNC are at most 325 bits of 345 at 50 kbit/s. In 100 ms, a request and an answer by SDO (CiA 301, 7.2.4: 8 bytes
/// each, 135 bits) and an EMCY are 405 of 5000: 94 % without what leads back, 102 % with it.
#[test]
fn a_rate_that_leaves_sdo_without_a_place_on_the_bus_is_refused() {
    let full = |period_us: u64| {
        let (period, bitrate) = (Duration::from_micros(period_us), Bitrate::K50);
        Asked { period, bitrate, ..asked(&[0x606C, 0x6064, 0x607A, 0x60FF]) }
    };
    let (kind, text) = full(6900).refused("zlac8030l");
    assert_eq!(kind, "bus_too_slow");
    assert!(text.contains("94 % of 50 kbit/s") && text.contains("by which everything is put back"), "{text}");
    // 325 of 405 bits: 88 % with them.
    assert_eq!(full(8100).of("zlac8030l").expect("it fits").pace, Pace::OwnSync);
}
