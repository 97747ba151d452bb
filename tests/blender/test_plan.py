# SPDX-License-Identifier: GPL-3.0-or-later
"""An extension cut to a scene renders the same picture, contains less, and reports what it
lacks."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from helpers import read_picture

ROOT = Path(__file__).parents[2]
DRIVER = ROOT / "script" / "render_scene.py"
SEEDS = 4
#: Scenes with an isotropic material of one model, and with four models.
SCENES = [
    pytest.param("room-radziszewski_alda", marks=pytest.mark.evidence),
    pytest.param("small-lamp", marks=[pytest.mark.full, pytest.mark.evidence]),
]


def small(name):
    """The scene as a small picture with few samples."""
    content = json.loads((ROOT / "scenes" / f"{name}.json").read_text())
    content["settings"] |= {"width": 48, "height": 48, "spp": 16}
    return content


def shaders_and_tables(extension_zip):
    """Uncompressed bytes; the manifest contains the tables that the panel reads."""
    with zipfile.ZipFile(extension_zip) as archive:
        return sum(
            i.file_size
            for i in archive.infolist()
            if i.filename.startswith(("shaders/", "tables/")) or i.filename == "manifest.json"
        )


def render(extension_zip, scene, *pictures):
    """Renders a picture for each dictionary of `out`, `seed` and `pack`, in one Blender."""
    jobs = Path(pictures[0]["out"]).with_suffix(".json")
    jobs.write_text(
        json.dumps([{"scene": str(scene), "timed": False} | picture for picture in pictures])
    )
    command = [sys.executable, DRIVER, "--extension", extension_zip, "--jobs", jobs]
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=os.environ)
    return done


@pytest.mark.parametrize("name", SCENES)
def test_a_pack_cut_to_a_scene_renders_the_same(empty, extension_zip, tool, tmp_path, name):
    content = small(name)
    source = tmp_path / f"{name}.json"
    source.write_text(json.dumps(content))
    why = json.loads(tool("build", "--scene", source, "--out", tmp_path / "cut", "--explain"))
    cut = next((tmp_path / "cut").glob("*.zip"))
    used = {m["model"] for m in content["materials"].values()}
    assert {m["model"] for m in why["models"]} == used
    assert used.isdisjoint(why["unused_models"])
    for model in why["models"]:
        assert set(model["fixed"]).isdisjoint(model["free"])
        for form in model["forms"]:
            assert form["after"]["operations"] <= form["before"]["operations"]
            assert form["after"]["closures"] <= form["before"]["closures"]

    tool("scene", source, "--out", tmp_path / "scene")
    scene = tmp_path / "scene" / "scene.json"
    pictures = []
    for pack in (extension_zip, cut):
        jobs = [
            {"out": str(tmp_path / f"{len(pictures)}-{seed}.exr"), "seed": seed}
            for seed in range(SEEDS)
        ]
        if pack == extension_zip:
            # The whole extension uses the pack for one picture, without being reinstalled.
            folder = tmp_path / "cut" / "brdfc_shaders"
            jobs.append({"out": str(tmp_path / "used.exr"), "seed": 0, "pack": str(folder)})
        done = render(pack, scene, *jobs)
        assert done.returncode == 0, done.stderr
        pictures.append([read_picture(Path(job["out"]))[..., :3].mean(-1) for job in jobs])
    used_pack = pictures[0].pop()
    assert np.array_equal(used_pack, pictures[1][0])
    # Omitted closures are no longer sampled, so the noise differs: a t-test compares the means of
    # tiles, with the variance of both.
    tiles = np.array(pictures).reshape(2, SEEDS, 6, 8, 6, 8).mean((3, 5)).reshape(2, SEEDS, -1)
    assert tiles.mean() > 0.01
    whole, lean = tiles.mean(1)
    spread = tiles.var(1, ddof=1).sum(0) / SEEDS
    # A tile in which few paths hit something bright underestimates its noise: no tile's variance is
    # less than a tenth of the mean.
    z = (lean - whole) / np.sqrt(np.maximum(spread, spread.mean() / 10))
    assert np.abs(z).max() < 7, z
    total = tiles.mean(2)
    error = np.sqrt(total.var(1, ddof=1).sum() / SEEDS)
    assert abs(total[1].mean() - total[0].mean()) < 6 * error
    if len(used) == 1:
        assert shaders_and_tables(cut) <= shaders_and_tables(extension_zip) / 10


@pytest.mark.slow
@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["aimed", "sampled", "fitted"])
def test_tables_of_the_views_that_occur_show_the_same(
    extension, empty, extension_zip, tool, tmp_path, form
):
    """A tilted disk: with camera rays alone, the pack contains only a part of the tables over the
    view."""
    content = {
        "name": "disk",
        "settings": {"width": 32, "height": 32, "spp": 8, "max_bounces": 0},
        "camera": {
            "type": "perspective",
            "position": [0, -4, 2.5],
            "look_at": [0, 0, 0],
            "fov_y_degrees": 26,
        },
        "materials": {
            "m": {"model": "phong", "parameters": {"e": 12}, "representation": form},
        },
        "objects": [{"name": "d", "shape": {"type": "disk", "radius": 1.2}, "material": "m"}],
        "lights": [
            {
                "type": "area",
                "position": [0, 3, 2],
                "direction": [0, -3, -2],
                "size": 1.5,
                "power": 60,
            }
        ],
        "environment": {"color": [0.2, 0.3, 0.4]},
    }
    source = tmp_path / "disk.json"
    source.write_text(json.dumps(content))
    why = json.loads(tool("build", "--scene", source, "--out", tmp_path / "cut", "--explain"))
    (built,) = why["models"][0]["forms"]
    assert built["after"]["table_floats"] < built["before"]["table_floats"]
    assert "never seen" in " ".join(why["models"][0]["left_out"])
    alone = tmp_path / "materials.json"
    alone.write_text(json.dumps({"materials": content["materials"]}))
    why = json.loads(tool("build", "--materials", alone, "--out", tmp_path / "whole", "--explain"))
    assert "never seen" not in " ".join(why["models"][0]["left_out"])

    extension.pack.use(tmp_path / "cut" / "brdfc_shaders")
    try:
        assert extension.api.albedo("phong", 0.53)[0] > 0
        with pytest.raises(ValueError, match="built for one scene, where phong is seen at 0.43"):
            extension.api.albedo("phong", 1)
        (node,) = extension.model_nodes.group_nodes(extension.api.new_material("phong", form))
        assert extension.ui.energy_text(node) == "not at a view angle of this scene"
    finally:
        extension.pack.use()

    tool("scene", source, "--out", tmp_path / "scene")
    jobs = [
        {"out": str(tmp_path / f"{pack}.exr"), "pack": str(tmp_path / pack / "brdfc_shaders")}
        for pack in ("cut", "whole")
    ]
    done = render(extension_zip, tmp_path / "scene" / "scene.json", *jobs)
    assert done.returncode == 0, done.stderr
    cut, whole = (read_picture(Path(job["out"]))[..., :3] for job in jobs)
    assert whole.mean() > 0.05 and whole.std() > 0.05
    # In a few pixels, a sample may fall on the other side of an edge.
    off = np.abs(cut - whole).max(-1) / (1e-3 + whole.max(-1))
    assert np.quantile(off, 0.98) < 1e-4, np.quantile(off, [0.5, 0.9, 0.98, 1])
    assert cut.mean() == pytest.approx(whole.mean(), rel=1e-3)


def test_a_pack_that_is_none(empty, extension_zip, tool, tmp_path):
    tool("scene", ROOT / "scenes" / "ra-vanish.json", "--out", tmp_path)
    out = tmp_path / "a.exr"
    job = {"out": str(out), "pack": str(tmp_path / "absent")}
    done = render(extension_zip, tmp_path / "scene.json", job)
    assert done.returncode == 2
    assert "absent/manifest.json" in done.stderr and "Traceback" not in done.stderr
    assert not out.exists()


@pytest.mark.slow
def test_a_value_that_was_cut_away_is_refused(empty, tool, tmp_path):
    source = tmp_path / "s.json"
    content = small("room-radziszewski_alda")
    source.write_text(json.dumps(content))
    tool("build", "--scene", source, "--out", tmp_path / "cut", "--explain")
    cut = next((tmp_path / "cut").glob("*.zip"))
    for material in content["materials"].values():
        material["parameters"] = material.get("parameters", {}) | {"n": 3}
    source.write_text(json.dumps(content))
    tool("scene", source, "--out", tmp_path / "scene")
    done = render(cut, tmp_path / "scene" / "scene.json", {"out": str(tmp_path / "a.exr")})
    assert done.returncode == 2
    assert "radziszewski_alda.n" in done.stderr and "built for one scene" in done.stderr
    assert not (tmp_path / "a.exr").exists()


def test_what_a_blend_file_uses_is_all_that_a_pack_holds(extension, empty, tool, tmp_path):
    api, bpy = extension.api, extension.api.bpy
    api.new_material("radziszewski_alda", "sampled", n=7.0, tint=(0.9, 0.5, 0.25))
    varied = api.new_material("ward", ax=0.25, normalisation="duer")
    node = extension.model_nodes.group_nodes(varied)[0]
    value = varied.node_tree.nodes.new("ShaderNodeValue")
    varied.node_tree.links.new(value.outputs[0], extension.model_nodes.sockets(node)["ay"])
    bpy.data.materials.new("of another kind")
    file = tmp_path / "materials.json"
    assert bpy.ops.brdfc.write_materials(filepath=str(file)) == {"FINISHED"}
    content = json.loads(file.read_text())["materials"]
    assert set(content) == {"Radziszewski-Alda", "Ward"}
    assert content["Ward"]["parameters"]["ay"] == {"varies": True}

    why = json.loads(tool("build", "--materials", file, "--out", tmp_path / "cut", "--explain"))
    lobe, ward = why["models"]
    assert (lobe["model"], lobe["free"]) == ("radziszewski_alda", [])
    assert lobe["fixed"]["n"] == 7 and lobe["fixed"]["tint"] == [0.9, 0.5, 0.25]
    assert (ward["model"], ward["free"]) == ("ward", ["ay"])
    assert ward["fixed"]["normalisation"] == "duer"
    assert "lambert" in why["unused_models"]
    for model in why["models"]:
        for form in model["forms"]:
            # Formula Nodes have sockets for all that a model has.
            part = 1 if form["form"] == "nodes" else 1 / 2
            assert form["after"]["bytes"] <= form["before"]["bytes"] * part


def test_a_list_of_materials_that_cannot_be_written(extension, empty, tmp_path):
    bpy = extension.api.bpy
    with pytest.raises(RuntimeError, match="No material of this file"):
        bpy.ops.brdfc.write_materials(filepath=str(tmp_path / "none.json"))
    assert not (tmp_path / "none.json").exists()
    extension.api.new_material("lambert")
    with pytest.raises(RuntimeError, match="absent"):
        bpy.ops.brdfc.write_materials(filepath=str(tmp_path / "absent" / "m.json"))
