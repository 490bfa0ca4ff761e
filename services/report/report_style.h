// The style sheet of the report pages: one column of cards, readable at 1280 px and on A4, portrait or
// landscape.
#pragma once

#include <string_view>

namespace forgescan {

inline constexpr std::string_view kReportStyle = R"css(
:root{--ink:#1f2933;--soft:#5b6774;--line:#dfe4ea;--paper:#fff;--ground:#f3f5f7;
--ok:#1b7f4d;--not-ok:#b8281d;--not-decidable:#b56a00;--not-inspected:#5d6773}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.45 "Segoe UI","Helvetica Neue",Arial,"DejaVu Sans",sans-serif;
-webkit-print-color-adjust:exact;print-color-adjust:exact}
main{max-width:1200px;margin:0 auto;padding:28px 24px 40px}
header{display:flex;justify-content:space-between;align-items:flex-start;gap:32px;margin-bottom:20px}
.over{color:var(--soft);letter-spacing:.08em;text-transform:uppercase;font-size:12px}
h1{font-size:34px;line-height:1.15;margin:2px 0 4px;font-weight:650}
h2{font-size:17px;margin:0 0 12px;font-weight:650}
.sub{color:var(--soft)}
.verdict{text-align:right;max-width:52%}
.badge{display:inline-block;color:#fff;font-weight:700;font-size:24px;padding:10px 24px;border-radius:8px;white-space:nowrap}
.chip{display:inline-block;color:#fff;font-weight:600;font-size:12px;padding:2px 9px;border-radius:10px;white-space:nowrap}
.badge.ok,.chip.ok{background:var(--ok)}.badge.not-ok,.chip.not-ok{background:var(--not-ok)}
.badge.not-decidable,.chip.not-decidable{background:var(--not-decidable)}
.badge.not-inspected,.chip.not-inspected{background:var(--not-inspected)}
.verdict p{margin:8px 0 0}
section{background:var(--paper);border:1px solid var(--line);border-radius:10px;padding:18px 20px;margin-bottom:16px}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:14px 24px}
.tiles div span{display:block;color:var(--soft);font-size:12.5px}
.tiles div b{font-size:18px;font-weight:600;font-variant-numeric:tabular-nums}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th{font-size:12.5px;color:var(--soft);font-weight:600;text-align:right;vertical-align:bottom;padding:4px 8px;border-bottom:2px solid var(--line)}
td{text-align:right;padding:6px 8px;border-bottom:1px solid var(--line);white-space:nowrap}
tr:last-child td{border-bottom:0}
th.t,td.t{text-align:left;white-space:normal}
td.c,th.c{text-align:center}
tr.remarked td{border-bottom:0}tr.remark td{color:var(--soft);font-size:13px;padding-top:0}
td.strong{font-weight:650}td.w{min-width:78px}
td small{display:block;color:var(--soft);white-space:normal;text-align:left}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:16px}.pair section{margin-bottom:16px}
.picture{width:100%;height:auto;display:block}
.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(330px,1fr));gap:18px 24px}
figure{margin:0}figcaption{font-weight:600;margin-bottom:4px}figcaption small{display:block;color:var(--soft);font-weight:400}
svg.bar{width:150px;height:26px;display:inline-block;vertical-align:middle}svg.chart{width:100%;height:auto;display:block}
svg text{font-size:11px;fill:#5b6774}
.outside{fill:#f3d5d1}.guard{fill:#f6e3bf}.inside{fill:#cfe8d9}.chart .inside{fill:#eff7f2}
.limit{stroke:#8a2b22;stroke-width:1.2}.nominal{stroke:#8d98a5;stroke-width:1;stroke-dasharray:4 4}.axis{stroke:#8d98a5}
.whisker{stroke:#1f2933;stroke-width:1.6}.trend{stroke:#2b5fa8;stroke-width:2}
.m.ok{fill:var(--ok)}.m.not-ok{fill:var(--not-ok)}.m.not-decidable{fill:var(--not-decidable)}
.m.not-inspected{fill:var(--not-inspected)}.m.none{stroke:var(--not-inspected);stroke-width:1.6;fill:none}
.ring{fill:none;stroke:#1f2933;stroke-width:1.4}
.none{color:var(--soft)}
footer{color:var(--soft);font-size:12.5px}footer p{margin:6px 0}
a{color:#2b5fa8}
@media(max-width:760px){.pair{grid-template-columns:1fr}}
@page{size:A4;margin:11mm}
@media print{.pair{grid-template-columns:1fr 1fr;gap:9px}body{background:#fff;font-size:11px}main{max-width:none;padding:0}section{padding:10px 12px;margin-bottom:9px}
section,figure,tr{break-inside:avoid}h1{font-size:26px}h2{font-size:14px;margin-bottom:8px;break-after:avoid}header{margin-bottom:12px}
.badge{font-size:19px;padding:7px 18px}th,td{padding:3px 4px;font-size:10px}th{font-size:9.5px}tr.remark td{font-size:10px}td.w{white-space:normal}svg.bar{width:84px;height:15px}
.chip{font-size:9.5px;padding:1px 7px}td small{font-size:9.5px}.sub{white-space:nowrap}
.tiles{grid-template-columns:repeat(auto-fit,minmax(94px,1fr));gap:8px 12px}.tiles div b{font-size:14px}.tiles div span{font-size:10px}
.charts{grid-template-columns:repeat(auto-fill,minmax(215px,1fr));gap:10px 14px}footer{font-size:10px}}
)css";

}  // namespace forgescan
