//! The FMUs as an importer uses them, without a C interface: against a world of the same drives, by the rules of FMI, with wrong input.

mod against_world;
mod axis;
mod bus;
mod importer;
mod joint;
mod rules;
mod states;
mod wrong_input;
