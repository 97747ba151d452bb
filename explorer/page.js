// SPDX-License-Identifier: GPL-3.0-or-later
// The page: controls, state in the address, and what is drawn when.
"use strict";

const MOST_MODELS = 4;
const CHANNELS = ["red", "green", "blue"];
/** Angles of the albedo's curve. */
const ALBEDO_ANGLES = 46;
/** Milliseconds that a frame may take before pictures shrink. */
const SLOW_FRAME = 150;
/** Parameters of a model that are shown at once; the others unfold. */
const SHOWN_PARAMETERS = 8;
const LOOKS = { matte: "Matte", glossy: "Glossy", metal: "Metal", glass: "Glass", special: "Special", measured: "Measured files" };

const byId = (id) => document.getElementById(id);
const radians = (degrees) => (degrees * Math.PI) / 180;

function make(name, attributes = {}, ...children) {
  const e = document.createElement(name);
  for (const [k, v] of Object.entries(attributes)) {
    if (k.startsWith("on")) e.addEventListener(k.slice(2), v);
    else if (v !== undefined && v !== false) e.setAttribute(k, v === true ? "" : v);
  }
  e.append(...children);
  return e;
}

// ---- Parameters ---------------------------------------------------------------------------------

function defaultsOf(model) {
  const values = {};
  for (const p of BRDFC.models[model].parameters) values[p.name] = p.default;
  return values;
}

const same = (a, b) => String(a) === String(b);
const written = (x) => String(Number(x.toPrecision(6)));

/** The parameters that differ from their defaults, as [parameter, value]. */
function changed({ model, values }) {
  return BRDFC.models[model].parameters.filter((p) => !same(values[p.name], p.default)).map((p) => [p, values[p.name]]);
}

/** The number that a text is; NaN for others, also for the empty one and for "0x20", which Number() takes. */
const numberOf = (text) => (/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text.trim()) ? Number(text) : NaN);

/** A value of text like "0.5", "0.5:0.1:0.2" or a choice; undefined if the parameter does not take it. */
function parsed(parameter, text) {
  if (parameter.kind === "choice") return parameter.choices.includes(text) ? text : undefined;
  if (parameter.kind === "number") {
    // Many people write a comma where others have a point.
    const number = numberOf(text.replace(",", "."));
    return number >= parameter.min && number <= parameter.max ? number : undefined;
  }
  const numbers = text.trim().split(/\s*[:,]\s*|\s+/).map(numberOf);
  const color = numbers.length === 1 ? [numbers[0], numbers[0], numbers[0]] : numbers;
  return color.length === 3 && color.every((x) => x >= 0 && x <= 1) ? color : undefined;
}

/** What parsed() takes, also of an option. */
function expected({ kind, choices, min, max }) {
  if (choices) return `expected ${choices.join(" or ")}`;
  return kind === "color" ? "expected a number from 0 to 1, or three as in 0.5:0.1:0.2" : `expected a number from ${min} to ${max}`;
}

/** A colour as text: one number if it is grey. */
function colorText(c, between) {
  return c[0] === c[1] && c[1] === c[2] ? written(c[0]) : c.map(written).join(between);
}

const toScale = { linear: (x) => x, log: Math.log, log1p: Math.log1p };
const fromScale = { linear: (x) => x, log: Math.exp, log1p: Math.expm1 };
/** The place of a value on a slider from 0 to 1, and the value at a place. */
function placeOf(p, value) {
  const at = toScale[p.scale], low = at(p.soft_min), high = at(p.soft_max);
  return Math.min(1, Math.max(0, (at(Math.min(p.soft_max, Math.max(p.soft_min, value))) - low) / (high - low)));
}
function valueAt(p, place) {
  if (place <= 0) return p.soft_min;
  if (place >= 1) return p.soft_max;
  const at = toScale[p.scale], low = at(p.soft_min), high = at(p.soft_max);
  return Number(fromScale[p.scale](low + place * (high - low)).toPrecision(3));
}

const toSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
const hexOf = (c) => `#${c.map((x) => Math.round(255 * toSrgb(x)).toString(16).padStart(2, "0")).join("")}`;
const colorOf = (hex) => [1, 3, 5].map((i) => Number(toLinear(parseInt(hex.slice(i, i + 2), 16) / 255).toPrecision(4)));

// ---- State --------------------------------------------------------------------------------------

const OPTIONS = {
  view: { default: "lamp", choices: ["lamp", "sky", "lobe"] },
  shape: { default: "sphere", choices: ["sphere", "knot"] },
  exposure: { default: 0, min: -4, max: 4 },
  theta: { default: 45, min: 0, max: 89 },
  azimuth: { default: 0, min: 0, max: 180 },
  turn: { default: 0, min: 0, max: 180 },
  quantity: { default: "f", choices: ["f", "cos", "pdf"] },
  plot: { default: "polar", choices: ["polar", "graph"] },
  scale: { default: "linear", choices: ["linear", "log"] },
  channel: { default: "mean", choices: ["mean", ...CHANNELS] },
};
const FIRST_MODELS = ["microfacet", "ward"];
const FIRST_LAMP = [-0.45, 0.5];
/** Whence lobes are seen: degrees around the normal, and above the surface. */
const FIRST_TURNED = [-25, 20];

