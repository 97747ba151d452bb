// SPDX-License-Identifier: GPL-3.0-or-later
// Lobes as meshes: the surface whose distance from the origin is f cos of the view, for one direction of light.
"use strict";

/** Rings about the mirror direction and rays from it, and the power by which the rings are narrower within. */
const LOBE_RINGS = 80, LOBE_RAYS = 160, LOBE_POWER = 4;
/** Linear colours, with alpha. */
const LOBE_COLORS = { light: [1, 0.65, 0.08, 1], mirror: [0.45, 0.5, 0.55, 1], disk: [0.45, 0.5, 0.6, 0.35], rim: [0.25, 0.28, 0.33, 1] };
/** Numbers a vertex: position, normal, colour and alpha. */
const LOBE_NUMBERS = 10;

const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/**
 * Directions over the hemisphere, or the sphere, and triangles between them. The half on the side of the mirror direction
 * has rings about that; the other half is its image, with rings about the light. Points are those of a disk on which areas
 * are solid angles.
 */
function lobeDirections(theta, phi, through) {
  const centre = Math.SQRT2 * Math.sin(theta / 2);
  const rays = Array.from({ length: LOBE_RAYS }, (_, i) => ((2 * i + 1) / LOBE_RAYS - 1) * Math.PI);
  // If the two directions are one, its rings fill the disk. If not, there are rays to even steps on the line between the halves.
  const isOne = centre < 1e-4;
  if (!isOne) for (let i = -24; i <= 24; ++i) rays.push(Math.atan2(i / 24, -centre));
  rays.sort((a, b) => a - b);
  const directions = [], triangles = [];
  for (const above of through ? [1, -1] : [1]) {
    const onLine = new Map();
    for (const side of isOne ? [1] : [1, -1]) {
      const at = rays.map((ray, i) => {
        const [x, y] = [Math.cos(ray), Math.sin(ray)];
        const toRim = Math.sqrt(Math.max(0, 1 - (centre * y) ** 2)) - centre * x;
        const toLine = x < 0 && !isOne ? centre / -x : Infinity;
        return Array.from({ length: LOBE_RINGS + 1 }, (_, ring) => {
          // The halves share the vertices of the line between them.
          const shared = ring === LOBE_RINGS && toLine <= toRim;
          if (shared && onLine.has(i)) return onLine.get(i);
          const way = Math.min(toRim, toLine) * (ring / LOBE_RINGS) ** LOBE_POWER;
          const u = side * (shared ? 0 : centre + way * x), v = way * y, r2 = Math.min(1, u * u + v * v), s = Math.sqrt(2 - r2);
          const z = above * Math.max(1e-5, 1 - r2);
          directions.push([s * (u * Math.cos(phi) - v * Math.sin(phi)), s * (u * Math.sin(phi) + v * Math.cos(phi)), z]);
          if (shared) onLine.set(i, directions.length - 1);
          return directions.length - 1;
        });
      });
      at.forEach((ray, i) => {
        const next = at[(i + 1) % at.length];
        for (let ring = 0; ring < LOBE_RINGS; ++ring)
          triangles.push(ray[ring], ray[ring + 1], next[ring + 1], ray[ring], next[ring + 1], next[ring]);
      });
    }
  }
  return { directions, triangles };
}

