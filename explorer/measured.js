// SPDX-License-Identifier: GPL-3.0-or-later
// Reads files of measured BRDFs, and has what samples them. Knows nothing of the page.
//
// A reader of a format gets a File, and returns {about, notes, glsl, tables, constants}: sentences; the name of the
// GLSL that has the function GLSL_eval(tables..., constants..., wi, wo); textures by name; and constants in GLSL. It
// throws an Error that says what was expected.
"use strict";

/** How the names of files end that can be read. */
const MEASURED_READERS = { ".binary": readMerl, ".bsdf": readRgl, ".bin": readUtia, ".csv": readTable };
/** Those that brdfc reads, too. */
const OTHER_FORMATS = [".alta", ".dat", ".xml"];
const COLUMNS_OF_NUMBERS = 1024;

/** Rows of half vectors, and of the pairs of directions that are tried for each: of views about it, and of azimuths. */
const HALF_ROWS = 90, ROW_VIEWS = 256, ROW_AZIMUTHS = 8;
/** Shares of samples that may be drawn from the cosine. */
const COSINE_SHARES = [0.2, 0.35, 0.5, 0.7];

const counted = (count, one, many) => `${count} ${count === 1 ? one : many}`;
const percentOf = (share) => String(Number((100 * share).toPrecision(2)));

/** A texture of numbers, 1, 3 or 4 to a pixel, row by row. */
function textureOf(numbers, channels, width = COLUMNS_OF_NUMBERS) {
  const height = Math.ceil(numbers.length / channels / width);
  const data = new Float32Array(channels * width * height);
  data.set(numbers);
  return { width, height, channels, data };
}

/** (1 - cos theta) / 2 where a row begins. In single precision the cosine itself does not tell the first rows apart. */
const versineOf = (row) => Math.sin(((row / HALF_ROWS) ** 2 * Math.PI) / 4) ** 2;

/** A direction of angles about a half vector, and its mirror direction. */
function pairAbout(half, phi, theta, turn) {
  const [s, c, x, y, z] = [Math.sin(half), Math.cos(half), ...direction(theta, turn)];
  const turned = ([a, b, d]) => [a * Math.cos(phi) - b * Math.sin(phi), a * Math.sin(phi) + b * Math.cos(phi), d];
  return [[c * x + s * z, y, c * z - s * x], [s * z - c * x, -y, c * z + s * x]].map(turned);
}

/** Pairs of directions, for which halfVectorRows() needs f: views by the cosine about half vectors, then those along
 * the normal. */
function halfVectorPairs() {
  const lights = [], views = [];
  const add = ([light, view]) => {
    lights.push(light);
    views.push(view);
  };
  for (let row = 0; row < HALF_ROWS; ++row) {
    for (let i = 0; i < ROW_VIEWS; ++i) {
      const u = [0.819172513, 0.671043607, 0.549700478].map((a) => ((row * ROW_VIEWS + i + 1) * a) % 1);
      const versine = versineOf(row) + (versineOf(row + 1) - versineOf(row)) * ((i + 0.5) / ROW_VIEWS);
      add(pairAbout(2 * Math.asin(Math.sqrt(versine)), 2 * Math.PI * u[0], Math.asin(Math.sqrt(u[1])), 2 * Math.PI * u[2]));
    }
    const half = ((row + 0.5) / HALF_ROWS) ** 2 * (Math.PI / 2);
    for (let i = 0; i < ROW_AZIMUTHS; ++i) add(pairAbout(half, (2 * Math.PI * i) / ROW_AZIMUTHS, half, 0));
  }
  return { lights, views };
}

/**
 * A distribution of half vectors for sampling, by rows of theta_h, as HalfVectors of generator/measured: four numbers a
 * row, the sum up to its end, the density per solid angle, and versineOf() its beginning and end. The last number is
 * the share of the cosine lobe, that with the least variance in the view along the normal. `values` has four numbers
 * for each of the pairs, f first.
 */
function halfVectorRows({ lights, views }, values) {
  const luminance = (i) => 0.2126 * values[4 * i] + 0.7152 * values[4 * i + 1] + 0.0722 * values[4 * i + 2];
  const mean = (first, count, of) => {
    let sum = 0;
    for (let i = first; i < first + count; ++i) if (lights[i][2] > 0 && views[i][2] > 0) sum += of(i) / count;
    return sum;
  };
  const rows = Array.from({ length: HALF_ROWS }, (_, row) => {
    const first = row * (ROW_VIEWS + ROW_AZIMUTHS), normal = first + ROW_VIEWS;
    const theta = ((row + 0.5) / HALF_ROWS) ** 2 * (Math.PI / 2);
    return {
      area: 4 * Math.PI * (versineOf(row + 1) - versineOf(row)),
      density: mean(first, ROW_VIEWS, (i) => luminance(i) * lights[i][2] * views[i][2]),
      toHalf: 4 * Math.cos(theta),
      cos: Math.cos(2 * theta),
      square: mean(normal, ROW_AZIMUTHS, (i) => luminance(i) ** 2),
    };
  });
  const total = rows.reduce((sum, r) => sum + r.area * r.density, 0);
  const out = new Float32Array(4 * HALF_ROWS + 4);
  let sum = 0;
  rows.forEach((r, row) => {
    r.density /= total > 0 ? total : 1;
    sum += r.area * r.density;
    out.set([sum, r.density, versineOf(row), versineOf(row + 1)], 4 * row);
  });
  const moment = (share) =>
    rows.reduce((m, { area, density, toHalf, cos, square }) => {
      const pdf = (share * cos) / Math.PI + ((1 - share) * density) / toHalf;
      return cos > 0 ? m + (area * toHalf * square * cos * cos) / pdf : m;
    }, 0);
  out[4 * HALF_ROWS + 3] = total > 0 ? COSINE_SHARES.reduce((best, share) => (moment(share) < moment(best) ? share : best)) : 1;
  return out;
}

/** Reads a File; throws an Error with a sentence that names it and says what was expected. */
async function readMeasured(file) {
  const ending = /\.[^.]*$/.exec(file.name.toLowerCase())?.[0];
  const reader = Object.hasOwn(MEASURED_READERS, ending) ? MEASURED_READERS[ending] : undefined;
  const known = Object.keys(MEASURED_READERS).join(", ");
  if (!reader)
    throw new Error(
      `${file.name}: expected a file whose name ends with one of ${known}` +
        (OTHER_FORMATS.includes(ending) ? "; brdfc measured reads this one, too." : "."),
    );
  try {
    return await reader(file);
  } catch (error) {
    // The browser's own errors: a folder, or a file that was moved or may not be read.
    const why = error instanceof DOMException ? "expected a file that can be read; this one can't" : error.message;
    throw new Error(`${file.name}: ${why}${why.endsWith("?") ? "" : "."}`);
  }
}
