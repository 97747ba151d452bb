# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates what a material's form reflects where this differs from its model: a fitted form by its
shader, a twin by its nodes. Both are read from the open file, so they may come from another version
or from a pack of the file's own."""

import numpy as np

from ..content.group_content import is_native
from ..groups import model_nodes, nodes
from . import shader_nodes, shader_text


def lobes(node, values, wo):
    """shader_text.Lobes of a group node for which model_nodes.is_fitted() holds.

    `values`: of all parameters; `wo`: unit vectors (k, 3) to the viewer, above the surface. This
    function and the Lobes it returns raise shader_text.Unreadable."""
    group = node.node_tree
    if not is_native(group):
        return shader_text.lobes(nodes.source_text(group), values, wo)
    given = dict.fromkeys((s.identifier for s in node.inputs), np.zeros(3))
    for name, socket in model_nodes.sockets(node).items():
        if name in values:
            given[socket.identifier] = values[name]
    return shader_nodes.lobes(group, given, wo)
