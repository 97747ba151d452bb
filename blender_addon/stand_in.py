# SPDX-License-Identifier: GPL-3.0-or-later
"""Where Open Shading Language does not run, a model's twin stands in for its shader.

EEVEE, and Cycles on devices or with settings that have no OSL, take the outputs of a script node
for 0. So a script whose output is 1 tells where shaders run, and chooses between the two. OSL finds
the constant before it renders: there the twin takes no time.
"""

import bpy

#: Name of the node that runs this, and of its output.
NODE = "Runs"
_FILE = "brdfc_runs.osl"
_SOURCE = """// SPDX-License-Identifier: GPL-3.0-or-later
// 1 where Open Shading Language runs; what can't run it takes the output for 0.
shader brdfc_runs(output float Runs = 1)
{
}
"""


def text():
    """The script's text, of which a file has one."""
    for found in bpy.data.texts:
        if found.library is None and found.as_string() == _SOURCE:
            return found
    made = bpy.data.texts.new(_FILE)
    made.write(_SOURCE)
    made.cursor_set(0)
    return made


def add(group, script, twin, inputs, bsdf):
    """Puts a twin beside a shader. Returns the output that is whichever runs.

    group: that of the shader; script: a script node in it that runs text(); twin: the group of the
    twin; inputs: what its sockets are linked to, by identifier; bsdf: output of the shader.
    """
    script.name = script.label = NODE
    script.location = (0, 300)
    node = group.nodes.new("ShaderNodeGroup")
    node.node_tree = twin
    node.location = (0, 200)
    for socket in node.inputs:
        if source := inputs.get(socket.identifier):
            group.links.new(source, socket)
    mix = group.nodes.new("ShaderNodeMixShader")
    mix.location = (150, 0)
    factor, first, second = mix.inputs
    factor.default_value = 0.0  # where there is no script node
    group.links.new(script.outputs[NODE], factor)
    group.links.new(node.outputs["BSDF"], first)
    group.links.new(bsdf, second)
    return mix.outputs["Shader"]


def is_in(group):
    """Whether a group of a shader has a twin that stands in for it."""
    return NODE in group.nodes
