//! The page that every report stands in: one file, nothing fetched, no scripts but that of a view.

use super::plot::{Colour, Shape};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// One part of a report: a heading and what stands under it.
#[derive(Debug, Clone)]
pub struct Section {
    /// heading
    pub title: String,
    /// contents; a section without any is left out of the page
    pub body: Markup,
    /// what it brings: news that is not neutral has a mark of its own
    pub tone: Tone,
}

impl Section {
    /// A section without a mark.
    pub fn new(title: impl Into<String>, body: Markup) -> Self {
        Section {
            title: title.into(),
            body,
            tone: Tone::Neutral,
        }
    }
}

/// How good the news is: it decides the colour beside the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// well
    Good,
    /// usable, with a reservation
    Fair,
    /// not to be used
    Bad,
    /// neither
    Neutral,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Tone::Good => "good",
            Tone::Fair => "fair",
            Tone::Bad => "bad",
            Tone::Neutral => "neutral",
        }
    }
}

/// A whole page: title, a line under it, the verdict, then the sections.
pub fn page(
    title: &str,
    line: &str,
    (tone, verdict): (Tone, &str),
    sections: &[Section],
) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(concat!("excite ", env!("CARGO_PKG_VERSION")));
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(VIEW)) }
            }
            body {
                header { h1 { (title) } p { (line) } }
                main {
                    p class={ "verdict " (tone.class()) } { (verdict) }
                    @for section in sections.iter().filter(|s| !s.body.0.is_empty()) {
                        section class=(section.tone.class()) {
                            @if !section.title.is_empty() { h2 { (section.title) } }
                            (section.body)
                        }
                    }
                }
                footer { "excite " (env!("CARGO_PKG_VERSION")) }
            }
        }
    }
    .into_string()
}

/// A figure of [`plot`](super::plot) with a caption under it.
pub fn figure(svg: String, caption: Markup) -> Markup {
    html! {
        figure {
            div class="sheet" { (PreEscaped(svg)) }
            figcaption { (caption) }
        }
    }
}

/// What the colours of a figure stand for.
pub fn legend(entries: &[(Colour, Shape, &str)]) -> Markup {
    let class = |s: Shape| (s != Shape::Line).then_some("dot");
    html! {
        span class="legend" {
            @for (colour, shape, text) in entries {
                span { i class=[class(*shape)] style=(format!("background:{}", colour.css())) {} (text) }
            }
        }
    }
}

/// Key figures: value, what it is, and a remark.
pub fn tiles(tiles: &[(String, String, String)]) -> Markup {
    html! {
        div class="tiles" {
            @for (value, name, remark) in tiles {
                div {
                    strong { (value) }
                    span { (name) }
                    small { (remark) }
                }
            }
        }
    }
}

/// A table. The first column and those whose number is in `texts` are set to the left, all others
/// as numbers to the right. It scrolls on its own where the page is too narrow.
pub fn table(head: &[&str], texts: &[usize], rows: &[Vec<Markup>]) -> Markup {
    let class = |k: usize| (k > 0 && !texts.contains(&k)).then_some("number");
    html! {
        div class="sheet" {
            table {
                thead { tr { @for (k, cell) in head.iter().enumerate() {
                    th class=[class(k)] { (cell) }
                } } }
                tbody { @for row in rows { tr { @for (k, cell) in row.iter().enumerate() {
                    td class=[class(k)] { (cell) }
                } } } }
            }
        }
    }
}

/// Something to be opened by those who want to know.
pub fn details(summary: &str, body: Markup) -> Markup {
    html! { details { summary { (summary) } (body) } }
}

/// The style of a view in space.
const VIEW: &str = include_str!("view/view.css");

