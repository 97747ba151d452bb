# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces a shader where Open Shading Language does not run, and Formula Nodes in EEVEE: by the
model's twin or by the nearest of Blender's nodes.

In EEVEE, and in Cycles on devices or with settings without OSL, the outputs of a script node are 0.
So the output of a script that sets it to 1 tells whether shaders run, and selects one of the two.
OSL folds this constant before rendering, so the stand-in takes no time there.
"""

import math

import bpy

from ..packs import pack
from . import table_albedo
from .wiring import Wiring

#: Name of that script node, and of its output.
NODE = "Runs"
#: Name of the node whose value differs from 0 in EEVEE alone.
EEVEE = "In EEVEE"
_FILE = "brdfc_runs.osl"
_SOURCE = """// SPDX-License-Identifier: GPL-3.0-or-later
// 1 where Open Shading Language runs; what can't run it takes the output for 0.
shader brdfc_runs(output float Runs = 1)
{
}
"""


def new_text(name, content):
    """A text that is deleted with its last user, like the other parts of a group: Blender gives new
    texts a fake user, which would keep them in the file for good. A text that undo has left without
    users is reused."""
    for found in bpy.data.texts:
        if found.library is None and found.users == 0 and found.as_string() == content:
            return found
    made = bpy.data.texts.new(name)
    made.use_fake_user = False
    made.write(content)
    made.cursor_set(0)
    return made


def texts():
    """The local texts of the file that contain the script."""
    return [t for t in bpy.data.texts if t.library is None and t.as_string() == _SOURCE]


def text():
    """The text with the script; a file has one."""
    for found in texts():
        return found
    return new_text(_FILE, _SOURCE)


def keep_one_text():
    """Replaces copies of the text, which appended materials bring, by one. An appended copy is
    preferred: Blender recognizes it and does not append it again."""
    found = sorted(texts(), key=lambda t: t.library_weak_reference is None)
    for other in found[1:]:
        other.user_remap(found[0])
        bpy.data.texts.remove(other)
    if found[1:]:
        found[0].name = _FILE


def _glass(w, given, normal):
    """Blender's Glass node; its colour tints what is reflected as well, which is little beside what
    is refracted."""
    node = w.node("ShaderNodeBsdfGlass", distribution="GGX")  # light that is reflected once
    w.give(node.inputs["IOR"], given("ior"))
    w.give(node.inputs["Color"], given("refracted") if given.has("refracted") else (1.0,) * 3)
    roughness = w.math("SQRT", given("alpha")) if given.has("alpha") else 0.0
    w.give(node.inputs["Roughness"], roughness)
    w.give(node.inputs["Normal"], normal)
    return node.outputs["BSDF"]


def _polished_metal(w, given, normal):
    node = w.node("ShaderNodeBsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR")
    w.give(node.inputs["Roughness"], 0.0)
    w.give(node.inputs["Normal"], normal)
    for socket, parts in {"IOR": "n", "Extinction": "k"}.items():
        w.give(node.inputs[socket], w.combine(*(given(f"{parts}_{c}") for c in "rgb")))
    return node.outputs["BSDF"]


def _metal(w, given, normal):
    """EEVEE has no anisotropy: the roughness is the mean of both."""
    roughness = w.math("SQRT", w.mean(given("ax"), given("ay")))
    return w.metal("ggx", given("f0"), given("tint"), roughness, normal)


def _ward(w, given, normal):
    roughness = w.math("SQRT", w.mean(given("ax"), given("ay")))
    return w.bsdf("beckmann", given("ks"), normal, roughness)


def _ashikhmin_shirley(w, given, normal):
    """A power of the half vector's cosine is as wide as facets with alpha^2 = 2 / (n + 2)."""
    alpha2 = w.math("DIVIDE", 2.0, w.math("ADD", w.mean(given("nu"), given("nv")), 2.0))
    roughness, white = w.math("POWER", alpha2, 0.25), (1.0, 1.0, 1.0)
    metal = w.metal("beckmann", given("rs"), white, roughness, normal)
    matte = w.vector("MULTIPLY", given("rd"), w.vector("SUBTRACT", white, given("rs")))
    diffuse = w.bsdf("diffuse", matte, normal)
    terms = {"diffuse": metal, "specular": diffuse}  # the part that lacks each
    return w.sum([w.shown(given.is_not("part", part), term) for part, term in terms.items()])


