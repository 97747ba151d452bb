// SPDX-License-Identifier: GPL-3.0-or-later
// The style sheet of the report page. It is inlined into the page, which loads nothing but its images.
#pragma once

namespace brdfc::report {

inline constexpr const char* kPageStyle = R"css(
:root { color-scheme: light dark;
  --back: #fbfbfa; --card: #ffffff; --ink: #1d1f21; --soft: #62676d; --line: #dfe1e4; --accent: #2a6f97; --warn: #a63d1f; }
@media (prefers-color-scheme: dark) { :root {
  --back: #16181a; --card: #1f2225; --ink: #e8e9ea; --soft: #a0a6ad; --line: #33383d; --accent: #7fb8d8; --warn: #f08a66; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.5rem 4rem; max-width: 78rem; background: var(--back); color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.25rem; margin: 3rem 0 .2rem; }
p { max-width: 48rem; margin: .4rem 0; }
.verdict { font-size: 1.15rem; max-width: 60rem; }
.soft { color: var(--soft); }
a { color: var(--accent); }
.wide { overflow-x: auto; margin: 1.2rem 0; }
table { border-collapse: collapse; width: 100%; background: var(--card); font-size: .92rem; }
th, td { padding: .4rem .6rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap;
  font-variant-numeric: tabular-nums; }
th { color: var(--soft); font-weight: 600; vertical-align: bottom; }
th.left, td.left { text-align: left; }
table.summary { table-layout: fixed; margin: 1.2rem 0; }
table.summary td, table.summary th { white-space: normal; overflow-wrap: anywhere; line-height: 1.3; }
table.summary td { vertical-align: top; }
summary { cursor: pointer; color: var(--accent); margin: .8rem 0; }
.wide th, .wide td { padding: .35rem .45rem; }
#overview { display: block; width: 100%; margin: 1rem 0; }
#overview circle:hover { stroke: var(--ink); stroke-width: 2; }
td.bad { color: var(--warn); font-weight: 600; }
tr.native td { color: var(--soft); }
tr.native td.bad { color: var(--warn); }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1rem; margin: 1rem 0; }
figure { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 6px; overflow: hidden; }
figure img { display: block; width: 100%; height: auto; }
figcaption { padding: .5rem .7rem .6rem; font-size: .86rem; color: var(--soft); }
figcaption b { color: var(--ink); font-size: .95rem; }
.flip { position: relative; display: block; }
.flip .under { position: absolute; inset: 0; opacity: 0; }
.flip:hover .under, .flip:focus .under { opacity: 1; }
.scale { display: flex; align-items: center; gap: .6rem; font-size: .86rem; color: var(--soft); }
.scale span.bar { width: 16rem; max-width: 40vw; height: .8rem; border-radius: 3px; border: 1px solid var(--line); }
svg { background: var(--card); border: 1px solid var(--line); border-radius: 6px; max-width: 100%; height: auto; }
svg text { font-size: 12px; fill: var(--soft); }
svg .name { fill: var(--ink); }
svg .axis { stroke: var(--line); }
svg .floor { stroke: var(--soft); stroke-dasharray: 4 4; }
svg circle { fill: var(--accent); }
svg circle.behind { fill: var(--card); stroke: var(--accent); }
dt { font-weight: 600; margin-top: .7rem; }
dd { margin: 0; max-width: 48rem; color: var(--soft); }
pre { background: var(--card); border: 1px solid var(--line); border-radius: 6px; padding: .8rem; overflow-x: auto;
  font-size: .84rem; }
code, .mono { font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; font-size: .9em; }
td.mono { white-space: normal; overflow-wrap: anywhere; }
)css";

}  // namespace brdfc::report
