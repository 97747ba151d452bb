# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the generated files of the extension: models, parameters, forms, tables. Independent of
bpy."""

import difflib
import hashlib
import json
import re
from functools import cache, cached_property, lru_cache
from pathlib import Path

from ..common import extension
from ..common.i18n import form_name, forms_in_scripts, say
from .parameter_values import canonical, checked_number, equal_in_float32, is_number, value_text

_INSTALLED = extension.ROOT
#: Folder that models are read from; see use().
root = _INSTALLED
FORMAT = 1
#: To be increased when code in content/ changes how it wires nodes.
WIRING = 3

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
    model.cache_clear()


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


@cache
def model(name):
    """A Model of this pack. Raises ValueError for an unknown name."""
    entries = manifest()["models"]
    if name not in entries:
        near = difflib.get_close_matches(str(name).lower(), entries, 1)
        meant = f"did you mean {near[0]!r}? " if near else ""
        listed = ", ".join(sorted(entries))
        raise ValueError(f"unknown model {name!r}; {meant}expected one of {listed}")
    return Model(name, entries[name])


def models_by_look():
    """{look: identifiers of models}, the models in the order of their labels; looks without a model
    are left out."""
    names = {look: [] for look in manifest()["looks"]}
    for name in sorted(model_names(), key=lambda name: model(name).label.casefold()):
        names[model(name).look].append(name)
    return {look: found for look, found in names.items() if found}


class Model:
    """A model of this pack."""

    def __init__(self, name, entry):
        """`entry`: that of the manifest."""
        self.name, self.entry = name, entry
        self.label, self.doc = entry["label"], entry["doc"]
        self.paper, self.look = entry["paper"], entry["look"]
        #: Schema of the parameters by name, in the order of the manifest.
        self.parameters = {p["name"]: p for p in entry["parameters"]}
        #: Parameters that this pack was built without, with the values that it assumes.
        self.fixed = canonical(entry.get("fixed", {}))
        #: Those of them that describe a substance, as `optical` of parameters.
        self.fixed_optical = entry.get("fixed_optical", {})
        #: Whether its forms can have an Albedo output: not where no table can hold it.
        self.has_albedo = not entry["scatter"] or entry.get("albedo") is not None
        #: {name: Form}
        self.forms = {n: Form(self, n, form) for n, form in entry["representations"].items()}

    @property
    def citation(self):
        """Authors and year of the paper: "Oren, Nayar 1994". Raises PackError if the paper is not
        cited as "I. Name, J. Name: Title, Journal, year"."""
        cited = re.match(r"([^:]+): .*?\b(1[5-9]\d\d|20\d\d)\b", self.paper)
        if cited is None:
            raise PackError(
                f"{self.label}: expected authors, a colon, a title and a year, got {self.paper!r}"
            )
        surnames = [author.split()[-1] for author in cited[1].split(",")]
        return f"{', '.join(surnames)} {cited[2]}"

    @property
    def native_form(self):
        """The Form that "auto" takes where OSL does not run: made of Blender's own nodes and equal
        to the model, at least for some of its choices. None if the model has no such form."""
        for form in self.forms.values():
            limited = [self.parameters[key]["kind"] for key in form.only if key in self.parameters]
            if form.is_native and form.name != "twin" and set(limited) <= {"choice"}:
                return form
        return None

    @cached_property
    def may_be_closure(self):
        """Whether is_closure() holds for some values."""
        from ..brdfc import model as formulas

        return any(found.whole for found in formulas(self.name).formulas.values())

    def lets_light_through(self, values):
        """Whether the model lets light through, with these values and defaults."""
        defaults = {name: p["default"] for name, p in self.parameters.items()}
        complete = defaults | self.fixed | values
        return any(limits.items() <= complete.items() for limits in self.entry["through"])

    def may_mirror(self, values):
        """Whether the model has an ideal mirror at these values; None stands for one that varies,
        with which it may."""
        from ..brdfc import model as formulas

        known = {name: values.get(name) for name in self.parameters} | self.fixed
        if any(value is None for value in known.values()):
            return True
        views = [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.96, 0.0, 0.28)]
        try:
            return bool(formulas(self.name).mirror(views, **known).any())
        except ValueError:  # as in is_closure()
            return True

    def is_closure(self, values):
        """Whether a closure of Cycles' equals the model at these values; None stands for one that
        is linked. Formula Nodes and the aimed form are then that closure."""
        from ..brdfc import model as formulas

        try:
            return formulas(self.name).is_closure(values | self.fixed)
        except ValueError:  # a value that scripts set outside of its range
            return False

    def automatic(self, values=None, osl=True):
        """The Form that "auto" takes with or without OSL: the model's preferred one, or the next if
        that does not support `values`."""
        first, native, values = self.forms[self.entry["auto"]], self.native_form, values or {}
        order = [first, *(f for f in self.forms.values() if f != first and not f.is_native)]
        if not osl:
            order = [f for f in (native, self.forms.get("twin")) if f] + order
        return next((form for form in order if form.refusal(values) is None), order[0])

    def resolve(self, name, values=None):
        """The Form of this name that is to be used. Raises ValueError. For "auto" it is
        automatic(), given whether this build of Blender has OSL, whatever the scene's setting."""
        values = values or {}
        if name == "auto":
            name = self.automatic(values, osl_available()).name
        if name not in self.forms:
            raise ValueError(
                say(
                    "{model} has no render method {form!r}",
                    more=f"expected one of {forms_in_scripts(('auto', *sorted(self.forms)))}",
                    model=self.label,
                    form=name,
                )
            )
        if problem := self.forms[name].refusal(values):
            raise ValueError(problem)
        return self.forms[name]

    def check_value(self, name, value):
        """Returns the value of a parameter in canonical form: float, (r, g, b) or the identifier of
        a choice.

        A colour may be given as one grey number. Raises ValueError naming model, parameter and what
        was expected.
        """
        if name in self.fixed:
            return self._checked_fixed(name, value)
        if name not in self.parameters:
            known = ", ".join(self.parameters)
            raise ValueError(
                f"model {self.name!r} has no parameter {name!r}; expected one of {known}"
            )
        parameter = self.parameters[name]
        what = f"{self.name}.{name}"
        if parameter["kind"] == "choice":
            if value not in parameter["choices"]:
                known = ", ".join(parameter["choices"])
                raise ValueError(f"{what}: expected one of {known}, got {value!r}")
            return value
        low, high = parameter["min"], parameter["max"]
        if parameter["kind"] == "number":
            return checked_number(what, value, low, high)
        if is_number(value):
            value = (value,) * 3
        try:
            channels = tuple(float(c) for c in value)
        except (TypeError, ValueError):
            channels = ()
        if isinstance(value, str) or len(channels) not in (3, 4):
            raise ValueError(f"{what}: expected a number or three (r, g, b), got {value!r}")
        return tuple(
            checked_number(f"{what} ({channel})", c, low, high)
            for channel, c in zip("rgb", channels[:3], strict=True)
        )

    def _checked_fixed(self, name, value):
        here = self.fixed[name]
        given = (value,) * 3 if isinstance(here, tuple) and is_number(value) else value
        given = tuple(given) if isinstance(given, list) else given
        if given != here:
            raise ValueError(
                f"{self.name}.{name}: expected {here}, the only value in this extension, which was "
                f"built for one scene; got {value!r}"
            )
        return here


