//! What a drive's EEPROM contents say of its place on the bus.

use std::io;
use std::sync::{Arc, Mutex};

use can::Bitrate;
use canopen::NodeId;
use processes::PATIENCE;
use serve::messages::Messages;
use sim::machine::{Order, order};
use words::drive::drive_spec;
use words::models;

use super::virtual_bus::VirtualBus;
use crate::command::simulate::sim::{note_presets_without_effect, note_what_the_image_changes};

/// A stream that keeps what is written to it.
#[derive(Clone, Default)]
struct Paper(Arc<Mutex<Vec<u8>>>);

impl io::Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("no thread panicked").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_node_id_that_another_drive_has_is_not_written() {
    let bench = VirtualBus::of(&["zlac8030l@4", "zlim42c@2", "m4230e17b50@1"]);
    let bench = bench.with(&["--model", "4=zlac8030l", "--model", "2=zlim42c", "--model", "1=m4230e17b50"]);
    for (node, object, taken) in [("4", "200D", "2"), ("2", "2008", "1"), ("1", "2615", "4")] {
        let before = bench.done(&["read", node, object]).out;
        let ended = bench.run(&["write", node, object, taken]);
        assert_eq!(ended.status, Some(1), "{node}: {}", ended.out);
        assert!(ended.err.contains(&format!("node-ID {taken} is in use")), "{}", ended.err);
        assert_eq!(bench.done(&["read", node, object]).out, before);
        bench.done(&["write", node, object, node]);
        bench.done(&["write", node, object, "9"]);
    }
}

#[test]
fn a_drive_that_its_image_puts_elsewhere_is_said_at_the_start() {
    let bench = VirtualBus::of(&["zlac8030l@4"]).with(&["--model", "4=zlac8030l"]);
    // Node-ID 9, and number 2 of the bit rates, which is 250 kbit/s.
    bench.done(&["write", "4", "200D", "9"]);
    bench.done(&["write", "4", "200E", "2"]);
    let image = bench.world().with_drive(4, |drive, _| drive.nvm_image()).expect("a drive of this bus");
    let model = models::resolve("zlac8030l").expect("a model");
    let mut drive =
        order(model, &Order::new(model, NodeId::new(4).expect("a node-ID"), Bitrate::K500)).expect("a drive");
    drive.load_nvm(&image).expect("its own image");
    let paper = Paper::default();
    let warnings = Messages::warnings_to(paper.clone());
    note_what_the_image_changes(drive, Bitrate::K500, 4, "zlac8030l@4", &warnings);
    assert!(warnings.finish(PATIENCE));
    let said = String::from_utf8(paper.0.lock().expect("no thread panicked").clone()).expect("text");
    assert!(said.contains("zlac8030l@4 is off the bus: its EEPROM contents say 250k, and the bus has 500k"), "{said}");
    assert!(said.contains("zlac8030l@4 is node 9 on the bus"), "{said}");
}

#[test]
fn values_that_an_image_has_otherwise_are_said_to_have_no_effect() {
    let spec = drive_spec("zlac8030l@4,2014=100,6060=3").expect("a drive");
    let paper = Paper::default();
    let warnings = Messages::warnings_to(paper.clone());
    note_presets_without_effect(spec.presets(), "zlac8030l@4", &warnings);
    note_presets_without_effect(&[], "zlac8030l@5", &warnings);
    assert!(warnings.finish(PATIENCE));
    let said = String::from_utf8(paper.0.lock().expect("no thread panicked").clone()).expect("text");
    let expected = "note: zlac8030l@4 has its EEPROM contents: what is given for 2014h:00, 6060h:00 has no effect; to begin with that, move its \
                    file out of --state\n";
    assert_eq!(said, expected);
}
