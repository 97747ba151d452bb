#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures noise and CPU time of every form of every model under many kinds of light, in units of
Blender's own Glossy node in the same scene.

Runs in a Python that has `bpy`. The scenes are in evidence/noise_scenes.py, the page is made by
evidence/noise_page.py. Noise is the variance between pictures with different seeds, so it needs no
reference picture. Only the mean that it is divided by does: it is taken from the model's form with
the least noise. Measurements are stored beside the pictures, keyed by the contents of the
extension, so that an interrupted run can be continued.
"""

import argparse
import concurrent.futures
import csv
import dataclasses
import functools
import hashlib
import json
import math
import multiprocessing
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from noise_page import BLOCK, LEAST_NOISE, NODE, UNBIASED, UNIT, Page

FIELDS = (
    *("model", "values", "form", "condition", "samples", "seeds", "pixels"),
    *("noise", "noise_error", "mean", "mean_error", "apart", "apart_error", "divided_by"),
)
KEY = FIELDS[:5]
COST_FIELDS = ("model", "values", "form", "condition", "cost", "cost_min", "cost_max")

#: Blender's own nodes, with the roughness that most models have by default. The first is the unit.
NATIVE = {
    "Glossy": ("ShaderNodeBsdfAnisotropic", {"Color": (0.8, 0.8, 0.8, 1), "Roughness": 0.4}),
    "Diffuse": ("ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.8, 0.8, 1)}),
}

#: Cases in addition to the default values of every model: rough, sharp and anisotropic ones of
#: some.
EXTRA_CASES = {
    "ashikhmin_shirley": [
        {"nu": 100, "nv": 1000},
        {"nu": 10, "nv": 10},
        {"nu": 10000, "nv": 10000},
    ],
    "cook_torrance": [{"m": 0.1}, {"m": 0.6}],
    "phong": [{"e": 3}, {"e": 1000}],
    "radziszewski_alda": [{"n": 1}, {"n": 12}],
    "schlick": [{"rough": 0.02}],
    "ward": [{"ax": 0.05, "ay": 0.3}],
}

#: Cases for the conditions that take too long for all models.
REPRESENTATIVE_CASES = (
    "Glossy",
    "ashikhmin_shirley",
    "cook_torrance",
    "coupled",
    "phong",
    "radziszewski_alda",
    "schlick",
    "ward",
)

#: The constant in the denominator of the mean of (f - f0)^2 / (f0^2 + FLOOR), as in
#: docs/conventions.md.
FLOOR = 0.01


@dataclasses.dataclass(frozen=True)
class Case:
    """A model with parameter values other than its defaults, or a node of Blender's."""

    model: str
    values: str = ""

    @property
    def parameters(self):
        pairs = (pair.split("=") for pair in self.values.split())
        return {name: float(value) for name, value in pairs}

    def __str__(self):
        return f"{self.model} {self.values}".strip()


def case_of(model, values):
    return Case(model, " ".join(f"{k}={v:g}" for k, v in values.items()))


# ---- in processes that have Blender --------------------------------------------------------------

_blender = {}