/** The name of the measured file that a slot shows, if it shows one. */
const fileOf = (slot) => BRDFC.models[slot.model].file;

/**
 * Everything that a link carries, and files, which it can't. `lamp` is a place on the picture, of which lampDirection()
 * makes a direction; `turned` is whence lobes are seen.
 */
const state = { slots: [], lamp: FIRST_LAMP, turned: FIRST_TURNED };

/** The direction to the lamp: in the picture's centre it is at the viewer, 100 degrees off where the sphere ends. */
function lampDirection([x, y]) {
  const r = Math.hypot(x, y);
  if (r < 1e-6) return [0, 0, 1];
  const angle = Math.min(radians(100) * r, Math.PI);
  return [(Math.sin(angle) * x) / r, (Math.sin(angle) * y) / r, Math.cos(angle)];
}

/** A link can't carry the data of files, which are left out. */
function addressOf() {
  const parts = state.slots.filter((slot) => !fileOf(slot)).map((slot) => {
    const values = changed(slot).map(([p, v]) => `${p.name}=${p.kind === "color" ? colorText(v, ":") : v}`);
    return `m=${[slot.model, ...values].join(",")}`;
  });
  for (const [name, option] of Object.entries(OPTIONS))
    if (state[name] !== option.default) parts.push(`${name}=${state[name]}`);
  if (!same(state.lamp, FIRST_LAMP)) parts.push(`lamp=${state.lamp.map((x) => x.toFixed(3)).join(":")}`);
  if (!same(state.turned, FIRST_TURNED)) parts.push(`turned=${state.turned.join(":")}`);
  return `#${parts.join("&")}`;
}

/** The text of an address; mail programs write some of its characters as "%3A". */
function decoded(hash) {
  try {
    return decodeURIComponent(hash);
  } catch {
    return hash;
  }
}

/** What is before the first "=" and after it; undefined if there is none. */
function assignmentOf(text) {
  const at = text.indexOf("=");
  return at < 0 ? [text, undefined] : [text.slice(0, at), text.slice(at + 1)];
}

