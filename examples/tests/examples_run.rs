//! Every example runs to its end, as `cargo run --example` would run it.

#[path = "../embed_in_your_test.rs"]
mod embed_in_your_test;
#[path = "../hello_drive.rs"]
mod hello_drive;
#[path = "../stream_positions.rs"]
mod stream_positions;
#[path = "../two_drives.rs"]
mod two_drives;

#[test]
fn hello_drive_runs() {
    hello_drive::main().unwrap();
}

#[test]
fn embed_in_your_test_runs() {
    embed_in_your_test::main();
}

#[test]
fn two_drives_runs() {
    two_drives::main().unwrap();
}

#[test]
fn stream_positions_runs() {
    stream_positions::main().unwrap();
}