def start(extension, cache):
    """Starts Blender with the extension in each process; its output goes to a file."""
    # Imported here, because this process may never render.
    from render_scene import start_blender, take_even_block

    log = os.open(cache / "blender.log", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(log, 1)
    resources = tempfile.TemporaryDirectory(prefix="brdfc-noise-")
    bpy, loader = start_blender(extension, resources.name)
    import noise_scenes

    _blender.update(
        bpy=bpy,
        loader=loader,
        scenes=noise_scenes,
        take_even_block=take_even_block,
        cache=cache,
        resources=resources,
        folder=Path(resources.name),
    )


def material_of(case, form):
    if case.model in NATIVE:
        kind, inputs = NATIVE[case.model]
        return _blender["scenes"].node_material(case.model, kind, **inputs)
    return _blender["loader"].api.new_material(case.model, form, **case.parameters)


def set_up(condition, size, pack):
    """(scene, object, mask) of a condition, rendered with OSL. The last scene is reused, which
    keeps the importance maps of skies; making them takes seconds."""
    wanted = condition, size, pack
    if _blender.pop("set_up", None) != wanted:
        loader = _blender["loader"]
        loader.pack.use(pack)
        _blender["scene"] = _blender["scenes"].build(condition, _blender["folder"], size)
        loader.api.enable_osl(_blender["scene"][0])
    _blender["set_up"] = wanted
    return _blender["scene"]


def set_material(scene, ball, make):
    """Replaces the object's material by the one that `make` returns."""
    bpy = _blender["bpy"]
    last = list(ball.data.materials)
    ball.data.materials.clear()
    for material in last:
        bpy.data.materials.remove(material)
    ball.data.materials.append(make())
    bpy.context.view_layer.update()
    # Forms that use the list of lamps need it once the lamps exist.
    if see_lamps := getattr(_blender["loader"].api, "see_lamps", None):
        see_lamps(scene)
        bpy.context.view_layer.update()


def render(scene, samples, seed, read=True):
    """Seconds of CPU time, and pixels (height, width, 3) with row 0 at the bottom."""
    bpy, cycles = _blender["bpy"], scene.cycles
    cycles.seed = seed
    _blender["take_even_block"](cycles, samples)
    path = _blender["folder"] / "picture.exr"
    scene.render.filepath = str(path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    bpy.ops.render.render(write_still=read)
    seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
    if not read:
        return seconds, None
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.is_data = True
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        return seconds, pixels.reshape(image.size[1], image.size[0], 4)[..., :3].astype(np.float64)
    finally:
        bpy.data.images.remove(image)


def picture_file(case, form, condition, samples, size):
    name = f"{case} {form} {samples} {size}".replace(" ", "_")
    return _blender["cache"] / "pictures" / condition / f"{name}.npz"


def pictures(case, form, job):
    """{mask, mean, variance of one picture, seeds} of the condition with this form; None if the
    form rejects the values."""
    condition, samples, size, seeds = (job[k] for k in ("condition", "samples", "size", "seeds"))
    file = picture_file(case, form, condition, samples, size)
    if file.exists():
        with np.load(file) as kept:
            if kept["seeds"] >= seeds:
                return dict(kept)
    scene, ball, mask = set_up(condition, size, pack_of(case, form, job))
    try:
        set_material(scene, ball, lambda: material_of(case, form))
    except ValueError:
        return None
    made = np.stack([render(scene, samples, seed)[1] for seed in range(1, seeds + 1)])
    if not np.isfinite(made).all():
        raise RuntimeError(f"{case} {form}, {condition}: a pixel is not finite")
    found = {
        "mask": mask,
        "mean": made.mean(0),
        "variance": made.var(0, ddof=1),
        "seeds": np.array(seeds),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(partial := file.with_suffix(f".{os.getpid()}.npz"), **found)
    os.replace(partial, file)
    return found


def pack_of(case, form, job):
    """The pack that has the form; None for the extension itself."""
    return job["pack"] if form in job["from_pack"] else None


def smoothed(mean, mask, radius=3):
    """Means over squares, using only pixels in the mask."""

    def total(a):
        a = np.pad(a, ((radius + 1, radius), (radius + 1, radius), (0, 0))).cumsum(0).cumsum(1)
        n = 2 * radius + 1
        return a[n:, n:] - a[:-n, n:] - a[n:, :-n] + a[:-n, :-n]

    inside = mask[..., None].astype(np.float64)
    return total(mean * inside) / np.maximum(total(inside), 1)


def blocks(values, mask):
    """Sums over square blocks of the mask's pixels, in grey."""
    grey = np.where(mask, values.mean(-1), 0)
    side = -(-grey.shape[0] // BLOCK) * BLOCK
    grey = np.pad(grey, ((0, side - grey.shape[0]), (0, side - grey.shape[1])))
    return grey.reshape(side // BLOCK, BLOCK, -1, BLOCK).sum((1, 3))


def measure(job):
    """Rows for a case and a condition: every form that is requested."""
    case, forms = Case(*job["case"]), job["forms"]
    least_noise = next((f for f in LEAST_NOISE if f in forms), forms[0])
    unbiased = next((f for f in UNBIASED if f in forms), forms[0])
    found = {}
    for form in dict.fromkeys((least_noise, unbiased, *job["wanted"])):
        if (made := pictures(case, form, job)) is not None:
            found[form] = made
    if not found:
        return []
    by = least_noise if least_noise in found else next(iter(found))
    mask, divide = found[by]["mask"], found[by]["mean"]
    if by not in LEAST_NOISE and by != NODE:
        # Light that is found only occasionally has to be averaged over neighbouring pixels.
        divide = smoothed(divide, mask)
    rows = []
    for form, made in found.items():
        variance, seeds = made["variance"], int(made["seeds"])
        relative = (variance / (divide**2 + FLOOR))[mask].mean(-1)
        # The channels of a path are correlated, so their errors add up.
        spread = np.sqrt(variance[mask]).mean(-1) ** 2 / seeds
        count = int(mask.sum())
        row = {"model": case.model, "values": case.values, "form": form}
        row |= {k: job[k] for k in ("condition", "samples")} | {"seeds": seeds, "pixels": count}
        row |= {
            "noise": relative.mean(),
            "noise_error": relative.std() / math.sqrt(count),
            "mean": made["mean"][mask].mean(),
            "mean_error": math.sqrt(spread.sum()) / count,
            "divided_by": by,
        }
        if unbiased in found and form != unbiased:
            row |= apart(made, found[unbiased], mask)
        rows.append({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()})
    return rows


def apart(made, right, mask):
    """Relative L1 difference of the blocks of two pictures, and the value that noise alone would
    give."""
    off = blocks(made["mean"] - right["mean"], mask)
    light = blocks(right["mean"], mask).sum()
    variance = sum(
        blocks(np.sqrt(p["variance"]).mean(-1, keepdims=True) ** 2, mask) / int(p["seeds"])
        for p in (made, right)
    )
    by_noise = math.sqrt(2 / math.pi) * np.sqrt(variance).sum()
    return {"apart": float(np.abs(off).sum() / light), "apart_error": float(by_noise / light)}


def time_forms(job):
    """Rows of costs: the forms of a case and the Glossy node take turns in one process."""
    case, condition = Case(*job["case"]), job["condition"]
    unit = (Case(UNIT), NODE)
    turns = [unit] + [(case, form) for form in job["forms"]]
    taken = {turn: [] for turn in turns}
    for _ in range(job["repeat"]):
        for turn in turns:
            scene, ball, _ = set_up(condition, job["size"], pack_of(*turn, job))
            try:
                set_material(scene, ball, functools.partial(material_of, *turn))
            except ValueError:
                continue
            render(scene, 1, 1, read=False)  # compiles
            one, _ = render(scene, 1, 2, read=False)
            many, _ = render(scene, job["samples"], 3, read=False)
            taken[turn].append(max(many - one, 0.0))
    rows = []
    for turn in turns[1:]:
        costs = [t / u for t, u in zip(taken[turn], taken[unit], strict=False)]
        if costs:
            row = {"model": case.model, "values": case.values, "form": turn[1]}
            row |= {"condition": condition, "cost": f"{statistics.median(costs):.3f}"}
            rows.append(row | {"cost_min": f"{min(costs):.3f}", "cost_max": f"{max(costs):.3f}"})
    return rows


def tried(work, job):
    """The result of `work`; or raises an exception that a process without Blender can unpickle."""
    try:
        return work(job)
    except Exception as error:
        _blender.pop("set_up", None)
        raise RuntimeError(f"{type(error).__name__}: {error}") from None


def titles():
    """The page's text about the conditions, for a process without Blender."""
    scenes = _blender["scenes"]
    return {
        name: {
            "title": c.title,
            "timed_as": c.timed_as,
            "samples": list(c.samples),
            "picked": c.picked,
        }
        for name, c in scenes.CONDITIONS.items()
    }


# ---- what to measure -----------------------------------------------------------------------------


def cases_of(entries, options):
    wanted = options.model
    known = [*NATIVE, *entries]
    for name in wanted or []:
        if name not in known:
            raise SystemExit(f"--model: expected one of {', '.join(known)}; got {name!r}")
    cases = [Case(name) for name in NATIVE]
    for name in entries:
        if not wanted or name in wanted:
            cases += [case_of(name, values) for values in ({}, *EXTRA_CASES.get(name, []))]
    return cases


def packs(options, cases, entries, cache):
    """Packs with forms made of a fit, by case: {case: (folder, forms)}. Empty without --tool."""
    if options.tool is None:
        return {}
    made = {}
    for case in cases:
        if case.model in NATIVE:
            continue
        folder = cache / "packs" / str(case).replace(" ", "_")
        manifest = folder / "brdfc_shaders" / "manifest.json"
        if not manifest.exists():
            folder.mkdir(parents=True, exist_ok=True)
            drawn = "sampled" in entries[case.model]["representations"]
            material = {"model": case.model, "representation": "sampled" if drawn else "auto"}
            material["parameters"] = case.parameters
            file = folder / "materials.json"
            file.write_text(json.dumps({"materials": {"m": material}}), encoding="utf-8")
            # Any error limit will do: the fit is built beside the sampled form.
            command = [options.tool, "build", "--materials", file, "--error", "100"]
            command += ["--twin", "--out", folder]
            subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        forms = json.loads(manifest.read_text("utf-8"))["models"][case.model]["representations"]
        made[case] = (str(folder / "brdfc_shaders"), [f for f in forms if f in MADE_OF_A_FIT])
    return made


#: Forms that packs for a scene or a .blend have, and the extension may lack.
MADE_OF_A_FIT = ("fitted", "twin")


def jobs_of(cases, entries, conditions, fitted, options):
    """One job per case, condition and number of samples, in the order of conditions."""
    for condition, entry in conditions.items():
        if options.condition and condition not in options.condition:
            continue
        for samples in options.samples or entry["samples"]:
            for case in cases:
                named = options.model and case.model in options.model
                if entry["picked"] and not named and case.model not in REPRESENTATIVE_CASES:
                    continue
                if case.model in NATIVE:
                    forms, pack, from_pack = [NODE], None, []
                else:
                    forms = list(entries[case.model]["representations"])
                    pack, made = fitted.get(case, (None, []))
                    # A fit for these values is better than one along a parameter.
                    from_pack = made
                    forms += [f for f in made if f not in forms]
                wanted = [f for f in forms if not options.form or f in options.form]
                if case.model in NATIVE:
                    wanted = forms
                if not wanted:
                    continue
                yield {
                    "case": (case.model, case.values),
                    "condition": condition,
                    "samples": samples,
                    # Many samples take long, and fewer pixels suffice to measure their noise.
                    "size": options.size
                    if samples <= 256 or entry["picked"]
                    else options.size // 2,
                    "seeds": options.seeds if samples <= 256 else 2,
                    "forms": forms,
                    "wanted": wanted,
                    "pack": pack,
                    "from_pack": from_pack,
                }


class Table:
    """Rows of a CSV file by key; rows that are added are written at once."""

    def __init__(self, path, fields, key):
        self.path, self.fields, self.key, self.rows = path, fields, key, {}
        if path.exists():
            with path.open(newline="", encoding="utf-8") as file:
                for row in csv.DictReader(file):
                    self.rows[self.of(row)] = {f: row.get(f, "") for f in fields}

    def of(self, row):
        return tuple(str(row[k]) for k in self.key)

    def add(self, rows):
        for row in rows:
            self.rows[self.of(row)] = {f: str(row.get(f, "")) for f in self.fields}
        self.write()

    def write(self):
        partial = self.path.with_suffix(".partial")
        with partial.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, self.fields, lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows.values())
        os.replace(partial, self.path)


def run(jobs, work, table, options, cache, processes):
    """Does the jobs that the table lacks, in several processes. Returns how many failed: one
    condition that fails with a form must not stop the others."""
    if not jobs:
        return 0
    pool = concurrent.futures.ProcessPoolExecutor(
        processes,
        multiprocessing.get_context("spawn"),
        initializer=start,
        initargs=(options.extension, cache),
    )
    with pool:
        pending = {pool.submit(tried, work, job): job for job in jobs}
        failed = 0
        for done, future in enumerate(concurrent.futures.as_completed(pending), 1):
            job = pending[future]
            what = f"[{done}/{len(jobs)}] {job['condition']}: {Case(*job['case'])}"
            try:
                table.add(future.result())
            except concurrent.futures.process.BrokenProcessPool:
                raise  # Blender crashed: what it left to do is lost
            except RuntimeError as error:
                failed += 1
                what += f": FAILED: {error}"
            print(what, file=sys.stderr, flush=True)
    return failed


def bench_costs():
    """Costs that evidence/bench measured, by model and form."""
    path = Path(__file__).resolve().parents[1] / "blender_addon" / "costs.csv"
    with open(path, encoding="utf-8", newline="") as file:
        return {(row["model"], row["form"]): float(row["cost"]) for row in csv.DictReader(file)}


def is_missing(job, table):
    model, values = job["case"]
    for form in job["wanted"]:
        row = table.rows.get((model, values, form, job["condition"], str(job["samples"])))
        if row is None or int(row["seeds"]) < job["seeds"]:
            return True
    return False


def cost_jobs(jobs, table, options):
    """Jobs for the costs of all models with their defaults, with no lamp, one, and four."""
    for job in jobs:
        model, values = job["case"]
        if values or model == UNIT or job["condition"] not in options.timed:
            continue
        if job["samples"] != 64:
            continue
        forms = job["wanted"]
        if all((model, "", f, job["condition"]) in table.rows for f in forms):
            continue
        yield job | {"forms": forms, "repeat": options.repeat, "samples": 64}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--extension", required=True, type=Path, help="brdfc_shaders-<version>.zip")
    parser.add_argument(
        "--tool", type=Path, help="the program brdfc, which makes forms that the extension lacks"
    )
    parser.add_argument("--docs", required=True, type=Path, help="where noise.md and .csv are")
    parser.add_argument("--cache", required=True, type=Path, help="what is kept between runs")
    parser.add_argument("--form", action="append", help="only this form; may be repeated")
    parser.add_argument("--model", action="append", help="only this model; may be repeated")
    parser.add_argument("--condition", action="append", help="only this light; may be repeated")
    parser.add_argument("--samples", action="append", type=int, help="instead of 64 (and 1024)")
    parser.add_argument("--seeds", type=int, default=4, help="pictures of each (4)")
    parser.add_argument("--size", type=int, default=42, help="side of the pictures in pixels (42)")
    parser.add_argument("--repeat", type=int, default=3, help="times that a cost is measured (3)")
    parser.add_argument("--processes", type=int, default=2, help="side by side, for noise (2)")
    parser.add_argument("--no-costs", action="store_true", help="leave run times as they are")
    parser.add_argument(
        "--quick", action="store_true", help="a rough look, not written into the documents"
    )
    parser.add_argument("--page", action="store_true", help="only write the page of the CSV again")
    options = parser.parse_args()
    if options.quick:
        options.size, options.seeds, options.repeat = 28, 2, 1
    if min(options.seeds - 1, options.repeat, options.processes, options.size - 15) < 1:
        parser.error(
            "expected --seeds of at least 2, --repeat and --processes of at least 1 and --size of "
            "at least 16"
        )
    for path in (options.extension, options.tool):
        if path is not None and not path.is_file():
            parser.error(f"{path}: no such file")
    options.extension = options.extension.resolve()
    if any(n < 2 or n & (n - 1) for n in options.samples or []):
        # Cycles' sequence is evenly distributed over blocks of such a length.
        parser.error("--samples: expected powers of two from 2 on")

    with zipfile.ZipFile(options.extension) as archive:
        entries = json.loads(archive.read("manifest.json"))["models"]
        # Names and checksums, because the time stamps of an archive may differ.
        contents = sorted((i.filename, i.CRC) for i in archive.infolist())
    digest = hashlib.sha256(json.dumps(contents).encode()).hexdigest()[:12]
    cache = options.cache.resolve() / (digest + ("-quick" if options.quick else ""))
    cache.mkdir(parents=True, exist_ok=True)

    with concurrent.futures.ProcessPoolExecutor(
        1,
        multiprocessing.get_context("spawn"),
        initializer=start,
        initargs=(options.extension, cache),
    ) as pool:
        conditions = pool.submit(titles).result()
    for name in options.condition or []:
        if name not in conditions:
            parser.error(f"--condition: expected one of {', '.join(conditions)}; got {name!r}")
    options.timed = {entry["timed_as"] for entry in conditions.values()}

    measured = Table(cache / "noise.csv", FIELDS, KEY)
    costs = Table(cache / "noise-cost.csv", COST_FIELDS, COST_FIELDS[:4])
    failed = 0
    if not options.page:
        cases = cases_of(entries, options)
        fitted = packs(options, cases, entries, cache)
        jobs = list(jobs_of(cases, entries, conditions, fitted, options))
        known = {f for job in jobs for f in job["forms"]}
        for form in options.form or []:
            if form not in known:
                parser.error(f"--form: expected one of {', '.join(sorted(known))}; got {form!r}")
        missing = [job for job in jobs if is_missing(job, measured)]
        failed += run(missing, measure, measured, options, cache, options.processes)
        if not options.no_costs:
            # In a single process, because parallel processes would affect the times.
            timed = list(cost_jobs(jobs, costs, options))
            failed += run(timed, time_forms, costs, options, cache, 1)

    docs = cache if options.quick else options.docs
    for made in (measured, costs):
        kept = Table(docs / made.path.name, made.fields, made.key)
        kept.add(made.rows.values())
        made.all = list(kept.rows.values())
    page = Page(measured.all, costs.all, conditions, bench_costs()).text(options.seeds)
    (docs / "noise.md").write_text(page + "\n", encoding="utf-8")
    print(docs / "noise.md")
    if failed:
        sys.exit(f"noise_table: {failed} measurements failed; the others are in the table")


if __name__ == "__main__":
    main()
