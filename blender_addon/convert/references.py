# SPDX-License-Identifier: GPL-3.0-or-later
"""References from a node to another one of its tree. They outlast new names, which users may give
to nodes: the node that is referred to also holds a mark."""

import uuid

#: Custom property of a node that others refer to: its mark.
_MARK = "brdfc_mark"
#: Ends the custom property of a node with the mark of the one that its property KEY refers to.
_OF = "_mark"
#: Custom property of a node that was added along with a group node: the name of that.
HELPS = "brdfc_helps"


def mark(node, key, other):
    """Has the reference KEY of a node, which holds the name of another one, outlast new names."""
    if _MARK not in other:
        other[_MARK] = uuid.uuid4().hex
    node[key + _OF] = other[_MARK]


def refer(node, key, other):
    """Sets a reference that is no more than a name."""
    node[key] = other.name
    mark(node, key, other)


def unmark(node):
    """Removes what references left at a node that none is meant for any more."""
    node.pop(_MARK, None)


def find(node, key, name):
    """The node that the reference KEY of a node is meant for, which had this name; None if it is
    gone. References that older versions made have no mark."""
    nodes, marked = node.id_data.nodes, node.get(key + _OF)
    named = nodes.get(name)
    if marked is None or (named is not None and named.get(_MARK) == marked):
        return named
    return next((n for n in nodes if n.get(_MARK) == marked), None)


def helpers(group):
    """The nodes that were added along with a node."""
    return [n for n in group.id_data.nodes if HELPS in n and find(n, HELPS, n[HELPS]) == group]