def _phong_material(w, given, normal):
    """See power_facets_under() of generator/model/under.h for how wide the facets are."""

    def glossy(color, exponent):
        roughness = w.math("POWER", w.math("DIVIDE", 0.5, w.math("ADD", exponent, 1.0)), 0.25)
        return w.bsdf("beckmann", color, normal, roughness)

    # A highlight has no factor that keeps its light the same at all widths.
    light = w.math("DIVIDE", 2 * math.pi, w.math("ADD", given("es"), 2.0))
    highlight = w.scaled(given("cs"), w.math("MULTIPLY", given("ks"), light))
    matte = w.bsdf("diffuse", w.scaled(given("cd"), given("kd")), normal)
    reflection = glossy(w.scaled(given("cr"), given("kr")), given("e"))
    return w.sum([matte, glossy(highlight, given("es")), reflection])


#: Wave numbers in 1 / um of light in three channels, and how much of them a channel sees.
_WAVES, _SPREAD = (1.65, 1.84, 2.2), 0.1


def _thin_film(w, given, normal):
    """Metal in the colour that light has which comes straight at film and base, but passes the film
    at the viewer's angle: R_12, R_23 and, as C, r_12 r_23 with the film's phase give
    (R_12 + R_23 + 2 C) / (1 + R_12 R_23 + 2 C)."""
    viewer = w.node("ShaderNodeNewGeometry").outputs["Incoming"]
    cosine = w.vector("DOT_PRODUCT", normal, viewer, output="Value")
    n2, n, k = given("film_ior"), *(w.combine(*(given(f"{x}_{c}") for c in "rgb")) for x in "nk")
    n2_squared = w.math("MULTIPLY", n2, n2)
    q2 = w.math("SQRT", w.math("MULTIPLY_ADD", cosine, cosine, w.math("SUBTRACT", n2_squared, 1.0)))
    turn = w.math("MULTIPLY", w.math("MULTIPLY", given("thickness"), q2), 4e-3 * math.pi)
    phase = w.vector("SCALE", _WAVES, scale=turn)
    seen = w.math("MULTIPLY", turn, _SPREAD)
    seen = w.math("EXPONENT", w.math("MULTIPLY", w.math("MULTIPLY", seen, seen), -0.5))
    above = w.math("DIVIDE", w.math("SUBTRACT", 1.0, n2), w.math("ADD", 1.0, n2))
    R12 = w.math("MULTIPLY", above, above)
    # r_23 = (a - 2 i n2 k) / b, with b = |n2 + n + i k|^2.
    film, k_squared = w.combine(n2, n2, n2), w.vector("MULTIPLY", k, k)
    b = w.vector("ADD", film, n)
    b = w.vector("MULTIPLY_ADD", b, b, k_squared)
    a = w.vector("SUBTRACT", w.vector("MULTIPLY", film, film), w.vector("MULTIPLY", n, n))
    a = w.vector("DIVIDE", w.vector("SUBTRACT", a, k_squared), b)
    i = w.vector("DIVIDE", w.vector("SCALE", k, scale=w.math("MULTIPLY", n2, 2.0)), b)
    R23 = w.vector("MULTIPLY_ADD", a, a, w.vector("MULTIPLY", i, i))
    shifted = w.vector("MULTIPLY", i, w.vector("SINE", phase))
    C = w.vector("MULTIPLY_ADD", a, w.vector("COSINE", phase), shifted)
    C = w.vector("SCALE", C, scale=w.math("MULTIPLY", w.math("MULTIPLY", above, seen), 2.0))
    both = w.vector("MULTIPLY_ADD", R23, w.combine(R12, R12, R12), (1.0, 1.0, 1.0))
    high = w.vector("ADD", w.vector("ADD", R23, w.combine(R12, R12, R12)), C)
    color = w.vector("DIVIDE", high, w.vector("ADD", both, C))
    roughness = w.math("SQRT", w.mean(given("ax"), given("ay")))
    return w.metal("ggx", color, (1.0, 1.0, 1.0), roughness, normal)


#: Blender's nodes by model: for glass and ideal mirrors, which have no twin, and for models with
#: two widths, whose twins have those of the defaults.
_NODES = {
    "glass": _glass,
    "fresnel_dielectric": _glass,
    "rough_glass": _glass,
    "fresnel_conductor": _polished_metal,
    "microfacet": _metal,
    "thin_film": _thin_film,
    "ward": _ward,
    "ashikhmin_shirley": _ashikhmin_shirley,
    "phong_material": _phong_material,
}


