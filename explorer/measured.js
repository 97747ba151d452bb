// SPDX-License-Identifier: GPL-3.0-or-later
// Reads files of measured BRDFs, as generator/measured does. Knows nothing of the page.
"use strict";

/** MERL's cells of theta_h, theta_d and phi_d, and what its numbers are multiplied with. */
const MERL = [90, 90, 180];
const MERL_ENTRIES = MERL[0] * MERL[1] * MERL[2];
const MERL_SCALES = [1 / 1500, 1.15 / 1500, 1.66 / 1500];
const MERL_HEADER = 12, MERL_BYTES = MERL_HEADER + 3 * 8 * MERL_ENTRIES;
/** Columns of MERL's texture, as in measured.glsl: rows of phi_d for nine theta_d. */
const MERL_COLUMNS = 9 * MERL[2];
/** Shares of samples that may be drawn from the cosine. */
const COSINE_SHARES = [0.2, 0.35, 0.5, 0.7];
/** Marks entries that were not measured; the others are not below 0. */
const HOLE = -1;

const counted = (count, one, many) => `${count} ${count === 1 ? one : many}`;
const percentOf = (share) => String(Number((100 * share).toPrecision(2)));

/** For each entry of MERL's whether the middle of its cell is above the horizon. */
function merlAbove() {
  const out = new Uint8Array(MERL_ENTRIES);
  eachMerlCell((i, { light, view }) => { out[i] = light > 0 && view > 0; });
  return out;
}

/** Calls `visit` for each entry with the cosines of light and view, and the angles' place, in the middle of its cell. */
function eachMerlCell(visit) {
  const [rows, columns, turns] = MERL;
  const cosines = Array.from({ length: turns }, (_, p) => Math.cos(((p + 0.5) / turns) * Math.PI));
  const at = { h: 0, light: 0, view: 0, cosSin: 0 };
  for (let h = 0, i = 0; h < rows; ++h) {
    const theta = ((h + 0.5) / rows) ** 2 * (Math.PI / 2), s = Math.sin(theta), c = Math.cos(theta);
    at.h = h;
    for (let d = 0; d < columns; ++d) {
      const difference = ((d + 0.5) / columns) * (Math.PI / 2), sd = Math.sin(difference), cd = Math.cos(difference);
      at.cosSin = cd * sd;
      for (let p = 0; p < turns; ++p, ++i) {
        const x = sd * cosines[p];
        at.light = c * cd - s * x;
        at.view = c * cd + s * x;
        visit(i, at);
      }
    }
  }
}

/**
 * Fills a line of MERL's entries from the nearest ones that were measured: linear between two, constant beyond, or
 * around a circle. As fill_line() of generator/measured/gaps.cpp.
 */
function fillLine(values, above, first, stride, length, circle, done) {
  const known = [], gaps = [];
  for (let k = 0; k < length; ++k) {
    const i = first + k * stride;
    if (above[i]) (values[3 * i] === HOLE ? gaps : known).push(k);
  }
  if (!gaps.length) return;
  done[known.length ? "some" : "left"] = true;
  if (!known.length) return;
  const last = known.at(-1);
  let next = 0;
  for (const k of gaps) {
    while (next < known.length && known[next] < k) ++next;
    let a = known[next - 1], b = known[next], weight = (k - a) / (b - a);
    if (a === undefined || b === undefined) {
      const outside = a === undefined ? k + length : k;
      weight = circle ? (outside - last) / (known[0] + length - last) : 0;
      a = circle ? last : (a ?? b);
      b = circle ? known[0] : a;
    }
    for (let c = 0; c < 3; ++c) {
      const from = values[3 * (first + a * stride) + c], to = values[3 * (first + b * stride) + c];
      values[3 * (first + k * stride) + c] = (1 - weight) * from + weight * to;
    }
  }
}

