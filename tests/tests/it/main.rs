//! The whole of Ferrodrive from outside: the manuals' data, conversations and laws. One program: a file each.

mod conversations;
mod data_of_the_drives;
mod data_of_the_mjoint;
mod data_of_the_zlim42c;
mod departures_of_the_drives;
mod described_node;
mod described_services;
mod documented;
mod eds_of_the_drives;
mod every_drive;
mod files_of_makers;
mod io_and_encoders;
mod laws_hold_for_seeded_input;
mod lss;
mod program_download;
mod random_frames;
mod realism;
mod sdo_servers;
mod tables_of_cia402;
mod tables_of_the_drives;
mod tables_of_the_mjoint;
mod traps_between_the_drives;
mod virtual_cia402;
mod virtual_mjoint;
mod virtual_zlac8030l;
mod virtual_zlim42c;
