// The colours of curves are Okabe and Ito's, told apart by all common kinds of colour vision; lighter ones on dark.
#include "tools/report_page.h"

namespace wasp::tools {

const char* report_style() {
  return R"(
:root{color-scheme:light dark;--back:#fbfbfa;--card:#fff;--ink:#1b1f24;--soft:#5a6470;--line:#dfe3e8;--span:#eef2f6;
--good:#00664a;--bad:#b3340a;--warn:#7a4b00;--warnback:#fff3d6;
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#aa3f86;--c4:#c98a00;--c5:#3f9bd6}
@media(prefers-color-scheme:dark){:root{--back:#14171a;--card:#1c2024;--ink:#e8eaed;--soft:#a3adb8;--line:#343b43;
--span:#242a31;--good:#4fd6a5;--bad:#ff8f66;--warn:#ffd27a;--warnback:#3a2d10;
--c0:#58aee8;--c1:#ff9350;--c2:#38cf9f;--c3:#ea9bd0;--c4:#f2bc3f;--c5:#9bd4f7}}
*{box-sizing:border-box}
body{margin:0;background:var(--back);color:var(--ink);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:1180px;margin:0 auto;padding:24px 16px 48px}
h1{font-size:1.7rem;line-height:1.2;margin:0 0 4px}h2{font-size:1.15rem;margin:34px 0 10px}
h3{font-size:.95rem;margin:0 0 2px}
p{margin:6px 0}.soft{color:var(--soft)}.small{font-size:.86rem}
.outcome{font-size:1.15rem;font-weight:600;margin:10px 0}.good{color:var(--good)}.bad{color:var(--bad)}
.banner{background:var(--warnback);color:var(--warn);border-radius:8px;padding:8px 14px;margin:12px 0;font-weight:600}
.card{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:14px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.9rem;font-variant-numeric:tabular-nums}
th{font-weight:600;text-align:left;color:var(--soft);white-space:nowrap}
td,th{padding:5px 10px;border-bottom:1px solid var(--line)}
tr:last-child td{border-bottom:0}td.n,th.n{text-align:right;white-space:nowrap}
td.state{white-space:nowrap;font-weight:600}td.state.soft{font-weight:400}
dl{display:grid;grid-template-columns:max-content 1fr;gap:3px 16px;margin:0;font-size:.92rem}dt{color:var(--soft)}
dd{margin:0;overflow-wrap:anywhere}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(440px,100%),1fr));gap:16px}
svg{display:block;width:100%;height:auto}.wide svg{min-width:760px}.pair svg{min-width:400px}
svg text{font:11.5px system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;fill:var(--ink)}
svg .mid{text-anchor:middle}svg .end{text-anchor:end}svg .faint,svg .name{fill:var(--soft)}
.grid{stroke:var(--line);stroke-width:1;fill:none}.axis{stroke:var(--soft);stroke-width:1;fill:none}
svg .halo{paint-order:stroke;stroke:var(--card);stroke-width:3;stroke-opacity:.85}
.span0{fill:var(--span)}.span1{fill:transparent}
.line{fill:none;stroke-linejoin:round}.thin{stroke-width:1.2}.medium{stroke-width:1.6}.thick{stroke-width:2.2}
.dots{stroke-width:3.4;stroke-linecap:round}
.soft.line{stroke-opacity:.6}.dashed{stroke-dasharray:7 4}
.c0{stroke:var(--c0)}.c1{stroke:var(--c1)}.c2{stroke:var(--c2)}.c3{stroke:var(--c3)}.c4{stroke:var(--c4)}
.c5{stroke:var(--c5)}.ink{stroke:var(--ink)}
.mark{fill:var(--card);stroke:var(--ink);stroke-width:2}.bar{fill:var(--c0)}
.quantile{stroke:var(--ink);stroke-width:1;stroke-dasharray:2 2;fill:none}
.budget{stroke:var(--c1);stroke-width:2.2;fill:none}svg .budget-text{fill:var(--c1);font-weight:600}
ul{margin:6px 0;padding-left:20px}code{font-size:.86em;overflow-wrap:anywhere}
@media print{body{background:#fff}.card{break-inside:avoid}}
)";
}

}  // namespace wasp::tools
