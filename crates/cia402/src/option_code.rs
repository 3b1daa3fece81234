//! Option codes: how a drive stops. Open newtypes: a drive supports some values and may add negative ones.
//! Source: CiA 402-2, tables 33 to 44.

macro_rules! option_code {
    ($(#[$doc:meta])* $name:ident { $($(#[$value_doc:meta])* $constant:ident = $value:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(pub i16);

        impl $name {
            $($(#[$value_doc])* pub const $constant: Self = Self($value);)*
        }
    };
}

option_code! {
    /// 605Ah: what a quick stop does.
    QuickStopOption {
        /// Drive function off at once.
        DISABLE = 0;
        /// Slow-down ramp, then Switch on disabled.
        SLOW_DOWN = 1;
        /// Quick-stop ramp, then Switch on disabled.
        QUICK_STOP = 2;
        /// Current limit, then Switch on disabled.
        CURRENT_LIMIT = 3;
        /// Slow-down ramp, stay in Quick stop active.
        SLOW_DOWN_AND_STAY = 5;
        /// Quick-stop ramp, stay in Quick stop active.
        QUICK_STOP_AND_STAY = 6;
        /// Current limit, stay in Quick stop active.
        CURRENT_LIMIT_AND_STAY = 7;
    }
}

option_code! {
    /// 605Bh: what "shutdown" does in Operation enabled.
    ShutdownOption {
        /// Drive function off at once.
        DISABLE = 0;
        /// Slow-down ramp, then off.
        SLOW_DOWN = 1;
    }
}

option_code! {
    /// 605Ch: what "disable operation" does.
    DisableOperationOption {
        /// Drive function off at once.
        DISABLE = 0;
        /// Slow-down ramp, then off.
        SLOW_DOWN = 1;
    }
}

option_code! {
    /// 605Dh: what the halt bit does; the drive stays in Operation enabled.
    HaltOption {
        /// Slow-down ramp.
        SLOW_DOWN = 1;
        /// Quick-stop ramp.
        QUICK_STOP = 2;
        /// Current limit.
        CURRENT_LIMIT = 3;
    }
}
