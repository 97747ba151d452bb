#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows measured materials: files, what is fitted to them, and pictures of both on one page.

    python script/demo_measured.py --tool TOOL --extension ZIP --python PYTHON --out DIR [FILE...]

Without FILE it makes three measured files, of sums that no single model of brdfc follows. For each
file, `brdfc measured` fits the models, curves and lobes. A ball is then rendered from the data by
the reference renderer, and from each fit in Blender, with Open Shading Language on and off. DIR
gets a folder for each file, index.html with all pictures, and sheet.jpg, a selection of them.

The Python package of `brdfc python` must be importable: it evaluates the made materials. Results of
earlier runs with the same inputs and programs are kept.
"""

import argparse
import collections
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from demo_matrix import RENDER_SCENE
from demo_tasks import Task, TaskError, digest, run_task, write_json
from markdown_table import percent
from measured_samples import MADE, make_files
from pages import page
from pictures import read_rgb

#: Pixels of a picture; samples a pixel in Blender, which denoises, and of the reference.
SIZE, SPP, REFERENCE_SPP = 160, 32, 512
#: Fits, by the name of their scene file.
FITS = {"formula": "Nearest formula", "curves": "Curves", "lobes": "Sum of lobes"}
MOST_LOBES = 4
#: Difference in full colour, relative to the mean of the picture of the data.
DIFFERENCE_SCALE = 0.5

# ---- fits --------------------------------------------------------------------------------------


def material_of(fit):
    """The material of a fit, for a scene file."""
    model = {"model": fit["model"], "parameters": fit["parameters"]}
    if fit["matte"] is None:
        return model
    return {"sum": [model, {"model": "lambert", "parameters": {"rho": fit["matte"]}}]}


def text_of(material, most=None):
    """The models of a material and their parameters; of each at most so many."""

    def text(value):
        if isinstance(value, list):
            return ",".join(f"{x:.3g}" for x in value)
        return value if isinstance(value, str) else f"{value:.3g}"

    out = []
    for lobe in material.get("sum", [material]):
        values = [f"{k}={text(v)}" for k, v in lobe["parameters"].items()]
        left = values[most:] if most else []
        more = [f"and {len(left)} more"] if left else []
        out.append((lobe["model"], " ".join(values[: len(values) - len(left)] + more)))
    return out


# ---- pictures ----------------------------------------------------------------------------------


def ball_scene(name, material, size):
    """A ball on a floor, under a lamp, in a dim room; a lamp at the viewer shows what is sent
    back."""
    lamp = {"type": "point", "radius": 0.1}
    return {
        "name": name,
        "description": f"A ball of {name}.",
        "settings": {"width": size, "height": size, "spp": SPP, "seed": 1, "max_bounces": 4},
        "camera": {
            "type": "perspective",
            "position": [0, -7, 2.1],
            "look_at": [0, 0, 0.46],
            "fov_y_degrees": 9.8,
        },
        "materials": {
            "floor": {"model": "lambert", "parameters": {"rho": [0.12, 0.12, 0.12]}},
            "ball": material,
        },
        "objects": [
            {"name": "floor", "shape": {"type": "quad", "size": [40, 40]}, "material": "floor"},
            {
                "name": "ball",
                "shape": {
                    "type": "sphere",
                    "radius": 0.5,
                    "segments": 128,
                    "rings": 64,
                    "smooth": True,
                },
                "transform": {"translate": [0, 0, 0.501]},
                "material": "ball",
            },
        ],
        "lights": [
            lamp | {"position": [-2.6, -3.2, 4], "power": 280},
            lamp | {"position": [0.2, -6.5, 2.4], "power": 180},
        ],
        "environment": {"procedural": "interior", "width": 512, "strength": 0.3},
    }


class Demo:
    """What is made of one file, in a folder of its own."""

    def __init__(self, file, options):
        self.file, self.options = file, options
        self.name = file.stem
        self.folder = options.out / self.name
        self.data = digest(file)
        (self.folder / "tasks").mkdir(parents=True, exist_ok=True)
        made = MADE.get(file.name) if file.parent == options.out / "files" else None
        self.about = made[0] if made else f"Measured in {file.name}"

    def run(self, name, command, *key, outputs=(), prints=True):
        """The record of a command, from an earlier run if nothing has changed: the programs, the
        data, the command and `key`."""
        options = self.options
        task = Task(
            name=f"{self.name}/{name}",
            kind="measured",
            command=tuple(command),
            key=digest(*options.sums.values(), self.data, *map(str, command), *key),
            folder=self.folder / "tasks",
            outputs=tuple(outputs),
            programs=(),
            prints_records=prints,
        )
        return run_task(task)

    def fit(self):
        """Fills `told`, what the tool says of the file, and `kind`, what the file is; `materials`
        and `misplaced` by fit; and `seconds` from the file to the fit."""
        command = [self.options.tool, "measured", self.file, "--json"]
        curves = ("--models", "factors")
        lobes = ("--lobes", MOST_LOBES)
        records = {
            name: self.run(f"fit-{name}", (*command, *extra))
            for name, extra in (("formula", ()), ("curves", curves), ("lobes", lobes))
        }
        found = {name: record["records"] for name, record in records.items()}
        told = self.told = found["formula"]
        isotropic = "isotropic" if told["isotropic"] else "anisotropic"
        self.kind = f"{told['format']}, {isotropic}, {told['grid']}"
        formula = next(f for f in told["fits"] if f["model"] != "factors")
        (curves,) = found["curves"]["fits"]
        if not found["lobes"]["sums"]:
            raise TaskError(f"{self.file}: expected data that reflect light, found black ones")
        best = found["lobes"]["sums"][-1]
        lobes = [{k: each[k] for k in ("model", "parameters")} for each in best["lobes"]]
        self.materials = {
            "formula": material_of(formula),
            "curves": material_of(curves),
            "lobes": {"sum": lobes},
        }
        self.misplaced = {
            "formula": formula["error"],
            "curves": curves["error"],
            "lobes": best["error"],
        }
        self.seconds = {name: record["wall_seconds"] for name, record in records.items()}

    def render(self):
        """Renders the data by the reference renderer and the fits in Blender. Fills `pictures`,
        records of Blender by fit and whether OSL is on."""
        tool, folder, size = self.options.tool, self.folder, self.options.size
        scenes = {"data": {"measured": os.path.relpath(self.file, folder)}} | self.materials
        for name, material in scenes.items():
            write_json(folder / f"{name}.json", ball_scene(self.name, material, size))
        data = folder / "data.exr"
        command = [tool, "render", folder / "data.json", "--spp", REFERENCE_SPP, "--out", data]
        self.run("data", command, folder / "data.json", outputs=(data,), prints=False)
        for name in FITS:
            resolved = folder / name / "scene.json"
            command = [tool, "scene", folder / f"{name}.json", "--out", folder / name]
            key = folder / f"{name}.json"
            self.run(f"scene-{name}", command, key, outputs=(resolved,), prints=False)
        jobs = [
            {
                "name": f"{self.name} {name}, OSL {'on' if osl else 'off'}",
                "scene": str(folder / name / "scene.json"),
                "out": str(self.picture(name, osl)),
                "representation": "auto",
                "osl": osl,
                "denoise": True,
            }
            for name in FITS
            for osl in (True, False)
        ]
        write_json(folder / "tasks" / "jobs.json", jobs)
        command = [self.options.python, RENDER_SCENE, "--extension", self.options.extension]
        command += ["--jobs", folder / "tasks" / "jobs.json"]
        scenes = [folder / f"{name}.json" for name in FITS]
        outputs = [Path(job["out"]) for job in jobs]
        record = self.run("blender", command, jobs, *scenes, outputs=outputs)
        of_picture = {r["out"]: r for r in record["records"]}
        self.processor = record["processor"]
        self.pictures = {}
        for name in FITS:
            for osl in (True, False):
                picture = self.picture(name, osl)
                self.pictures[name, osl] = of_picture[str(picture)]
                difference = self.difference(name, osl)
                command = [tool, "compare", picture, data, "--json", "--diff", difference]
                command += ["--diff-scale", DIFFERENCE_SCALE]
                self.run(f"compare-{picture.stem}", command, picture, data, outputs=(difference,))

    def picture(self, name, osl):
        return self.folder / f"{name}-{'osl' if osl else 'nodes'}.exr"

    def difference(self, name, osl):
        picture = self.picture(name, osl)
        return picture.with_name(f"{picture.stem}-difference.png")

    def first_pixel(self, name, osl):
        """Seconds from the file to a picture of one sample."""
        record = self.pictures[name, osl]
        in_blender = record["load_wall_seconds"] + record["one_sample_wall_seconds"]
        return self.seconds[name] + in_blender


# ---- page --------------------------------------------------------------------------------------

OSL = {True: "Open Shading Language on", False: "Open Shading Language off"}


def write_png(exr):
    """The picture beside it, as a display shows it."""
    pixels = np.clip(read_rgb(exr), 0, 1).astype("f4")
    shown = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * pixels ** (1 / 2.4) - 0.055)
    png = exr.with_suffix(".png")
    if not oiio.ImageBuf(np.ascontiguousarray(shown)).write(str(png), "uint8"):
        raise TaskError(f"{png}: cannot be written")
    return png


def of_page(demo):
    """What the page says of a file; names of pictures are relative to the page."""

    def source(path):
        return path.relative_to(demo.options.out).as_posix()

    def picture(name, osl):
        return {
            "picture": source(demo.picture(name, osl).with_suffix(".png")),
            "seconds": demo.first_pixel(name, osl),
            "difference": source(demo.difference(name, osl)),
        }

    return {
        "name": demo.file.name,
        "about": demo.about,
        "facts": [
            f"{said[0].upper()}{said[1:].removesuffix('.')}."
            for said in (demo.kind, *demo.told["notes"], *demo.told["lacks"])
        ],
        "data": source(demo.folder / "data.png"),
        "fits": [
            {
                "name": name,
                "title": title,
                "misplaced": demo.misplaced[name],
                "pictures": [picture(name, osl) for osl in OSL],
                "models": text_of(demo.materials[name], 8),
            }
            for name, title in FITS.items()
        ],
    }


def write_page(demos, out):
    page.write_page(
        out,
        "measured.html.j2",
        files=[of_page(demo) for demo in demos],
        modes=list(OSL.values()),
        blender=next(iter(demos[0].pictures.values()))["blender"],
        processor=demos[0].processor,
        most_lobes=MOST_LOBES,
        difference_scale=DIFFERENCE_SCALE,
        spp=SPP,
        reference_spp=REFERENCE_SPP,
    )


def write_sheet(demos, file):
    """A row for each file: the data and the fits, as Blender renders them with OSL off."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = 1 + len(FITS)
    figure, axes = pyplot.subplots(
        len(demos), columns, figsize=(2 * columns, 2.3 * len(demos)), squeeze=False
    )
    for row, demo in zip(axes, demos, strict=True):
        shown = [(demo.folder / "data.png", demo.file.name, "the data")]
        for name, title in FITS.items():
            counts = collections.Counter(model for model, _ in text_of(demo.materials[name]))
            models = " + ".join(f"{n} {m}" if n > 1 else m for m, n in counts.items())
            off = f"{title.lower()}, error {percent(demo.misplaced[name])}"
            shown.append((demo.picture(name, False).with_suffix(".png"), models, off))
        for place, (picture, first, second) in zip(row, shown, strict=True):
            place.axis("off")
            place.imshow(pyplot.imread(picture))
            at = {"x": 0.5, "ha": "center", "transform": place.transAxes}
            place.text(y=-0.07, s=first, fontsize=min(6.5, 260 / len(first)), **at)
            place.text(y=-0.14, s=second, fontsize=6.5, color="0.4", **at)
    figure.subplots_adjust(0.005, 0.05, 0.995, 0.998, 0.03, 0.16)
    figure.savefig(file, dpi=110, pil_kwargs={"quality": 88})


