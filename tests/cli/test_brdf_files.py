# SPDX-License-Identifier: GPL-3.0-or-later
"""`brdfc build --brdf`: files of BRDF Explorer, read as it reads them, in a headless Chromium.

BRDF Explorer itself needs a desktop. GLSL of version 4.10, which it uses, has all that GLSL ES 3.00
has, which Chromium runs.
"""

import csv
import io
import json
import subprocess

import numpy as np
import pytest
from browser import found_by_page
from support import BROWSERS, CHROMIUM, LISTED, TOOL, run

pytestmark = pytest.mark.slow

PAGE = """<pre id="found"></pre><script>
const gl = document.createElement("canvas").getContext("webgl2");
gl.getExtension("EXT_color_buffer_float");
const texture = gl.createTexture();
gl.bindTexture(gl.TEXTURE_2D, texture);
gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, PAIRS.length, 1);
gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
const compiled = (kind, text) => {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, "#version 300 es\\nprecision highp float;\\n" + text);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
  return shader;
};
const found = {};
for (const {name, uniforms, text, values} of FILES)
  try {
    const program = gl.createProgram();
    gl.attachShader(program, compiled(gl.VERTEX_SHADER, `void main() {
      gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1);
    }`));
    gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, uniforms + text +
      `uniform vec3 lights[${PAIRS.length}], views[${PAIRS.length}]; out vec4 color;
       void main() {
         int i = int(gl_FragCoord.x);
         mat3 axes = mat3(1);
         color = vec4(BRDF(lights[i], views[i], axes[2], axes[0], axes[1]), 1);
       }`));
    gl.linkProgram(program);
    const linked = gl.getProgramParameter(program, gl.LINK_STATUS);
    if (!linked) throw Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    const at = (key) => gl.getUniformLocation(program, key);
    gl.uniform3fv(at("lights"), PAIRS.flatMap(([light]) => light));
    gl.uniform3fv(at("views"), PAIRS.flatMap(([, view]) => view));
    for (const [key, value] of Object.entries(values))
      if (value.length === 3) gl.uniform3fv(at(key), value);
      else gl.uniform1f(at(key), value[0]);
    gl.viewport(0, 0, PAIRS.length, 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const pixels = new Float32Array(4 * PAIRS.length);
    gl.readPixels(0, 0, PAIRS.length, 1, gl.RGBA, gl.FLOAT, pixels);
    found[name] = Array.from(pixels);
  } catch (error) {
    found[name] = error.message;
  }
document.getElementById("found").textContent = JSON.stringify(found);
</script>"""


def _unit(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]


PAIRS = [
    (_unit(theta, phi), _unit(view, 0))
    for view in (5, 44, 75)
    for theta, phi in ((0, 0), (20, 50), (60, 110), (80, 180), (view + 3, 181), (view, 30))
]


def read(path):
    """The sections of a file, as BRDF Explorer reads them: it drops lines that begin with #."""
    first, *lines = path.read_text(encoding="utf-8").splitlines()
    assert first == "analytic"
    sections, inside = {}, None
    for line in lines:
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] == "::begin":
            assert inside is None
            inside = words[1]
            sections[inside] = []
        elif words[0] == "::end":
            assert words[1] == inside
            inside = None
        elif inside:
            sections[inside].append(line)
    return sections


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("brdf") / "files"
    done = run("build", "--all", "--brdf", out)
    assert done.returncode == 0, done.stderr
    assert "without glass: an ideal mirror or glass alone" in done.stderr
    assert "without coupled-dielectric: its formula reads tables" in done.stderr
    return out


@pytest.fixture(scope="module")
def values(folder, tmp_path_factory):
    """By file: f of each pair with the default parameters, or an error."""
    if CHROMIUM is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed: the files were not tried")
    files = []
    for path in sorted(folder.iterdir()):
        sections = read(path)
        uniforms, given = "", {}
        for line in sections["parameters"]:
            kind, name, *numbers = line.split()
            uniforms += f"uniform {'vec3' if kind == 'color' else 'float'} {name};\n"
            given[name] = [float(x) for x in (numbers if kind == "color" else numbers[2:])]
            if kind == "float":
                low, high, value = map(float, numbers)
                assert low <= value <= high
        text = "\n".join(sections["shader"]) + "\n"
        files.append({"name": path.stem, "uniforms": uniforms, "text": text, "values": given})
    page = tmp_path_factory.mktemp("page") / "page.html"
    data = f"<script>const PAIRS = {json.dumps(PAIRS)}, FILES = {json.dumps(files)};</script>"
    page.write_text(data + PAGE, encoding="utf-8")
    profile = tmp_path_factory.mktemp("profile")
    return found_by_page(CHROMIUM, profile, page.as_uri())[0]


def test_every_model_that_scatters_has_a_file(folder):
    models = {path.stem.split("-")[0] for path in folder.iterdir()}
    assert models == {m["name"] for m in LISTED if m["scatter"]}


def test_values_are_those_of_the_tool(values):
    for name, found in values.items():
        assert isinstance(found, list), (name, found)
        model, *chosen = name.split("-")
        schema = next(m for m in LISTED if m["name"] == model)["parameters"]
        choices = (p["name"] for p in schema if p["kind"] == "choice")
        parameters = map("=".join, zip(choices, chosen, strict=True))
        rows = [[*light, *view] for light, view in PAIRS]
        table = io.StringIO()
        csv.writer(table).writerows([["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"], *rows])
        done = subprocess.run(
            [TOOL, "eval", model, *parameters],
            input=table.getvalue(),
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, (name, done.stderr)
        wanted = [
            [float(row[key]) for key in ("f_r", "f_g", "f_b")]
            for row in csv.DictReader(io.StringIO(done.stdout))
        ]
        f = np.array(found).reshape(-1, 4)[:, :3]
        np.testing.assert_allclose(f, wanted, rtol=1e-4, atol=1e-7, err_msg=name)


def test_options_that_do_not_go_together_are_refused(tmp_path):
    for more in (("--out", tmp_path / "out"), ("--osl", tmp_path / "osl"), ("--error", "5")):
        done = run("build", "--all", "--brdf", tmp_path / "files", *more)
        assert (
            done.returncode == 2
            and "--brdf DIR goes with --all or --model NAME alone" in done.stderr
        )
        assert list(tmp_path.iterdir()) == []
