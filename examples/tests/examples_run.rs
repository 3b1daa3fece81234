//! Every example runs to its end, as `cargo run --example` would run it.

#[path = "../arm_group.rs"]
mod arm_group;
#[path = "../base_square.rs"]
mod base_square;
#[path = "../embed_in_your_test.rs"]
mod embed_in_your_test;
#[path = "../first_light.rs"]
mod first_light;
#[path = "../hello_drive.rs"]
mod hello_drive;
#[path = "../stepper_axis.rs"]
mod stepper_axis;
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

#[test]
fn arm_group_runs() {
    arm_group::main().unwrap();
}

#[test]
fn base_square_runs() {
    base_square::main().unwrap();
}

#[test]
fn stepper_axis_runs() {
    stepper_axis::main().unwrap();
}

/// `FERRODRIVE_WRITE_PAGES=1 cargo test -p ferrodrive-examples` draws it anew.
#[test]
fn the_picture_of_the_front_page_is_what_first_light_draws() {
    let picture = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/first-light.svg");
    let drawn = first_light::watch().unwrap().to_svg();
    if std::env::var_os("FERRODRIVE_WRITE_PAGES").is_some() {
        std::fs::write(&picture, &drawn).unwrap();
    }
    assert!(std::fs::read_to_string(picture).unwrap() == drawn, "docs/first-light.svg is not what the program draws");
}
