//! Pages for people to keep, to send and to print: light, on A4 with what belongs together on one sheet.

use crate::xml::escaped;

const STYLE: &str = "
:root{--ink:#1d2430;--dim:#5d6675;--line:#dfe3ea;--pass:#1a7f4b;--fail:#c0272d;--expected:#96650a;--na:#6b7382;color-scheme:light}
*{box-sizing:border-box}body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:#fff;margin:0 auto;max-width:1080px;padding:32px 24px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:17px;margin:32px 0 8px;border-bottom:2px solid var(--ink);padding-bottom:4px}
p{margin:6px 0;color:var(--dim)}dl{display:grid;grid-template-columns:max-content 1fr;gap:2px 16px;margin:16px 0}
dt{color:var(--dim)}dd{margin:0}.sum{display:flex;gap:12px;margin:20px 0;flex-wrap:wrap}
.sum div{flex:1;min-width:120px;border:1px solid var(--line);border-top:4px solid;border-radius:6px;padding:10px 14px}
.sum b{display:block;font-size:26px;line-height:1.2}
.pass{color:var(--pass)}.fail{color:var(--fail)}.expected{color:var(--expected)}.na{color:var(--na)}
.sum div span{color:var(--dim)}table{border-collapse:collapse;width:100%}
td,th{text-align:left;vertical-align:top;padding:6px 10px 6px 0;border-bottom:1px solid var(--line);overflow-wrap:anywhere}
th{font-weight:600;color:var(--dim);font-size:13px}td.id{white-space:nowrap;font-variant-numeric:tabular-nums}
td.r{white-space:nowrap;font-weight:600}td.c{white-space:nowrap;color:var(--dim);font-size:13px}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}figure{margin:12px 0}figure svg{width:100%;height:auto}
.why{color:var(--dim);font-size:13.5px;overflow-wrap:anywhere}details{margin-top:2px}summary{cursor:pointer;color:var(--dim);font-size:13px}
pre{font:12.5px/1.45 ui-monospace,monospace;background:#f5f7fa;border-radius:4px;padding:8px 10px;margin:4px 0;overflow-x:auto}
tr.f{background:#fdf3f3}footer{margin-top:32px;color:var(--dim);font-size:13px}
@page{size:A4;margin:16mm 14mm}
@media print{body{padding:0;max-width:none;font-size:9.5pt;print-color-adjust:exact;-webkit-print-color-adjust:exact}
h1{font-size:17pt}h2{font-size:12pt;margin-top:16pt;break-after:avoid}tr,.sum,dl,figure{break-inside:avoid}thead{display:table-header-group}
td,th{padding:3pt 8pt 3pt 0}th,td.c,.why,footer{font-size:8.5pt}.sum b{font-size:15pt}details>pre{display:block;white-space:pre-wrap}}";

/// A page around this body, which is HTML; no script, and nothing that is loaded. The title is text.
pub fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>{}</title><style>{STYLE}</style></head>\
         <body>{body}</body></html>\n",
        escaped(title)
    )
}
