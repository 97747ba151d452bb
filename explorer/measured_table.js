// SPDX-License-Identifier: GPL-3.0-or-later
// Reads grids over the angles of light and view: tables of text, a row for every combination, as csv_grid.cpp and
// angle_rows.cpp of generator/measured; and UTIA's files, as utia.cpp.
"use strict";

const ANGLES = ["theta_i", "phi_i", "theta_o", "phi_o"], VECTORS = ["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"];
/** Angles are told apart in these steps, of degrees; those of unit vectors with six digits are the same within so many. */
const STEPS = 1e4, ROUNDING = 100;
/** Rows of a direction along the normal may differ by this share without a note. */
const ALIKE = 1e-3;

/** The fields of a line, which commas separate, without the quotes around them. */
const fieldsOf = (line) => line.split(",").map((field) => field.trim().replace(/^"(.*)"$/, "$1").trim());

/** Radians of a few digits in degrees: whole degrees stay whole. */
function degreesOf(radians) {
  const degrees = (radians * 180) / Math.PI, whole = Math.round(degrees);
  return Math.abs(degrees - whole) < 50 / STEPS ? whole : degrees;
}

/** Theta and phi of the unit vector in three numbers, in degrees. */
function anglesOf(vector) {
  const length = Math.hypot(...vector), [x, y, z] = vector, s = Math.hypot(x, y);
  if (!(Math.abs(length - 1) <= 1e-6)) throw new Error(`expected a unit vector, its length is ${length}`);
  if (!(z > 0)) throw new Error("expected directions above the surface");
  return [Math.atan2(s, z), s > 1e-9 ? Math.atan2(y, x) : 0].map((radians) => (radians * 180) / Math.PI);
}

/** Gives angles that rounding made different the same steps. */
function removeRounding(rows) {
  for (let k = 0; k < 4; ++k) {
    const matters = rows.filter(({ steps }) => k % 2 === 0 || steps[k - 1] !== 0);
    for (const { steps } of matters) if (k % 2 && steps[k] > 360 * STEPS - ROUNDING) steps[k] = 0;
    const all = [...new Set(matters.map(({ steps }) => steps[k]))].sort((a, b) => a - b), rounded = new Map();
    for (let first = 0, last; first < all.length; first = last) {
      for (last = first + 1; last < all.length && all[last] - all[last - 1] < ROUNDING;) ++last;
      const same = all.slice(first, last);
      const mean = same[0] < ROUNDING ? 0 : Math.round(same.reduce((a, b) => a + b) / same.length);
      for (const step of same) rounded.set(step, mean);
    }
    for (const { steps } of matters) steps[k] = rounded.get(steps[k]);
  }
}

/** The columns of a table by its header: {at: the places of the directions and r, g, b; vectors; radians; others}. */
function columnsOf(header) {
  const names = fieldsOf(header.replace(/^\uFEFF/, "")).map((name) => name.toLowerCase());
  for (const [separator, title] of [[";", "semicolons"], ["\t", "tabs"]])
    if (names.length === 1 && header.includes(separator)) throw new Error(`line 1: expected fields separated by commas, got ${title}`);
  const vectors = names.includes("wi_x");
  const unit = ["_deg", "_rad"].find((u) => names.includes(`theta_i${u}`)) || "";
  const expected = [...(vectors ? VECTORS : ANGLES.map((name) => name + unit)), "r", "g", "b"];
  const at = expected.map((name) => names.indexOf(name));
  if (at.includes(-1))
    throw new Error(`expected a header with the columns ${expected.join(",")}; ${expected[at.indexOf(-1)]} is missing`);
  const twice = expected.find((name) => names.indexOf(name) !== names.lastIndexOf(name));
  if (twice) throw new Error(`expected one column ${twice}, found several`);
  const others = names.filter((name) => !expected.includes(name));
  return { names, at, expected, vectors, radians: unit === "_rad", plain: !vectors && unit === "", others };
}