/** A rod, or a cone, of 12 sides; one that is not lit is as bright everywhere. */
function addRod(mesh, from, to, radius, end, color, lit) {
  const minus = (a, b) => a.map((x, i) => x - b[i]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((x) => x / Math.hypot(...a));
  const along = unit(minus(to, from)), x = unit(cross(along, Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), y = cross(along, x);
  const first = mesh.vertices.length / LOBE_NUMBERS, sides = 12;
  for (let i = 0; i < sides; ++i) {
    const a = (2 * Math.PI * i) / sides, n = x.map((_, k) => Math.cos(a) * x[k] + Math.sin(a) * y[k]);
    for (const [point, r] of [[from, radius], [to, end]]) mesh.vertices.push(...point.map((p, k) => p + r * n[k]), ...n.map((x) => (lit ? x : 0)), ...color);
    const at = first + 2 * i, next = first + 2 * ((i + 1) % sides);
    mesh.triangles.push(at, at + 1, next + 1, at, next + 1, next);
  }
}

function addArrow(mesh, to, color) {
  const length = Math.hypot(...to), tip = Math.min(0.12, 0.5 * length);
  const neck = to.map((x) => x * (1 - tip / length));
  addRod(mesh, [0, 0, 0], neck, 0.022, 0.022, color, true);
  addRod(mesh, neck, to, 0.055, 0, color, true);
}

/** The circle of the surface, and on it the line of azimuth 0. */
function addDisk(mesh) {
  const sides = 96, place = (i, r) => [r * Math.cos((2 * Math.PI * i) / sides), r * Math.sin((2 * Math.PI * i) / sides), 0];
  for (let i = 0; i < sides; ++i) addRod(mesh, place(i, 1), place(i + 1, 1), 0.007, 0.007, LOBE_COLORS.rim);
  addRod(mesh, [0, 0, 0], [1, 0, 0], 0.007, 0.007, LOBE_COLORS.rim);
  // What is seen through comes last.
  mesh.opaque = mesh.triangles.length;
  const first = mesh.vertices.length / LOBE_NUMBERS;
  for (let i = 0; i < sides; ++i) {
    mesh.vertices.push(...place(i, 1), 0, 0, 1, ...LOBE_COLORS.disk);
    mesh.triangles.push(first, first + i, first + ((i + 1) % sides));
  }
}

/** The largest of the values' luminances times the cosine. */
function lobeTop(directions, values) {
  return directions.reduce((top, d, i) => {
    const y = luminance(values[4 * i], values[4 * i + 1], values[4 * i + 2]) * Math.abs(d[2]);
    return Number.isFinite(y) ? Math.max(top, y) : top;
  }, 0);
}

/**
 * The mesh of a lobe, whose largest radius is 1, with the directions of the light and of its mirror image. `at` takes a
 * fraction of the largest value to a radius. `shares` are colours of ideal reflection and refraction, and the ratio of
 * indices of refraction.
 */
function lobeMesh({ directions, triangles }, values, top, at, [theta, phi], shares) {
  const mesh = { vertices: [], triangles: [], opaque: 0 };
  if (top > 0) {
    const points = [], normals = new Float64Array(3 * directions.length);
    directions.forEach((d, i) => {
      const y = luminance(values[4 * i], values[4 * i + 1], values[4 * i + 2]) * Math.abs(d[2]);
      const radius = Number.isFinite(y) && y > 0 ? at(y / top) : 0;
      points.push(d.map((x) => radius * x));
    });
    for (let t = 0; t < triangles.length; t += 3) {
      const [i, j, k] = [triangles[t], triangles[t + 1], triangles[t + 2]], [a, b, c] = [points[i], points[j], points[k]];
      const [bx, by, bz, cx, cy, cz] = [b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]];
      const n = [by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx];
      // Outwards: away from the origin.
      const sign = n[0] * (a[0] + b[0] + c[0]) + n[1] * (a[1] + b[1] + c[1]) + n[2] * (a[2] + b[2] + c[2]) < 0 ? -1 : 1;
      for (const vertex of [i, j, k]) for (let x = 0; x < 3; ++x) normals[3 * vertex + x] += sign * n[x];
    }
    points.forEach((p, i) => {
      const n = normals.subarray(3 * i, 3 * i + 3), size = Math.hypot(n[0], n[1], n[2]) || 1;
      const rgb = [0, 1, 2].map((c) => Math.max(0, values[4 * i + c])), most = Math.max(...rgb);
      const color = most > 0 && Number.isFinite(most) ? rgb.map((x) => x / most) : [1, 1, 1];
      mesh.vertices.push(p[0], p[1], p[2], n[0] / size, n[1] / size, n[2] / size, color[0], color[1], color[2], 1);
    });
    mesh.triangles = triangles.slice();
  }
  const long = (d, length) => d.map((x) => x * length);
  const light = direction(-theta, phi), mirror = direction(theta, phi);
  addRod(mesh, [0, 0, 0], long(light, 1.15), 0.012, 0.012, LOBE_COLORS.light);
  // The light comes in.
  addRod(mesh, long(light, 0.62), long(light, 0.5), 0.045, 0, LOBE_COLORS.light);
  addRod(mesh, [0, 0, 0], long(mirror, 1.15), 0.009, 0.009, LOBE_COLORS.mirror);
  const sine = Math.sin(theta) / shares.ior, down = -Math.sqrt(Math.max(0, 1 - sine * sine));
  const refracted = [sine * Math.cos(phi), sine * Math.sin(phi), down];
  for (const [share, towards] of [[shares.mirror, mirror], [shares.transmit, refracted]]) {
    const length = luminance(...share), most = Math.max(...share);
    if (length > 1e-3) addArrow(mesh, long(towards, length), [...share.map((x) => x / most), 1]);
  }
  addDisk(mesh);
  return mesh;
}