/** Reads the address; returns what in it was not understood. */
function readAddress(hash) {
  const wrong = [];
  state.slots = [];
  state.lamp = FIRST_LAMP;
  state.turned = FIRST_TURNED;
  for (const [name, option] of Object.entries(OPTIONS)) state[name] = option.default;
  for (const part of decoded(hash).replace(/^#/, "").split("&").filter(Boolean)) {
    const [name, text = ""] = assignmentOf(part);
    if (name === "m") {
      const [model, ...assignments] = text.split(",");
      if (!Object.hasOwn(BRDFC.models, model) || BRDFC.models[model].file || state.slots.length === MOST_MODELS) {
        wrong.push(part);
        continue;
      }
      const values = defaultsOf(model);
      for (const assignment of assignments) {
        const [key, value = ""] = assignmentOf(assignment);
        const p = BRDFC.models[model].parameters.find((q) => q.name === key);
        const read = p && parsed(p, value);
        if (read === undefined) wrong.push(`${model}: ${assignment}${p ? `, ${expected(p)}` : ""}`);
        else values[key] = read;
      }
      state.slots.push({ model, values });
    } else if (name === "lamp") {
      const place = text.split(":").map(numberOf);
      if (place.length === 2 && place.every((x) => Math.abs(x) <= 2)) state.lamp = place;
      else wrong.push(`${part}, expected two numbers from -2 to 2, as in 0.1:0.2`);
    } else if (name === "turned") {
      const angles = text.split(":").map(numberOf);
      if (angles.length === 2 && Math.abs(angles[0]) <= 180 && Math.abs(angles[1]) <= 90) state.turned = angles;
      else wrong.push(`${part}, expected degrees from -180 to 180 and from -90 to 90, as in -25:20`);
    } else if (Object.hasOwn(OPTIONS, name)) {
      const { choices, min, max } = OPTIONS[name];
      const value = choices ? text : numberOf(text);
      if (choices ? choices.includes(value) : value >= min && value <= max) state[name] = value;
      else wrong.push(`${part}, ${expected(OPTIONS[name])}`);
    } else wrong.push(part);
  }
  if (!state.slots.length) state.slots = FIRST_MODELS.map((model) => ({ model, values: defaultsOf(model) }));
  return wrong;
}

let writing = 0;
function writeAddress() {
  // Browsers refuse to write it more than some ten times a second.
  clearTimeout(writing);
  writing = setTimeout(() => history.replaceState(null, "", addressOf()), 200);
}

// ---- Drawing ------------------------------------------------------------------------------------

let renderer;
/** Pictures by slot: {samples, sum}, or {top} of a lobe. */
let pictures = [];
/** What is not up to date. */
const stale = new Set();
let scheduled = false, begun = false;
/** Pictures shrink on devices that take too long for a frame. */
let quality = 1, slowFrames = 0, lastFrame = 0;

const slotColor = (k) => getComputedStyle(document.documentElement).getPropertyValue(`--color-${k}`).trim();
const slotLabel = (k) => {
  const label = BRDFC.models[state.slots[k].model].label;
  const twins = state.slots.filter((s) => s.model === state.slots[k].model);
  return twins.length > 1 ? `${label} (${k + 1})` : label;
};
const channelOf = (rgba, i) => {
  const at = CHANNELS.indexOf(state.channel);
  return at >= 0 ? rgba[4 * i + at] : (rgba[4 * i] + rgba[4 * i + 1] + rgba[4 * i + 2]) / 3;
};
const formulasOf = (slot) => BRDFC.models[slot.model].formulas[choiceKey(slot.model, slot.values)];

/** The labels of models whose formulas are such, separated by commas. */
function labelsOf(are) {
  const slots = state.slots.filter((s) => are(formulasOf(s)));
  return [...new Set(slots.map((s) => BRDFC.models[s.model].label))].join(", ");
}

function fail(error) {
  byId("error").textContent = error.message || String(error);
  byId("error").hidden = false;
}

function redraw(...what) {
  for (const w of what) stale.add(w);
  if (stale.has("pictures")) pictures = state.slots.map(() => ({}));
  if (!scheduled && renderer) {
    scheduled = true;
    requestAnimationFrame(frame);
  }
}

function frame(now) {
  scheduled = false;
  try {
    if (renderer.lost) throw new Error("The graphics device was reset. Reload the page to go on.");
    // A sample of the pictures, and one of the others: the one that has waited longest, so that all follow a slider.
    // While some wait, pictures that have a sample get no more. The first picture is not kept waiting.
    const next = [...stale].find((w) => Object.hasOwn(DRAWN, w));
    const more = drawPictures(stale.delete("pictures") || !next);
    if (next && begun) {
      stale.delete(next);
      DRAWN[next]();
    }
    begun = true;
    // How many times a frame took what it may; compilation and other drawing do not count.
    const late = more && lastFrame ? (now - lastFrame) / SLOW_FRAME : 0;
    slowFrames = late > 1 ? slowFrames + Math.min(late, 3) : 0;
    if (slowFrames > 5 && quality > 0.25) {
      quality /= 2;
      slowFrames = 0;
    }
    lastFrame = more && !next ? now : 0;
    if (more || stale.size) redraw();
  } catch (error) {
    fail(error);
  }
}

function pictureSize(canvas) {
  const wanted = (canvas.clientWidth || 256) * Math.min(window.devicePixelRatio || 1, 2) * quality;
  return Math.max(64, Math.min(512, Math.round(wanted)));
}

/** Shows the lobes, which are made when they have no largest value yet. */
function drawLobes(canvases, size) {
  const angles = [radians(state.theta), radians(state.azimuth)], light = direction(-angles[0], angles[1]);
  const isThrough = (slot) => Boolean(formulasOf(slot).through || formulasOf(slot).transmit);
  const at = state.scale === "log" ? (x) => Math.max(0, 1 + Math.log10(x) / DECADES) : (x) => x;
  const [around, above] = state.turned.map(radians), [c, s, d, t] = [Math.cos(around), Math.sin(around), Math.cos(above), Math.sin(above)];
  const view = { right: [c, s, 0], up: [-s * t, c * t, d], towards: [s * d, -c * d, t], middle: state.slots.some(isThrough) ? 0 : 0.4 };
  state.slots.forEach((slot, k) => {
    if (pictures[k].top === undefined) {
      const points = lobeDirections(...angles, formulasOf(slot).through);
      const values = renderer.evaluate(slot, points.directions.map(() => light), points.directions);
      pictures[k].top = lobeTop(points.directions, values);
      renderer.fillLobe(k, lobeMesh(points, values, pictures[k].top, at, angles, renderer.shares(slot, light)));
    }
    renderer.showLobe(canvases[k], k, view, size);
  });
  const tops = state.slots.map((_, k) => `${slotLabel(k)} ${pictures[k].top > 0 ? digits(pictures[k].top, 3) : "none"}`);
  const ideal = labelsOf((f) => f.mirror || f.transmit);
  byId("samples").textContent =
    `The radius is f cos θ of the view, on the slice's ${state.scale === "log" ? "logarithmic" : "linear"} scale, for light at ` +
    `θ = ${state.theta}°, φ = ${state.azimuth}° (orange); the mirror direction is grey. Each column is scaled to its own largest value: ` +
    `${tops.join(", ")}.` + (ideal ? ` Thick arrows are shares of ideal reflection and refraction (${ideal}); the circle's radius is 1.` : "");
}

/** Shows the pictures, with another sample if `add`; true if more will follow. */
function drawPictures(add) {
  let more = false;
  const lamp = lampDirection(state.lamp), scale = 2 ** state.exposure;
  const canvases = document.querySelectorAll("#pictures canvas");
  // All have one size, so that they can be compared pixel by pixel.
  const size = pictureSize(canvases[0]);
  if (state.view === "lobe") {
    drawLobes(canvases, size);
    return false;
  }
  state.slots.forEach((slot, k) => {
    if (pictures[k].sum && pictures[k].sum.width !== size) pictures[k] = {};
    if (add || !pictures[k].sum) renderer.addSample(pictures[k], `picture ${k}`, slot, state.view, size, lamp, state.shape);
    more = more || pictures[k].samples < SAMPLES[state.view];
    renderer.show(canvases[k], pictures[k], scale);
  });
  if (state.slots.length > 1)
    renderer.show(byId("difference-picture"), pictures[0], scale * 2, pictures[1]);
  const { samples } = pictures[0];
  const dark = state.view === "lamp" ? labelsOf((f) => !f.eval) : "";
  const refracting = labelsOf((f) => f.transmit);
  byId("samples").textContent =
    `Samples a pixel: ${samples} of ${SAMPLES[state.view]}.` +
    (dark ? ` A lamp without a size is not seen in ideal reflection and refraction (${dark}): choose the sky.` : "") +
    (state.shape === "knot" ? ` The knot casts no shadows on itself, and does not see itself${refracting ? "; it refracts as a ball would" : ""}.` : "");
  return more;
}

function sliceAngles(full) {
  const end = full ? 180 : 90, angles = new Set();
  for (let a = -end; a <= end; a += 0.5) angles.add(a);
  // Lobes may be narrow: more points about the mirror direction and about the light.
  for (const centre of [state.theta, -state.theta])
    for (let d = -4; d <= 4; d += 0.05) if (Math.abs(centre + d) < end) angles.add(centre + d);
  return [...angles].sort((a, b) => a - b);
}

/** A number with so many digits, and a power of ten where it is very large or small. */
function digits(x, count) {
  const written = Number(x.toPrecision(count));
  return Math.abs(written) >= 1e6 ? written.toExponential() : String(written);
}

let shownCurves = [];
function drawSlice() {
  const full = state.slots.some((s) => formulasOf(s).through);
  const angles = sliceAngles(full);
  const phi = radians(state.azimuth), plane = radians(state.azimuth + state.turn);
  const fixed = direction(-radians(state.theta), phi);
  const varied = angles.map((a) => direction(radians(a), plane));
  const constant = angles.map(() => fixed);
  const isPdf = state.quantity === "pdf";
  shownCurves = state.slots.map((slot, k) => {
    const values = renderer.evaluate(slot, isPdf ? varied : constant, isPdf ? constant : varied);
    const points = angles.map((a, i) => {
      const f = isPdf ? values[4 * i + 3] : channelOf(values, i);
      return [a, state.quantity === "cos" ? f * Math.abs(Math.cos(radians(a))) : f];
    });
    return { label: slotLabel(k), color: slotColor(k), points };
  });
  const logarithmic = state.scale === "log";
  const inPlane = state.turn === 0;
  const given = isPdf ? "view" : "light", drawn = isPdf ? "light" : "view";
  if (state.plot === "polar") {
    const marks = inPlane ? [{ angle: -state.theta, into: true, label: given }] : [];
    if (inPlane && state.theta > 0) marks.push({ angle: state.theta, label: "mirror" });
    drawPolar(byId("slice"), shownCurves, { logarithmic, full, marks });
  } else {
    const end = full ? 180 : 90;
    const label = `angle of the ${drawn} from the normal; negative on the side of the ${given}`;
    const marks = inPlane ? [{ angle: state.theta }] : [];
    drawGraph(byId("slice"), shownCurves, { logarithmic, first: -end, last: end, label, marks });
  }
  const ideal = labelsOf((f) => f.mirror || f.transmit);
  const what = { f: "BRDF", cos: "BRDF times the cosine of the view", pdf: "pdf of the light's direction" }[state.quantity];
  byId("slice-note").textContent =
    `${what} for each ${drawn}, ${given} at θ = ${state.theta}°. Point at the plot to read values.` +
    (ideal ? ` Ideal reflection and refraction (${ideal}) have no finite value: see sphere and albedo.` : "");
}

function readSlice(event) {
  if (!shownCurves.length) return;
  const svg = byId("slice"), box = svg.getBoundingClientRect(), [, , width, height] = svg.getAttribute("viewBox").split(" ").map(Number);
  const x = ((event.clientX - box.left) / box.width) * width, y = ((event.clientY - box.top) / box.height) * height;
  const first = shownCurves[0].points[0][0];
  const angle =
    state.plot === "polar"
      ? (Math.atan2(x - width / 2, (first < -90 ? height / 2 : height - 30) - y) * 180) / Math.PI
      : first + ((x - 52) / (width - 64)) * -2 * first;
  if (Math.abs(angle) > -first) return;
  const near = (points) => points.reduce((a, b) => (Math.abs(b[0] - angle) < Math.abs(a[0] - angle) ? b : a));
  const values = shownCurves.map((c) => `${c.label} ${digits(near(c.points)[1], 4)}`);
  byId("slice-note").textContent = `${digits(near(shownCurves[0].points)[0], 4)}°: ${values.join(", ")}`;
}

function drawAlbedo() {
  const at = [];
  const curves = state.slots.map((slot, k) => {
    const values = renderer.albedo(slot, ALBEDO_ANGLES, radians(state.azimuth));
    const points = Array.from({ length: ALBEDO_ANGLES }, (_, i) => [(90 * i) / (ALBEDO_ANGLES - 1), channelOf(values, i)]);
    const i = Math.min(ALBEDO_ANGLES - 2, Math.floor((state.theta / 90) * (ALBEDO_ANGLES - 1)));
    const t = (state.theta / 90) * (ALBEDO_ANGLES - 1) - i;
    at.push(`${slotLabel(k)} ${digits((1 - t) * points[i][1] + t * points[i + 1][1], 2)}`);
    return { label: slotLabel(k), color: slotColor(k), points };
  });
  drawGraph(byId("albedo"), curves, { first: 0, last: 90, limit: 1, label: "angle of the view from the normal", height: 260, marks: [{ angle: state.theta }] });
  byId("albedo-note").textContent =
    `The integral of f cos θ over all directions of light, with ideal reflection and refraction; the dashed line is 1. At ${state.theta}°: ${at.join(", ")}.`;
}

function drawDifference() {
  if (state.slots.length < 2) return;
  const { here, everywhere } = renderer.difference(state.slots.slice(0, 2), radians(state.theta), radians(state.azimuth));
  const percent = (x) => (Number.isFinite(x) ? `${Number((100 * x).toPrecision(3))} %` : "–");
  byId("difference-text").replaceChildren(
    make("strong", {}, percent(everywhere)),
    `of the light, over all views; ${percent(here)} in the view at θ = ${state.theta}°.`,
    make("p", { class: "note" }, "The integral of |f − g| cos θ over that of f cos θ, with the first model f and the second g."),
    make("p", { class: "note", id: "difference-colors", hidden: state.view === "lobe" }, "In the picture, orange is where the first is brighter, and blue where the second is, both doubled."),
  );
}

/** What is drawn beside pictures, in this order. */
const DRAWN = { slice: drawSlice, albedo: drawAlbedo, difference: drawDifference };

// ---- Controls -----------------------------------------------------------------------------------

/** A field for a parameter's value, and what is wrong with its text. `take` gets a value that the parameter takes. */
function valueField(p, attributes, textOf, take) {
  const wrong = make("span", { class: "wrong", role: "alert" });
  const say = (text) => {
    wrong.textContent = text;
    field.setAttribute("aria-invalid", text !== "");
  };
  const field = make("input", {
    type: "text", spellcheck: "false", autocomplete: "off", ...attributes,
    onchange: () => {
      const value = parsed(p, field.value);
      if (value === undefined) {
        say(`${expected(p)}; still ${textOf()}`);
        return;
      }
      take(value);
      show();
    },
  });
  const show = () => {
    field.value = textOf();
    say("");
  };
  show();
  return { field, wrong, show };
}

function numberControl(slot, p, id, update) {
  const slider = make("input", {
    type: "range", id, min: 0, max: 1, step: 0.001, "aria-describedby": `${id}-doc`,
    oninput: () => {
      slot.values[p.name] = valueAt(p, Number(slider.value));
      show();
      describe();
      update();
    },
  });
  const attributes = { class: "number", inputmode: "decimal", "aria-label": `${p.label}, value` };
  const { field, wrong, show } = valueField(p, attributes, () => String(slot.values[p.name]), (value) => {
    slot.values[p.name] = value;
    slider.value = placeOf(p, value);
    describe();
    update();
  });
  const describe = () => slider.setAttribute("aria-valuetext", `${slot.values[p.name]} ${p.unit}`.trim());
  slider.value = placeOf(p, slot.values[p.name]);
  describe();
  return [slider, field, wrong];
}

function colorControl(slot, p, id, update) {
  const swatch = make("input", {
    type: "color", id, "aria-describedby": `${id}-doc`,
    oninput: () => {
      slot.values[p.name] = colorOf(swatch.value);
      show();
      update();
    },
  });
  const attributes = { "aria-label": `${p.label}, linear red, green, blue`, title: "Linear red, green, blue, or one number for grey" };
  const { field, wrong, show } = valueField(p, attributes, () => colorText(slot.values[p.name], ", "), (value) => {
    slot.values[p.name] = value;
    swatch.value = hexOf(value);
    update();
  });
  swatch.value = hexOf(slot.values[p.name]);
  return [swatch, field, wrong];
}

function choiceControl(slot, p, id, update) {
  const menu = make(
    "select",
    { id, "aria-describedby": `${id}-doc`, onchange: () => { slot.values[p.name] = menu.value; update(); } },
    ...p.choices.map((c) => make("option", { value: c }, c.replaceAll("_", " "))),
  );
  menu.value = slot.values[p.name];
  return [menu];
}

function parameterControl(slot, p, k, update) {
  const id = `p${k}-${p.name}`;
  const control = { number: numberControl, color: colorControl, choice: choiceControl }[p.kind](slot, p, id, update);
  return make(
    "div",
    { class: `parameter ${p.kind}`, title: p.doc },
    make("label", { for: id }, p.unit ? `${p.label}, ${p.unit}` : p.label),
    ...control,
    make("span", { id: `${id}-doc`, class: "hidden" }, p.doc),
  );
}

/** The name of a file as a word of a shell. */
const shellWord = (name) => (/^\w[\w.+-]*$/.test(name) ? name : `'./${name.replaceAll("'", "'\\''")}'`);

/** How to have the same elsewhere: [where, text]. */
function recipes(slot) {
  const set = changed(slot);
  const plain = set.map(([p, v]) => ` ${p.name}=${p.kind === "color" ? colorText(v, ",") : v}`).join("");
  const named = set
    .map(([p, v]) => `, ${p.name}=${p.kind === "color" ? `(${v.map(written).join(", ")})` : p.kind === "choice" ? `"${v}"` : v}`)
    .join("");
  // The pair of directions that the slice has its mirror direction at.
  const phi = radians(state.azimuth), theta = radians(state.theta);
  const [wi, wo] = [direction(-theta, phi), direction(theta, phi)].map((w) => w.map((x) => Number(x.toFixed(9))));
  const directions = `printf 'wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\\n${[...wi, ...wo].join(",")}\\n'`;
  const file = fileOf(slot);
  if (file)
    return [
      ["Command", `${directions} | brdfc measured ${shellWord(file)} --pairs`],
      ["Fits", `brdfc measured ${shellWord(file)}`],
      ["Python", `import brdfc\nwi, wo = [${wi.join(", ")}], [${wo.join(", ")}]\nprint(brdfc.measured(${JSON.stringify(file)}).eval(wi, wo))`],
      ["Blender", `from bl_ext.user_default.brdfc_shaders import api\napi.new_measured_material(${JSON.stringify(file)})`],
    ];
  return [
    ["Command", `${directions} | brdfc eval ${slot.model}${plain}`],
    ["Python", `import brdfc\nwi, wo = [${wi.join(", ")}], [${wo.join(", ")}]\nprint(brdfc.model("${slot.model}").eval(wi, wo${named}))`],
    ["Blender", `from bl_ext.user_default.brdfc_shaders import api\napi.new_material("${slot.model}"${named})`],
  ];
}

function recipeList(slot) {
  return recipes(slot).map(([where, text]) => {
    const shown = make("pre", { "aria-label": where, tabindex: 0 }, text);
    const button = make("button", {
      type: "button", "aria-label": `Copy: ${where}`,
      onclick: async () => {
        try {
          await navigator.clipboard.writeText(text);
          button.textContent = "Copied";
        } catch {
          // Browsers may keep the clipboard from pages that are files.
          getSelection().selectAllChildren(shown);
          button.textContent = document.execCommand("copy") ? "Copied" : "Selected";
        }
        setTimeout(() => { button.textContent = where; }, 1500);
      },
    }, where);
    return make("div", { class: "copy" }, shown, button);
  });
}

/** Makes the recipes of all models anew: they hold the slice's directions. */
function showRecipes() {
  document.querySelectorAll("#slots .copies").forEach((copies, k) => copies.replaceChildren(...recipeList(state.slots[k])));
}

function modelMenu(slot, k) {
  const menu = make("select", {
    "aria-label": `Model ${k + 1}`,
    onchange: () => {
      state.slots[k] = { model: menu.value, values: defaultsOf(menu.value) };
      rebuild();
      document.querySelectorAll("#slots .head select")[k].focus();
    },
  });
  for (const [look, label] of Object.entries(LOOKS)) {
    const names = Object.keys(BRDFC.models).filter((m) => BRDFC.models[m].look === look);
    const options = names.map((m) => make("option", { value: m }, BRDFC.models[m].label));
    if (options.length) menu.append(make("optgroup", { label }, ...options));
  }
  menu.value = slot.model;
  return menu;
}

function slotCard(slot, k) {
  const model = BRDFC.models[slot.model];
  const copies = make("div", { class: "copies" });
  const update = () => {
    copies.replaceChildren(...recipeList(slot));
    changedState("pictures", "slice", "albedo", "difference");
  };
  const controls = model.parameters.map((p) => parameterControl(slot, p, k, update));
  const file = fileOf(slot);
  const head = make("div", { class: "head" }, modelMenu(slot, k));
  const reset = () => {
    state.slots[k] = { model: slot.model, values: defaultsOf(slot.model) };
    rebuild();
    document.querySelectorAll("#slots .head")[k].querySelector("button").focus();
  };
  if (!file)
    head.append(make("button", { type: "button", title: "Set all parameters to their defaults", onclick: reset }, "Reset"));
  if (state.slots.length > 1)
    head.append(make("button", {
      type: "button", "aria-label": `Remove model ${k + 1}`, title: "Remove",
      onclick: () => { state.slots.splice(k, 1); rebuild(); },
    }, "×"));
  const card = make("div", { class: "slot", style: `--own: var(--color-${k})`, role: "group", "aria-label": `Model ${k + 1}: ${model.label}` }, head);
  card.append(make("p", { class: "about" }, model.doc), ...controls.slice(0, SHOWN_PARAMETERS));
  if (controls.length > SHOWN_PARAMETERS) {
    const rest = controls.slice(SHOWN_PARAMETERS);
    const open = changed(slot).some(([p]) => model.parameters.indexOf(p) >= SHOWN_PARAMETERS);
    card.append(make("details", { open }, make("summary", {}, `${rest.length} more parameters`), ...rest));
  }
  copies.append(...recipeList(slot));
  if (file) {
    card.append(
      make("p", { class: "note" }, "The data stay in this browser: nothing is sent."),
      make("details", { open: true }, make("summary", {}, "Copy"), copies,
        make("p", { class: "note" }, "A link to this page, its address, can't carry the file: whoever opens it has to add the file, too.")),
    );
    return card;
  }
  card.append(
    make("details", { open: true }, make("summary", {}, "Paper and equations"), make("dl", {},
      make("dt", {}, "Paper"), make("dd", {}, model.paper), make("dt", {}, "Equations"), make("dd", {}, model.equations))),
    make("details", {}, make("summary", {}, "Copy these settings"), copies),
  );
  return card;
}

/** Turns the lobes by degrees. */
function turn(around, above) {
  const [a, b] = state.turned, full = a + around;
  state.turned = [full - 360 * Math.round(full / 360), Math.min(90, Math.max(-90, b + above))].map((x) => Number(x.toFixed(1)));
  changedState();
}

function pictureOf(slot, k) {
  const canvas = make("canvas", { role: "img", tabindex: 0, width: 64, height: 64 });
  let before = [0, 0];
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    if (state.view === "lobe") {
      turn((180 * (before[0] - event.clientX)) / box.width, (180 * (event.clientY - before[1])) / box.height);
      before = [event.clientX, event.clientY];
      return;
    }
    const at = [((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2];
    state.lamp = at.map((x) => Number(Math.min(1.6, Math.max(-1.6, x)).toFixed(3)));
    changedState("pictures");
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    before = [event.clientX, event.clientY];
    place(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) place(event);
  });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-0.05, 0], ArrowRight: [0.05, 0], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05] }[event.key];
    if (!step) return;
    event.preventDefault();
    if (state.view === "lobe") {
      turn(-100 * step[0], -100 * step[1]);
      return;
    }
    state.lamp = state.lamp.map((x, i) => Number(Math.min(1.6, Math.max(-1.6, x + step[i])).toFixed(3)));
    changedState("pictures");
  });
  return make("figure", { style: `--own: var(--color-${k})` }, canvas, make("figcaption", {}, slotLabel(k)));
}

