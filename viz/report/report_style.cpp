// SPDX-License-Identifier: BSD-3-Clause
#include "report_html.hpp"

namespace plumbline::report {

const char* report_style() {
  return R"css(:root{--ground:#fff;--ink:#1b2027;--muted:#5d6673;--rule:#d8dde4;--soft:#f5f7f9;--accent:#0072b2;
--good:#12703f;--good-soft:#e6f5ec;--warn:#8a5300;--warn-soft:#fff4e0;--bad:#b42318;--bad-soft:#fdeceb}
@media screen and (prefers-color-scheme:dark){:root{--ground:#14171b;--ink:#e7eaee;--muted:#9aa4b1;--rule:#333a43;
--soft:#1c2127;--accent:#67b7e6;--good:#6fd19c;--good-soft:#15291e;--warn:#f2be6b;--warn-soft:#2d2413;--bad:#ff8f85;
--bad-soft:#331a18}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,
"Helvetica Neue",Arial,"Noto Sans","DejaVu Sans",sans-serif}
main{max-width:1080px;margin:0 auto;padding:2em 1.2em 3em}
h1{font-size:2em;line-height:1.15;margin:.1em 0 .6em;overflow-wrap:anywhere}
h2{font-size:1.3em;margin:0 0 .5em;padding-top:.6em;border-top:2px solid var(--rule)}
h3{font-size:1.02em;margin:1.4em 0 .3em}
section{margin-top:2.2em}
p{margin:.5em 0;max-width:75em}
.kicker{color:var(--muted);margin:0;letter-spacing:.08em;text-transform:uppercase;font-size:.8em}
.note,figcaption{color:var(--muted);font-size:.88em}
.verdict{padding:.8em 1.1em;border-radius:8px;border-left:6px solid;margin:0 0 1.2em;overflow-wrap:anywhere}
.verdict b{font-size:1.1em}
.good{color:var(--good);background:var(--good-soft);border-color:var(--good)}
.warn{color:var(--warn);background:var(--warn-soft);border-color:var(--warn)}
.bad{color:var(--bad);background:var(--bad-soft);border-color:var(--bad)}
.verdict p{color:var(--ink);margin:.25em 0 0}
.tiles{display:flex;flex-wrap:wrap;gap:.6em;margin:1em 0}
.tiles div{flex:1 1 auto;white-space:nowrap;background:var(--soft);border:1px solid var(--rule);border-radius:8px;padding:.6em .85em}
.tiles b{display:block;font-size:1.35em;line-height:1.25;font-variant-numeric:tabular-nums}
.tiles span{color:var(--muted);font-size:.85em;white-space:normal}
nav{display:flex;flex-wrap:wrap;gap:.2em 1.1em;margin:1.6em 0 0;font-size:.92em}
a{color:var(--accent);text-decoration:none}
a:hover{text-decoration:underline}
.scroll{overflow-x:auto;margin:.5em 0 .9em}
table{border-collapse:collapse;font-size:.9em;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:.28em .8em .28em 0;border-bottom:1px solid var(--rule);vertical-align:top}
thead th{color:var(--muted);font-weight:600;vertical-align:bottom}
.n{text-align:right;white-space:nowrap}
td{overflow-wrap:anywhere}
tr.yes td:nth-child(2){color:var(--good);font-weight:600}
tr.no td:first-child{color:var(--muted)}
tr.bad td{background:none}tr.bad td:nth-child(2){color:var(--bad);font-weight:600}
.facts th{color:var(--muted);font-weight:400;padding-right:1.6em;white-space:nowrap}
figure{margin:0}
figure>img{display:block;max-width:100%;height:auto}
.plan{margin:1.2em 0}.plan img{width:100%;background:#fff;border:1px solid var(--rule);border-radius:6px}
.half{display:inline-block;vertical-align:top;margin-right:3em}.half h3{margin-top:.4em}
.logo{float:right;max-width:180px;max-height:70px}
.made>summary{font-size:1.3em;font-weight:600;padding:.6em 0;border-top:2px solid var(--rule);margin-top:1.6em}
.plans figure{margin:0 0 1.2em}
.plans img{margin:0 auto;background:#fff;border:1px solid var(--rule);border-radius:6px}
.pictures{display:grid;grid-template-columns:repeat(2,1fr);gap:1em}
.pictures figure:first-child,.pictures.even figure:nth-child(2){grid-column:1/-1}
.pictures img{width:100%;height:auto;display:block;border:1px solid var(--rule);border-radius:6px;background:#fff}
details{margin:.6em 0}
summary{cursor:pointer;color:var(--accent)}
pre{background:var(--soft);border:1px solid var(--rule);border-radius:6px;padding:.8em 1em;overflow-x:auto;
font:12.5px/1.45 ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace}
footer{margin-top:3em;color:var(--muted);font-size:.85em;border-top:1px solid var(--rule);padding-top:.8em}
@media(max-width:640px){.facts th{white-space:normal}.pictures{grid-template-columns:1fr}main{padding:1.2em .8em}}
@page{margin:14mm}
@media print{.screen,section:has(>.pv):not(:has(>.pv-paper)){display:none}.plans img{max-height:225mm}.plan img{max-height:105mm;object-fit:contain;border:0}
.plan{margin:.6em 0}.half table{font-size:.78em}.half{margin-right:2em}.half h3{margin:.2em 0}
header{break-after:page}
body{font-size:10.5pt}main{max-width:none;padding:0}nav{display:none}section{margin-top:1.4em}
*{-webkit-print-color-adjust:exact;print-color-adjust:exact}h2,h3{break-after:avoid}
figure,tr,.tiles,.verdict{break-inside:avoid}thead{display:table-header-group}.scroll{overflow:visible}
pre{white-space:pre-wrap;overflow-wrap:anywhere}.pictures figure:first-child img{max-height:150mm;width:auto;margin:auto}details>summary{color:inherit}}
)css";
}

}  // namespace plumbline::report
