# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the generated files of the extension: models, parameters, forms, tables. Independent of
bpy."""

import hashlib
import json
import math
import re
from functools import cache, lru_cache
from numbers import Real
from pathlib import Path

from ..common import extension
from ..common.i18n import form_name, say

_INSTALLED = extension.ROOT
#: Folder that models are read from; see use().
root = _INSTALLED
FORMAT = 1
#: To be increased when nodes.py or twin.py changes how it wires nodes.
WIRING = 1

#: Custom property of a node group: its model, its representation and its sockets' identifiers.
TAG = "brdfc"
#: Sockets of every group, besides the model's parameters.
NORMAL = "Normal"
TANGENT = "Tangent"


class PackError(RuntimeError):
    """The extension's own files are missing or damaged."""

    def __init__(self, more):
        super().__init__(say("A file of this extension is damaged: install it again", more=more))


def use(folder=None):
    """Reads models from another folder that `brdfc build` wrote, for instance one cut to a scene;
    None: from the extension's own."""
    global root
    root = _INSTALLED if folder is None else Path(folder)
    manifest.cache_clear()
    digest.cache_clear()


@lru_cache(maxsize=1)
def manifest():
    """The manifest as a dict. Raises PackError if it is missing, damaged or of another format."""
    path = root / "manifest.json"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise PackError(f"{path}: {error}") from error
    if not isinstance(data, dict) or not isinstance(data.get("models"), dict):
        raise PackError(f"{path}: expected an object with models")
    if data.get("format") != FORMAT:
        raise PackError(f"{path}: format {data.get('format')!r}, expected {FORMAT}")
    return data


#: Why only twins are available.
NO_OSL = say("This Blender was built without Open Shading Language")


def osl_available():
    """Whether this build of Blender has Open Shading Language; Debian's has not."""
    try:
        import _cycles
    except ImportError:  # outside of Blender
        return True
    return bool(_cycles.with_osl)


def version(generator):
    """The numbers in "brdfc 1.2.3"; empty if there are none."""
    return tuple(int(n) for n in re.findall(r"\d+", generator))


def model_names():
    """Identifiers of the models, in alphabetical order."""
    return sorted(manifest()["models"])


def model(name):
    """Manifest entry of a model. Raises ValueError for an unknown name."""
    models = manifest()["models"]
    if name not in models:
        raise ValueError(f"unknown model {name!r}; expected one of {', '.join(sorted(models))}")
    return models[name]


def models_by_look():
    """{look: identifiers of models}, both in the order of menus; looks without a model are left
    out."""
    names = {look: [] for look in manifest()["looks"]}
    for name in model_names():
        names[model(name)["look"]].append(name)
    return {look: found for look, found in names.items() if found}


def citation(entry):
    """Authors and year of a model's paper, from a manifest entry: "Oren, Nayar 1994". Raises
    PackError if the paper is not cited as "I. Name, J. Name: Title, Journal, year"."""
    cited = re.match(r"([^:]+): .*?\b(1[5-9]\d\d|20\d\d)\b", entry["paper"])
    if cited is None:
        raise PackError(
            f"{entry['label']}: expected authors, a colon, a title and a year, got "
            f"{entry['paper']!r}"
        )
    surnames = [author.split()[-1] for author in cited[1].split(",")]
    return f"{', '.join(surnames)} {cited[2]}"


def equal_in_float32(value, only):
    """Whether two values of a parameter are equal in single precision, which sockets have."""
    if isinstance(only, str) or value is None:
        return value == only
    pairs = zip(value, only, strict=True) if isinstance(only, tuple) else [(value, only)]
    return all(math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-9) for a, b in pairs)


def reason_unavailable(model_name, name, values):
    """Why a form that exists for some values only is not available for these; None if it is."""
    for key, only in form_values(model_name, name).items():
        if key in values and not equal_in_float32(values[key], only):
            got = values[key]
            shown = say("a linked or animated value") if got is None else value_text(got)
            given = "a linked or animated value" if got is None else repr(got)
            return say(
                "{form} is only for {parameter} = {only}, not for {got}",
                more=f"model {model_name!r} has the form {name!r} only for {key}={only!r}, not "
                f"for {given}",
                form=form_name(name),
                parameter=parameters(model_name).get(key, {}).get("label", key),
                only=value_text(only),
                got=shown,
            )
    return None


