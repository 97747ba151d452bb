// SPDX-License-Identifier: GPL-3.0-or-later
// Draws with WebGL 2: pictures of objects, and numbers about models. Knows nothing of the page.
"use strict";

/** Columns of textures that hold tables, as in library.glsl. */
const TABLE_COLUMNS = 256;
/** Samples of a picture after which drawing stops. */
const SAMPLES = { lamp: 16, sky: 400 };

/** The key of a choice's formulas in BRDFC.models[...].formulas. */
function choiceKey(model, values) {
  return BRDFC.models[model].parameters
    .filter((p) => p.kind === "choice")
    .map((p) => values[p.name])
    .join(" ");
}

/** The directions of a plane through the normal: angles from it, azimuth of the half with positive angles. */
function direction(theta, phi) {
  return [Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)];
}

/**
 * GLSL that makes a model available as eval_K, pdf_K, sample_K, mirror_K, transmit_K, iors_K and inside_K, with its
 * parameters as uniforms, and defines SCATTERS_K, MIRROR_K, TRANSMIT_K and THROUGH_K. Only what is in `needed` is compiled.
 */
function modelSource(slot, k, needed, functions, tables) {
  const model = BRDFC.models[slot.model];
  const formulas = model.formulas[choiceKey(slot.model, slot.values)];
  const parameters = model.parameters.filter((p) => p.kind !== "choice");
  let out = "";
  for (const p of parameters) out += `uniform ${p.kind === "color" ? "vec3" : "float"} p${k}_${p.name};\n`;
  const passed = parameters.map((p) => `p${k}_${p.name}`);
  const xyz = (...vectors) => vectors.flatMap((v) => [`${v}.x`, `${v}.y`, `${v}.z`]);
  const call = (what, inputs, results = []) => {
    const name = formulas[what];
    functions.set(name, model.functions[name].text);
    for (const table of model.functions[name].tables) tables.add(table);
    return `${name}(${[...inputs, ...passed, ...results].join(", ")})`;
  };
  const define = (what, head, inputs, none) => {
    if (!needed.includes(what)) return;
    const body = formulas[what] ? call(what, inputs) : none;
    out += `${head.replace("(", `_${k}(`)} { return ${body}; }\n`;
  };
  define("eval", "vec3 eval(vec3 wi, vec3 wo)", xyz("wi", "wo"), "vec3(0.0)");
  define("pdf", "float pdf(vec3 wi, vec3 wo)", xyz("wi", "wo"), "0.0");
  define("mirror", "vec3 mirror(vec3 wo)", xyz("wo"), "vec3(0.0)");
  define("transmit", "vec3 transmit(vec3 wo)", xyz("wo"), "vec3(0.0)");
  define("iors", "vec3 iors()", [], "vec3(1.0)");
  define("inside", "vec3 inside(float distance)", ["distance"], "vec3(1.0)");
  if (needed.includes("sample") && formulas.sample)
    out +=
      `void sample_${k}(vec3 wo, vec3 u, out vec3 wi, out vec3 weight, out float pdf) { ` +
      `${call("sample", xyz("wo", "u"), [...xyz("wi"), "weight", "pdf"])}; }\n`;
  if (formulas.eval) out = `#define SCATTERS_${k}\n${out}`;
  for (const what of ["mirror", "transmit", "through"])
    if (formulas[what]) out = `#define ${what.toUpperCase()}_${k}\n${out}`;
  return out;
}

/**
 * A model of BRDFC.models for measured data, which has no parameters: `name` is its key, in GLSL, too. The data are in
 * tables, as Renderer.addMeasured() makes them.
 */
function measuredModel(name, label, file, data) {
  const wi = "vec3(wi_x, wi_y, wi_z)", wo = "vec3(wo_x, wo_y, wo_z)";
  const pair = "float wi_x, float wi_y, float wi_z, float wo_x, float wo_y, float wo_z";
  const rows = `table_${name}_rows`, tables = [...Object.keys(data.tables), "rows"].map((t) => `${name}_${t}`);
  const given = [...Object.keys(data.tables).map((t) => `table_${name}_${t}`), ...data.constants].join(", ");
  const value = (light) => `${data.glsl}_eval(${given}, ${light}, ${wo})`;
  const functions = {
    [`${name}_eval`]: { tables, text: `vec3 ${name}_eval(${pair}) { return ${value(wi)}; }\n` },
    [`${name}_pdf`]: { tables, text: `float ${name}_pdf(${pair}) { return measured_pdf(${rows}, ${wi}, ${wo}); }\n` },
    [`${name}_sample`]: {
      tables,
      text:
        `void ${name}_sample(float wo_x, float wo_y, float wo_z, float u_x, float u_y, float u_z, out float wi_x, ` +
        "out float wi_y, out float wi_z, out vec3 weight, out float pdf)\n{\n" +
        `    vec3 wi = measured_sample(${rows}, ${wo}, vec3(u_x, u_y, u_z));\n` +
        "    wi_x = wi.x;\n    wi_y = wi.y;\n    wi_z = wi.z;\n" +
        `    pdf = measured_pdf(${rows}, wi, ${wo});\n` +
        `    weight = pdf > 0.0 ? ${value("wi")} * wi.z / pdf : vec3(0.0);\n}\n`,
    },
  };
  const formulas = { eval: `${name}_eval`, pdf: `${name}_pdf`, sample: `${name}_sample`, through: false };
  const doc = [data.about, ...data.notes.map((note) => `${note}.`)].join(" ");
  return { label, look: "measured", file, doc, glsl: data.glsl, parameters: [], formulas: { "": formulas }, functions };
}

class Renderer {
  /** Throws an Error that says what the browser lacks. */
  constructor() {
    this.canvas = document.createElement("canvas");
    const gl = this.canvas.getContext("webgl2", { alpha: true, premultipliedAlpha: true, antialias: false });
    if (!gl) throw new Error("This browser offers no WebGL 2. Update it, or turn on hardware acceleration in its settings.");
    this.gl = gl;
    this.targets = new Map();
    if (!gl.getExtension("EXT_color_buffer_float") || !this.isComplete(this.target("trial", 1, 1)))
      throw new Error("This device can't draw into float textures (EXT_color_buffer_float), which the pictures need.");
    this.lost = false;
    this.canvas.addEventListener("webglcontextlost", () => {
      this.lost = true;
    });
    this.programs = new Map();
    this.tables = new Map();
    gl.disable(gl.DITHER);
    this.lobes = new Map();
    this.plain = gl.createVertexArray();
    gl.bindVertexArray(this.plain);
    this.vertex = this.shader(
      gl.VERTEX_SHADER,
      "#version 300 es\nvoid main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }\n",
    );
  }

  shader(type, text) {
    const { gl } = this;
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    return shader;
  }

  /** The program of a shader in BRDFC.glsl for models; compiled when it is first asked for. */
  program(name, slots, needed) {
    const key = [name, ...slots.map((s) => `${s.model} ${choiceKey(s.model, s.values)}`)].join("|");
    const found = this.programs.get(key);
    if (found) return found;
    const { gl } = this;
    const functions = new Map(), tables = new Set();
    const wrappers = slots.map((s, k) => modelSource(s, k, needed, functions, tables));
    const text = [
      "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;",
      BRDFC.glsl.library,
      ...this.measuredGlsl(slots),
      ...[...tables].map((t) => `uniform sampler2D table_${t};`),
      ...functions.values(),
      ...wrappers,
      BRDFC.glsl.scene,
      BRDFC.glsl[name],
    ].join("\n");
    const fragment = this.shader(gl.FRAGMENT_SHADER, text);
    const program = gl.createProgram();
    const own = BRDFC.glsl[`${name}_vertex`];
    const vertex = own ? this.shader(gl.VERTEX_SHADER, `#version 300 es\n${own}`) : this.vertex;
    gl.attachShader(program, vertex);
    gl.attachShader(program, fragment);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(`${key}: ${gl.getShaderInfoLog(fragment) || gl.getProgramInfoLog(program)}`);
    gl.deleteShader(fragment);
    if (own) gl.deleteShader(vertex);
    const uniforms = new Map();
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; ++i) {
      const info = gl.getActiveUniform(program, i);
      uniforms.set(info.name, { type: info.type, at: gl.getUniformLocation(program, info.name) });
    }
    const made = { program, uniforms, tables };
    this.programs.set(key, made);
    return made;
  }

  /** The GLSL that is written by hand for the measured data among models. */
  measuredGlsl(slots) {
    const names = slots.map((s) => BRDFC.models[s.model].glsl).filter(Boolean);
    return names.length ? [BRDFC.glsl.measured, ...[...new Set(names)].map((n) => BRDFC.glsl[n])] : [];
  }

  texture(width, height, format, data) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const layout = { [gl.R32F]: gl.RED, [gl.RGB32F]: gl.RGB }[format] || gl.RGBA;
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, layout, gl.FLOAT, data);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    return texture;
  }

  table(name) {
    if (!this.tables.has(name)) {
      const bytes = Uint8Array.from(atob(BRDFC.tables[name]), (c) => c.charCodeAt(0));
      const values = new Float32Array(bytes.buffer);
      const rows = Math.ceil(values.length / TABLE_COLUMNS);
      const padded = new Float32Array(rows * TABLE_COLUMNS);
      padded.set(values);
      this.tables.set(name, this.texture(TABLE_COLUMNS, rows, this.gl.R32F, padded));
    }
    return this.tables.get(name);
  }

  /** Makes the tables of a measuredModel() that is in BRDFC.models. */
  addMeasured(name, tables) {
    try {
      this.fillMeasured(name, tables);
    } catch (error) {
      for (const table of [...Object.keys(tables), "rows"]) {
        this.gl.deleteTexture(this.tables.get(`${name}_${table}`) || null);
        this.tables.delete(`${name}_${table}`);
      }
      throw error;
    }
  }

  fillMeasured(name, tables) {
    const { gl } = this;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    while (gl.getError() !== gl.NO_ERROR);
    for (const [table, { width, height, channels, data }] of Object.entries(tables)) {
      if (height > most) throw new Error("expected less data: they are too many for this device");
      const format = { 1: gl.R32F, 3: gl.RGB32F, 4: gl.RGBA32F }[channels];
      this.tables.set(`${name}_${table}`, this.texture(width, height, format, data));
    }
    if (gl.getError() !== gl.NO_ERROR) throw new Error("expected less data: this device has no memory for them");
    // The data themselves tell how to sample them: any rows do to evaluate f.
    const rows = (data) => {
      const key = `${name}_rows`;
      if (this.tables.has(key)) gl.deleteTexture(this.tables.get(key));
      this.tables.set(key, this.texture(HALF_ROWS + 1, 1, gl.RGBA32F, data));
    };
    rows(new Float32Array(4 * HALF_ROWS + 4));
    const pairs = halfVectorPairs();
    rows(halfVectorRows(pairs, this.evaluate({ model: name, values: {} }, pairs.lights, pairs.views)));
  }

  /** A float texture that can be drawn into; one of these for each key, made anew if its size changes. */
  target(key, width, height) {
    const { gl } = this;
    let target = this.targets.get(key);
    if (target && (target.width !== width || target.height !== height)) {
      gl.deleteFramebuffer(target.framebuffer);
      gl.deleteTexture(target.texture);
      target = undefined;
    }
    if (!target) {
      const texture = this.texture(width, height, gl.RGBA32F, null);
      const framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      target = { texture, framebuffer, width, height };
      this.targets.set(key, target);
    }
    return target;
  }

  isComplete(target) {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, target.framebuffer);
    return this.gl.checkFramebufferStatus(this.gl.FRAMEBUFFER) === this.gl.FRAMEBUFFER_COMPLETE;
  }

  /** Makes a program the one that draws, with its uniforms, into the target, or into the canvas if that is null. */
  use(made, target, slots, values) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target ? target.framebuffer : null);
    gl.viewport(0, 0, target ? target.width : this.canvas.width, target ? target.height : this.canvas.height);
    gl.useProgram(made.program);
    const all = { ...values };
    slots.forEach((slot, k) => {
      for (const p of BRDFC.models[slot.model].parameters)
        if (p.kind !== "choice") all[`p${k}_${p.name}`] = slot.values[p.name];
    });
    for (const name of made.tables) all[`table_${name}`] = this.table(name);
    let unit = 0;
    for (const [name, { type, at }] of made.uniforms) {
      const value = all[name];
      if (type === gl.SAMPLER_2D) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, value);
        gl.uniform1i(at, unit++);
      } else if (type === gl.FLOAT) gl.uniform1f(at, value);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(at, value);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(at, value);
      else gl.uniform1i(at, value);
    }
    gl.activeTexture(gl.TEXTURE0);
  }

  /** Runs a program for each pixel of the target, or of the canvas if that is null. */
  draw(made, target, slots, values) {
    this.use(made, target, slots, values);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
  }

  read(target) {
    const { gl } = this;
    const out = new Float32Array(4 * target.width * target.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.readPixels(0, 0, target.width, target.height, gl.RGBA, gl.FLOAT, out);
    return out;
  }

  /** f and pdf, four numbers a pair, for arrays of unit vectors wi and wo. */
  evaluate(slot, lights, views) {
    const width = 256, height = Math.ceil(lights.length / width);
    const made = this.program("values", [slot], ["eval", "pdf"]);
    const packed = (vectors) => {
      const data = new Float32Array(4 * width * height);
      for (let i = 0; i < width * height; ++i) data.set(vectors[Math.min(i, vectors.length - 1)], 4 * i);
      return this.texture(width, height, this.gl.RGBA32F, data);
    };
    const textures = { lights: packed(lights), views: packed(views) };
    const target = this.target(`values ${height}`, width, height);
    this.draw(made, target, [slot], textures);
    for (const texture of Object.values(textures)) this.gl.deleteTexture(texture);
    return this.read(target).subarray(0, 4 * lights.length);
  }

  /** The mean of a target's rows. */
  columns(target) {
    const pixels = this.read(target), width = 4 * target.width;
    const out = new Float64Array(width);
    pixels.forEach((x, i) => {
      out[i % width] += x / target.height;
    });
    return out;
  }

  /** The albedo, four numbers an angle, for `count` angles evenly from 0 to nearly 90 degrees. */
  albedo(slot, count, azimuth) {
    const made = this.program("albedo", [slot], ["sample", "mirror", "transmit"]);
    // Data are not sampled as well as formulas.
    const rows = BRDFC.models[slot.model].file ? 128 : 32, target = this.target(`albedo ${rows}`, count, rows);
    this.draw(made, target, [slot], { columns: count - 1, azimuth });
    return this.columns(target);
  }

  /** The sum of |f - g| cos over that of f cos, in the view at an angle and in all views. */
  difference(slots, angle, azimuth) {
    const made = this.program("difference", slots, ["eval", "pdf", "sample", "mirror", "transmit"]);
    const views = 16, target = this.target("difference", views + 1, 32);
    this.draw(made, target, slots, { columns: views + 1, angle, azimuth });
    const found = this.columns(target);
    let off = 0, all = 0;
    for (let i = 0; i < views; ++i) {
      // Views from everywhere, weighted by their cosine.
      const weight = Math.sin((Math.PI * (i + 0.5)) / views);
      off += weight * found[4 * i];
      all += weight * found[4 * i + 1];
    }
    return { here: found[4 * views] / found[4 * views + 1], everywhere: off / all };
  }

  /** Adds a sample to the picture of a slot unless that is finished; `picture` is its state, which begins as {}. */
  addSample(picture, key, slot, view, size, lamp, shape = "sphere") {
    if (picture.samples >= SAMPLES[view]) return;
    const number = picture.samples || 0;
    const needed = view === "lamp" ? ["eval"] : ["eval", "pdf", "sample", "mirror", "transmit", "iors", "inside"];
    const made = this.program(view, [slot], needed);
    const from = this.target(`${key} ${number % 2}`, size, size), to = this.target(`${key} ${1 - (number % 2)}`, size, size);
    if (number === 0) {
      this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, from.framebuffer);
      this.gl.clearColor(0, 0, 0, 0);
      this.gl.clear(this.gl.COLOR_BUFFER_BIT);
    }
    // The first sample is in the pixel's centre; the others fill the pixel evenly.
    const offset = [((number * 0.7548776662 + 0.5) % 1) - 0.5, ((number * 0.5698402910 + 0.5) % 1) - 0.5];
    this.draw(made, to, [slot], { sum: from.texture, size: [size, size], offset, lamp, number, is_knot: shape === "knot" });
    picture.sum = to;
    picture.samples = number + 1;
  }

  /** The colours of ideal reflection and refraction of light from a direction, and the index of refraction of green. */
  shares(slot, from) {
    const made = this.program("shares", [slot], ["mirror", "transmit", "iors"]);
    const target = this.target("shares", 3, 1);
    this.draw(made, target, [slot], { from });
    const found = Array.from(this.read(target));
    return { mirror: found.slice(0, 3), transmit: found.slice(4, 7), ior: found[9] };
  }

  /** Takes the mesh of a lobe, as lobeMesh() makes it, in the place of the one that had this key. */
  fillLobe(key, mesh) {
    const { gl } = this;
    if (!this.lobes.has(key)) {
      const made = { array: gl.createVertexArray(), vertices: gl.createBuffer(), triangles: gl.createBuffer() };
      gl.bindVertexArray(made.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, made.vertices);
      for (const [at, first, count] of [[0, 0, 3], [1, 3, 3], [2, 6, 4]]) {
        gl.enableVertexAttribArray(at);
        gl.vertexAttribPointer(at, count, gl.FLOAT, false, 4 * LOBE_NUMBERS, 4 * first);
      }
      this.lobes.set(key, made);
    }
    const lobe = this.lobes.get(key);
    gl.bindVertexArray(lobe.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, lobe.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(mesh.vertices), gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, lobe.triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(mesh.triangles), gl.DYNAMIC_DRAW);
    gl.bindVertexArray(this.plain);
    Object.assign(lobe, { opaque: mesh.opaque, count: mesh.triangles.length });
  }

  /** Shows a lobe, with four pixels for each of the canvas, whose edges are smooth then. */
  showLobe(canvas, key, view, size) {
    const { gl } = this, lobe = this.lobes.get(key);
    if (this.canvas.width !== 2 * size) this.canvas.width = this.canvas.height = 2 * size;
    if (canvas.width !== size) canvas.width = canvas.height = size;
    this.use(this.program("lobe", [], []), null, [], view);
    gl.bindVertexArray(lobe.array);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.drawElements(gl.TRIANGLES, lobe.opaque, gl.UNSIGNED_INT, 0);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawElements(gl.TRIANGLES, lobe.count - lobe.opaque, gl.UNSIGNED_INT, 4 * lobe.opaque);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.plain);
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, size, size);
    context.drawImage(this.canvas, 0, 0, size, size);
  }

  /** Copies a picture, or the difference of two, to a 2D canvas. */
  show(canvas, picture, scale, other) {
    const size = picture.sum.width;
    if (this.canvas.width !== size) this.canvas.width = this.canvas.height = size;
    if (canvas.width !== size) canvas.width = canvas.height = size;
    const made = this.program("display", [], []);
    this.gl.clearColor(0, 0, 0, 0);
    this.draw(made, null, [], {
      sum: picture.sum.texture,
      other: (other || picture).sum.texture,
      difference: other ? 1 : 0,
      scale,
      samples: picture.samples,
    });
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, size, size);
    context.drawImage(this.canvas, 0, 0);
  }
}
