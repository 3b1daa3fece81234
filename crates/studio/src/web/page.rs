//! The files of the page, embedded in the program.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::sync::OnceLock;

use axum::http::header::{ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, ETAG, IF_NONE_MATCH, VARY};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;

use super::answer::trouble;
use super::bundle::bundles;

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Name and content of each file in the folder `page`.
macro_rules! files {
    ($($name:literal),* $(,)?) => { &[$(($name, include_str!(concat!("../../page/", $name)))),*] };
}

const SOURCES: &[(&str, &str)] = files![
    "index.html",
    "login.html",
    "style.css",
    "login.js",
    "main.js",
    "link.js",
    "transport.js",
    "keys.js",
    "limit.js",
    "dom.js",
    "bus.js",
    "bus_rows.js",
    "drive.js",
    "choice.js",
    "chosen_units.js",
    "guarding.js",
    "motion_form.js",
    "sight.js",
    "machine.js",
    "motion.js",
    "scope.js",
    "scope_picture.js",
    "scope_edge.js",
    "scope_trigger.js",
    "capture.js",
    "capture_store.js",
    "fast_capture.js",
    "fast_capture_panel.js",
    "formula.js",
    "linked.js",
    "quantities.js",
    "recordings.js",
    "remedy.js",
    "report.js",
    "remedy_bar.js",
    "scale.js",
    "scope_captures.js",
    "scope_computed.js",
    "scope_pointer.js",
    "scope_readout.js",
    "scope_scales.js",
    "scope_source.js",
    "settings.js",
    "kept.js",
    "sequence.js",
    "sequence_held.js",
    "sequence_panel.js",
    "series.js",
    "analysis.js",
    "svg_pen.js",
    "test_motion.js",
    "test_motion_panel.js",
    "tune.js",
    "tune_panel.js",
    "tune_picture.js",
    "parameters.js",
    "parameter_file.js",
    "pdo.js",
    "pdo_editor.js",
    "pdo_plan.js",
    "faults.js",
    "group.js",
    "help.js",
    "homing.js",
    "homing_picture.js",
    "identified_panel.js",
    "tour.js",
    "heard.js",
    "trace.js",
    "trace_identifiers.js",
    "trace_send.js",
    "trace_sum.js",
    "console.js",
    "console_lines.js",
    "unit_field.js",
    "unit_table.js",
    "units.js",
    "views.js",
    "world.js",
    "world_form.js",
    "world_picture.js",
    "world_sliders.js",
];

/// The script that the page loads, and the one that it loads afterwards: all modules.
const BUNDLE: &str = "bundle.js";
const LATER: &str = "later.js";

/// A file as it is sent.
struct File {
    name: &'static str,
    plain: String,
    packed: Vec<u8>,
    tag: String,
}

/// Made at the first request: the scripts of all modules take some milliseconds.
fn files() -> &'static [File] {
    static FILES: OnceLock<Vec<File>> = OnceLock::new();
    FILES.get_or_init(|| {
        let main = "main.js";
        let [first, later] = bundles(SOURCES, main, BUNDLE, LATER);
        let of_file = |&(name, text): &(&'static str, &str)| match name {
            "index.html" => (name, text.replace(main, BUNDLE)),
            _ => (name, text.to_owned()),
        };
        SOURCES.iter().map(of_file).chain([(BUNDLE, first), (LATER, later)]).map(prepared).collect()
    })
}

fn prepared((name, plain): (&'static str, String)) -> File {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    // Into memory: it cannot fail.
    let packed = packer.write_all(plain.as_bytes()).and_then(|()| packer.finish()).unwrap_or_default();
    let mut hasher = DefaultHasher::new();
    plain.hash(&mut hasher);
    File { name, tag: format!("W/\"{:016x}\"", hasher.finish()), plain, packed }
}

fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.') {
        Some((_, "html")) => HTML,
        Some((_, "css")) => CSS,
        _ => SCRIPT,
    }
}

