// SPDX-License-Identifier: GPL-3.0-or-later
// Reads RGL's files, as generator/measured/rgl.cpp, tensor_file.cpp and warp.cpp.
"use strict";

const TENSOR_MAGIC = "tensor_file\0";
/** Names and sizes of types by the number that stands for them in a file. */
const TENSOR_TYPES = [
  ["none", 0], ["uint8", 1], ["int8", 1], ["uint16", 2], ["int16", 2], ["uint32", 4],
  ["int32", 4], ["uint64", 8], ["int64", 8], ["float16", 2], ["float32", 4], ["float64", 8],
];
const UINT8 = 1, FLOAT32 = 10;

/** The fields of a tensor file. */
class TensorFile {
  constructor(buffer) {
    this.buffer = buffer;
    this.fields = new Map();
    const view = new DataView(buffer);
    let at = 0;
    const truncated = (what) => new Error(`${what}: expected its data inside the file, which has ${counted(buffer.byteLength, "byte", "bytes")}: truncated?`);
    const take = (bytes, what) => {
      if (at + bytes > buffer.byteLength) throw truncated(what);
      at += bytes;
      return at - bytes;
    };
    const text = (place, bytes) => String.fromCharCode(...new Uint8Array(buffer, place, bytes));
    if (buffer.byteLength < 18 || text(take(12), 12) !== TENSOR_MAGIC)
      throw new Error(`expected a tensor file, which starts with "tensor_file"`);
    const version = [view.getUint8(take(1)), view.getUint8(take(1))];
    if (version[0] !== 1) throw new Error(`version: expected 1.0, got ${version.join(".")}`);
    const count = view.getUint32(take(4), true);
    for (let i = 0; i < count; ++i) {
      const what = `field ${i + 1} of ${count}`, length = view.getUint16(take(2, what), true);
      const name = text(take(length, what), length).replace(/[^ -~]/g, "?");
      const dimensions = view.getUint16(take(2, name), true), type = view.getUint8(take(1, name));
      const place = Number(view.getBigUint64(take(8, name), true));
      if (!(type >= 1 && type < TENSOR_TYPES.length)) throw new Error(`${name}: expected a type from 1 to ${TENSOR_TYPES.length - 1}, got ${type}`);
      const shape = Array.from({ length: dimensions }, () => Number(view.getBigUint64(take(8, name), true)));
      const entries = shape.reduce((a, b) => a * b, 1);
      if (place + entries * TENSOR_TYPES[type][1] > buffer.byteLength) throw truncated(name);
      if (this.fields.has(name)) throw new Error(`${name}: expected each field once`);
      this.fields.set(name, { type, place, shape, entries });
    }
  }

  field(name, type) {
    const field = this.fields.get(name);
    if (!field) throw new Error(`${name}: expected this field, found none of the name`);
    if (field.type !== type) throw new Error(`${name}: expected numbers of type ${TENSOR_TYPES[type][0]}, got ${TENSOR_TYPES[field.type][0]}`);
    return field;
  }

  shape(name, dimensions) {
    const { shape } = this.field(name, FLOAT32);
    if (shape.length !== dimensions) throw new Error(`${name}: expected ${dimensions} dimensions, got ${shape.length}`);
    if (shape.includes(0)) throw new Error(`${name}: expected data, got a size of 0`);
    return shape;
  }

  numbers(name) {
    const { place, entries } = this.field(name, FLOAT32);
    const out = new Float32Array(this.buffer.slice(place, place + 4 * entries));
    const bad = out.findIndex((x) => !Number.isFinite(x));
    if (bad >= 0) throw new Error(`${name}: expected finite numbers, got ${out[bad]} at ${bad}`);
    return out;
  }

  /** Numbers that increase. */
  axis(name) {
    this.shape(name, 1);
    const out = this.numbers(name);
    for (let i = 1; i < out.length; ++i)
      if (!(out[i] > out[i - 1])) throw new Error(`${name}: expected increasing numbers, got ${out[i]} after ${out[i - 1]}`);
    return out;
  }

  /** Slices of height rows of width numbers, which are not negative, and not all 0. */
  slices(name, count, dimensions) {
    const [height, width] = this.shape(name, dimensions).slice(-2), data = this.numbers(name), size = width * height;
    if (width < 2 || height < 2) throw new Error(`${name}: expected at least 2 x 2 numbers a slice`);
    if (data.length !== count * size)
      throw new Error(`${name}: expected ${count} slices, one for each phi_i and theta_i, got ${data.length / size}`);
    const negative = data.find((x) => x < 0);
    if (negative !== undefined) throw new Error(`${name}: expected no number below 0, got ${negative}`);
    for (let s = 0; s < count; ++s)
      if (!data.subarray(s * size, (s + 1) * size).some((x) => x > 0)) throw new Error(`${name}: expected a number above 0, found none${count > 1 ? ` in slice ${s}` : ""}`);
    return { data, width, height, count };
  }
}

/**
 * Slices as distributions whose integral is 1: three numbers an entry, its value, the sum of its row up to the next
 * entry, and the sum of rows up to the next one. As Warp of generator/measured/warp.cpp.
 */
function cumulative({ data, width, height, count }) {
  const out = new Float32Array(3 * data.length), size = width * height;
  const stepX = 0.5 / (width - 1), stepY = 0.5 / (height - 1);
  for (let s = 0; s < count; ++s) {
    const value = (x, y) => data[s * size + y * width + x];
    const rows = new Float64Array(size), totals = new Float64Array(height);
    for (let y = 0; y < height; ++y)
      for (let x = 0, sum = 0; x < width; ++x) {
        if (x + 1 < width) sum += stepX * (value(x, y) + value(x + 1, y));
        rows[y * width + x] = sum;
      }
    let total = 0;
    for (let y = 0; y + 1 < height; ++y) {
      total += stepY * (rows[(y + 1) * width - 1] + rows[(y + 2) * width - 1]);
      totals[y] = total;
    }
    for (let i = 0; i < size; ++i)
      out.set([data[s * size + i] / total, rows[i] / total, totals[Math.floor(i / width)] / total], 3 * (s * size + i));
  }
  return out;
}

