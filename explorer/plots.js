// SPDX-License-Identifier: GPL-3.0-or-later
// Curves as SVG. Each curve is {label, color, points: [[degrees, value], ...]}.
"use strict";

const SVG = "http://www.w3.org/2000/svg";
/** Decades that a logarithmic scale shows. */
const DECADES = 4;

function element(name, attributes, text) {
  const e = document.createElementNS(SVG, name);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
  if (text !== undefined) e.textContent = text;
  return e;
}

/** A round number from the value up: 1, 2 or 5 times a power of ten. */
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((m) => m * power).find((x) => x >= value * (1 - 1e-3));
}

function shortNumber(x) {
  if (x === 0) return "0";
  const a = Math.abs(x);
  return a >= 1e4 || a < 1e-3 ? x.toExponential(0).replace("e+", "e") : String(Number(x.toPrecision(3)));
}

/** The scale of values for curves: {at: value -> [0, 1], marks: values, top}. */
function scaleOf(curves, logarithmic) {
  let top = 0;
  for (const c of curves) for (const [, y] of c.points) if (Number.isFinite(y)) top = Math.max(top, y);
  if (!(top > 0)) top = 1;
  if (logarithmic) {
    const end = Math.ceil(Math.log10(top) - 1e-9);
    const marks = Array.from({ length: DECADES }, (_, i) => 10 ** (end - i));
    return { at: (y) => (y > 0 ? Math.max(0, 1 + (Math.log10(y) - end) / DECADES) : 0), marks, top: 10 ** end };
  }
  // Values that exceed a mark by rounding alone do not need another.
  const step = roundUp(top / 4), count = Math.ceil(top / step - 1e-3), end = count * step;
  return { at: (y) => Math.max(0, y) / end, marks: Array.from({ length: count }, (_, i) => (i + 1) * step), top: end };
}

function pathOf(points) {
  let out = "";
  let down = false;
  for (const [x, y] of points) {
    if (!Number.isFinite(x + y)) {
      down = false;
      continue;
    }
    out += `${down ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`;
    down = true;
  }
  return out;
}

/** A polar plot: 0 degrees is up, positive angles are right. `marks`: arrows {angle, into, label}. */
function drawPolar(svg, curves, { logarithmic, full, marks }) {
  const width = 640, height = full ? 560 : 360, radius = full ? 240 : 285;
  const cx = width / 2, cy = full ? height / 2 : height - 30;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren();
  const scale = scaleOf(curves, logarithmic);
  const place = (degrees, r) => {
    const a = (degrees * Math.PI) / 180;
    return [cx + radius * r * Math.sin(a), cy - radius * r * Math.cos(a)];
  };
  for (const mark of scale.marks) {
    const r = radius * scale.at(mark);
    if (r < 1) continue;
    const arc = full
      ? `M${cx - r} ${cy}A${r} ${r} 0 1 1 ${cx + r} ${cy}A${r} ${r} 0 1 1 ${cx - r} ${cy}`
      : `M${cx - r} ${cy}A${r} ${r} 0 0 1 ${cx + r} ${cy}`;
    svg.append(element("path", { d: arc, class: "grid" }));
    svg.append(element("text", { x: cx + r, y: cy + 16, "text-anchor": "middle" }, shortNumber(mark)));
  }
  for (let angle = full ? -150 : -60; angle <= (full ? 180 : 60); angle += 30) {
    const [x, y] = place(angle, 1);
    svg.append(element("line", { x1: cx, y1: cy, x2: x, y2: y, class: "grid" }));
    const [tx, ty] = place(angle, 1.06);
    svg.append(element("text", { x: tx, y: ty + 4, "text-anchor": "middle" }, `${Math.abs(angle)}°`));
  }
  svg.append(element("line", { x1: cx - radius, y1: cy, x2: cx + radius, y2: cy, class: "axis" }));
  for (const mark of marks) {
    const [x, y] = place(mark.angle, 1);
    if (mark.into) {
      const [tipX, tipY] = place(mark.angle, 0.04);
      svg.append(element("line", { x1: x, y1: y, x2: tipX, y2: tipY, class: "axis", "stroke-width": 1.5 }));
      const a = (mark.angle * Math.PI) / 180;
      const side = (s) => [tipX + 12 * Math.sin(a + s), tipY - 12 * Math.cos(a + s)];
      svg.append(element("path", { d: pathOf([side(0.35), [tipX, tipY], side(-0.35)]), class: "axis", "stroke-width": 1.5 }));
    } else {
      svg.append(element("line", { x1: cx, y1: cy, x2: x, y2: y, class: "limit" }));
    }
    const [tx, ty] = place(mark.angle, 0.9);
    const left = mark.angle < 0;
    svg.append(element("text", { x: tx + (left ? 8 : -8), y: ty - 6, "text-anchor": left ? "start" : "end" }, mark.label));
  }
  for (const c of curves) {
    const points = c.points.map(([angle, y]) => place(angle, scale.at(y)));
    const closed = pathOf([[cx, cy], ...points, [cx, cy]]);
    svg.append(element("path", { d: closed, class: "area", style: `fill: ${c.color}` }));
    svg.append(element("path", { d: pathOf(points), class: "curve", style: `stroke: ${c.color}` }));
  }
}

/** A graph over degrees from `first` to `last`. `limit`: a value with a dashed line. */
function drawGraph(svg, curves, { logarithmic, first, last, limit, label, height = 360, marks = [] }) {
  const width = 640, left = 52, right = 12, top = 14, bottom = 38;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren();
  const scale = scaleOf(limit ? [...curves, { points: [[0, limit]] }] : curves, logarithmic);
  const x = (degrees) => left + ((degrees - first) / (last - first)) * (width - left - right);
  const y = (value) => height - bottom - scale.at(value) * (height - top - bottom);
  for (const mark of [...(logarithmic ? [] : [0]), ...scale.marks]) {
    svg.append(element("line", { x1: left, x2: width - right, y1: y(mark), y2: y(mark), class: "grid" }));
    svg.append(element("text", { x: left - 6, y: y(mark) + 4, "text-anchor": "end" }, shortNumber(mark)));
  }
  for (let angle = first; angle <= last; angle += (last - first) / 6) {
    svg.append(element("line", { x1: x(angle), x2: x(angle), y1: top, y2: height - bottom, class: "grid" }));
    svg.append(element("text", { x: x(angle), y: height - bottom + 16, "text-anchor": "middle" }, `${angle}°`));
  }
  svg.append(element("text", { x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, label));
  if (limit)
    svg.append(element("line", { x1: left, x2: width - right, y1: y(limit), y2: y(limit), class: "limit" }));
  for (const mark of marks)
    svg.append(element("line", { x1: x(mark.angle), x2: x(mark.angle), y1: top, y2: height - bottom, class: "limit" }));
  for (const c of curves) {
    const points = c.points.map(([angle, value]) => [x(angle), y(value)]);
    svg.append(element("path", { d: pathOf(points), class: "curve", style: `stroke: ${c.color}` }));
  }
}