/** Fills what was not measured above the horizon: along theta_d; where a line has nothing, along phi_d, then theta_h. */
function fillMerl(values, above) {
  const strides = [MERL[1] * MERL[2], MERL[2], 1], done = { some: false, left: false };
  do {
    done.some = done.left = false;
    for (const axis of [1, 2, 0]) {
      done.left = false;
      const stride = strides[axis], block = stride * MERL[axis];
      for (let begin = 0; begin < MERL_ENTRIES; begin += block)
        for (let k = 0; k < stride; ++k) fillLine(values, above, begin + k, stride, MERL[axis], axis === 2, done);
    }
  } while (done.some && done.left);
}

/**
 * A distribution of half vectors for sampling, by rows of theta_h, as HalfVectors of generator/measured: four numbers a
 * row, the sum up to its end, the density per solid angle, and (1 - cos theta_h) / 2 at its beginning and end. In
 * single precision the cosine itself does not tell the first rows apart. The last number is the share of the cosine
 * lobe, that with the least variance in the view along the normal, in which the data are `atNormal`, by rows.
 */
function halfVectorRows(weights, atNormal) {
  const rows = weights.length, out = new Float32Array(4 * rows + 4);
  const versine = (row) => Math.sin(((row / rows) ** 2 * Math.PI) / 4) ** 2;
  const areas = Array.from(weights, (_, row) => 4 * Math.PI * (versine(row + 1) - versine(row)));
  const total = areas.reduce((sum, area, row) => sum + area * weights[row], 0);
  let sum = 0;
  for (let row = 0; row < rows; ++row) {
    sum += (areas[row] * weights[row]) / total;
    out.set([sum, weights[row] / total, versine(row), versine(row + 1)], 4 * row);
  }
  const moment = (share) =>
    areas.reduce((m, area, row) => {
      const theta = ((row + 0.5) / rows) ** 2 * (Math.PI / 2), toHalf = 4 * Math.cos(theta), cos = Math.cos(2 * theta);
      if (!(cos > 0)) return m;
      const pdf = (share * cos) / Math.PI + ((1 - share) * weights[row]) / total / toHalf;
      return m + (area * toHalf * (atNormal[row] * cos) ** 2) / pdf;
    }, 0);
  out[4 * rows + 3] = COSINE_SHARES.reduce((best, share) => (moment(share) < moment(best) ? share : best));
  return out;
}

