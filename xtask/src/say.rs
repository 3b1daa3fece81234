//! Lines of a step, with its name before them while several steps run side by side.

use std::cell::Cell;
use std::fmt::Display;

thread_local! {
    static STEP: Cell<Option<&'static str>> = const { Cell::new(None) };
}

/// Prints a line for people.
pub(crate) fn say(line: impl Display) {
    match STEP.get() {
        Some(step) => println!("{step:10} | {line}"),
        None => println!("   {line}"),
    }
}

/// The step that this thread works for, if its lines are shown with its name.
pub(crate) fn step() -> Option<&'static str> {
    STEP.get()
}

/// From here on this thread works for a step.
pub(crate) fn work_for(step: Option<&'static str>) {
    STEP.set(step);
}
