# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material's form reflects, where that is not its model: of a fitted form its shader, of a
twin its nodes, as the open file has them, also where another version or a pack of the file's own
made them."""

import numpy as np

from ..groups import nodes
from . import shader_nodes, shader_text


def lobes(node, values, wo):
    """shader_text.Lobes of a group node of which nodes.is_fitted(), at these values of all
    parameters, for viewers (k, 3), unit vectors above the surface. It and what it returns raise
    shader_text.Unreadable."""
    group = node.node_tree
    if not nodes.is_native(group):
        return shader_text.lobes(nodes.source_text(group), values, wo)
    given = dict.fromkeys((s.identifier for s in node.inputs), np.zeros(3))
    for name, socket in nodes.sockets(node).items():
        if name in values:
            given[socket.identifier] = values[name]
    return shader_nodes.lobes(group, given, wo)