/// A file of the page, compressed if the browser takes that. What the browser has already is not sent again: it asks by the tag of
/// the content, since another version of the studio may answer at the same address. The tag is a weak one, because it is the same for
/// both codings (RFC 9110, 8.8.3.3).
pub(super) fn file(name: &str, asked: &HeaderMap) -> Response {
    let Some(file) = files().iter().find(|file| file.name == name) else {
        return trouble(StatusCode::NOT_FOUND, "not_found", "the page has no such file");
    };
    let has = |header: HeaderName, part: &str| {
        asked.get_all(header).iter().any(|value| value.to_str().is_ok_and(|text| text.contains(part)))
    };
    let (kept, vary) = (HeaderValue::from_static("private, no-cache"), HeaderValue::from_static("accept-encoding"));
    let mut headers = HeaderMap::from_iter([(CACHE_CONTROL, kept), (VARY, vary)]);
    headers.extend(HeaderValue::from_str(&file.tag).ok().map(|tag| (ETAG, tag)));
    if has(IF_NONE_MATCH, &file.tag) {
        return (StatusCode::NOT_MODIFIED, headers).into_response();
    }
    headers.insert(CONTENT_TYPE, HeaderValue::from_static(kind(name)));
    if !has(ACCEPT_ENCODING, "gzip") {
        return (headers, file.plain.as_str()).into_response();
    }
    headers.insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    (headers, file.packed.as_slice()).into_response()
}

/// The page of a refused request: why, and what to do.
pub(super) fn refused(status: StatusCode, reason: &str) -> Response {
    let text = include_str!("../../page/refused.html").replace("REASON", reason);
    (status, [(CONTENT_TYPE, HTML)], text).into_response()
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::GzDecoder;

    use super::*;

    fn asked(headers: &[(HeaderName, &str)]) -> HeaderMap {
        let value = |text: &str| HeaderValue::from_str(text).expect("a header");
        HeaderMap::from_iter(headers.iter().map(|(name, text)| (name.clone(), value(text))))
    }

    async fn body(response: Response) -> Vec<u8> {
        axum::body::to_bytes(response.into_body(), 1 << 20).await.expect("it ends").to_vec()
    }

    #[tokio::test]
    async fn a_file_comes_compressed_where_that_is_understood_and_once() {
        let plain = file(BUNDLE, &asked(&[]));
        let packed = file(BUNDLE, &asked(&[(ACCEPT_ENCODING, "gzip, deflate, br")]));
        assert!(!plain.headers().contains_key(CONTENT_ENCODING));
        assert_eq!(
            (&packed.headers()[CONTENT_ENCODING], &packed.headers()[CACHE_CONTROL]),
            (&"gzip".parse().expect("text"), &"private, no-cache".parse().expect("text"))
        );
        let tag = packed.headers()[ETAG].to_str().expect("text").to_owned();
        assert_eq!(plain.headers()[ETAG], packed.headers()[ETAG]);
        let mut unpacked = Vec::new();
        GzDecoder::new(body(packed).await.as_slice()).read_to_end(&mut unpacked).expect("it is gzip");
        assert_eq!(unpacked, body(plain).await);
        let again = file(BUNDLE, &asked(&[(IF_NONE_MATCH, &tag)]));
        assert_eq!((again.status(), &again.headers()[ETAG]), (StatusCode::NOT_MODIFIED, &tag.parse().expect("text")));
        assert!(body(again).await.is_empty());
        assert_eq!(file(BUNDLE, &asked(&[(IF_NONE_MATCH, "\"0\"")])).status(), StatusCode::OK);
        assert_eq!(file("none.js", &asked(&[])).status(), StatusCode::NOT_FOUND);
    }

    /// With a round trip of 150 ms and 1 Mbit/s: connection, redirect to where no token is seen, page, script with style, and the socket are
    /// 0.75 s, and TCP that begins slowly may take one more round trip; 25 kB are 0.2 s.
    #[test]
    fn the_first_visit_is_small_and_whole() {
        let files = files();
        let of = |name: &str| files.iter().find(|file| file.name == name).expect("a file");
        let (page, script) = (of("index.html"), of(BUNDLE));
        assert!(page.plain.contains("page/bundle.js") && !page.plain.contains("main.js"));
        let bytes: usize = ["index.html", "style.css", BUNDLE].map(|name| of(name).packed.len()).iter().sum();
        assert!(bytes < 25_000, "{bytes} bytes");
        let statement = |line: &&str| line.starts_with("import ") || line.starts_with("export ");
        assert_eq!(script.plain.lines().filter(statement).collect::<Vec<_>>(), ["export { modules };"]);
        let later = of(LATER).plain.as_str();
        let statements: Vec<_> = later.lines().filter(statement).collect();
        assert_eq!(statements, ["import { modules } from \"./bundle.js\";", "export { modules };"]);
        let unused = |name: &str| {
            let is_in = format!("modules[\"{name}\"] =");
            [&script.plain, later].iter().filter(|text| text.contains(&is_in)).count() != 1
        };
        let left: Vec<_> =
            SOURCES.iter().map(|(name, _)| *name).filter(|name| name.ends_with(".js") && unused(name)).collect();
        assert_eq!(left, ["login.js"], "every module is in one of them");
    }
}