class Form:
    """A form of a model: a way to render it."""

    def __init__(self, model, name, entry):
        """`entry`: that of the manifest."""
        self.model, self.name, self.entry = model, name, entry
        #: Parameters of the model for which the form supports one value only, with that value.
        self.only = canonical(entry["only"])
        #: Whether it consists of Blender's own nodes and needs no OSL.
        self.is_native = "nodes" in entry
        #: Number of slots for lamps.
        self.lamps = entry.get("lamps") or 0
        #: Whether the Albedo output needs a script of its own, since its tables are large.
        self.has_albedo_script = entry.get("albedo_shader") is not None

    @property
    def constants(self):
        """Values of the parameters for which it has no socket, because the pack or the form
        supports one value only."""
        return self.model.fixed | self.only

    @property
    def choices(self):
        """Identifiers of all choices; a single one where it exists for that one alone."""
        return {
            key: [self.only[key]] if key in self.only else p["choices"]
            for key, p in self.model.parameters.items()
            if p["kind"] == "choice"
        }

    @property
    def socket_parameters(self):
        """The parameters for which it has a socket: those with more than one possible value."""
        return {
            key: p
            for key, p in self.model.parameters.items()
            if key not in self.only and len(p.get("choices", "any")) > 1
        }

    def refusal(self, values):
        """Why a form that exists for some values only is not available for these; None if it is."""
        for key, only in self.only.items():
            if key in values and not equal_in_float32(values[key], only):
                got = values[key]
                shown = say("a linked or animated value") if got is None else value_text(got)
                given = "a linked or animated value" if got is None else repr(got)
                return say(
                    "{form} is only for {parameter} = {only}, not for {got}",
                    more=f"model {self.model.name!r} has the form {self.name!r} only for "
                    f"{key}={only!r}, not for {given}",
                    form=form_name(self.name),
                    parameter=self.model.parameters.get(key, {}).get("label", key),
                    only=value_text(only),
                    got=shown,
                )
        return None

    def source(self):
        """File stem and text of the OSL source, or of the data for Blender's own nodes."""
        return _text_of(self.entry["nodes" if self.is_native else "shader"])

    def albedo_source(self):
        """The same for the script of the Albedo output, if it has one of its own; otherwise
        None."""
        return _text_of(self.entry["albedo_shader"]) if self.has_albedo_script else None

    @cached_property
    def digest(self):
        """A key that changes whenever the shader or its group's sockets change. Panels need it at
        each redraw; so the manifest holds the hash of the source, which can be a megabyte."""
        hashes = [WIRING, self.entry["sha256"], self.entry.get("albedo_sha256")]
        twin = self.model.forms.get("twin")
        if twin is not None and twin != self:  # every other form contains it as a stand-in
            hashes.append(twin.entry["sha256"])
        schema = [self.model.entry["parameters"], self.entry["only"]]
        text = json.dumps([*hashes, *schema], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def error_at(entry, values):
    """The measured error of a form, as its entry of a manifest has it, for these values of the
    parameters; empty if it is known for other values only."""
    known = canonical(entry["error"].get("at") or {})
    same = all(equal_in_float32(values.get(key), value) for key, value in known.items())
    return entry["error"] if same else {}


def _text_of(relative):
    """Stem and text of a file of the pack."""
    path = root / relative
    if not path.is_file():
        raise PackError(f"{path} is missing")
    return path.stem, path.read_text(encoding="utf-8")


def has_aimed():
    """Whether any form of this pack aims at lamps."""
    return any(form.lamps for name in model_names() for form in model(name).forms.values())
