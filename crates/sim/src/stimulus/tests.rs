//! Whatever a stimulus is, its words say it: `parse(print(x)) == x`.

use std::time::Duration;

use canopen::{Mux, NodeId};

use super::*;
use crate::Prng;

/// Numbers of all sizes, not below `least`.
fn number(random: &mut Prng, least: f64) -> f64 {
    let value = match random.below(4) {
        0 => f64::from(random.below(100) as u32),
        1 => random.below(1 << 40) as f64 * 1e-9,
        2 => -(random.below(1 << 40) as f64) * 1e-21,
        _ => f64::from_bits(random.next_u64()),
    };
    if value.is_finite() && value >= least { value } else { least.max(0.5) }
}

fn name(random: &mut Prng) -> String {
    ["X0", "PU", "DIR", "ä", "any"][random.below(5) as usize].to_owned()
}

fn some<T>(random: &mut Prng, value: T) -> Option<T> {
    (random.below(2) == 0).then_some(value)
}

fn any_load(random: &mut Prng) -> LoadPart {
    let [a, b, c, d] = [(); 4].map(|()| number(random, 0.0));
    let [more, further] = [c, d].map(|value| some(random, value));
    match random.below(8) {
        0 => LoadPart::None,
        1 => LoadPart::Off(LoadKind::ALL[random.below(6) as usize]),
        2 => LoadPart::Friction(Friction { coulomb_nm: a, viscous_nm_s: b, static_nm: more, stribeck_rad_s: further }),
        3 => LoadPart::Pulley { mass_kg: a, radius_m: number(random, f64::MIN) },
        4 => LoadPart::Spring { stiffness_nm_rad: a, rest_deg: number(random, f64::MIN) },
        5 => {
            let (low, high) = (random.next_u64() as i64, random.next_u64() as i64);
            let range = SwitchRange { low: some(random, low.min(high)), high: some(random, low.max(high)) };
            LoadPart::Stop { range, stiffness_nm_rad: more, damping_nm_s_rad: further.filter(|_| more.is_some()) }
        }
        6 => LoadPart::Fan { torque_nm: a, speed_rpm: b },
        _ => LoadPart::Gear { ratio: a, backlash_deg: b, stiffness_nm_rad: more },
    }
}

fn any(random: &mut Prng) -> Stimulus {
    let coin = random.below(2) == 0;
    match random.below(19) {
        0 => Stimulus::Power(Power::ALL[random.below(4) as usize]),
        1 => Stimulus::Input { name: name(random), level: coin },
        2 => {
            let (a, b) = (random.next_u64() as i64, random.next_u64() as i64);
            let range = SwitchRange { low: some(random, a.min(b)), high: some(random, a.max(b)) };
            Stimulus::Switch { name: name(random), range }
        }
        3 => Stimulus::LoadTorque(number(random, f64::MIN)),
        4 => Stimulus::LoadInertia(number(random, 0.0)),
        5 => Stimulus::RotorLock(coin),
        6 => {
            let [voltage_v, limit_a, ohm] = [(); 3].map(|()| number(random, 0.0));
            let (limit_a, resistance_ohm) = (some(random, limit_a), some(random, ohm));
            let voltage_v = Some(voltage_v).filter(|_| coin || (limit_a, resistance_ohm) == (None, None));
            Stimulus::Supply(Source { voltage_v, limit_a, resistance_ohm })
        }
        7 => {
            let celsius = number(random, -273.15);
            Stimulus::Temperature(TemperatureSensor::ALL[usize::from(coin)], some(random, celsius))
        }
        8 => Stimulus::Fault(Component::ALL[random.below(8) as usize], coin),
        9 => Stimulus::Battery(coin),
        10 => Stimulus::Pulses(PulseTrain::Pulses { count: random.next_u64() as i64, hz: number(random, 0.0) }),
        11 => Stimulus::Pulses(PulseTrain::Quadrature { count: random.next_u64() as i64, hz: number(random, 0.0) }),
        12 => Stimulus::Pulses(match coin {
            true => PulseTrain::Duty(number(random, 0.0)),
            false => PulseTrain::Clock(number(random, 0.0)),
        }),
        13 => Stimulus::CableCut(coin),
        14 => Stimulus::Bus(bus_fault(random)),
        15 | 16 => Stimulus::Load(any_load(random)),
        17 => Stimulus::Mpdo {
            to: NodeId::new(random.below(128) as u8),
            object: Mux::new(random.next_u64() as u16, random.next_u64() as u8),
            value: if coin { (random.next_u64() as i32).into() } else { (random.next_u64() as u32).into() },
        },
        _ => Stimulus::Object {
            mux: Mux::new(random.next_u64() as u16, random.next_u64() as u8),
            value: match random.below(3) {
                0 => ObjectValue::Integer(i128::from(random.next_u64()) - i128::from(random.next_u64())),
                1 => ObjectValue::Real(number(random, f64::MIN)),
                _ => {
                    ObjectValue::Text(["", "one", "two  words ", "\"quoted\"", "é\t"][random.below(5) as usize].into())
                }
            },
        },
    }
}