/** MERL's .binary files, as read_merl() of generator/measured/merl.cpp. */
async function readMerl(file) {
  const head = new DataView(await file.slice(0, MERL_HEADER).arrayBuffer());
  if (head.byteLength < MERL_HEADER)
    throw new Error(`expected a header of three numbers, as MERL's files have, found ${counted(file.size, "byte", "bytes")}`);
  const dimensions = (little) => [0, 4, 8].map((at) => head.getInt32(at, little));
  if (String(dimensions(true)) !== String(MERL)) {
    const reversed = String(dimensions(false)) === String(MERL);
    throw new Error(
      `header: expected ${MERL.join(" x ")} values of theta_h, theta_d and phi_d, as MERL's files have, found ` +
        dimensions(true).join(" x ") + (reversed ? ": the byte order is reversed; little-endian numbers are expected" : ""),
    );
  }
  if (file.size !== MERL_BYTES) {
    const single = file.size === MERL_HEADER + (MERL_BYTES - MERL_HEADER) / 2;
    const doubt = single ? ": are these numbers in single precision?" : file.size < MERL_BYTES ? ": truncated?" : "";
    throw new Error(`expected ${MERL_BYTES} bytes, 3 planes of ${MERL_ENTRIES} doubles after a header of ${MERL_HEADER} bytes, got ${file.size}${doubt}`);
  }
  const numbers = new Float64Array(await file.slice(MERL_HEADER).arrayBuffer());
  const values = new Float32Array(3 * MERL_ENTRIES), negative = new Uint8Array(MERL_ENTRIES);
  for (let c = 0; c < 3; ++c)
    for (let i = 0; i < MERL_ENTRIES; ++i) {
      const read = numbers[c * MERL_ENTRIES + i], value = read * MERL_SCALES[c];
      if (!Number.isFinite(Math.fround(value)))
        throw new Error(
          `${["red", "green", "blue"][c]}: found ${read} at entry ${i}: expected ` +
            (Number.isFinite(read) ? "reflectances in little-endian byte order, which this is too large for" : "finite numbers"),
        );
      negative[i] += value < 0;
      values[3 * i + c] = Math.max(value, 0);
    }
  const above = merlAbove();
  let inside = 0, holes = 0, clipped = 0, largest = 0;
  for (let i = 0; i < MERL_ENTRIES; ++i) {
    const brightest = Math.max(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    // Noise takes single channels below 0; what was not measured is negative in all.
    const hole = negative[i] === 3 || (brightest === 0 && !above[i]);
    inside += above[i];
    holes += above[i] && hole;
    clipped += above[i] && !hole && negative[i] > 0;
    largest = Math.max(largest, brightest);
    if (hole) values[3 * i] = HOLE;
  }
  if (holes === inside) throw new Error("expected values above the horizon, found none");
  if (!(largest > 0)) throw new Error("expected a number above 0, found none: the data are black");
  const notes = [];
  if (holes) {
    fillMerl(values, above);
    notes.push(`${counted(holes, "entry", "entries")} of ${inside} above the horizon are negative, ${percentOf(holes / inside)} %: not measured, filled from their neighbours.`);
  }
  if (clipped) notes.push(`${counted(clipped, "entry is", "entries are")} negative in one channel or two: taken for 0 there.`);
  const weights = new Float64Array(MERL[0]);
  const luminance = (i) => 0.2126 * values[3 * i] + 0.7152 * values[3 * i + 1] + 0.0722 * values[3 * i + 2];
  eachMerlCell((i, { h, light, view, cosSin }) => {
    if (above[i]) weights[h] += luminance(i) * light * view * cosSin;
  });
  // Seen along the normal, theta_d is theta_h, and phi_d is 0.
  const atNormal = Array.from(weights, (_, h) => {
    const d = Math.floor(((h + 0.5) / MERL[0]) ** 2 * MERL[1]);
    return Math.max(0, luminance((h * MERL[1] + d) * MERL[2]));
  });
  return {
    about: `Measured, in MERL's format: isotropic, ${MERL.join(" x ")} cells of half and difference angles, linear in between.`,
    notes,
    eval: "merl_eval",
    values: { width: MERL_COLUMNS, height: MERL_ENTRIES / MERL_COLUMNS, data: values },
    rows: halfVectorRows(weights, atNormal),
  };
}

/** How the names of files end that can be read. */
const MEASURED_READERS = { ".binary": readMerl };
const OTHER_FORMATS = [".bsdf", ".bin", ".alta", ".dat", ".xml", ".csv"];

/** Reads a File; throws an Error with a sentence that names it and says what was expected. */
async function readMeasured(file) {
  const ending = /\.[^.]*$/.exec(file.name.toLowerCase())?.[0];
  const reader = Object.hasOwn(MEASURED_READERS, ending) ? MEASURED_READERS[ending] : undefined;
  const known = Object.keys(MEASURED_READERS).join(" or ");
  if (!reader)
    throw new Error(
      `${file.name}: expected a file whose name ends with ${known}, as MERL's do.` +
        (OTHER_FORMATS.includes(ending) ? ` The program reads this format: brdfc measured ${file.name}` : ""),
    );
  try {
    return await reader(file);
  } catch (error) {
    // The browser's own errors: a folder, or a file that was moved or may not be read.
    const why = error instanceof DOMException ? "expected a file that can be read; this one can't" : error.message;
    throw new Error(`${file.name}: ${why}${why.endsWith("?") ? "" : "."}`);
  }
}
