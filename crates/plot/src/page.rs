//! A picture as a web page of its own: the SVG, and a script that shows the values under the pointer.

use crate::poster::Poster;
use crate::xml::escaped;

const SCRIPT: &str = include_str!("page.js");

const STYLE: &str = "body{margin:0;font:14px/1.5 ui-sans-serif,system-ui,'Segoe UI',Helvetica,Arial,sans-serif;background:#eef1f4;\
color:#1f2933}main{max-width:1200px;margin:0 auto;padding:16px}svg{width:100%;height:auto;cursor:crosshair}\
aside{position:sticky;bottom:0;background:#fff;border-top:1px solid #d0d7de;padding:6px 16px;min-height:3em}\
td{padding:0 14px 0 0}td:nth-child(2),td:nth-child(3){text-align:right;font-variant-numeric:tabular-nums}";

/// The page; it needs nothing from anywhere.
pub(crate) fn page(poster: &Poster, svg: &str) -> String {
    let title = escaped(&poster.title);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
         <main>\n{svg}</main>\n\
         <aside>Point at a curve to read it; click to measure from there.<table id=\"readout\"></table></aside>\n\
         <script>\n{SCRIPT}</script>\n</html>\n"
    )
}
