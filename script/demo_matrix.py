# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists the tasks of the report: scenes x versions of Blender x seeds, each in every form.

Each scene has one reference picture and one pack cut to it. A task in Blender is one seed of a
scene in one version: all forms take turns in one process. The report divides the CPU times of these
pictures by one another, so they must be measured on one machine at the same time. Different seeds
may run anywhere.
"""

import os
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from demo_tasks import ROOT, Task, TaskError, digest, read_json, shown, write_json

#: Samples per pixel, number of pictures for each, pixels along the longer side.
CONVERGENCE_SPP, CONVERGENCE_SEEDS, CONVERGENCE_SIZE = (16, 256, 1024), 4, 64
RENDER_SCENE = ROOT / "script" / "render_scene.py"
#: The version whose folder has no version in its name.
USUAL_BLENDER = "4.5"


class Form(NamedTuple):
    """A form with which a scene is rendered."""

    name: str
    representation: str
    pack: str | None = None  #: folder, beside the scene, of a pack cut to it
    osl: bool = True  #: whether Open Shading Language is on


def resolved_files(folder):
    """scene.json of a resolved scene and every file that it names, in a stable order."""
    scene = folder / "scene.json"
    found = set()

    def walk(value):
        if isinstance(value, dict):
            for item in value.values():
                walk(item)
        elif isinstance(value, list):
            for item in value:
                walk(item)
        # Not Path.is_file: a description may be too long for a file name.
        elif isinstance(value, str) and value and os.path.isfile(folder / value):
            found.add(folder / value)

    walk(read_json(scene))
    return [scene, *sorted(found)]


def forms_of(scene, models, native, wanted="all"):
    """The forms to render: the one that `auto` selects, under its own name, or as auto if materials
    differ; sampled directions if every material has them; the representation that the scene asks
    for; Blender's Glossy node as the unit of cost; and others of its nodes if they were fitted to
    every material. `wanted` selects all of them, only that of `auto`, or that, what `auto` is
    without Open Shading Language, and the unit."""
    used = [models[m["model"]] for m in scene["materials"].values()]
    chosen = {u["auto"] for u in used}
    auto = chosen.pop() if len(chosen) == 1 else "auto"
    if wanted == "auto":
        return [Form(auto, auto)]
    if wanted == "unit":
        without = all("nodes" in u["representations"] for u in used)
        nodes = [Form("nodes", "auto", osl=False)] if without else []
        return [Form("glossy", "glossy"), Form(auto, auto), *nodes]
    forms = ["glossy"]
    fitted = [native.get(name, {}) for name in scene["materials"]]
    forms += [node for node in ("principled", "metallic") if all(node in f for f in fitted)]
    forms.append(auto)
    if all("sampled" in u["representations"] for u in used):
        forms.append("sampled")
    if any(m.get("representation", "auto") != "auto" for m in scene["materials"].values()):
        forms.append("scene")
    return [Form(name, name) for name in forms]


def planned_forms(folder, scene):
    """Forms that the pack cut to the scene has and the whole extension lacks: the one that it
    chooses, and those that every material can have."""
    pack = "plan/brdfc_shaders"
    models = read_json(folder / pack / "manifest.json")["models"]
    used = [models[m["model"]]["representations"] for m in scene["materials"].values()]
    forms = []
    if any("fitted" in u for u in used):
        forms.append(Form("planned", "auto", pack))
    if all("twin" in u for u in used):
        forms.append(Form("twin", "twin", pack))
    return forms


def smaller(scene, longest, spp=None):
    """The scene with at most this many pixels along its longer side, and this number of samples per
    pixel."""
    settings = scene["settings"]
    factor = min(1, longest / max(settings["width"], settings["height"]))
    fewer = {k: max(1, round(settings[k] * factor)) for k in ("width", "height")}
    fewer["spp"] = min(settings["spp"], spp or settings["spp"])
    return scene | {"settings": settings | fewer}


def samples(settings, spp):
    return settings["width"] * settings["height"] * spp


def python_of(version):
    return ROOT / ".env" / f"blender-{version}" / "bin" / "python"


def folder_of(out, version):
    """The folder of the report for a version; each version has its own page."""
    return out if version == USUAL_BLENDER else out.with_name(f"{out.name}-{version}")


@dataclass
class Scene:
    """A resolved scene, and its tasks. Files that all versions of Blender share are in the folder
    of the first version."""

    source: Path
    options: object  #: of the command line
    index: int  #: among the scenes
    models: dict  #: of the extension's manifest
    records: dict = field(default_factory=dict)  #: of tasks that are done, by name

    def __post_init__(self):
        options = self.options
        self.name = self.source.stem
        self.folder = folder_of(options.out, options.blender[0]) / self.name
        for version in options.blender:
            (self.folder_of(version) / "tasks").mkdir(parents=True, exist_ok=True)
        command = [options.tool, "scene", self.source, "--out", self.folder]
        self.command = shown(command)
        done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise TaskError(f"{self.name}: failed: {self.command}\n    {done.stderr.strip()}")
        file = self.folder / "scene.json"
        if options.size or options.spp:
            write_json(file, smaller(read_json(file), options.size or 1 << 14, options.spp))
        self.inputs = digest(*resolved_files(self.folder))
        self.scene = read_json(file)
        self.settings = self.scene["settings"]
        self.spp = max(1, self.settings["spp"] // options.seeds)  #: of a picture
        self.reference_spp = self.settings["spp"] * options.reference_factor
        self.native = options.native.get(self.name, {}).get("materials", {})
        write_json(self.folder / "native.json", self.native)
        self.forms = forms_of(self.scene, self.models, self.native, options.forms)

    def folder_of(self, version):
        return folder_of(self.options.out, version) / self.name

    def first_tasks(self):
        """The tasks that depend on no other."""
        options = self.options
        reference = [options.tool, "render", self.folder / "scene.json"]
        reference += ["--out", self.folder / "reference.exr", "--spp", self.reference_spp]
        tasks = [
            Task(
                name=f"{self.name}/reference",
                kind="reference",
                command=tuple(reference),
                key=digest(options.sums[options.tool], self.inputs, self.reference_spp),
                folder=self.folder / "tasks",
                outputs=(self.folder / "reference.exr",),
                programs=self._programs(options.tool),
                threads="--threads",
                work=samples(self.settings, self.reference_spp),
                order=(self.index, 1),
            )
        ]
        if options.forms == "all":
            return [self._plan(), *tasks]
        return [*tasks, *self.blender_tasks()]

    def blender_tasks(self):
        """The tasks in Blender, once the pack cut to the scene exists."""
        key = [self.inputs, self.folder / "native.json"]
        if self.options.forms == "all":
            key.append(self._plan().key)
            self.forms = [*self.forms, *planned_forms(self.folder, self.scene)]
        if self.options.convergence:
            # Beside the scene, so that its meshes and images are found.
            write_json(self.folder / "convergence.json", smaller(self.scene, CONVERGENCE_SIZE))
        tasks = []
        for version in self.options.blender:
            tasks += [self._blender(version, s, key) for s in range(1, self.options.seeds + 1)]
            if self.options.convergence:
                (self.folder_of(version) / "convergence").mkdir(exist_ok=True)
                tasks += [
                    self._convergence(version, s, key) for s in range(1, CONVERGENCE_SEEDS + 1)
                ]
        return tasks

    def expected(self):
        """The expected number of tasks in Blender, and the work of one, by kind. Before the pack
        cut to the scene exists, it assumes the two forms that the pack usually adds."""
        forms = len(self.forms) + 2 * (self.options.forms == "all")
        versions = len(self.options.blender)
        out = {"blender": (versions * self.options.seeds, forms * samples(self.settings, self.spp))}
        if self.options.convergence:
            work = forms * samples(self._small_settings(), sum(CONVERGENCE_SPP))
            out["convergence"] = (versions * CONVERGENCE_SEEDS, work)
        return out

    def _programs(self, *paths):
        return tuple((path, self.options.sums.get(path)) for path in paths)

    def _plan(self):
        options = self.options
        command = [options.tool, "build", "--scene", self.folder / "scene.json"]
        command += ["--error", options.plan, "--twin", "--out", self.folder / "plan"]
        return Task(
            name=f"{self.name}/plan",
            kind="plan",
            command=tuple(command),
            key=digest(options.sums[options.tool], self.inputs, options.plan),
            folder=self.folder / "tasks",
            outputs=(self.folder / "plan" / "brdfc_shaders" / "manifest.json",),
            programs=self._programs(options.tool),
            work=len(self.scene["materials"]),
            order=(self.index, 0),
        )

    def _blender(self, version, seed, key):
        jobs = [
            (f"{form.name} {seed}", "scene.json", f"{form.name}-{seed}.exr", form, self.spp)
            for form in self.forms
        ]
        key = [*key, self.forms, self.spp]
        return self._jobs("blender", version, seed, jobs, key, self.settings)

    def _convergence(self, version, seed, key):
        """A smaller picture in every form, with increasing numbers of samples."""
        jobs = [
            (
                f"{form.name}, {spp} samples, {seed}",
                "convergence.json",
                f"convergence/{form.name}-{spp}-{seed}.exr",
                form,
                spp,
            )
            for spp in CONVERGENCE_SPP
            for form in self.forms
        ]
        key = [*key, self.forms, CONVERGENCE_SPP, CONVERGENCE_SIZE]
        return self._jobs("convergence", version, seed, jobs, key, self._small_settings())

    def _small_settings(self):
        return smaller(self.scene, CONVERGENCE_SIZE)["settings"]

    def _jobs(self, kind, version, seed, jobs, key, settings):
        """A Blender process that renders jobs in their order. Each job is (name, scene, picture,
        form, samples), where picture is the file in the folder of that version. `settings` are
        those of the scene."""
        options, out = self.options, self.folder_of(version)
        listed = [
            {
                "name": f"{self.name} {name}",
                "scene": str(self.folder / scene),
                "out": str(out / picture),
                "representation": form.representation,
                "spp": spp,
                "seed": seed,
                "native": str(self.folder / "native.json"),
                "pack": form.pack and str(self.folder / form.pack),
                "osl": form.osl,
            }
            for name, scene, picture, form, spp in jobs
        ]
        python = python_of(version)
        file = out / "tasks" / f"{kind}-{seed}-jobs.json"
        write_json(file, listed)
        stamp = python.parents[1] / ".stamp"
        sums = options.sums
        return Task(
            name=f"{self.name}/{kind}-{seed}" + (f"/{version}" if version != USUAL_BLENDER else ""),
            kind=kind,
            command=(python, RENDER_SCENE, "--extension", options.extension, "--jobs", file),
            key=digest(sums[options.extension], sums[RENDER_SCENE], stamp, seed, *key),
            folder=out / "tasks",
            outputs=tuple(Path(job["out"]) for job in listed),
            programs=self._programs(options.extension, RENDER_SCENE, python),
            threads="--threads",
            prints_records=True,
            work=sum(samples(settings, job["spp"]) for job in listed),
            order=(self.index, 2, options.blender.index(version), kind, seed),
        )
