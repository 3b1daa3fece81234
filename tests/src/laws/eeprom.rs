//! Memory images that no drive of this kind has written, at power-on.

use can::{Bitrate, CanId, Frame, Instant};
use canopen::sdo::wire::Reply;
use drives::engine::storage::{BANK_SIZE, IMAGE_SIZE, StoredImage};
use drives::{mjoint, zlac8030l, zlim42c};

use super::firmware::LawSubject;

/// A selector (the drive in its low digits, what the image is above), then bytes for the damage.
pub(super) const SAMPLES: &[&[u8]] = &[
    // A factory image with bits turned; with the tail gone; random bytes; another drive's.
    b"\x00\x05\x00\x13\x01\x80\x02\x01",
    b"\x11\x80\x03",
    b"\x22FDRV\x01\x00\xFF\xFF",
    b"\x30",
    // Sound banks with records of one's own: 2014h, 200Bh and 1017h with values; a count beyond the bank.
    b"\x40\x03\x00\x14\x20\xFF\xFF\xFF\xFF\x00\x0B\x20\x00\x00\x00\x00\x00\x17\x10\x64\x00\x00\x00",
    b"\x42\xFF\x00\x05\x20\x00\x00\x00\x80",
    b"\x51\x00\x15\x26\x00\x00\x00\x00",
];

/// Periods after power-on: enough for the first supervision and a heartbeat's time.
const PERIODS: u32 = 60;

/// Any image boots: each writable object is then within its row's limits, the power stage is off, and the drive answers.
pub(super) fn eeprom(data: &[u8]) {
    let Some((&selector, damage)) = data.split_first() else { return };
    let image = image(selector, damage);
    match selector & 3 {
        0 => boots(zlac8030l::Zlac8030l::new(), &zlac8030l::hardware::Hardware { dip_address: 1, eeprom: image }),
        1 => boots(zlim42c::Zlim42c::new(), &zlim42c::hardware::Hardware { dip_address: 1, eeprom: image }),
        _ => {
            let joint = mjoint::MJoint::new(&mjoint::Model::M4230E17B50);
            boots(joint, &mjoint::Hardware { eeprom: image, bitrate: Bitrate::K500 });
        }
    }
}

fn image(selector: u8, damage: &[u8]) -> StoredImage {
    let factory = |drive: u8| match drive & 3 {
        0 => zlac8030l::hardware::Hardware::default().eeprom,
        1 => zlim42c::hardware::Hardware::default().eeprom,
        _ => mjoint::Hardware::default().eeprom,
    };
    let mut image = factory(selector);
    match selector >> 4 & 7 {
        // Bits turned: two bytes of place and one of bits.
        0 => {
            for turn in damage.chunks_exact(3) {
                let place = usize::from(u16::from_le_bytes([turn[0], turn[1]])) % IMAGE_SIZE;
                image.0[place] ^= turn[2];
            }
        }
        // The file ends early, or goes on for ever.
        1 => {
            let length = damage.iter().fold(0, |length, byte| length << 8 | usize::from(*byte)) % (2 * IMAGE_SIZE);
            let file: Vec<u8> = image.0.iter().chain(&image.0).take(length).copied().collect();
            image = StoredImage::from_bytes(&file);
        }
        // Anything.
        2 => {
            image = StoredImage::from_bytes(
                &damage.iter().cycle().take(IMAGE_SIZE * damage.len().min(1)).copied().collect::<Vec<u8>>(),
            )
        }
        // Another drive's.
        3 => image = factory(selector + 1),
        // Records of one's own under a good checksum, in either bank.
        4 => image.0[..BANK_SIZE].copy_from_slice(&bank(damage)),
        _ => image.0[BANK_SIZE..].copy_from_slice(&bank(damage)),
    }
    image
}

/// A bank with these records and a right checksum: "FDRV", version 1, the number of records, a sequence number that makes
/// it the newer one, records of a key and a value, and the CRC-32 of ISO 3309.
fn bank(records: &[u8]) -> [u8; BANK_SIZE] {
    let mut bank = [0; BANK_SIZE];
    let Some((&count, records)) = records.split_first() else { return bank };
    let head = [&b"FDRV\x01\x00"[..], &u16::from(count).to_le_bytes(), &7_u32.to_le_bytes()].concat();
    bank[..12].copy_from_slice(&head);
    for (to, from) in bank[12..].iter_mut().zip(records) {
        *to = *from;
    }
    let end = 12 + 8 * usize::from(count);
    let crc = !bank[..end.min(BANK_SIZE)].iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    });
    if let Some(place) = bank.get_mut(end..end + 4) {
        place.copy_from_slice(&crc.to_le_bytes());
    }
    bank
}

fn boots<F: LawSubject>(mut firmware: F, hardware: &F::Hardware) {
    let mut now = Instant::ZERO;
    firmware.power_on(hardware, now);
    for _ in 0..PERIODS {
        let actuation = firmware.tick(&F::Sensors::default(), now);
        assert!(F::is_off(&actuation), "it was not enabled");
        now = now.plus_nanos(F::CONTROL_PERIOD_NS);
        firmware.handle_timeout(now);
        while firmware.poll_transmit().is_some() {}
    }
    for (slot, row) in F::table().iter().filter(|(_, row)| row.access.is_writable()) {
        let value = firmware.value(slot);
        assert_eq!(row.check_value(value), Ok(()), "{} is {value}", row.mux());
    }
    assert!(F::table().iter().any(|(slot, row)| row.index == 0x6041 && firmware.value(slot) != 0));
    answers(&mut firmware, now);
}

/// An upload of 1000h is answered with the object, whatever address the image gave it.
fn answers<F: LawSubject>(firmware: &mut F, mut now: Instant) {
    let node = u16::from(firmware.report(devices::AxisId::FIRST).node_id.raw());
    firmware.handle_frame(&Frame::new(CanId::standard(0x600 + node), &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), now);
    // A device may take its time.
    for _ in 0..2_000 {
        while let Some(sent) = firmware.poll_transmit() {
            if sent.id() == CanId::standard(0x580 + node) {
                let raw = sent.data().first_chunk::<8>().expect("an SDO answer has eight bytes");
                assert!(matches!(Reply::parse(raw), Reply::InitiateUpload(..)), "{sent}");
                return;
            }
        }
        let _ = firmware.tick(&F::Sensors::default(), now);
        now = now.plus_nanos(F::CONTROL_PERIOD_NS);
        firmware.handle_timeout(now);
    }
    panic!("node {node} does not answer");
}
