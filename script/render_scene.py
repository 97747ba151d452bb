#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders resolved scenes in Blender without a window, with the extension installed as by a user.

Runs in a Python that has the `bpy` module. Takes one job from the command line or several from a
file. Repetitions of several jobs take turns, so that their run times can be compared:

    python script/render_scene.py --extension ZIP --scene DIR/scene.json --out OUT.exr
    python script/render_scene.py --extension ZIP --jobs jobs.json

jobs.json: [{"scene": ..., "out": ..., "representation": ..., "spp": ..., "seed": ...,
"repeat": ..., "native": ..., "pack": ..., "timed": ..., "denoise": ..., "view": ..., "osl": ...,
"width": ...}, ...]; all but scene and out are optional, and default to the options of the command
line.

"native" names a file with a scene's materials from script/native_nodes.py. "pack" is a folder that
`brdfc build` wrote, whose models are used instead of the extension's own. "timed" false omits the
additional render with one sample, which separates sampling from compiling. "osl" false turns Open
Shading Language off. "out" may also be a .png or .jpg, shown with the view transform "view".

Prints a JSON list with a record per job on stdout, and progress on stderr. Exit status 2: wrong
usage or input.
"""

import argparse
import contextlib
import json
import os
import resource
import statistics
import sys
import tempfile
import time
import tomllib
import uuid
import zipfile
from pathlib import Path

#: File types for viewing, and Blender's names of their formats.
PICTURES = {".png": "PNG", ".jpg": "JPEG"}


class UsageError(Exception):
    """An error that the user can correct; its message is one line."""


@contextlib.contextmanager
def quiet():
    """Redirects everything that Blender prints to a file, which is shown if a step fails."""
    sys.stdout.flush()
    with tempfile.TemporaryFile() as sink:
        saved = os.dup(1)
        os.dup2(sink.fileno(), 1)
        try:
            yield
        except BaseException:
            sink.seek(0)
            sys.stderr.write(sink.read().decode(errors="replace")[-4000:])
            raise
        finally:
            sys.stdout.flush()
            os.dup2(saved, 1)
            os.close(saved)


def start_blender(extension, resources):
    """Imports bpy with temporary user folders and installs the extension. Returns bpy and
    a SceneLoader."""
    os.environ["BLENDER_USER_RESOURCES"] = str(resources)
    # Blender leaves the bytecode of each compiled script in the folder for temporary files.
    tempfile.tempdir = str(resources)
    import bpy
    from scene_loader import SceneLoader

    with quiet():
        bpy.ops.preferences.addon_enable(module="bl_pkg")
        bpy.ops.extensions.package_install_files(
            filepath=str(extension), repo="user_default", enable_on_install=True
        )
    try:
        # A pack cut to a scene has its own id.
        with zipfile.ZipFile(extension) as archive:
            about = tomllib.loads(archive.read("blender_manifest.toml").decode())
        loader = SceneLoader(f"bl_ext.user_default.{about['id']}")
    except (KeyError, ImportError, zipfile.BadZipFile) as error:
        raise UsageError(f"{extension}: not an extension of brdfc: {error}") from error
    return bpy, loader


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def take_even_block(cycles, samples):
    """Sets the number of samples, and which ones: a block of Cycles' sequence that is as evenly
    distributed as its first samples, but does not contain the very first one. Cycles sends the
    first sample through the centre of each pixel whatever the seed, so a form whose random numbers
    depend on the path's position would sample the same direction in every picture."""
    first = 1 << (samples - 1).bit_length()  # blocks of powers of two are even
    cycles.samples, cycles.sample_offset = first + samples, first
    cycles.use_sample_subset, cycles.sample_subset_length = True, samples


def timed_render(bpy, samples, path=None):
    """CPU and wall seconds of one render of the active scene."""
    scene = bpy.context.scene
    take_even_block(scene.cycles, samples)
    if path is not None:
        scene.render.filepath = str(path)
    with quiet():
        cpu, wall = cpu_seconds(), time.perf_counter()
        bpy.ops.render.render(write_still=path is not None)
        return cpu_seconds() - cpu, time.perf_counter() - wall


def for_eyes(loader, scene, path, view):
    """Writes a picture for viewing instead of an EXR: 8 bits, with a view transform of Blender's.
    If `view` is None, it is Standard, or the display's equivalent."""
    images = scene.render.image_settings
    images.file_format = PICTURES[path.suffix]
    images.color_mode, images.color_depth, images.quality = "RGB", "8", 92
    if view is None:
        loader.color.set_view(scene.view_settings, "Standard")
        return
    try:
        scene.view_settings.view_transform = view
    except TypeError as error:
        raise UsageError(f"view: {error}") from error


