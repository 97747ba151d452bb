# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the generated code in Cycles with the model, step by step.

`brdfc probe` prints a shader that outputs f, pdf, and a sample's wi, weight and pdf for given wi,
wo, u and parameters, which are read from attributes: one render executes thousands of points. The
tool evaluates the same points in four ways: the model in double and in float precision, the
recording in float, and the recording with OSL's arithmetic. So the error of each step is known:

    double -> float      rounding, and how the formula amplifies it
    float -> osl         OSL's fast functions
    osl -> Cycles        differences between the printed text and the recording: a bug in printing
"""

import csv
import json
import os
from pathlib import Path

import bpy
import numpy as np
import pytest
from goniometer import Goniometer
from helpers import arguments, read_csv, script_material, to_csv

VERSION = ".".join(map(str, bpy.app.version[:2]))
#: Number of points in a group: one parameter at one value, the others at their defaults.
POINTS = 24
#: Values of the attribute `show`, and the columns that it selects.
SHOWN = {
    0.0: ("f_r", "f_g", "f_b"),
    1.0: ("wi_x", "wi_y", "wi_z"),
    1.5: ("sample_pdf",) * 3,
    2.0: ("weight_r", "weight_g", "weight_b"),
    3.0: ("pdf",) * 3,
}
NOT_FINITE = -31337.0
#: Relative L1 error allowed for f, pdf and weight in Cycles, by the largest parameter: an exponent
#: amplifies the rounding of single precision.
LIMITS = ((1e5, 1e-3), (1e6, 1e-2))
#: Error allowed for the last step: OSL's compiler does not contract or reorder, but merges
#: constants that were rounded differently.
EMISSION = 2e-5


def groups(parameters):
    """(name, value) for each decade of parameters with a wide range, and for a few values of the
    others."""
    chosen = [("", None)]
    for p in parameters:
        if p["kind"] != "number":
            continue
        low, high = p["min"], p["max"]
        if high >= 1000:
            start = -2 if low <= 0 else int(np.ceil(np.log10(low)))
            values = [10.0**k for k in range(start, int(np.floor(np.log10(high))) + 1)]
        else:
            values = np.linspace(p["soft_min"], p["soft_max"], 4)[:-1]
        chosen += [(p["name"], float(v)) for v in values if low <= v <= high]
    return chosen


def other_choices(parameters):
    """Assignments of choices; each changes a single choice from its default."""
    choices = [p for p in parameters if p["kind"] == "choice"]
    return [{p["name"]: c} for p in choices for c in p["choices"] if c != p["default"]]


def points_of(tool, model, choices, parameters, rng):
    """Points of all groups, as columns by name, and the group of each point. Choices other than the
    defaults are tested only with default numbers."""
    numbers = [p for p in parameters if p["kind"] != "choice"]
    columns, group = {}, []
    for index, (name, value) in enumerate(groups(parameters)[: 1 if choices else None]):
        count = POINTS
        values = {p["name"]: p["default"] for p in numbers}
        if name:
            values[name] = value
        cosine, azimuth = rng.uniform(0.05, 1, count), rng.uniform(0, 2 * np.pi, count)
        sine = np.sqrt(1 - cosine**2)
        wo = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], -1)
        wo, u = wo.astype(np.float32), rng.random((count, 3)).astype(np.float32)
        u = np.minimum(u, np.float32(1 - 2**-24))
        rows = {f"wo_{a}": wo[:, i] for i, a in enumerate("xyz")}
        rows |= {f"u{i + 1}": u[:, i] for i in range(3)}
        other_u = rng.random((count, 3))
        rows |= {f"other_u{i + 1}": other_u[:, i] for i in range(3)}
        for p in numbers:
            v = np.float32(values[p["name"]])
            if p["kind"] == "color":
                rows |= {f"{p['name']}_{c}": np.full(count, v[i]) for i, c in enumerate("rgb")}
            else:
                rows[p["name"]] = np.full(count, v)
        for key, column in rows.items():
            columns.setdefault(key, []).append(column.astype(np.float64))
        group += [index] * count
    columns = {key: np.concatenate(parts) for key, parts in columns.items()}
    # wi is sampled from the model, with other random numbers: nothing else hits a narrow lobe.
    drawing = {f"u{i}": columns.pop(f"other_u{i}") for i in (1, 2, 3)}
    drawing |= {f"wi_{a}": columns[f"wo_{a}"] for a in "xyz"}
    drawn = run_probe(tool, model, choices, columns | drawing)
    kept = drawn["double_sample_pdf"] > 0
    for a in "xyz":
        wi = np.where(kept, drawn[f"double_wi_{a}"], columns[f"wo_{a}"])
        columns[f"wi_{a}"] = wi.astype(np.float32).astype(np.float64)
    return columns, np.array(group)


def run_probe(tool, model, choices, columns):
    """Results of `brdfc probe --run` at these points, as columns by name."""
    stdin = to_csv(list(columns), np.stack(list(columns.values()), -1))
    header, rows = read_csv(tool("probe", model, *arguments(choices), "--run", stdin=stdin))
    return {name: rows[:, i] for i, name in enumerate(header)}


def probe_material(extension, name, source):
    """A material in which each input of the probe reads the attribute of its name."""
    material = script_material(extension, name, source)
    tree = material.node_tree
    script = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeScript")
    for socket in script.inputs:
        read = tree.nodes.new("ShaderNodeAttribute")
        read.attribute_name = socket.identifier
        output = {"VALUE": "Fac", "VECTOR": "Vector", "RGBA": "Color"}[socket.type]
        tree.links.new(read.outputs[output], socket)
    return material


PARTS = ["defaults", pytest.param("choices", marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=PARTS)
def chosen(request):
    """Every model with its default choices, and with each other choice."""
    return request.param


@pytest.fixture(scope="module")
def measured(extension, tool, chosen):
    """By (model, choices): groups, group of each point, columns of the tool's runs, and Cycles'
    values."""
    rng = np.random.default_rng(7)
    scattering = {m["name"] for m in json.loads(tool("list", "--json")) if m.get("scatter", True)}
    jobs = []
    for model, entry in extension.api.models().items():
        if model not in scattering:
            continue
        for choices in [{}] if chosen == "defaults" else other_choices(entry["parameters"]):
            source = tool("probe", model, *arguments(choices))
            columns, group = points_of(tool, model, choices, entry["parameters"], rng)
            runs = run_probe(tool, model, choices, columns)
            jobs.append((model, choices, source, columns, group, runs, entry["parameters"]))

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    materials = [probe_material(extension, f"probe {i}", j[2]) for i, j in enumerate(jobs)]
    sizes = [len(j[4]) for j in jobs]
    attributes, which, show = {}, [], []
    total = sum(sizes) * len(SHOWN)
    start = 0
    for i, (_, _, _, columns, group, _, parameters) in enumerate(jobs):
        for s in SHOWN:
            part = slice(start, start + len(group))
            for v, keys in (
                ("wi", ("wi_x", "wi_y", "wi_z")),
                ("wo", ("wo_x", "wo_y", "wo_z")),
                ("numbers", ("u1", "u2", "u3")),
            ):
                at = attributes.setdefault(v, np.zeros((total, 3)))
                at[part] = np.stack([columns[k] for k in keys], -1)
            for p in parameters:
                name = f"p_{p['name']}"
                # A name may be a number in one model and a colour in another: they get separate
                # attributes.
                if p["kind"] == "number":
                    at = attributes.setdefault(name, np.zeros(total))
                    if at.ndim == 2:
                        at[part] = columns[p["name"]][:, None]
                    else:
                        at[part] = columns[p["name"]]
                elif p["kind"] == "color":
                    if name not in attributes or attributes[name].ndim == 1:
                        old = attributes.get(name, np.zeros(total))
                        attributes[name] = np.repeat(old[:, None], 3, 1)
                    colour = [columns[f"{p['name']}_{c}"] for c in "rgb"]
                    attributes[name][part] = np.stack(colour, -1)
            which += [i] * len(group)
            show += [s] * len(group)
            start += len(group)
    attributes["show"] = np.array(show)
    up = np.tile([0.0, 0.0, 1.0], (total, 1))
    meter = Goniometer(scene, materials, up, 1, which=np.array(which), attributes=attributes)
    picture = meter.measure()
    result, start = {}, 0
    for (model, choices, _, _, group, runs, parameters), size in zip(jobs, sizes, strict=True):
        values = {}
        for names in SHOWN.values():
            for c, name in enumerate(names):
                values[name] = picture[start : start + size, c]
            start += size
        key = (model, " ".join(arguments(choices)))
        result[key] = (groups(parameters)[: group.max() + 1], group, runs, values)
    return result


def _l1(a, b):
    scale = np.abs(b).sum()
    return float(np.abs(a - b).sum() / scale) if scale else float(np.abs(a).sum() > 0)


@pytest.fixture(scope="module")
def rows(measured, chosen):
    """A row for each group and quantity, with the error of each step."""
    found = []
    for (model, choices), (names, group, runs, cycles) in measured.items():
        for index, (name, value) in enumerate(names):
            mine = group == index
            for quantity, columns in (
                ("f", ("f_r", "f_g", "f_b")),
                ("pdf", ("pdf",)),
                ("wi", ("wi_x", "wi_y", "wi_z")),
                ("weight", ("weight_r", "weight_g", "weight_b")),
                ("sample_pdf", ("sample_pdf",)),
            ):
                step = {
                    run: np.stack([runs[f"{run}_{c}"][mine] for c in columns])
                    for run in ("double", "float", "recorded", "osl")
                }
                step["cycles"] = np.stack([cycles[c][mine] for c in columns])
                # The direction of a lost sample is arbitrary.
                if quantity == "wi":
                    alive = (runs["double_sample_pdf"][mine] > 0) & (cycles["sample_pdf"][mine] > 0)
                    step = {run: v[:, alive] for run, v in step.items()}
                bad = sum(int((v == NOT_FINITE).sum()) for v in step.values())
                found.append(
                    {
                        "model": model,
                        "choices": choices,
                        "parameter": name,
                        "value": value,
                        "quantity": quantity,
                        "rounding": _l1(step["float"], step["double"]),
                        "recording": _l1(step["recorded"], step["float"]),
                        "osl_arithmetic": _l1(step["osl"], step["recorded"]),
                        "emission": _l1(step["cycles"], step["osl"]),
                        "total": _l1(step["cycles"], step["double"]),
                        "not_finite": bad,
                    }
                )
    folder = Path(os.environ["BRDFC_TOOL"]).resolve().parent / "generated_code"
    folder.mkdir(exist_ok=True)
    with (folder / f"{VERSION}-{chosen}.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(found[0]))
        writer.writeheader()
        writer.writerows(found)
    return found


def _says(row):
    at = f" at {row['parameter']} = {row['value']:g}" if row["parameter"] else ""
    steps = ("rounding", "recording", "osl_arithmetic", "emission", "total")
    errors = ", ".join(f"{s} {row[s]:.1e}" for s in steps)
    return f"{row['model']} {row['choices']}: {row['quantity']}{at}: {errors}"


@pytest.mark.long
def test_text_says_what_was_recorded(rows):
    """Compares Cycles with the recording in OSL's arithmetic. If a formula amplifies rounding, the
    last bit of a constant matters as well: the allowed error is the one between float and
    double."""
    bad = [r for r in rows if r["emission"] > EMISSION + r["rounding"] + r["osl_arithmetic"]]
    assert not bad, "\n".join(map(_says, bad))


def test_everything_is_finite(rows):
    bad = [r for r in rows if r["not_finite"]]
    assert not bad, "\n".join(map(_says, bad))


def _sharpness(row):
    """The Phong exponent of an equally narrow lobe. Radziszewski and Alda's lobe has a width of
    about 1/n, so rounded directions affect it as they affect an exponent of n^2."""
    value = row["value"] or 0
    squared = row["model"] == "radziszewski_alda" and (row["parameter"] or "").startswith("n")
    return value**2 if squared else value


def test_accuracy_in_cycles_by_decade(rows):
    worst = {}
    for r in rows:
        limit = next((e for top, e in LIMITS if _sharpness(r) <= top), None)
        if limit is None:
            continue
        key = (r["model"], r["choices"], r["quantity"])
        if key not in worst or r["total"] / limit > worst[key][0]:
            worst[key] = (r["total"] / limit, r)
    for share, row in sorted(worst.values(), key=lambda w: -w[0])[:12]:
        print(f"{share:.2f} of the limit: {_says(row)}")
    bad = [row for share, row in worst.values() if share > 1]
    assert not bad, "\n".join(map(_says, bad))
