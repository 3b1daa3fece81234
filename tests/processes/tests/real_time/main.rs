//! Processes of `ferrodrive` in real time: servers, signals, sockets, terminals. One program: a file each.

mod capture;
mod control_strangers;
mod gateway;
mod group;
mod handbook;
mod interrupted;
mod killed;
mod modbus;
mod params;
mod prompt;
mod realtime;
mod recording;
mod run_served;
mod simulator;
mod socketcan;
mod stores;
mod studio;
mod top;
mod transport;
mod under_attack;