/** The names of the models, in the colours of their curves. */
function legend() {
  return state.slots.map((_, k) => make("span", { style: `color: var(--color-${k})` }, slotLabel(k)));
}

function changedState(...what) {
  writeAddress();
  redraw(...what);
}

/** Shows the state in the controls that are always there. */
function showOptions() {
  for (const name of ["exposure", "theta", "azimuth", "turn"]) {
    byId(name).value = state[name];
    document.querySelector(`output[for="${name}"]`).textContent = name === "exposure" ? state[name].toFixed(1) : `${state[name]}°`;
  }
  for (const name of ["quantity", "plot", "scale", "channel"]) byId(name).value = state[name];
  for (const radio of document.querySelectorAll('input[type="radio"]')) radio.checked = radio.value === state[radio.name];
  const isLobe = state.view === "lobe";
  byId("moved").textContent = { lamp: "move the lamp", sky: "move the sun", lobe: "turn the lobes" }[state.view];
  byId("spheres-title").textContent = isLobe ? "Lobe" : state.shape === "knot" ? "Knot" : "Sphere";
  for (const id of ["shapes", "exposure-label", "difference-picture", "difference-colors"]) if (byId(id)) byId(id).hidden = isLobe;
  document.querySelectorAll("#pictures canvas").forEach((canvas, k) => {
    const what = isLobe ? ["Lobe of f cos θ", "turn the lobes"] : [`Lit ${state.shape}`, "move the light"];
    canvas.setAttribute("aria-label", `${what[0]}, ${slotLabel(k)}. Arrow keys ${what[1]}.`);
  });
}

