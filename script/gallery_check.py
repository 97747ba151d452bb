#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks that every scene loads and renders, equally bright in Blender and the reference renderer.

    python script/gallery_check.py --tool TOOL --python PYTHON --extension ZIP --out DIR SCENE...

Renders one small picture of each scene with either renderer, in the form that `auto` selects. The
two pictures of a scene should differ by noise alone, so the spread of their difference over the
pixels gives the standard error of its mean. The check fails (exit status 1) if the mean differs by
more than that allows, and by more than the stated error of the scene's forms.
"""

import argparse
import json
import math
import subprocess
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from demo_matrix import RENDER_SCENE, smaller
from demo_tasks import read_json, shown, write_json
from pictures import read_rgb

#: Pixels along the longer side; samples of both pictures. Most of the time is spent on compiling
#: shaders, so fewer would save little.
SIZE, BLENDER_SPP, REFERENCE_SPP = 40, 64, 128
#: Limit in standard errors. Pictures do not change from run to run; new ones may deviate a little
#: by chance.
FAR = 5


class CheckError(Exception):
    """What is wrong with a scene, in one line."""


def checked_run(command, **options):
    done = subprocess.run([str(c) for c in command], text=True, capture_output=True, **options)
    if done.returncode != 0:
        raise CheckError(f"failed: {shown(command)}\n{done.stderr.strip()[-2000:]}")
    return done.stdout


def resolve(tool, source, out):
    """Resolves the scene at a small size, as both renderers read it. Returns its folder."""
    folder = out / source.stem
    checked_run([tool, "scene", source, "--out", folder])
    small = smaller(read_json(folder / "scene.json"), SIZE)
    small["settings"]["spp"] = BLENDER_SPP
    write_json(folder / "scene.json", small)
    return folder


def render_in_blender(options, folders):
    """Renders one picture per scene, all in one process. Returns records by scene."""
    jobs = [
        {
            "name": f.name,
            "scene": str(f / "scene.json"),
            "out": str(f / "blender.exr"),
            "representation": "auto",
            "timed": False,
        }
        for f in folders
    ]
    write_json(options.out / "jobs.json", jobs)
    command = [options.python, RENDER_SCENE, "--extension", options.extension]
    records = json.loads(checked_run([*command, "--jobs", options.out / "jobs.json"]))
    return {r["name"]: r for r in records}


def render_reference(tool, folder):
    command = [tool, "render", folder / "scene.json", "--out", folder / "reference.exr"]
    checked_run([*command, "--spp", REFERENCE_SPP, "--threads", 1])


def stated_error(record):
    """The largest stated error of a scene's forms, as a share of the light."""
    groups = [g for of_material in record["materials"].values() for g in of_material]
    return max(((g.get("error") or {}).get("relative_l1") or 0 for g in groups), default=0)


def judge(picture, reference, error):
    """Returns (difference from the reference, its standard error) for the channel with the largest
    difference. Raises CheckError if it is too large, or if a picture can't be right."""
    for name, pixels in (("Blender's picture", picture), ("the reference", reference)):
        if not np.isfinite(pixels).all():
            raise CheckError(f"{name} has {np.count_nonzero(~np.isfinite(pixels))} bad values")
        if pixels.max() <= 0:
            raise CheckError(f"{name} is black")
    if picture.shape != reference.shape:
        raise CheckError(f"{picture.shape} and {reference.shape} pixels")
    difference = (picture - reference).reshape(-1, 3)
    mean = reference.mean()
    # The spread does not include rounding in single precision.
    noise = difference.std(0, ddof=1) / math.sqrt(len(difference)) / mean + 1e-6
    off = difference.mean(0) / mean
    worst = np.argmax(np.abs(off) / noise)
    if (np.abs(off) > FAR * noise + error).any():
        raise CheckError(
            f"in Blender {100 * off[worst]:+.2f} % of the reference's light in {'RGB'[worst]}, "
            f"where noise is {100 * noise[worst]:.2f} % and its forms state {100 * error:.2f} %"
        )
    return off[worst], noise[worst]


def third(scenes, text):
    """Every third scene, begun with one of the first three by what the text is."""
    return scenes[zlib.crc32(text.encode()) % 3 :: 3]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="+", type=Path, help="scenes/NAME.json")
    parser.add_argument("--tool", required=True, type=Path)
    parser.add_argument("--python", required=True, type=Path, help="a Python that has bpy")
    parser.add_argument("--extension", required=True, type=Path)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument(
        "--third", metavar="TEXT", help="every third scene, begun by what TEXT is: a commit, say"
    )
    options = parser.parse_args()
    if options.third is not None:
        options.scenes = third(options.scenes, options.third)
    options.out.mkdir(parents=True, exist_ok=True)
    failed, seen = [], {}
    try:
        with ThreadPoolExecutor(2) as pool:  # of processes
            folders = list(
                pool.map(lambda s: resolve(options.tool, s, options.out), options.scenes)
            )
            blender = pool.submit(render_in_blender, options, folders)
            for folder in folders:
                render_reference(options.tool, folder)
            records = blender.result()
    except CheckError as error:
        sys.exit(f"gallery_check: {error}")
    for folder in folders:
        try:
            pictures = [
                read_rgb(folder / f"{n}.exr").astype(float) for n in ("blender", "reference")
            ]
            seen[folder.name] = judge(*pictures, stated_error(records[folder.name]))
        except (CheckError, OSError) as error:
            failed.append(folder.name)
            print(f"    {folder.name}: {error}", file=sys.stderr)
    if failed:
        sys.exit(f"gallery_check: {len(failed)} of {len(folders)} scenes are wrong: {failed}")
    worst = max(seen, key=lambda name: abs(seen[name][0]) / seen[name][1])
    off, noise = (100 * x for x in seen[worst])
    middle = 100 * np.median([n for _, n in seen.values()])
    print(
        f"    {len(seen)} scenes render as bright as their references; median noise "
        f"{middle:.2f} %, furthest {worst}: {off:+.2f} % at a noise of {noise:.2f} %"
    )


if __name__ == "__main__":
    main()
