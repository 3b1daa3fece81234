//! The commands, one file each (commands that share everything but a word share a file), a folder for each group of the help.

mod cycles;
mod repeat;

pub(crate) mod simulate {
    pub(crate) mod demo;
    pub(crate) mod events;
    pub(crate) mod run;
    pub(crate) mod sim;
    pub(crate) mod world;
}

pub(crate) mod look {
    pub(crate) mod dump;
    pub(crate) mod emcy;
    pub(crate) mod pdo;
    pub(crate) mod read;
    pub(crate) mod report;
    pub(crate) mod studio;
    pub(crate) mod top;
    pub(crate) mod watch;
}

pub(crate) mod moving {
    pub(crate) mod drive_base;
    pub(crate) mod group;
    pub(crate) mod test_motion;
}

pub(crate) mod configure {
    pub(crate) mod dcf;
    pub(crate) mod init;
    pub(crate) mod lss;
    pub(crate) mod params;
    pub(crate) mod program;
    pub(crate) mod store;
    pub(crate) mod tune;
}

pub(crate) mod network {
    pub(crate) mod boot;
    pub(crate) mod check;
    pub(crate) mod conform;
    pub(crate) mod gateway;
    pub(crate) mod latency;
    pub(crate) mod plan;
    pub(crate) mod send;
    pub(crate) mod supervise;
    pub(crate) mod sync;
    pub(crate) mod time;
}

pub(crate) mod record_and_replay {
    pub(crate) mod capture;
    pub(crate) mod convert;
    pub(crate) mod decode;
    pub(crate) mod plot;
    pub(crate) mod record;
    pub(crate) mod replay;
}

pub(crate) mod tools {
    pub(crate) mod completions;
    pub(crate) mod eds;
    pub(crate) mod export;
    pub(crate) mod fmu;
    pub(crate) mod man_pages;
    pub(crate) mod readings;
}
