# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material's form reflects, where that is not its model: of a fitted form its shader, of a
twin its nodes, as the open file has them, also where another version or a pack of the file's own
made them."""

import numpy as np

from . import nodes, shader_nodes, shader_text


def scattered(node, values, wi, wo):
    """f cos(theta_i) of a group node of which nodes.is_fitted(), (N, 3), without an ideal mirror's
    part, at these values of all parameters; wi: (N, 3), wo: (3,), unit vectors above the surface.
    Raises shader_text.Unreadable."""
    group = node.node_tree
    if not nodes.is_native(group):
        light = shader_text.scattered(nodes.source_text(group), values, wi, wo)
    else:
        given = dict.fromkeys((s.identifier for s in node.inputs), np.zeros(3))
        for name, socket in nodes.sockets(node).items():
            if name in values:
                given[socket.identifier] = values[name]
        light = shader_nodes.scattered(group, given, wi, wo)
    if not np.isfinite(light).all():
        raise shader_text.Unreadable("expected numbers, got infinite ones or none")
    return light
