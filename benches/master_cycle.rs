//! One cycle of six drives in the master: SYNC and six RPDOs out, six TPDOs in, a step of each drive. Instructions and
//! allocations: `examples/count_cycle.rs`.

#[path = "workload/cycle.rs"]
mod workload;

use criterion::{Criterion, criterion_group, criterion_main};
use workload::Line;

fn cycle_of_six(criterion: &mut Criterion) {
    let mut line = Line::new();
    criterion.bench_function("a cycle of six drives", |bencher| bencher.iter(|| line.cycle()));
}

criterion_group!(benches, cycle_of_six);
criterion_main!(benches);