/** The rows of a table: {steps: four angles, value, line}, and how many numbers are negative. */
function rowsOf(text) {
  const lines = text.split("\n"), first = lines.findIndex((line) => line.trim());
  if (first < 0) throw new Error(`expected a header with the columns ${ANGLES.join(",")},r,g,b`);
  const columns = columnsOf(lines[first]), rows = [];
  let negative = 0;
  for (let i = first + 1; i < lines.length; ++i) {
    if (!lines[i].trim()) continue;
    const fields = fieldsOf(lines[i]), where = `line ${i + 1}`;
    if (fields.length !== columns.names.length)
      throw new Error(`${where}: expected ${columns.names.length} values as in the header, got ${fields.length}`);
    const numbers = columns.at.map((at, k) => {
      const number = /^[\d.e+-]+$/i.test(fields[at]) ? Number(fields[at]) : NaN;
      if (!Number.isFinite(Math.fround(number)))
        throw new Error(`${where}: ${columns.expected[k]}: expected a finite number, got '${fields[at].slice(0, 40)}'`);
      return number;
    });
    const value = numbers.slice(-3);
    let angles;
    try {
      if (columns.vectors) angles = [...anglesOf(numbers.slice(0, 3)), ...anglesOf(numbers.slice(3, 6))];
      else angles = numbers.slice(0, 4).map((x) => (columns.radians ? degreesOf(x) : x));
    } catch (error) {
      throw new Error(`${where}: ${error.message}`);
    }
    for (const k of [0, 2])
      if (!(angles[k] >= 0 && angles[k] <= 90))
        throw new Error(`${where}: ${columns.expected[k]}: expected ${columns.radians ? "radians from 0 to pi/2" : "degrees from 0 to 90"}, got ${numbers[k]}`);
    for (const k of [1, 3])
      if (!(Math.abs(angles[k]) <= 1e6)) throw new Error(`${where}: ${columns.expected[k]}: expected an azimuth, got ${numbers[k]}`);
    const steps = angles.map((x, k) => {
      const step = Math.round((k % 2 ? x - 360 * Math.floor(x / 360) : x) * STEPS);
      return k % 2 && step === 360 * STEPS ? 0 : step;
    });
    negative += value.filter((x) => x < 0).length;
    rows.push({ steps, value: value.map((x) => Math.fround(Math.max(x, 0))), line: i + 1 });
  }
  if (!rows.length) throw new Error("expected rows below the header, found none");
  if (columns.vectors) removeRounding(rows);
  return { rows, negative, columns };
}

/** The mean of rows by place, where azimuths of directions along the normal are 0, and by how much rows differ. */
function placesOf(rows, vectors) {
  const places = new Map(), lines = new Map();
  for (const { steps, value, line } of rows) {
    const key = String(steps), before = lines.get(key);
    // A direction along the normal has no azimuth: several rows may be of it.
    const several = vectors && [0, 2].some((k) => steps[k] === 0 && steps[k + 1] === 0);
    if (before && !several) {
      if (String(before.value) === String(value)) continue;
      const angles = ANGLES.map((name, k) => `${name} ${steps[k] / STEPS}`).join(", ");
      throw new Error(`line ${line}: expected each combination of angles once, or the same values: ${angles} is in line ${before.line}, too`);
    }
    lines.set(key, { value, line });
    const at = [...steps];
    for (const k of [1, 3]) if (at[k - 1] === 0) at[k] = 0;
    const place = places.get(String(at));
    if (place) place.push(value);
    else places.set(String(at), [value]);
  }
  let spread = 0;
  for (const [key, values] of places) {
    const mean = [0, 1, 2].map((c) => values.reduce((sum, v) => sum + v[c], 0) / values.length);
    for (let c = 0; c < 3; ++c) {
      const all = values.map((v) => v[c]);
      if (mean[c] > 0) spread = Math.max(spread, (Math.max(...all) - Math.min(...all)) / mean[c]);
    }
    places.set(key, mean);
  }
  return { places, spread };
}

/** Whether angles that are taken for degrees are likely to be radians. */
function looksLikeRadians(axes) {
  const thetas = new Set([...axes[0], ...axes[2]].filter((x) => x > 0));
  return thetas.size > 1 && axes.every((axis, k) => axis.at(-1) <= (k % 2 ? 2 : 0.5) * Math.PI + 1e-3);
}

/** What a reader returns for values on four axes in degrees, of which the last runs fastest. */
function gridOf(format, degrees, values, mirrored, notes) {
  const sizes = degrees.map((axis) => axis.length), width = Math.max(...sizes);
  const padded = degrees.flatMap((axis) => [...axis, ...Array(width - axis.length).fill(0)]);
  if (!values.some((x) => x > 0)) throw new Error("expected a number above 0, found none: the data are black");
  const highest = Math.min(degrees[0].at(-1), degrees[2].at(-1));
  if (highest < 89) notes.push(`Nothing was measured beyond ${highest} degrees to the normal: what is there holds beyond`);
  return {
    about:
      `Measured, ${format}: ${sizes[1] === 1 ? "isotropic" : "anisotropic"}, ${sizes[0]} x ${sizes[1]} directions of ` +
      `light, ${sizes[2]} x ${sizes[3]} of view, linear in between.`,
    notes,
    glsl: "measured_table",
    tables: { values: textureOf(values, 3), axes: textureOf(padded, 1, width) },
    constants: [`ivec4(${sizes.join(", ")})`, String(mirrored)],
  };
}

