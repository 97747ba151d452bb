// SPDX-License-Identifier: GPL-3.0-or-later
// Reads MERL's files, as generator/measured/merl.cpp.
"use strict";

/** MERL's cells of theta_h, theta_d and phi_d, and what its numbers are multiplied with. */
const MERL = [90, 90, 180];
const MERL_ENTRIES = MERL[0] * MERL[1] * MERL[2];
const MERL_SCALES = [1 / 1500, 1.15 / 1500, 1.66 / 1500];
const MERL_HEADER = 12, MERL_BYTES = MERL_HEADER + 3 * 8 * MERL_ENTRIES;
/** Columns of MERL's texture, as in measured_merl.glsl: rows of phi_d for nine theta_d. */
const MERL_COLUMNS = 9 * MERL[2];
/** Marks entries that were not measured; the others are not below 0. */
const HOLE = -1;

/** For each entry of MERL's whether the middle of its cell is above the horizon. */
function merlAbove() {
  const [rows, columns, turns] = MERL, out = new Uint8Array(MERL_ENTRIES);
  const cosines = Array.from({ length: turns }, (_, p) => Math.cos(((p + 0.5) / turns) * Math.PI));
  for (let h = 0, i = 0; h < rows; ++h) {
    const theta = ((h + 0.5) / rows) ** 2 * (Math.PI / 2), s = Math.sin(theta), c = Math.cos(theta);
    for (let d = 0; d < columns; ++d) {
      const difference = ((d + 0.5) / columns) * (Math.PI / 2), sd = Math.sin(difference), cd = Math.cos(difference);
      // The cosine of light or view is c cd plus or minus this.
      for (let p = 0; p < turns; ++p, ++i) out[i] = c * cd > Math.abs(s * (sd * cosines[p]));
    }
  }
  return out;
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
    notes.push(`${counted(holes, "entry", "entries")} of ${inside} above the horizon are negative, ${percentOf(holes / inside)} %: not measured, filled from their neighbours`);
  }
  if (clipped) notes.push(`${counted(clipped, "entry is", "entries are")} negative in one channel or two: taken for 0 there`);
  const weights = new Float64Array(MERL[0]);
  return {
    about: `Measured, in MERL's format: isotropic, ${MERL.join(" x ")} cells of half and difference angles, linear in between.`,
    notes,
    glsl: "measured_merl",
    tables: { values: textureOf(values, 3, MERL_COLUMNS) },
    constants: [],
  };
}