/**
 * What the numbers of each wavelength of a file add to red, green and blue: spectra are linear between wavelengths and
 * constant beyond.
 */
function sharesOf(nm) {
  const out = Array.from(nm, () => [0, 0, 0]), { first, step, rgb } = BRDFC.spectrum;
  rgb.forEach((color, i) => {
    const at = first + step * i, after = nm.findIndex((x) => x >= at), last = nm.length - 1;
    const second = after < 0 ? last : after, before = after < 0 ? last : Math.max(after - 1, 0);
    const weight = before === second ? 1 : (at - nm[before]) / (nm[second] - nm[before]);
    for (let c = 0; c < 3; ++c) {
      out[second][c] += weight * color[c];
      if (before !== second) out[before][c] += (1 - weight) * color[c];
    }
  });
  return out;
}

/** What each plane of a file's values adds to red, green and blue, and the name of their field. */
function channelsOf(tensors) {
  if (!tensors.fields.has("wavelengths")) return { name: "rgb", shares: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] };
  const nm = tensors.axis("wavelengths");
  if (nm[0] > 430 || nm.at(-1) < 650) throw new Error(`wavelengths: expected 430 to 650 nm at least, got ${nm[0]} to ${nm.at(-1)}`);
  return { name: "spectra", shares: sharesOf(nm) };
}

async function readRgl(file) {
  const tensors = new TensorFile(await file.arrayBuffer());
  const phis = tensors.axis("phi_i"), thetas = tensors.axis("theta_i"), count = phis.length * thetas.length;
  if (thetas[0] < 0 || thetas.at(-1) > 1.5708) throw new Error(`theta_i: expected radians from 0 to pi / 2, got ${thetas[0]} to ${thetas.at(-1)}`);
  if (Math.max(Math.abs(phis[0]), Math.abs(phis.at(-1))) > 6.2832) throw new Error(`phi_i: expected radians, got ${phis[0]} to ${phis.at(-1)}`);
  const ndf = tensors.slices("ndf", 1, 2), sigma = tensors.slices("sigma", 1, 2), vndf = tensors.slices("vndf", count, 4);
  const { name, shares } = channelsOf(tensors), channels = shares.length;
  const shape = tensors.shape(name, 5), [height, width] = shape.slice(-2), size = width * height;
  if (String(shape.slice(0, 3)) !== String([phis.length, thetas.length, channels]) || width < 2 || height < 2)
    throw new Error(`${name}: expected ${phis.length} x ${thetas.length} x ${channels} x n x n numbers, n at least 2, got ${shape.join(" x ")}`);
  const planes = tensors.numbers(name), rgb = new Float32Array(3 * count * size), notes = [];
  let negative = 0, largest = 0, jacobian = true;
  // The conversion of spectra is linear, as interpolation is, so it may come first.
  for (let slice = 0; slice < count; ++slice)
    for (let i = 0; i < size; ++i)
      for (let c = 0; c < 3; ++c) {
        let value = 0;
        for (let k = 0; k < channels; ++k) value += shares[k][c] * planes[(slice * channels + k) * size + i];
        rgb[3 * (slice * size + i) + c] = value;
        negative += value < 0;
        largest = Math.max(largest, value);
      }
  if (!(largest > 0)) throw new Error("expected a number above 0, found none: the data are black");
  if (tensors.fields.has("jacobian")) {
    const { place, entries } = tensors.field("jacobian", UINT8);
    if (entries !== 1) throw new Error(`jacobian: expected one byte, got ${entries}`);
    jacobian = new Uint8Array(tensors.buffer)[place] !== 0;
  } else notes.push("jacobian: not in the file, taken for 1");
  if (negative) notes.push(`${counted(negative, "number is", "numbers are")} negative: f is taken for 0 where they make it negative`);
  const isotropic = phis.length <= 2;
  // How many times the azimuths in the file go into a circle.
  const reduction = isotropic ? 1 : Math.round(Math.min((2 * Math.PI) / (phis.at(-1) - phis[0]), 100));
  const highest = (thetas.at(-1) * 180) / Math.PI;
  if (highest < 89) notes.push(`Nothing was measured beyond ${Number(highest.toPrecision(6))} degrees to the normal: what is there holds beyond`);
  const axisWidth = Math.max(phis.length, thetas.length), axes = new Float32Array(2 * axisWidth);
  axes.set(phis);
  axes.set(thetas, axisWidth);
  return {
    about:
      `Measured, in RGL's format: ${isotropic ? "isotropic" : "anisotropic"}, ${phis.length} x ${thetas.length} ` +
      `directions of view, ${height} x ${width} of light${name === "spectra" ? `, ${channels} wavelengths` : ""}.`,
    notes,
    glsl: "measured_rgl",
    tables: {
      axes: textureOf(axes, 1, axisWidth),
      ndf: textureOf(ndf.data, 1),
      sigma: textureOf(sigma.data, 1),
      vndf: textureOf(cumulative(vndf), 3),
      rgb: textureOf(rgb, 3),
    },
    constants: [
      `ivec2(${phis.length}, ${thetas.length})`,
      ...[ndf, sigma, vndf, { width, height }].map((slices) => `ivec2(${slices.width}, ${slices.height})`),
      ...[isotropic, jacobian, reduction].map(String),
    ],
  };
}
