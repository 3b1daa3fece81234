//! The functions of the module: a caller writes a call to the place that [`reserve`] gives, and reads the answer where [`answer`] says.
//!
//! After a panic the module is of no use; the answer is then what the panic said.
#![allow(unsafe_code, reason = "names that JavaScript finds; nothing here is dereferenced")]
#![allow(unreachable_pub, reason = "the module's symbols, not the crate's items")]

use std::cell::RefCell;
use std::sync::Once;

use crate::call::{Library, failed};

thread_local! {
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static LIBRARY: RefCell<Library> = RefCell::default();
}

static HOOK: Once = Once::new();

/// Makes room for a call of so many bytes, and returns where it is to be written.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> *mut u8 {
    HOOK.call_once(|| {
        std::panic::set_hook(Box::new(|panic| {
            let defect = format!("a defect of Ferrodrive; please report it with what was done: {panic}");
            OUTPUT.with(|output| *output.borrow_mut() = failed("defect", &defect));
        }));
    });
    // What ends the module without a panic (memory, stack) leaves no answer, and not that of the call before.
    OUTPUT.with(|output| output.borrow_mut().clear());
    INPUT.with(|input| {
        let mut input = input.borrow_mut();
        input.clear();
        input.resize(length, 0);
        input.as_mut_ptr()
    })
}

/// Carries out the call that was written, and returns the length of its answer.
#[unsafe(no_mangle)]
pub extern "C" fn call() -> usize {
    let answered = INPUT.with(|input| LIBRARY.with(|library| library.borrow_mut().call(&input.borrow())));
    OUTPUT.with(|output| {
        let mut output = output.borrow_mut();
        *output = answered;
        output.len()
    })
}

/// Where the answer is.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    OUTPUT.with(|output| output.borrow().as_ptr())
}

/// The length of the answer; after a panic, of what it said.
#[unsafe(no_mangle)]
pub extern "C" fn answer_length() -> usize {
    OUTPUT.with(|output| output.borrow().len())
}