def render_once(bpy, loader, job, repetition, threads=None):
    """Loads and renders one job. Returns its times and, from the first repetition, a description.

    Compiling, building the BVH and the like happen in every render. They are told apart from
    sampling by a render with one sample: sampling = (T(spp) - T(1)) * spp / (spp - 1).
    """
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    start = time.perf_counter()
    loader.pack.use(job["pack"])
    native = json.loads(Path(job["native"]).read_text("utf-8")) if job["native"] else None
    scene = loader.load_scene(job["scene"], job["representation"], native=native, osl=job["osl"])
    load_wall = time.perf_counter() - start
    samples = job["spp"] or scene.cycles.samples
    if job["seed"] is not None:
        scene.cycles.seed = job["seed"]
    if job["width"] is not None:
        render, width = scene.render, job["width"]
        height = round(render.resolution_y * width / render.resolution_x)
        render.resolution_x, render.resolution_y = width, max(height, 1)
    if threads:
        scene.render.threads_mode, scene.render.threads = "FIXED", threads
    one_cpu, one_wall = timed_render(bpy, 1) if job["timed"] else (None, None)
    out = Path(job["out"]).resolve()
    # A name of its own, because a farm may try the same job twice at once.
    partial = out.with_name(f".{out.stem}.{uuid.uuid4().hex}{out.suffix}")
    scene.cycles.use_denoising = job["denoise"]
    if out.suffix in PICTURES:
        for_eyes(loader, scene, out, job["view"])
    out.parent.mkdir(parents=True, exist_ok=True)
    cpu, wall = timed_render(bpy, samples, partial if repetition == 0 else None)
    factor = samples / max(samples - 1, 1)
    times = {
        "cpu_seconds": cpu,
        "wall_seconds": wall,
        "load_wall_seconds": load_wall,
    }
    if job["timed"]:
        times |= {
            "sampling_cpu_seconds": max(cpu - one_cpu, 0.0) * factor if samples > 1 else cpu,
            "one_sample_cpu_seconds": one_cpu,
            "one_sample_wall_seconds": one_wall,
        }
    if repetition > 0:
        return times, None
    if not partial.exists():
        raise UsageError(f"{job['scene']}: Blender wrote no picture")
    os.replace(partial, out)
    return times, describe(bpy, loader, scene, job, samples)


def describe(bpy, loader, scene, job, samples):
    """What was rendered, and with which settings."""
    api, model_nodes, pack = loader.api, loader.model_nodes, loader.pack
    materials, warnings = {}, []
    used = {s.material for o in scene.objects for s in o.material_slots if s.material}
    for material in sorted(used, key=lambda m: m.name):
        forms = []
        for node in model_nodes.group_nodes(material):
            model, representation = model_nodes.identity(node)
            entry = pack.model(model).forms[representation].entry
            keep = ("closures", "slots", "operations", "error", "warnings")
            forms.append(
                {"model": model, "representation": representation}
                | {key: entry.get(key) for key in keep}
            )
        materials[material.name] = forms or [{"representation": job["representation"]}]
        warnings += [f"{material.name}: {w.message}" for w in api.warnings(material, scene)]
    cycles, render = scene.cycles, scene.render
    return {
        "scene": str(job["scene"]),
        "out": str(job["out"]),
        "representation": job["representation"] or "scene",
        "blender": bpy.app.version_string,
        "materials": materials,
        "warnings": warnings,
        "settings": {
            "width": render.resolution_x,
            "height": render.resolution_y,
            "spp": samples,
            "seed": cycles.seed,
            "max_bounces": cycles.max_bounces,
            "device": cycles.device,
            "osl": cycles.shading_system,
            "pixel_filter": cycles.pixel_filter_type,
            "threads": render.threads,
        },
    }