def choice_label(identifier):
    """Display text of an identifier."""
    return identifier.replace("_", " ").capitalize()


def value_text(value):
    """Display text of a parameter's value."""
    if isinstance(value, str):
        return choice_label(value)
    if isinstance(value, tuple):
        return f"({', '.join(f'{v:g}' for v in value)})"
    return f"{value:g}"


def native_form(model_name):
    """The form that "auto" takes where OSL does not run: made of Blender's own nodes and equal to
    the model, at least for some of its choices. None if the model has no such form."""
    schema = parameters(model_name)
    for name, form in model(model_name)["representations"].items():
        limited = [schema[key]["kind"] for key in form["only"] if key in schema]
        if "nodes" in form and name != "twin" and set(limited) <= {"choice"}:
            return name
    return None


def automatic(model_name, values=None, osl=True):
    """The form that "auto" takes with or without OSL: the model's preferred one, or the next if
    that does not support `values`."""
    entry, values = model(model_name), values or {}
    forms, native = entry["representations"], native_form(model_name)
    others = [n for n in forms if n != entry["auto"] and "nodes" not in forms[n]]
    order = [entry["auto"], *others]
    if not osl:
        order = [n for n in (native, "twin") if n in forms] + order
    return next((n for n in order if reason_unavailable(model_name, n, values) is None), order[0])


def resolve(model_name, representation, values=None):
    """The representation to use. Raises ValueError. For "auto" it is automatic(), given whether
    this build of Blender has OSL, whatever the scene's setting."""
    entry, values = model(model_name), values or {}
    name = representation
    if name == "auto":
        name = automatic(model_name, values, osl_available())
    if name not in entry["representations"]:
        known = ", ".join(["auto", *sorted(entry["representations"])])
        raise ValueError(
            say(
                "{model} has no render method {form!r}",
                more=f"expected one of {known}",
                model=entry["label"],
                form=representation,
            )
        )
    if problem := reason_unavailable(model_name, name, values):
        raise ValueError(problem)
    return name


def representation(model_name, name):
    """Manifest entry of one representation. Raises ValueError."""
    return model(model_name)["representations"][resolve(model_name, name)]


def parameters(model_name):
    """Schema of the parameters by name, in the order of the manifest."""
    return {p["name"]: p for p in model(model_name)["parameters"]}


def unused_parameters(schema, values):
    """Parameters that differ from their default though no formula reads them under these choices:
    {name: a choice that causes it}. The value of a linked parameter is None."""
    found = {}
    for name, parameter in schema.items():
        value, needs = values.get(name), parameter.get("needs", {})
        if needs and not equal_in_float32(value, canonical(parameter)["default"]):
            for choice, needed in needs.items():
                if choice in schema and values.get(choice) not in (None, *needed):
                    found[name] = choice
    return found


def fixed(model_name):
    """Parameters that this pack was built without, with the values that it assumes."""
    return canonical(model(model_name).get("fixed", {}))


def fixed_optical(model_name):
    """Those of them that describe a substance, as `optical` of parameters."""
    return model(model_name).get("fixed_optical", {})


def canonical(found):
    """Converts parameter values from JSON to the form of check_value()."""
    return {name: tuple(v) if isinstance(v, list) else v for name, v in found.items()}


def form_values(model_name, name):
    """Parameters of the model for which a form supports one value only, with that value."""
    return canonical(model(model_name)["representations"][name]["only"])


def constants(model_name, name):
    """Values of the parameters for which a form has no socket, because the pack or the form
    supports one value only."""
    return fixed(model_name) | form_values(model_name, name)


def form_choices(model_name, name):
    """Identifiers of all choices of a form; a single one where it exists for that one alone."""
    only = form_values(model_name, name)
    return {
        key: [only[key]] if key in only else p["choices"]
        for key, p in parameters(model_name).items()
        if p["kind"] == "choice"
    }


