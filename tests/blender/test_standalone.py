# SPDX-License-Identifier: GPL-3.0-or-later
"""The output of `brdfc build --osl`: shaders for Blender's Script node, without the extension, and
headers with formulas, compiled by the OSL compiler in Blender.

Renders show albedos in a white world, and f, pdf and samples at given directions, which are
compared with the tool's.
"""

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import bpy
import numpy as np
import pytest
from goniometer import Goniometer, tilted
from helpers import albedo_and_mirror, empty_tree, pairs_csv, read_csv, to_csv

COSINES = (1.0, 0.7, 0.3)
REPLICAS, SAMPLES = 512, 48
POINTS = 24
#: Values to show: 0 f, 1 pdf, 2 a sample's wi, 3 its weight, 4 its pdf, 5 mirror, 6 transmit.
SHOWN = range(7)
#: Relative L1 error allowed for single precision and OSL's fast functions at default parameters.
CLOSE = 1e-3


@pytest.fixture(scope="module")
def folder(program, tmp_path_factory):
    out = tmp_path_factory.mktemp("osl")
    done = subprocess.run([program, "build", "--osl", out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def models(tool):
    return {m["name"]: m for m in json.loads(tool("list", "--json"))}


@pytest.fixture(scope="module")
def scene():
    """Settings made directly: these tests must not use the extension."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.shading_system = "CPU", True
    cycles.max_bounces = 4
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    # Cycles imports oslquery to find a script's sockets; in the wheel it is elsewhere.
    root = Path(bpy.utils.resource_path("LOCAL"))
    sys.path += [str(p) for p in root.glob("python/lib/python3.*/site-packages")]
    return scene


def script_of_file(path):
    """A material with a Script node for a file; and the node."""
    import cycles.osl

    material = bpy.data.materials.new(path.stem)
    material.cycles.use_bump_map_correction = False
    tree = empty_tree(material)
    script = tree.nodes.new("ShaderNodeScript")
    script.mode, script.filepath = "EXTERNAL", str(path)
    said = []
    cycles.osl.update_script_node(script, lambda kind, message: said.append((kind, message)))
    assert script.outputs, f"{path.name} failed to compile: {said}"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(script.outputs["BSDF"], output.inputs["Surface"])
    return material, script


def clear(scene):
    for block in (*scene.objects, *bpy.data.materials, *bpy.data.worlds):
        bpy.data.batch_remove([block])


def test_there_is_a_shader_and_a_header_of_each_model(folder, models):
    names = {p.relative_to(folder).as_posix() for p in folder.rglob("*.*")}
    headers = {f"include/brdfc_{m}.h" for m in models} | {"include/brdfc_library.h"}
    assert names == {f"{m}.osl" for m in models} | headers


def test_exact_shaders_are_the_extensions(folder, models, extension_zip):
    with zipfile.ZipFile(extension_zip) as archive:
        forms = json.loads(archive.read("manifest.json"))["models"]
        exact = 0
        for model in models:
            form = forms[model]["representations"].get("exact")
            if form and not form["only"]:
                exact += 1
                assert (folder / f"{model}.osl").read_bytes() == archive.read(form["shader"])
    assert exact >= 4


def test_headers_have_no_closure(folder):
    for path in folder.glob("include/*.h"):
        assert not re.search(r"\bclosure\b|\bgetattribute\b", path.read_text())


@pytest.mark.long
@pytest.mark.full
def test_shaders_reflect_the_albedo_of_their_models(folder, models, few_of, scene, tool, subtests):
    clear(scene)
    models = dict(few_of(models.items(), 8))
    made = [script_of_file(folder / f"{model}.osl")[0] for model in models]
    seen = np.repeat(COSINES, REPLICAS)
    which = np.repeat(np.arange(len(made)), len(seen))
    turns = np.random.default_rng(5).uniform(0, 2 * np.pi, len(which))
    normals = tilted(np.tile(seen, len(made)), turns)
    # Forms that sample directions derive random numbers from positions and views, which must
    # differ.
    meter = Goniometer(scene, made, normals, SAMPLES, perspective=True, which=which)
    meter.add_world()
    picture = meter.measure().reshape(len(made), len(COSINES), REPLICAS, 3)
    cosines = meter.own_wo()[:, 2].reshape(len(made), len(COSINES), REPLICAS)
    for i, (model, info) in enumerate(models.items()):
        # Facets are rotated at random.
        isotropic = info["properties"]["isotropic"]
        around = [0.0] if isotropic else np.arange(8) * np.pi / 16
        means = cosines[i].mean(1)
        truths = np.mean([albedo_and_mirror(tool, model, {}, means, phi)[0] for phi in around], 0)
        for k in range(len(COSINES)):
            with subtests.test(model=model, cosine=COSINES[k]):
                found = picture[i, k]
                truth = truths[k]
                noise = 5 * found.std(0, ddof=1).max() / np.sqrt(REPLICAS)
                assert noise < 0.1, "too noisy to tell"
                error = np.abs(found.mean(0) - truth).max()
                assert error <= noise + 5e-3, f"{found.mean(0)} for {truth}"


def call(model, function, before, parameters):
    values = []
    for p in parameters:
        if p["kind"] == "choice":
            values.append(str(p["choices"].index(p["default"])))
        elif p["kind"] == "color":
            values.append("color({}, {}, {})".format(*p["default"]))
        else:
            values.append(repr(float(p["default"])))
    return f"brdfc_{model}_{function}({', '.join([*before, *values])})"


def has(header, model, function):
    return f" brdfc_{model}_{function}(" in header


def shader_around(folder, model, parameters):
    """A shader that outputs the results of the header's functions."""
    header = (folder / "include" / f"brdfc_{model}.h").read_text()
    lines = []
    if has(header, model, "eval"):
        lines += [
            f"if (show == 0) shown = {call(model, 'eval', ['wi', 'wo'], parameters)};",
            f"if (show == 1) shown = {call(model, 'pdf', ['wi', 'wo'], parameters)};",
            "vector drawn; float drawn_pdf;",
            "color weight = "
            + call(model, "sample", ["wo", "numbers", "drawn", "drawn_pdf"], parameters)
            + ";",
            "if (show == 2) shown = color(drawn[0], drawn[1], drawn[2]);",
            "if (show == 3) shown = weight;",
            "if (show == 4) shown = drawn_pdf;",
        ]
    for show, function in ((5, "mirror"), (6, "transmit")):
        if has(header, model, function):
            lines.append(
                f"if (show == {show}) shown = {call(model, function, ['wo'], parameters)};"
            )
    if has(header, model, "ior"):
        lines.append(f"color n = {call(model, 'ior', [], parameters)};")
        lines.append("if (min(n[0], min(n[1], n[2])) <= 0) shown = -1;")
    if has(header, model, "transmittance"):
        left = call(model, "transmittance", ["0.0"], parameters)
        lines.append(f"if ({left} != color(1.0)) shown = -1;")
    body = "\n    ".join(lines)
    text = f"""#include "include/brdfc_{model}.h"

shader show_{model}(float show = 0, vector wi = 0, vector wo = 0, vector numbers = 0,
    output closure color BSDF = 0)
{{
    color shown = 0;
    {body}
    BSDF = shown * emission();
}}
"""
    path = folder / f"show_{model}.osl"
    path.write_text(text)
    return path


def sampled(tool, model, wo, numbers):
    """Columns wi (3), weight (3), pdf."""
    header = ("wo_x", "wo_y", "wo_z", "u1", "u2", "u3")
    return read_csv(tool("sample", model, stdin=to_csv(header, np.hstack([wo, numbers]))))[1]


def expected(tool, model, info, wi, wo, numbers):
    """Expected values, (shown, n, 3); 0 for functions that the model lacks."""
    out = np.zeros((len(SHOWN), len(wi), 3))
    if info.get("scatter", True):
        rows = read_csv(tool("eval", model, stdin=pairs_csv(wi, wo)))[1]
        out[0], out[1] = rows[:, :3], rows[:, 3:4]
        rows = sampled(tool, model, wo, numbers)
        out[2], out[3], out[4] = rows[:, :3], rows[:, 3:6], rows[:, 6:7]
    albedo, out[5] = albedo_and_mirror(tool, model, {}, wo[:, 2])
    if not info.get("scatter", True):
        out[6] = albedo - out[5]
    return out


@pytest.mark.long
@pytest.mark.slow
def test_headers_give_what_the_models_do(folder, models, few_of, scene, tool, subtests):
    clear(scene)
    # Glass has the functions that most models lack.
    models = dict(few_of(models.items(), 8)) | {"glass": models["glass"]}
    rng = np.random.default_rng(11)
    cosine, azimuth = rng.uniform(0.1, 1, POINTS), rng.uniform(0, 2 * np.pi, POINTS)
    wo = tilted(cosine, azimuth).astype(np.float32).astype(np.float64)
    numbers = rng.random((POINTS, 3)).astype(np.float32).astype(np.float64)
    made, truths, directions = [], [], []
    for model, info in models.items():
        wi = np.zeros_like(wo)
        wi[:, 2] = 1
        if info.get("scatter", True):
            # Sampled from the model: nothing else hits a narrow lobe.
            drawn = sampled(tool, model, wo, rng.random((POINTS, 3)))
            wi = np.where(drawn[:, 6:] > 0, drawn[:, :3], wi)
            wi = wi.astype(np.float32).astype(np.float64)
        path = shader_around(folder, model, info["parameters"])
        material, script = script_of_file(path)
        for socket in script.inputs:
            read = material.node_tree.nodes.new("ShaderNodeAttribute")
            read.attribute_name = socket.identifier
            output = "Fac" if socket.type == "VALUE" else "Vector"
            material.node_tree.links.new(read.outputs[output], socket)
        made.append(material)
        directions.append(wi)
        truths.append(expected(tool, model, info, wi, wo, numbers))
    count = len(made) * len(SHOWN) * POINTS
    attributes = {
        "show": np.tile(np.repeat(SHOWN, POINTS), len(made)),
        "wi": np.concatenate([np.tile(wi, (len(SHOWN), 1)) for wi in directions]),
        "wo": np.tile(wo, (len(made) * len(SHOWN), 1)),
        "numbers": np.tile(numbers, (len(made) * len(SHOWN), 1)),
    }
    meter = Goniometer(
        scene,
        made,
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        1,
        which=np.repeat(np.arange(len(made)), len(SHOWN) * POINTS),
        attributes=attributes,
    )
    picture = meter.measure().reshape(len(made), len(SHOWN), POINTS, 3)
    for i, model in enumerate(models):
        for show in SHOWN:
            with subtests.test(model=model, show=show):
                found, truth = picture[i, show], truths[i][show]
                if show == 2:  # if a direction was sampled
                    kept = truths[i][4][:, 0] > 0
                    found, truth = found[kept], truth[kept]
                scale = np.abs(truth).sum()
                assert np.abs(found - truth).sum() <= CLOSE * scale + 1e-6
    shown = np.abs(np.array(truths)).sum((0, 2, 3))
    assert (shown > 0).all(), "each of the functions was asked for something"
