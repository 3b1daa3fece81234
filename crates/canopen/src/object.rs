//! Where the objects of CiA 301 stand that programs ask for by themselves, and one of CiA 302's, by their names.
//!
//! Numbers in brackets are clauses of CiA 301. What a device has of them is in its [`Table`](crate::od::Table); the records of
//! PDOs are counted by [`PdoNumber`](crate::pdo::PdoNumber).

/// Constants of objects, and the list of them by name as `ALL`.
#[doc(hidden)]
#[macro_export]
macro_rules! objects {
    ($($(#[$doc:meta])* $name:ident = $index:literal, $sub_index:literal;)+) => {
        $($(#[$doc])* pub const $name: $crate::Mux = $crate::Mux::new($index, $sub_index);)+

        /// All of them by name, ascending.
        pub const ALL: &[(&str, $crate::Mux)] = &[$((stringify!($name), $name)),+];
    };
}

objects! {
    /// Device type (7.5.2.1): profile number, and what the profile says of it.
    DEVICE_TYPE = 0x1000, 0;
    /// Error register (7.5.2.2).
    ERROR_REGISTER = 0x1001, 0;
    /// Pre-defined error field (7.5.2.4): the number of errors that are kept.
    PRE_DEFINED_ERROR_FIELD = 0x1003, 0;
    /// COB-ID SYNC message (7.5.2.5).
    COB_ID_SYNC_MESSAGE = 0x1005, 0;
    /// Communication cycle period in µs (7.5.2.6).
    COMMUNICATION_CYCLE_PERIOD = 0x1006, 0;
    /// Synchronous window length in µs (7.5.2.7).
    SYNCHRONOUS_WINDOW_LENGTH = 0x1007, 0;
    /// Manufacturer device name (7.5.2.8).
    MANUFACTURER_DEVICE_NAME = 0x1008, 0;
    /// Manufacturer software version (7.5.2.10).
    MANUFACTURER_SOFTWARE_VERSION = 0x100A, 0;
    /// Guard time in ms (7.5.2.11).
    GUARD_TIME = 0x100C, 0;
    /// Life time factor (7.5.2.12).
    LIFE_TIME_FACTOR = 0x100D, 0;
    /// COB-ID time stamp object (7.5.2.15).
    COB_ID_TIME_STAMP_OBJECT = 0x1012, 0;
    /// COB-ID EMCY (7.5.2.17).
    COB_ID_EMCY = 0x1014, 0;
    /// Inhibit time EMCY in 100 µs (7.5.2.18).
    INHIBIT_TIME_EMCY = 0x1015, 0;
    /// Consumer heartbeat time (7.5.2.19): how many nodes can be watched.
    CONSUMER_HEARTBEAT_TIME = 0x1016, 0;
    /// The first node that is watched, and for how long in ms (7.5.2.19).
    CONSUMER_HEARTBEAT_TIME_1 = 0x1016, 1;
    /// Producer heartbeat time in ms (7.5.2.20).
    PRODUCER_HEARTBEAT_TIME = 0x1017, 0;
    /// Vendor-ID of the identity object (7.5.2.21).
    VENDOR_ID = 0x1018, 1;
    /// Product code of the identity object (7.5.2.21).
    PRODUCT_CODE = 0x1018, 2;
    /// Revision number of the identity object (7.5.2.21).
    REVISION_NUMBER = 0x1018, 3;
    /// Serial number of the identity object (7.5.2.21).
    SERIAL_NUMBER = 0x1018, 4;
    /// Synchronous counter overflow value (7.5.2.22).
    SYNCHRONOUS_COUNTER_OVERFLOW_VALUE = 0x1019, 0;
    /// Date of the verified configuration, in days (7.5.2.23).
    CONFIGURATION_DATE = 0x1020, 1;
    /// Time of the verified configuration, in ms of its day (7.5.2.23).
    CONFIGURATION_TIME = 0x1020, 2;
    /// Emergency consumer object (7.5.2.31): how many producers can be heard.
    EMERGENCY_CONSUMER_OBJECT = 0x1028, 0;
    /// Error behavior object (7.5.2.32): what a communication error does to the NMT state.
    COMMUNICATION_ERROR = 0x1029, 1;
    /// Application software identification of the first program (CiA 302-3).
    APPLICATION_SOFTWARE_IDENTIFICATION = 0x1F56, 1;
}