/** Makes the controls of models anew, after models were chosen, added or removed. */
function rebuild() {
  if (renderer) byId("error").hidden = true;
  byId("slots").replaceChildren(...state.slots.map(slotCard));
  byId("pictures").replaceChildren(...state.slots.map(pictureOf));
  for (const id of ["slice-legend", "albedo-legend"]) byId(id).replaceChildren(...legend());
  byId("add").hidden = state.slots.length >= MOST_MODELS;
  byId("compared").hidden = state.slots.length < 2;
  showOptions();
  changedState("pictures", "slice", "albedo", "difference");
}

function addModel() {
  const last = BRDFC.models[state.slots.at(-1).model];
  const free = Object.keys(BRDFC.models).filter((m) => !BRDFC.models[m].file && !state.slots.some((s) => s.model === m));
  const model = free.find((m) => BRDFC.models[m].look === last.look) || free[0];
  state.slots.push({ model, values: defaultsOf(model) });
  rebuild();
  [...document.querySelectorAll("#slots .head select")].at(-1).focus();
}

// ---- Measured files -----------------------------------------------------------------------------

/** Keys of BRDFC.models by what tells files apart, and how many keys there were. */
const files = new Map();
let fileKeys = 0;

/** Reads a file and returns the key of its model, which the menus of models offer from then on. */
async function modelOfFile(file) {
  const known = `${file.name} ${file.size} ${file.lastModified}`;
  if (!files.has(known)) {
    const data = await readMeasured(file), name = `file${++fileKeys}`;
    const namesakes = Object.values(BRDFC.models).filter((m) => m.file === file.name).length;
    const label = namesakes ? `${file.name}, ${namesakes + 1}` : file.name;
    BRDFC.models[name] = measuredModel(name, label, file.name, data);
    try {
      renderer.addMeasured(name, data.tables);
    } catch (error) {
      delete BRDFC.models[name];
      throw new Error(`${file.name}: ${error.message}.`);
    }
    files.set(known, name);
  }
  return files.get(known);
}

