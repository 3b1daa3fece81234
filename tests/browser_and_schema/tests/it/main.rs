//! What large libraries of others judge: the studio's page in a real browser, and the JSON of every command by its schema.

mod bus_notes;
mod control;
mod json_schema;
mod studio_browser;
