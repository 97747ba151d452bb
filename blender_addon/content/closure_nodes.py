# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a twin whose closures are computed from the parameters, as the model's C++ file declares
them: for models whose parameters are usually far from those that twins with tables are fitted
to."""

from .part_groups import Parts, add_group, make_group
from .wiring import Wiring


def has_formulas(data):
    """Whether the data of a twin are formulas instead of tables."""
    return "parts" in data


def within(w, parameter, low, high):
    """A parameter within its bounds, as a link may give it any value; None is no bound."""
    for operation, bound in (("MAXIMUM", low), ("MINIMUM", high)):
        if bound is not None:
            compute = w.vector if isinstance(bound, list) else w.math
            parameter = compute(operation, parameter, bound)
    return parameter


def wire(tree, data, normal, parameters, title):
    """Adds the nodes as a group; returns the outputs for the BSDF and the albedo.

    `data`: contents of twins/*.json. `normal`: an output that is 0 where the surface's own is
    meant. `parameters`: outputs or numbers by name. `title`: prefix of the names of new groups.
    """
    kinds = dict(data["parts"]["closures"]["inputs"])
    sockets = {"Normal": (normal, "VECTOR")}
    sockets |= {f"parameter {n}": (v, kinds[n]) for n, v in parameters.items() if n in kinds}

    def fill(w, found):
        given = {n: found[f"parameter {n}"] for n in parameters if n in kinds}
        return _wired(w, data, found["Normal"], given, title)

    inputs = [[name, kind] for name, (_, kind) in sockets.items()]
    outputs = [["BSDF", "SHADER"], ["Albedo", "VECTOR"]]
    group = make_group(f"{title}: closures", [data, inputs], inputs, outputs, fill, kept=True)
    w = Wiring(tree)
    made = add_group(w, group, {name: value for name, (value, _) in sockets.items()}, "")
    w.place_nodes()
    return made["BSDF"], made["Albedo"]


def _wired(w, data, normal, parameters, title):
    normal = w.bent_or_own(normal)
    viewer = w.node("ShaderNodeNewGeometry").outputs["Incoming"]
    given = {n: within(w, v, *data["bounds"].get(n, (None, None))) for n, v in parameters.items()}
    given["wo_z"] = w.vector("DOT_PRODUCT", normal, viewer, output="Value")
    found = Parts(w, data["parts"], title, {}).add("closures", **given)
    shaders = []
    for closure in data["closures"]:
        color = found[closure["weight"]]
        roughness = found[closure["roughness"]] if "roughness" in closure else 0.0
        shaders.append(w.bsdf(closure["kind"], color, normal, roughness))
    return {"BSDF": w.sum(shaders), "Albedo": found["albedo"]}