async function readUtia(file) {
  const thetas = Array.from({ length: 6 }, (_, i) => 15 * i), phis = Array.from({ length: 48 }, (_, i) => 7.5 * i);
  const directions = thetas.length * phis.length, entries = directions ** 2, bytes = 3 * 8 * entries;
  if (file.size !== bytes) {
    const doubt = file.size === bytes / 2 ? ": are these numbers in single precision?" : file.size < bytes ? ": truncated?" : "";
    throw new Error(`expected ${bytes} bytes, 3 planes of ${directions} x ${directions} doubles, as UTIA's files have, got ${file.size}${doubt}`);
  }
  const numbers = new Float64Array(await file.arrayBuffer()), values = new Float32Array(3 * entries);
  let negative = 0;
  numbers.forEach((x, i) => {
    const entry = i % entries, c = Math.floor(i / entries);
    if (!Number.isFinite(Math.fround(x)))
      throw new Error(`${["red", "green", "blue"][c]}: found ${x} in row ${Math.floor(entry / directions)}, column ${entry % directions}: expected finite numbers in little-endian byte order`);
    negative += x < 0;
    values[3 * entry + c] = Math.max(x, 0);
  });
  const notes = negative ? [`${counted(negative, "number is", "numbers are")} negative, ${percentOf(negative / numbers.length)} %: taken for 0`] : [];
  return gridOf("in UTIA's format", [thetas, phis, thetas, phis], values, false, notes);
}

async function readTable(file) {
  const { rows, negative, columns } = rowsOf(await file.text());
  const { places, spread } = placesOf(rows, columns.vectors);
  // An azimuth counts where it matters: not along the normal.
  const axes = ANGLES.map((_, k) => {
    const steps = rows.map((row) => row.steps).filter((s) => k % 2 === 0 || s[k - 1] !== 0).map((s) => s[k]);
    return steps.length ? [...new Set(steps)].sort((a, b) => a - b) : [0];
  });
  const degrees = axes.map((axis) => axis.map((step) => step / STEPS));
  if (columns.plain && looksLikeRadians(degrees))
    throw new Error("theta_i, theta_o: expected degrees, and all are small: name the columns theta_i_rad and so on for radians, theta_i_deg for such small degrees");
  const sizes = axes.map((axis) => axis.length), entries = sizes.reduce((a, b) => a * b);
  const found = `${ANGLES.map((name, k) => `${sizes[k]} ${name}`).join(", ")}, found ${counted(places.size, "row", "rows")}`;
  if (entries > 4 * places.size) throw new Error(`expected a row for every combination of angles: ${found}`);
  const values = new Float32Array(3 * entries);
  let at = 0;
  for (const a of axes[0])
    for (const b of axes[1])
      for (const c of axes[2])
        for (const d of axes[3]) {
          const value = places.get(`${a},${a ? b : 0},${c},${c ? d : 0}`);
          if (!value) {
            const missing = [a, b, c, d].map((step, k) => `${ANGLES[k]} ${step / STEPS}`).join(", ");
            throw new Error(`expected a row for every combination of angles: ${found}; none of ${missing}`);
          }
          values.set(value, at);
          at += 3;
        }
  const isotropic = sizes[1] === 1;
  if (isotropic && axes[1][0] !== 0) throw new Error(`phi_i: expected 0 where it has one value, got ${degrees[1][0]}`);
  const mirrored = isotropic && degrees[3].at(-1) <= 180;
  const notes = [];
  if (columns.others.length) notes.push(`Not known and not read: ${columns.others.join(", ")}`);
  if (negative) notes.push(`${counted(negative, "number is", "numbers are")} negative: taken for 0`);
  if (spread > ALIKE) notes.push(`Rows of one direction along the normal differ by up to ${percentOf(spread)} %: their mean is taken`);
  if (mirrored) notes.push("phi_o lies within half a circle: the other half is taken for its mirror image");
  return gridOf("a table", degrees, values, mirrored, notes);
}