/** Files are read one after another, also those that are dropped while others are read. */
let reading = Promise.resolve();
function addFiles(list) {
  reading = reading.then(() => showFiles(list)).catch(fail);
  return reading;
}

/** Shows files as the first models: the difference is then divided by the light of the data. Says what is wrong. */
async function showFiles(list) {
  if (!renderer) return;
  const wrong = [], added = [];
  byId("status").textContent = `Reading ${list.map((f) => f.name).join(", ")}.`;
  for (const file of list) {
    try {
      const model = await modelOfFile(file);
      if (added.includes(model) || state.slots.some((s) => s.model === model)) continue;
      if (state.slots.length + added.length < MOST_MODELS) added.push(model);
      else wrong.push(`${file.name}: ${MOST_MODELS} models are shown already; choose the file in the menu of one of them, to show it instead.`);
    } catch (error) {
      wrong.push(error.message);
    }
  }
  state.slots.unshift(...added.map((model) => ({ model, values: {} })));
  byId("status").textContent = added.length ? `Shown first: ${added.map((m) => BRDFC.models[m].label).join(", ")}.` : "";
  rebuild();
  if (wrong.length) {
    fail(new Error(wrong.join("\n")));
    byId("error").scrollIntoView({ block: "nearest" });
  }
}

/** Files may be dropped anywhere on the page, or chosen. */
function acceptFiles() {
  const show = (dropping) => document.body.classList.toggle("dropping", dropping);
  const carries = (event) => [...event.dataTransfer.types].includes("Files");
  document.addEventListener("dragover", (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    show(true);
  });
  document.addEventListener("dragleave", (event) => show(event.relatedTarget !== null));
  document.addEventListener("drop", (event) => {
    show(false);
    if (!carries(event)) return;
    // Otherwise the browser would leave the page, and show the file.
    event.preventDefault();
    addFiles([...event.dataTransfer.files]);
  });
  const field = byId("file");
  byId("add-file").addEventListener("click", () => field.click());
  field.addEventListener("change", async () => {
    await addFiles([...field.files]);
    // The same file may be chosen again.
    field.value = "";
  });
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  byId("theme").textContent = theme === "dark" ? "Light" : "Dark";
  byId("theme").setAttribute("aria-label", `Use ${theme === "dark" ? "light" : "dark"} colours`);
  redraw("slice", "albedo");
}