# ---- command line ------------------------------------------------------------------------------


def parse():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="measured BRDFs")
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("--extension", required=True, type=Path, help="brdfc_shaders-<version>.zip")
    parser.add_argument("--python", required=True, type=Path, help="a Python that has bpy")
    parser.add_argument("--out", required=True, type=Path, help="folder of the results")
    parser.add_argument("--size", type=int, default=SIZE, help=f"pixels of a picture ({SIZE})")
    options = parser.parse_args()
    if not 1 <= options.size <= 4096:
        parser.error(f"--size: expected 1 to 4096 pixels, got {options.size}")
    for name in ("tool", "extension", "out"):
        setattr(options, name, getattr(options, name).resolve())
    # Not resolved: the interpreter of a virtual environment is a link.
    options.python = options.python.absolute()
    options.files = [file.resolve() for file in options.files]
    for path in (options.tool, options.extension, options.python, *options.files):
        if not path.is_file():
            parser.error(f"{path}: no such file")
    stems = [file.stem for file in options.files]
    if repeated := sorted({stem for stem in stems if stems.count(stem) > 1}):
        parser.error(f"expected files of different names, got {repeated[0]} twice")
    options.sums = {p: digest(p) for p in (options.tool, options.extension, RENDER_SCENE)}
    return options


def print_fits(demo):
    print(f"    {demo.file.name}: {demo.kind}")
    for name, title in FITS.items():
        off, seconds = percent(demo.misplaced[name]), demo.seconds[name]
        print(f"      {title.lower():<16} error {off:>7}, after {seconds:4.1f} s")
        for model, values in text_of(demo.materials[name], 8):
            print(f"        {model:<20} {values}")
    sys.stdout.flush()


def main():
    options = parse()
    for file in options.files:
        command = [options.tool, "measured", file, "--models", "none"]
        checked = subprocess.run(command, stdout=subprocess.DEVNULL)
        if checked.returncode != 0:
            sys.exit(checked.returncode)
    try:
        demos = [Demo(file, options) for file in options.files or make_files(options.out)]
        for demo in demos:
            demo.fit()
            print_fits(demo)
        for demo in demos:
            print(f"    {demo.file.name}: rendering", flush=True)
            demo.render()
            for exr in (demo.folder / "data.exr", *(demo.picture(*key) for key in demo.pictures)):
                write_png(exr)
    except (TaskError, OSError) as error:
        sys.exit(f"demo_measured: {error}")
    write_page(demos, options.out)
    write_sheet(demos, options.out / "sheet.jpg")


if __name__ == "__main__":
    main()