def read_jobs(options):
    """The list of complete jobs. Raises UsageError."""
    defaults = {
        "representation": options.representation,
        "spp": options.spp,
        "seed": options.seed,
        "width": options.width,
        "repeat": options.repeat,
        "native": None,
        "pack": None,
        "timed": True,
        "denoise": options.denoise,
        "view": options.view,
        "osl": not options.without_osl,
    }
    if options.jobs:
        try:
            jobs = json.loads(Path(options.jobs).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise UsageError(f"{options.jobs}: {error}") from error
        if not isinstance(jobs, list) or not all(isinstance(j, dict) for j in jobs) or not jobs:
            raise UsageError(f"{options.jobs}: expected a list of jobs")
    elif options.scene and options.out:
        jobs = [{"scene": options.scene, "out": options.out}]
    else:
        raise UsageError("expected --scene and --out, or --jobs")
    complete = []
    for index, job in enumerate(jobs):
        for key in ("scene", "out"):
            if not isinstance(job.get(key), str):
                raise UsageError(f"{options.jobs}: job {index}: {key}: expected a path")
        if unknown := sorted(set(job) - set(defaults) - {"scene", "out", "name"}):
            raise UsageError(f"{options.jobs}: job {index}: unknown key {unknown[0]}")
        merged = defaults | job
        for key, least in (("spp", 1), ("seed", 0), ("width", 1), ("repeat", 1)):
            value = merged[key]
            if value is not None and (not isinstance(value, int) or value < least):
                raise UsageError(
                    f"job {index}: {key}: expected a whole number from {least}, got {value!r}"
                )
        for key in ("timed", "denoise", "osl"):
            if not isinstance(merged[key], bool):
                got = repr(merged[key])
                raise UsageError(f"job {index}: {key}: expected true or false, got {got}")
        if (suffix := Path(merged["out"]).suffix) not in (".exr", *PICTURES):
            expected = ", ".join((".exr", *PICTURES))
            raise UsageError(f"job {index}: out: expected a name in {expected}, got '{suffix}'")
        if merged["representation"] == "scene":
            merged["representation"] = None
        complete.append(merged)
    return complete


def run(options):
    """Renders every job, with repetitions taking turns, and returns their records."""
    jobs = read_jobs(options)
    if options.threads is not None and options.threads < 1:
        raise UsageError(f"--threads: expected a whole number from 1, got {options.threads}")
    extension = Path(options.extension).resolve()
    if not extension.is_file():
        raise UsageError(f"{extension}: no such file")
    records = [None] * len(jobs)
    times = [[] for _ in jobs]
    with tempfile.TemporaryDirectory(prefix="brdfc-blender-") as resources:
        bpy, loader = start_blender(extension, resources)
        total = sum(job["repeat"] for job in jobs)
        done = 0
        for repetition in range(max(job["repeat"] for job in jobs)):
            for index, job in enumerate(jobs):
                if repetition >= job["repeat"]:
                    continue
                try:
                    taken, record = render_once(bpy, loader, job, repetition, options.threads)
                except (ValueError, loader.pack.PackError) as error:
                    raise UsageError(str(error)) from error
                times[index].append(taken)
                records[index] = records[index] or record
                done += 1
                name = job.get("name", job["out"])
                print(f"[{done}/{total}] {name}: {taken['cpu_seconds']:.1f} s", file=sys.stderr)
    for record, job, taken in zip(records, jobs, times, strict=True):
        if "name" in job:
            record["name"] = job["name"]
        record["repeats"] = taken
        for key in taken[0]:
            record[key] = statistics.median(t[key] for t in taken)
    return records


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--extension", required=True, help="brdfc_shaders-<version>.zip")
    parser.add_argument("--scene", help="resolved scene.json")
    parser.add_argument(
        "--out",
        help="EXR to write, 32-bit float, scene linear; or a .png or .jpg, as --view shows it",
    )
    parser.add_argument(
        "--view",
        help="Blender's view transform (default: Standard, else the display's own)",
    )
    parser.add_argument("--denoise", action="store_true", help="by Blender's denoiser")
    parser.add_argument(
        "--without-osl",
        action="store_true",
        help="with Open Shading Language off, as in a new file of Blender: auto is then nodes, "
        "formulas as Blender's math nodes",
    )
    parser.add_argument("--jobs", help="JSON file with a list of jobs")
    parser.add_argument(
        "--representation",
        default="scene",
        help="scene (as the file says), auto, or a form: exact, aimed, sampled, fitted, nodes or "
        "twin; glossy, principled or metallic for Blender's own nodes",
    )
    parser.add_argument("--spp", type=int, help="samples a pixel; default: as the scene says")
    parser.add_argument("--width", type=int, help="pixels across; default: as the scene says")
    parser.add_argument("--seed", type=int, help="random numbers; default: as the scene says")
    parser.add_argument("--threads", type=int, help="threads of Cycles; default: all")
    parser.add_argument("--repeat", type=int, default=1, help="renders a job; times are medians")
    options = parser.parse_args()
    try:
        records = run(options)
    except UsageError as error:
        print(f"render_scene: {error}", file=sys.stderr)
        sys.exit(2)
    json.dump(records, sys.stdout, indent=2)
    sys.stdout.write("\n")


if __name__ == "__main__":
    main()
