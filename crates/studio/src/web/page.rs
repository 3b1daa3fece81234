//! The files of the page, embedded in the program, and the tables that it draws.

use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};

use super::answer::trouble;

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Name, type and content of each.
const FILES: &[(&str, &str, &str)] = &[
    ("index.html", HTML, include_str!("../../page/index.html")),
    ("login.html", HTML, include_str!("../../page/login.html")),
    ("style.css", CSS, include_str!("../../page/style.css")),
    ("login.js", SCRIPT, include_str!("../../page/login.js")),
    ("main.js", SCRIPT, include_str!("../../page/main.js")),
    ("link.js", SCRIPT, include_str!("../../page/link.js")),
    ("transport.js", SCRIPT, include_str!("../../page/transport.js")),
    ("keys.js", SCRIPT, include_str!("../../page/keys.js")),
    ("limit.js", SCRIPT, include_str!("../../page/limit.js")),
    ("dom.js", SCRIPT, include_str!("../../page/dom.js")),
    ("bus.js", SCRIPT, include_str!("../../page/bus.js")),
    ("drive.js", SCRIPT, include_str!("../../page/drive.js")),
    ("choice.js", SCRIPT, include_str!("../../page/choice.js")),
    ("guarding.js", SCRIPT, include_str!("../../page/guarding.js")),
    ("motion_form.js", SCRIPT, include_str!("../../page/motion_form.js")),
    ("sight.js", SCRIPT, include_str!("../../page/sight.js")),
    ("machine.js", SCRIPT, include_str!("../../page/machine.js")),
    ("motion.js", SCRIPT, include_str!("../../page/motion.js")),
    ("scope.js", SCRIPT, include_str!("../../page/scope.js")),
    ("scope_picture.js", SCRIPT, include_str!("../../page/scope_picture.js")),
    ("scope_edge.js", SCRIPT, include_str!("../../page/scope_edge.js")),
    ("scope_trigger.js", SCRIPT, include_str!("../../page/scope_trigger.js")),
    ("kept.js", SCRIPT, include_str!("../../page/kept.js")),
    ("series.js", SCRIPT, include_str!("../../page/series.js")),
    ("analysis.js", SCRIPT, include_str!("../../page/analysis.js")),
    ("svg_pen.js", SCRIPT, include_str!("../../page/svg_pen.js")),
    ("parameters.js", SCRIPT, include_str!("../../page/parameters.js")),
    ("parameter_file.js", SCRIPT, include_str!("../../page/parameter_file.js")),
    ("pdo.js", SCRIPT, include_str!("../../page/pdo.js")),
    ("pdo_editor.js", SCRIPT, include_str!("../../page/pdo_editor.js")),
    ("pdo_plan.js", SCRIPT, include_str!("../../page/pdo_plan.js")),
    ("faults.js", SCRIPT, include_str!("../../page/faults.js")),
    ("group.js", SCRIPT, include_str!("../../page/group.js")),
    ("help.js", SCRIPT, include_str!("../../page/help.js")),
    ("homing.js", SCRIPT, include_str!("../../page/homing.js")),
    ("homing_picture.js", SCRIPT, include_str!("../../page/homing_picture.js")),
    ("tour.js", SCRIPT, include_str!("../../page/tour.js")),
    ("heard.js", SCRIPT, include_str!("../../page/heard.js")),
    ("trace.js", SCRIPT, include_str!("../../page/trace.js")),
    ("world.js", SCRIPT, include_str!("../../page/world.js")),
    ("world_form.js", SCRIPT, include_str!("../../page/world_form.js")),
    ("world_picture.js", SCRIPT, include_str!("../../page/world_picture.js")),
];

/// A file of the page.
pub(super) fn file(name: &str) -> Response {
    match FILES.iter().find(|(of, _, _)| *of == name) {
        Some((_, kind, content)) => ([(CONTENT_TYPE, *kind)], *content).into_response(),
        None => trouble(StatusCode::NOT_FOUND, "not_found", "the page has no such file"),
    }
}

/// The page of a refused request: why, and what to do.
pub(super) fn refused(status: StatusCode, reason: &str) -> Response {
    let text = include_str!("../../page/refused.html").replace("REASON", reason);
    (status, [(CONTENT_TYPE, HTML)], text).into_response()
}
