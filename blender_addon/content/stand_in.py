# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces a shader where Open Shading Language does not run: by the model's twin or, for glass and
ideal mirrors, by the nearest of Blender's nodes.

In EEVEE, and in Cycles on devices or with settings without OSL, the outputs of a script node are 0.
So the output of a script that sets it to 1 tells whether shaders run, and selects one of the two.
OSL folds this constant before rendering, so the stand-in takes no time there.
"""

import bpy

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


#: Blender's nodes for models without a twin, which scatter nothing or let light through: the kind,
#: and the parameter for each socket; that of Roughness is its square.
_NODES = {
    "glass": ("ShaderNodeBsdfGlass", {"IOR": "ior"}),
    # Its colour tints what is reflected as well, which is little beside what is refracted.
    "fresnel_dielectric": ("ShaderNodeBsdfGlass", {"IOR": "ior", "Color": "refracted"}),
    "rough_glass": (
        "ShaderNodeBsdfGlass",
        {"IOR": "ior", "Color": "refracted", "Roughness": "alpha"},
    ),
    "fresnel_conductor": (
        "ShaderNodeBsdfMetallic",
        {"IOR": ("n_r", "n_g", "n_b"), "Extinction": ("k_r", "k_g", "k_b")},
    ),
}


def has_node(model):
    """Whether a node of Blender can stand in for a model."""
    return model.name in _NODES


def node_of(group, form, parameters):
    """The outputs, by name, of the node that stands in for a form. `parameters`: outputs by
    name."""
    kind, given = _NODES[form.model.name]
    node = group.nodes.new(kind)
    if kind == "ShaderNodeBsdfMetallic":
        node.fresnel_type = "PHYSICAL_CONDUCTOR"
    else:
        node.distribution = "GGX"  # light that is reflected once
    node.inputs["Roughness"].default_value = 0.0

    def give(socket, name):
        if name in parameters:
            group.links.new(parameters[name], socket)
        else:
            value = form.constants[name]
            socket.default_value = (*value, 1.0) if isinstance(value, (tuple, list)) else value

    for name, source in given.items():
        if name == "Roughness":
            root = group.nodes.new("ShaderNodeMath")
            root.operation = "SQRT"
            give(root.inputs[0], source)
            group.links.new(root.outputs[0], node.inputs[name])
            continue
        if isinstance(source, str):
            give(node.inputs[name], source)
            continue
        vector = group.nodes.new("ShaderNodeCombineXYZ")
        for part, socket in zip(source, vector.inputs, strict=True):
            give(socket, part)
        group.links.new(vector.outputs[0], node.inputs[name])
    return {"BSDF": node.outputs["BSDF"]}


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
    lit = group.nodes.new("ShaderNodeEmission")
    lit.inputs["Color"].default_value = (1, 1, 1, 1)
    lit.inputs["Strength"].default_value = 1.0
    seen = group.nodes.new("ShaderNodeShaderToRGB")
    seen.name = seen.label = EEVEE
    lit.location, seen.location = (-150, 300), (0, 300)
    group.links.new(lit.outputs[0], seen.inputs[0])
    mixed = choose(group, seen.outputs["Color"], outputs, instead)
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