fn bus_fault(random: &mut Prng) -> BusFault {
    use crate::fault::{Babble, Delay, Overrun};
    let day_ns = 86_400_000_000_000;
    let [a, b] = [(); 2].map(|()| random.below(day_ns));
    match random.below(5) {
        0 => BusFault::Silent(a > b),
        1 => BusFault::Late(some(random, Delay { min_ns: a.min(b), max_ns: a.max(b) })),
        2 => {
            let frame = if a > b { "080#" } else { "18FF0102#0102" }.parse().expect("a frame");
            BusFault::Babble(some(random, Babble { frame, gap_ns: a }))
        }
        3 => BusFault::Overrun(some(random, Overrun { depth: a as u32, service_ns: b })),
        _ => BusFault::Corrupt(random.below(1_000_001) as f64 * 1e-6),
    }
}

#[test]
fn every_stimulus_is_read_back_from_its_words() {
    let mut random = Prng::new(402);
    for n in 0..50_000 {
        let stimulus = any(&mut random);
        let words = stimulus.to_string();
        assert_eq!(words.parse().as_ref(), Ok(&stimulus), "{n}: {words}");
    }
}

#[test]
fn an_object_is_given_in_any_of_the_usual_spellings() {
    let parsed = |words: &str| words.parse::<Stimulus>();
    let set = |index, sub_index, value| Ok(Stimulus::Object { mux: Mux::new(index, sub_index), value });
    for words in ["set 6000:01 FFh", "set 6000h:01h 0xff", "set 0x6000:0x1 255"] {
        assert_eq!(parsed(words), set(0x6000, 1, ObjectValue::Integer(255)), "{words}");
    }
    assert_eq!(parsed("set 2000 -5"), set(0x2000, 0, ObjectValue::Integer(-5)));
    assert_eq!(parsed("set 2000 1.5"), set(0x2000, 0, ObjectValue::Real(1.5)));
    assert_eq!(parsed("set  2000 \"two  words\""), set(0x2000, 0, ObjectValue::Text("two  words".into())));
    for (words, error) in [
        ("set", "expected: NODE set OBJECT VALUE"),
        ("set 6000:01", "expected: NODE set OBJECT VALUE"),
        ("set 60000 1", "invalid object \"60000\"; expected: NODE set OBJECT VALUE"),
        ("set 6000:100 1", "invalid object \"6000:100\"; expected: NODE set OBJECT VALUE"),
        ("set 6000 -FFh", "invalid value \"-FFh\"; expected: NODE set OBJECT VALUE"),
        ("set 6000 \"open", "invalid value \"\\\"open\"; expected: NODE set OBJECT VALUE"),
        ("mpdo 128 6200 1", "invalid node \"128\"; expected: NODE mpdo OTHER|all OBJECT VALUE"),
        ("mpdo 7 6200", "expected: NODE mpdo OTHER|all OBJECT VALUE"),
        (
            "mpdo all 6200 4294967296",
            "invalid value of up to four bytes \"4294967296\"; expected: NODE mpdo OTHER|all OBJECT VALUE",
        ),
        ("set 6000 nan", "invalid value \"nan\"; expected: NODE set OBJECT VALUE"),
    ] {
        assert_eq!(parsed(words).unwrap_err().to_string(), error, "{words}");
    }
}