/// The style of all reports.
const STYLE: &str = "
:root{color-scheme:light;--ink:#1f2933;--quiet:#616e7c;--line:#e4e7eb;--page:#f3f5f7;--blue:#0072b2;\
--green:#009e73;--orange:#e69f00;--red:#d55e00}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);\
font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}
header,main,footer{max-width:1120px;margin:0 auto;padding:0 20px}
header{padding-top:28px}
h1{font-size:26px;line-height:1.25;margin:0;overflow-wrap:anywhere}
header p{margin:4px 0 18px;color:var(--quiet);overflow-wrap:anywhere}
section,.verdict{background:#fff;border:1px solid var(--line);border-radius:8px;padding:18px 20px;margin:0 0 16px}
.verdict{max-width:none;font-size:18px;line-height:1.45;border-left:6px solid var(--blue);overflow-wrap:anywhere}
main>.good{border-left:6px solid var(--green)}
main>.fair{border-left:6px solid var(--orange)}
main>.bad{border-left:6px solid var(--red)}
h2{font-size:18px;margin:0 0 8px}
h3{font-size:15px;margin:18px 0 6px}
p{margin:0 0 10px;max-width:100ch}
section>:last-child{margin-bottom:0}
figure{margin:6px 0 12px}
figcaption{color:var(--quiet);font-size:13px;margin-top:8px}
.sheet{overflow-x:auto}
.sheet svg{min-width:640px}
.sheet+p{margin-top:12px}
.legend{display:inline-flex;flex-wrap:wrap;gap:2px 16px;margin-right:16px;color:var(--ink)}
.legend i{display:inline-block;width:16px;height:4px;border-radius:2px;margin-right:6px;vertical-align:middle}
.legend i.dot{width:9px;height:9px;border-radius:50%}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:18px 24px}
.tiles strong{display:block;font-size:26px;font-weight:600;line-height:1.2;font-variant-numeric:tabular-nums}
.tiles span{display:block;font-size:14px}
.tiles small{display:block;color:var(--quiet);font-size:13px;line-height:1.35;overflow-wrap:anywhere}
table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
th{text-align:left;color:var(--quiet);font-weight:600;font-size:13px;border-bottom:1px solid #cbd2d9}
th:first-child{white-space:nowrap}
th,td{padding:5px 14px 5px 0;vertical-align:top}
td{border-bottom:1px solid var(--line)}
tbody tr:last-child td{border-bottom:0}
th:last-child,td:last-child{padding-right:0}
.number{text-align:right;white-space:nowrap}
th.number{white-space:normal}
td .code{display:block;min-width:190px}
.value{min-width:210px}
code,.code{font:12.5px/1.45 ui-monospace,SFMono-Regular,Menlo,Consolas,'Liberation Mono',monospace;overflow-wrap:anywhere}
pre{font:12.5px/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,'Liberation Mono',monospace;background:var(--page);\
border-radius:6px;padding:12px 14px;margin:0 0 10px;white-space:pre-wrap;overflow-wrap:anywhere}
details{margin:8px 0}
summary{cursor:pointer;color:var(--blue);font-size:14px}
details>:nth-child(2){margin-top:8px}
dl{display:grid;grid-template-columns:max-content 1fr;gap:4px 20px;margin:0 0 10px}
dt{color:var(--quiet)}
dd{margin:0;overflow-wrap:anywhere}
ul{margin:0 0 10px;padding-left:20px}
li{margin-bottom:4px;overflow-wrap:anywhere}
.bad-text{color:var(--red);font-weight:600}
.bar{display:inline-block;width:90px;height:8px;background:var(--line);border-radius:2px;overflow:hidden;vertical-align:1px}
.bar i{display:block;height:100%;background:var(--blue)}
.bar.far i{background:var(--orange)}
.classes{width:auto}
.classes td,.classes th{padding:4px 9px;text-align:center}
.classes td:first-child,.classes th:first-child{text-align:left;padding-left:0;font-weight:600}
.chip{display:inline-block;width:16px;height:16px;border-radius:50%;border:2px solid var(--blue);vertical-align:middle}
.chip.alone{background:var(--blue)}
.chip.combination{background:linear-gradient(90deg,var(--blue) 50%,#fff 50%)}
.chip.none{border-color:#b0b6bd}
.key span{margin-right:18px;white-space:nowrap}
.key .chip{margin-right:6px}
footer{color:var(--quiet);font-size:13px;padding-bottom:28px}
@media (max-width:600px){section,.verdict{padding:14px}dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:8px}}
@media (prefers-color-scheme:dark){:root{--page:#1b2127}header h1{color:#eef1f4}header p,footer{color:#a3adb8}\
pre{background:#f3f5f7}}
@media print{:root{--page:#fff}body{font-size:11pt;background:#fff}header h1{color:#1f2933}\
header,main,footer{max-width:none;padding:0}section,.verdict{break-inside:auto;border-radius:0}\
figure,tr,.tiles{break-inside:avoid}h2{break-after:avoid}.sheet{overflow:visible}.sheet svg{min-width:0}\
*{print-color-adjust:exact;-webkit-print-color-adjust:exact}details::details-content{content-visibility:visible;\
display:block}\
table{font-size:8.5pt}th,td{padding-right:9px}td .code{min-width:0}}
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_self_contained_and_escapes_what_it_is_given() {
        let page = page(
            "a <b> & c",
            "<i>",
            (Tone::Bad, "\"<script>\""),
            &[Section::new("<s>", html! { p { "<u>" } })],
        );
        for raw in [
            "<b>", "<i>", "<script", "<s>", "<u>", "http:", "https:", "@import", "url(",
        ] {
            assert!(!page.contains(raw), "{raw}");
        }
        assert!(page.starts_with("<!DOCTYPE html>") && page.contains("verdict bad"));
    }
}