class _Given:
    """Values of a form's parameters: outputs, or constants."""

    def __init__(self, w, form, sources):
        self._w, self._form, self._sources = w, form, sources

    def has(self, name):
        return name in self._sources or name in self._form.constants

    def __call__(self, name):
        if name in self._sources:
            return self._sources[name]
        return self._form.constants[name]

    def constant(self, name, default):
        """The value of a parameter if it is constant, by default this one; otherwise None."""
        return None if name in self._sources else self._form.constants.get(name, default)

    def is_not(self, name, choice):
        """1 unless a choice is this one, otherwise 0."""
        if name not in self._sources:
            return float(self._form.constants[name] != choice)
        index = self._form.model.parameters[name]["choices"].index(choice)
        return self._w.math(
            "SUBTRACT", 1.0, self._w.math("COMPARE", self._sources[name], index, 0.25)
        )


def has_node(model):
    """Whether a node of Blender can stand in for a model."""
    return model.name in _NODES


def node_of(group, form, sources):
    """The outputs, by name, of the nodes that stand in for a form. `sources`: outputs by
    parameter, and of the normal, which is 0 where the surface's own is meant."""
    w, model = Wiring(group), form.model
    given, normal = _Given(w, form, sources), w.bent_or_own(sources[pack.NORMAL])
    made = {"BSDF": _NODES[model.name](w, given, normal)}
    return made | albedo_of(group, form, sources, normal)


def albedo_of(group, form, sources, normal=None):
    """The output of nodes with the albedo, by name, if the model's twin has another; as
    node_of()."""
    w, model = Wiring(group), form.model
    if not table_albedo.is_needed(model):
        return {}
    normal = normal or w.bent_or_own(sources[pack.NORMAL])
    viewer = w.node("ShaderNodeNewGeometry").outputs["Incoming"]
    cos_theta = w.vector("DOT_PRODUCT", normal, viewer, output="Value")
    return {"Albedo": table_albedo.wire(w, model, _Given(w, form, sources), cos_theta)}


def twin_of(group, twin, inputs):
    """Puts a group into another; returns its outputs by name. `inputs`: outputs for its sockets, by
    identifier."""
    node = group.nodes.new("ShaderNodeGroup")
    node.node_tree = twin
    for socket in node.inputs:
        if source := inputs.get(socket.identifier):
            group.links.new(source, socket)
    return {socket.name: socket for socket in node.outputs}


def add(group, script, outputs, instead):
    """Returns outputs by name: the shader's where it runs, otherwise those of the stand-in, as far
    as both have them. `script`: a script node in the group that runs text()."""
    script.name = script.label = NODE
    script.location = (0, 300)
    return choose(group, script.outputs[NODE], instead, outputs)


def add_in_eevee(group, outputs, instead):
    """Returns outputs by name: in Cycles the given ones, in EEVEE those of the stand-in. The switch
    is a Shader to RGB node: Cycles ignores it, and the linked socket keeps its own value."""
    # What has no closures covers what is behind it. An Emission node would do as well, but
    # exporters find it: in a file of glTF the material would shine.
    nothing = group.nodes.new("ShaderNodeAddShader")
    seen = group.nodes.new("ShaderNodeShaderToRGB")
    seen.name = seen.label = EEVEE
    nothing.location, seen.location = (-150, 300), (0, 300)
    group.links.new(nothing.outputs[0], seen.inputs[0])
    mixed = choose(group, seen.outputs["Alpha"], outputs, instead)
    # Formulas that use random directions have no albedo output: the twin's is used.
    return {**instead, **outputs, **mixed}


def choose(group, chosen, at_0, at_1):
    """Outputs by name: those of `at_0` where the output `chosen` is 0, those of `at_1` where it is
    1."""
    at_0["BSDF"].node.location = (0, 200)
    made = {}
    for name in at_0.keys() & at_1.keys():
        if name == "BSDF":
            mix = group.nodes.new("ShaderNodeMixShader")
            factor, first, second = mix.inputs
            made[name] = mix.outputs[0]
        else:
            mix = group.nodes.new("ShaderNodeMix")
            mix.data_type = "RGBA"
            by_identifier = {socket.identifier: socket for socket in (*mix.inputs, *mix.outputs)}
            names = ("Factor_Float", "A_Color", "B_Color")
            factor, first, second = (by_identifier[n] for n in names)
            made[name] = by_identifier["Result_Color"]
        mix.location = (150, -200 * len(made))
        factor.default_value = 0.0  # where nothing is linked
        group.links.new(chosen, factor)
        group.links.new(at_0[name], first)
        group.links.new(at_1[name], second)
    return made


def expected(group):
    """The node that tells where shaders run (or None), its inputs and its outputs."""
    return group.nodes.get(NODE), {}, {NODE: "VALUE"}


def is_in(group):
    """Whether a group has a stand-in for its shader."""
    return NODE in group.nodes
