//! What the object table does not say of this drive's objects.

use crate::virtual_zlim42c::bench::Bench;

#[test]
fn the_software_version_reads_alike_in_both_places() {
    let mut bench = Bench::new();
    let version = bench.get(0x100A);
    bench.reads(0x2088, version);
}