function begin() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  setTheme(dark.matches ? "dark" : "light");
  dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
  byId("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
  const what = { exposure: [], theta: ["slice", "albedo", "difference"], azimuth: ["slice", "albedo", "difference"], turn: ["slice"] };
  for (const [name, drawn] of Object.entries(what))
    byId(name).addEventListener("input", () => {
      state[name] = Number(byId(name).value);
      showOptions();
      showRecipes();
      changedState(...drawn, ...(state.view === "lobe" && drawn.includes("albedo") ? ["pictures"] : []));
    });
  for (const name of ["quantity", "plot", "scale", "channel"])
    byId(name).addEventListener("change", () => {
      state[name] = byId(name).value;
      changedState("slice", ...(name === "channel" ? ["albedo"] : []), ...(name === "scale" && state.view === "lobe" ? ["pictures"] : []));
    });
  for (const radio of document.querySelectorAll('input[type="radio"]'))
    radio.addEventListener("change", () => {
      state[radio.name] = radio.value;
      showOptions();
      changedState("pictures");
    });
  byId("add").addEventListener("click", addModel);
  acceptFiles();
  byId("slice").addEventListener("pointermove", readSlice);
  byId("slice").addEventListener("pointerleave", () => redraw("slice"));
  window.addEventListener("hashchange", () => load());
  window.addEventListener("resize", () => redraw());
  byId("footer").textContent =
    `Made by brdfc ${BRDFC.version} of the formulas that also render in Blender. This device computes them in single precision; ` +
    "brdfc eval and the Python package do so in double precision.";
  try {
    renderer = new Renderer();
  } catch (error) {
    fail(error);
  }
  load();
}

function load() {
  const wrong = readAddress(location.hash);
  rebuild();
  if (renderer && wrong.length) fail(new Error(`This page does not know what the link says here, and ignores it: ${wrong.join("; ")}`));
}

begin();
