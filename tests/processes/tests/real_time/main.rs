//! Processes of `ferrodrive` in real time: servers, signals, sockets, terminals. One program: a file each.

mod boot;
mod control_strangers;
mod every_day;
mod gateway;
mod group;
mod handbook;
mod interrupted;
mod killed;
mod latency;
mod limits;
mod logs;
mod lss;
mod modbus;
mod models;
mod params;
mod recording;
mod run_served;
mod scan_and_dump;
mod simulator;
mod socketcan;
mod stores;
mod studio;
mod top;
mod transport;
mod under_attack;
