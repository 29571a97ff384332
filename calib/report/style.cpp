#include "calib/report/style.hpp"

namespace afterglow::calib {

const char* const kReportStyle = R"(
:root { --ink: #1c2128; --soft: #59636e; --rule: #d5dbe1; --faint: #f4f6f8; --printed: #0077c8;
  --projected: #e07a00; --outlier: #d1002f; --line: #0b5fa5; }
* { box-sizing: border-box; }
html { background: #fff; color: var(--ink); -webkit-print-color-adjust: exact;
  print-color-adjust: exact;
  font: 15px/1.5 system-ui, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif; }
body { margin: 0; }
main { max-width: 1120px; margin: 0 auto; padding: 40px 32px 64px; }
h1 { font-size: 26px; line-height: 1.2; margin: 0; font-weight: 650; letter-spacing: -0.01em; }
h2 { font-size: 19px; margin: 52px 0 6px; font-weight: 650; padding-top: 14px;
  border-top: 2px solid var(--ink); break-after: avoid; }
h3 { font-size: 15px; margin: 0; font-weight: 650; }
p { margin: 6px 0 12px; max-width: 78ch; }
.under { color: var(--soft); margin: 4px 0 28px; }
.soft, figcaption, .legend, th { color: var(--soft); }
.headline { display: grid; grid-template-columns: auto 1fr; gap: 12px 48px; align-items: center;
  padding: 28px 32px; background: var(--faint); border-radius: 6px; }
.big { font-size: 64px; line-height: 1; font-weight: 700; letter-spacing: -0.03em;
  white-space: nowrap; }
.big small { font-size: 30px; font-weight: 600; letter-spacing: 0; }
.second { font-size: 22px; margin-top: 8px; font-weight: 600; }
.label { font-size: 13px; color: var(--soft); margin-bottom: 8px; }
.headline p:last-child { margin-bottom: 0; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 16px 24px;
  margin: 20px 0 0; }
.facts div { border-top: 1px solid var(--rule); padding-top: 8px; }
.facts dt { font-size: 13px; color: var(--soft); }
.facts dd { margin: 0; font-size: 18px; font-weight: 600; }
.facts dd small { font-size: 13px; font-weight: 400; color: var(--soft); }
.note { border-left: 4px solid #d97706; background: #fff7e8; padding: 12px 18px; margin: 20px 0 0;
  border-radius: 0 6px 6px 0; break-inside: avoid; }
.note.bad { border-color: var(--outlier); background: #fdf0f2; }
.note ul { margin: 4px 0 0; padding-left: 20px; }
.note li { margin: 2px 0; }
table { border-collapse: collapse; width: 100%; margin: 12px 0; font-variant-numeric: tabular-nums;
  font-size: 14px; }
th { text-align: left; font-weight: 500; font-size: 13px; vertical-align: bottom;
  border-bottom: 1px solid var(--ink); padding: 4px 12px 4px 0; line-height: 1.3; }
td { padding: 5px 12px 5px 0; border-bottom: 1px solid var(--rule); vertical-align: top; }
th.n, td.n { text-align: right; padding-right: 20px; white-space: nowrap; }
td.bar { width: 22%; vertical-align: middle; }
td.bar svg { display: block; width: 100%; height: 12px; }
tr { break-inside: avoid; }
tr.out td { color: var(--soft); }
tr.sum td:first-child { white-space: nowrap; }
tr.sum td { font-weight: 650; border-bottom: 1px solid var(--ink); }
table.parameters { table-layout: fixed; }
.parameters th:nth-child(1) { width: 14%; } .parameters th:nth-child(2) { width: 18%; }
.parameters th:nth-child(3) { width: 22%; }
table.narrow { width: auto; min-width: 60%; } .narrow td:first-child { color: var(--soft); }
a { color: inherit; text-decoration-color: var(--rule); text-underline-offset: 3px; }
figure { margin: 0; break-inside: avoid; }
figure svg { display: block; width: 100%; height: auto; border: 1px solid var(--rule);
  background: #fff; }
figcaption { font-size: 13px; line-height: 1.4; margin: 6px 0 0; }
figure h3 .right { float: right; font-size: 13px; font-weight: 400; line-height: 22px; }
figure h3 + p { margin: 0 0 6px; font-size: 13px; color: var(--soft); }
.two, .three { display: grid; grid-template-columns: 1fr 1fr; gap: 28px 28px; margin: 16px 0; }
.views { align-items: end; }
.three { grid-template-columns: 1fr 1fr 1fr; gap: 20px; }
.legend { display: flex; flex-wrap: wrap; align-items: center; gap: 6px 22px; font-size: 13px;
  margin: 10px 0; }
.legend span { display: inline-flex; align-items: center; gap: 7px; }
.legend i { display: inline-block; width: 22px; height: 13px; border: 1px solid #0002; }
.legend i.line { height: 3px; border: 0; }
.scale { display: flex; max-width: 700px; margin: 10px 0 6px; font-size: 12px;
  color: var(--soft); font-variant-numeric: tabular-nums; }
.scale div { flex: 1; position: relative; padding-top: 18px; }
.scale i { display: block; height: 14px; }
.scale b { position: absolute; top: 0; right: 0; transform: translateX(50%); font-weight: 400; }
.pill { display: inline-block; padding: 0 8px; border-radius: 9px; font-size: 12px;
  background: #fdf0f2; color: var(--outlier); font-weight: 600; }
.printed { stroke: #00c2ff; } .projected { stroke: #ffb000; } .wrong { stroke: #ff2457; }
.halo { stroke: #000; stroke-opacity: 0.55; }
path, line, circle, polyline { vector-effect: non-scaling-stroke; fill: none;
  stroke-linecap: round; }
text { font-family: inherit; font-variant-numeric: tabular-nums; }
@media screen and (max-width: 800px) { .two, .three, .headline { grid-template-columns: 1fr; } }
@page { size: A4; margin: 14mm 12mm; }
@media print { html { font-size: 11px; } main { padding: 0; max-width: none; }
  h2 { margin-top: 28px; } .three, .scale, .legend { break-inside: avoid; }
  .scale { break-before: avoid; } .big { font-size: 48px; } .two, .three { gap: 14px; }
  table, figcaption, .legend { font-size: 10px; } th { font-size: 10px; } }
)";

}  // namespace afterglow::calib
