//! Look of the report, on a screen and on A4.

/// Style sheet without external resources.
pub(super) const CSS: &str = "\
@page { size: A4; margin: 14mm 14mm 17mm; @bottom-right { content: \"page \" counter(page) \" of \" counter(pages); } }
@page { @bottom-left { font: 7.5pt system-ui, sans-serif; color: #555; } @bottom-right { font: 7.5pt system-ui, sans-serif; color: #555; } }
* { box-sizing: border-box; }
html { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
body { margin: 0; background: #fff; color: #1d2129; font: 10pt/1.4 system-ui, 'Helvetica Neue', Arial, sans-serif; }
main { max-width: 190mm; margin: 0 auto; padding: 8mm 4mm; }
h1 { font-size: 19pt; line-height: 1.15; margin: 0 0 4mm; letter-spacing: -.01em; }
h2 { font-size: 12.5pt; margin: 8mm 0 2.5mm; padding-bottom: 1mm; border-bottom: .4mm solid #1d2129; break-after: avoid; }
h3 { font-size: 10.5pt; margin: 5mm 0 1.5mm; break-after: avoid; }
p { margin: 0 0 2mm; }
.small { font-size: 8pt; color: #4a5160; }
table { border-collapse: collapse; width: 100%; font-size: 8.5pt; line-height: 1.3; }
table + table { margin-top: 4mm; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
th { text-align: left; font-weight: 600; color: #4a5160; border-bottom: .3mm solid #1d2129; padding: 1mm 1.4mm; vertical-align: bottom; }
td { border-bottom: .15mm solid #c9ced8; padding: 1mm 1.4mm; vertical-align: top; overflow-wrap: break-word; }
.num, .files { table-layout: fixed; } .num td, .files td { overflow-wrap: anywhere; }
.rel td:nth-child(-n+3), .cal td:nth-child(2) { white-space: nowrap; }
.files th:nth-child(1) { width: 34mm; } .files th:nth-child(n+3) { width: 24mm; }
code { font: 8pt ui-monospace, monospace; }
.facts { columns: 2; column-gap: 8mm; margin: 0 0 4mm; }
.facts div { display: flex; gap: 2mm; break-inside: avoid; padding: .6mm 0; border-bottom: .15mm solid #c9ced8; }
.facts dt { flex: 0 0 26mm; color: #4a5160; } .facts dd { margin: 0; overflow-wrap: anywhere; font-weight: 600; }
.verdict { display: flex; gap: 5mm; align-items: center; padding: 4mm 5mm; border: .5mm solid #1d2129; border-left-width: 3mm; border-radius: 1mm; break-inside: avoid; }
.verdict b { font-size: 17pt; white-space: nowrap; } .verdict p { margin: 0; }
.verdict.pass { border-color: #00735a; background: #e7f4f0; } .verdict.fail { border-color: #b94a00; background: #fcefe6; }
.verdict.undecided { border-color: #6b5c00; background: #fdf8dc; }
.chip { display: inline-block; white-space: nowrap; font-weight: 700; padding: .3mm 1.6mm; border-radius: .8mm; }
.chip.undecided { border: .2mm dashed #1d2129; }
.why { display: block; font-size: 7.5pt; color: #1d2129; margin-top: .6mm; }
.num td:nth-child(n+3):nth-child(-n+7), .num th:nth-child(n+3):nth-child(-n+7) { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.num th:nth-child(1) { width: 9mm; } .num th:nth-child(3) { width: 19mm; } .num th:nth-child(4), .num th:nth-child(5) { width: 14.5mm; }
.num th:nth-child(6) { width: 17mm; } .num th:nth-child(7) { width: 13mm; } .num th:nth-child(8) { width: 30mm; } .num th:nth-child(9) { width: 33mm; }
.num svg { width: 28mm; }
.unit { color: #4a5160; }
figure { margin: 3mm 0; break-inside: avoid; } figcaption { font-size: 8pt; color: #4a5160; margin-top: 1mm; }
svg { display: block; max-width: 100%; height: auto; } svg text { font-family: system-ui, 'Helvetica Neue', Arial, sans-serif; }
.part { max-height: 112mm; margin: 0 auto; border: .2mm solid #c9ced8; border-radius: 1mm; }
.feature { break-inside: avoid; } .plots { display: grid; grid-template-columns: 1fr 1fr; gap: 2mm 5mm; }
.plots figure { margin: 1mm 0; }
.formula { font-family: 'STIX Two Text', Cambria, Georgia, serif; font-size: 10.5pt; margin: 1mm 0 2mm 6mm; }
.glossary { break-inside: avoid; } .glossary dt { font-weight: 600; float: left; clear: left; width: 24mm; } .glossary dd { margin: 0 0 1mm 26mm; }
.two { columns: 2; column-gap: 8mm; }
ul { margin: 0 0 2mm; padding-left: 5mm; } li { margin: 0 0 1mm; }
@media print { main { max-width: none; padding: 0; } body { font-size: 9.5pt; } }
@media screen and (max-width: 700px) { .facts, .two { columns: 1; } .plots { grid-template-columns: 1fr; } .scroll { overflow-x: auto; } }
";
