# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled node that comes nearest to a node of a model."""

from ..groups import model_nodes
from ..packs import pack
from ..trees import shader_trees


def values(node):
    """A node's values by name, and the names of linked parameters, which have the value None."""
    model = pack.model(model_nodes.identity(node).model)
    found = model.fixed | {name: model_nodes.get_value(node, name) for name in model.parameters}
    return found, [name for name, value in found.items() if value is None]


def of_node(node):
    """nearest.principled.Nearest to a model with a node's values, or with its default where one is
    linked; None for a black one. Raises ValueError for a model that the extension lacks."""
    # NumPy's formulas are imported on first use.
    from . import plots

    return plots.nearest_to(model_nodes.identity(node).model, values(node)[0])


def of_material(material):
    """The same for a material that is a model's node alone, BLACK for a black one; None for others,
    and where the extension lacks the model. For exporters, which may have found a Principled node
    in others, as below a coat."""
    shown = [s.node for s in shader_trees.shown(material)] if material else []
    if len(shown) != 1 or not model_nodes.is_ours(shown[0]):
        return None
    try:
        near = of_node(shown[0])
    except (ValueError, pack.PackError):  # of another version
        return None
    # It imports NumPy, as above.
    from ..nearest.principled import BLACK

    return near or BLACK
