//! What is asked of more than one drive: each function is the body of one test, over the bench of any drive.
//!
//! `tests/every_drive.rs` says which of them each drive is asked. What differs between drives stands with their benches;
//! what only one of them has, in that drive's own tests. In frames `n` stands for the node.

pub mod motion;
pub mod network;
pub mod pdo;
pub mod power;
pub mod sdo;
pub mod stops;
pub mod terminals;

pub use crate::object_rows as objects;

/// The tests of a table `file { scenario: drive drive; }`: one for each drive of each row, `file::scenario::drive`.
#[macro_export]
macro_rules! scenarios {
    ($($file:ident { $($scenario:ident: $($drive:ident)+;)+ })+) => {$(
        mod $file {$(
            mod $scenario {$(
                #[test]
                fn $drive() {
                    $crate::scenarios::$file::$scenario::<$crate::bench::$drive::Drive>();
                }
            )+}
        )+}
    )+};
}
