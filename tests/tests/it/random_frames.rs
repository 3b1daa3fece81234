//! The short form of `cargo run -p ferrodrive-tests --example random_frames`.

use ferrodrive_tests::random_frames::{kinds, survives};

#[test]
fn every_kind_of_node_survives_random_frames() {
    let kinds = kinds();
    assert!(kinds.len() >= 7, "three drives, the servo, two devices beside drives and a described one");
    for model in kinds {
        survives(model, 10_000, 7);
    }
}