def socket_parameters(model_name, name):
    """The parameters for which a form has a socket: those with more than one possible value."""
    only = form_values(model_name, name)
    return {
        key: p
        for key, p in parameters(model_name).items()
        if key not in only and len(p.get("choices", "any")) > 1
    }


def has_aimed():
    """Whether any form of this pack aims at lamps."""
    models = manifest()["models"].values()
    return any(form.get("lamps") for m in models for form in m["representations"].values())


def _file(relative):
    path = root / relative
    if not path.is_file():
        raise PackError(f"{path} is missing")
    return path


def is_native(model_name, name):
    """Whether a form consists of Blender's own nodes and needs no OSL."""
    return "nodes" in representation(model_name, name)


def source(model_name, name):
    """File stem and text of the OSL source, or of the data for Blender's own nodes."""
    entry = representation(model_name, name)
    path = _file(entry["nodes"] if is_native(model_name, name) else entry["shader"])
    return path.stem, path.read_text(encoding="utf-8")


def albedo_source(model_name, name):
    """The same for the script of the Albedo output if it is separate: its tables are large, and
    most materials do without it. Otherwise None."""
    file = representation(model_name, name).get("albedo_shader")
    if file is None:
        return None
    path = _file(file)
    return path.stem, path.read_text(encoding="utf-8")


@cache
def digest(model_name, name):
    """A key that changes whenever the shader or its group's sockets change. Panels need it at each
    redraw; so the manifest holds the hash of the source, which can be a megabyte."""
    form = representation(model_name, name)
    schema = [model(model_name)["parameters"], form["only"]]
    forms = model(model_name)["representations"]
    hashes = [WIRING, form["sha256"], form.get("albedo_sha256")]
    if "twin" in forms and name != "twin":  # every other form contains it as a stand-in
        hashes.append(forms["twin"]["sha256"])
    text = json.dumps([*hashes, *schema], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _is_number(value):
    return isinstance(value, Real) and not isinstance(value, bool)


def _checked_number(what, value, low, high):
    if not _is_number(value):
        raise ValueError(f"{what}: expected a number from {low:g} to {high:g}, got {value!r}")
    value = float(value)
    if not math.isfinite(value) or not low <= value <= high:
        raise ValueError(f"{what}: expected a number from {low:g} to {high:g}, got {value:g}")
    return value


def _checked_fixed(model_name, name, value):
    here = fixed(model_name)[name]
    given = (value,) * 3 if isinstance(here, tuple) and _is_number(value) else value
    given = tuple(given) if isinstance(given, list) else given
    if given != here:
        raise ValueError(
            f"{model_name}.{name}: expected {here}, the only value in this extension, which was "
            f"built for one scene; got {value!r}"
        )
    return here


def check_value(model_name, name, value):
    """Returns the value in canonical form: float, (r, g, b) or the identifier of a choice.

    A colour may be given as one grey number. Raises ValueError naming model, parameter and
    what was expected.
    """
    schema = parameters(model_name)
    if name in fixed(model_name):
        return _checked_fixed(model_name, name, value)
    if name not in schema:
        known = ", ".join(schema)
        raise ValueError(f"model {model_name!r} has no parameter {name!r}; expected one of {known}")
    parameter = schema[name]
    what = f"{model_name}.{name}"
    if parameter["kind"] == "choice":
        if value not in parameter["choices"]:
            known = ", ".join(parameter["choices"])
            raise ValueError(f"{what}: expected one of {known}, got {value!r}")
        return value
    low, high = parameter["min"], parameter["max"]
    if parameter["kind"] == "number":
        return _checked_number(what, value, low, high)
    if _is_number(value):
        value = (value,) * 3
    try:
        channels = tuple(float(c) for c in value)
    except (TypeError, ValueError):
        channels = ()
    if isinstance(value, str) or len(channels) not in (3, 4):
        raise ValueError(f"{what}: expected a number or three (r, g, b), got {value!r}")
    return tuple(
        _checked_number(f"{what} ({channel})", c, low, high)
        for channel, c in zip("rgb", channels[:3], strict=True)
    )
