//! The laws of [`ferrodrive_tests::laws`] under seeded input. The fuzz targets call the same laws.

use ferrodrive_tests::{laws, seeded};

const FRAME_TEXTS: &[&[u8]] = &[
    b"604#2B40600006000000",
    b"704#00",
    b"000#0104",
    b"1FFFFFFF#",
    b"080#",
    b"584#R",
    b"123#R8",
    b"7FF#0102030405060708",
];

#[test]
fn candump_text_is_read_or_refused_and_reads_back_as_printed() {
    seeded::check(FRAME_TEXTS, laws::frame_text);
}

#[test]
fn a_frame_is_never_shorter_than_its_bits_nor_longer_than_with_all_stuff_bits() {
    seeded::check(&[b"\x04\x06\0\0\x2B\x40\x60\0\0\0\0\0", b"\0\0\0\0\0\0\0\0"], laws::frame_length);
}