#[test]
fn a_place_is_a_node_or_an_axis_of_it_counted_from_1() {
    for (text, node, axis) in [("5", 5, 0), ("5.2", 5, 1), ("127.8", 127, 7)] {
        let place = Place { node, axis: devices::AxisId(axis) };
        assert_eq!((text.parse(), place.to_string()), (Ok(place), text.to_owned()));
    }
    assert_eq!("5.1".parse(), Ok(Place::node(5)));
    for text in ["", "0", "128", "5.", "5.0", ".2", "5.-1", "5.257", "+5", "5.2.1", "5 2"] {
        assert_eq!(text.parse::<Place>(), Err(()), "{text:?}");
    }
}

#[test]
fn what_is_wrong_with_a_load_is_said_with_its_own_form() {
    for (words, error) in [
        ("load", "expected: NODE load torque|inertia|friction|pulley|spring|stop|fan|gear VALUES, or NODE load none"),
        ("load pulley 2", "expected: NODE load pulley KG METRES, or NODE load pulley off"),
        ("load pulley -2 1", "invalid mass \"-2\"; expected: NODE load pulley KG METRES, or NODE load pulley off"),
        ("load fan 1 inf", "invalid speed \"inf\"; expected: NODE load fan N·m R/MIN, or NODE load fan off"),
        ("load stop 5 -5", "the range from 5 to -5 is empty; give the lower bound first"),
        (
            "load friction 1 static",
            "expected: NODE load friction N·m [viscous N·m·s/rad] [static N·m] [stribeck rad/s], or NODE load friction off",
        ),
        (
            "load friction 0.2 0.02",
            "invalid term of friction \"0.02\"; expected: NODE load friction N·m \
             [viscous N·m·s/rad] [static N·m] [stribeck rad/s], or NODE load friction off",
        ),
        ("load none of it", "expected: NODE load none"),
    ] {
        assert_eq!(words.parse::<Stimulus>().unwrap_err().to_string(), error, "{words}");
    }
}

#[test]
fn faults_of_the_bus_from_numbers_have_the_bounds_of_their_words() {
    let ms = Duration::from_millis;
    let day = Duration::from_secs(86_400);
    let frame: can::Frame = "080#".parse().expect("a frame");
    for (fault, words) in [
        (BusFault::late(ms(5), ms(20)), "bus late 5 20"),
        (BusFault::babble(frame, ms(1)), "bus babble 080# 1"),
        (BusFault::overrun(2, Duration::from_micros(500)), "bus overrun 2 0.5"),
        (BusFault::corrupt(0.3), "bus corrupt 0.3"),
    ] {
        assert_eq!(fault.map(Stimulus::Bus), words.parse(), "{words}");
    }
    for refused in [
        BusFault::late(ms(5), ms(4)),
        BusFault::late(ms(5), day + ms(1)),
        BusFault::babble(frame, day + ms(1)),
        BusFault::overrun(2, day + ms(1)),
        BusFault::corrupt(1.1),
        BusFault::corrupt(-0.1),
        BusFault::corrupt(f64::NAN),
    ] {
        assert!(refused.is_err(), "{refused:?}");
    }
    assert_eq!(WireFault::destroy(3, 20), WireFault::parse(&["destroy", "3", "20"]));
    assert!(
        WireFault::destroy(0, 20).is_err() && WireFault::destroy(3, 0).is_err() && WireFault::corrupt(2.0).is_err()
    );
    assert!(SwitchRange::new(Some(2), Some(1)).is_err() && SwitchRange::new(None, Some(1)).is_ok());
}
