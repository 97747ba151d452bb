# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicates of warnings about a group node: its shader, its version and its values."""

from ..common.i18n import form_name, say
from ..groups import model_nodes, nodes, tables
from ..packs import pack
from ..packs.parameter_values import unused_parameters, value_text
from .rows import when


def damaged(at):
    """The node's group lacks its script, its compiled code, one of its sockets, a group inside it,
    or all nodes of such a group."""
    problem = nodes.script_problem(at.node.node_tree)
    return when(problem, problem=problem)


def lost_tables(at):
    """An image with a table of the node's shader was unpacked, its file is gone, and the extension
    can't make it again: the material is linked, lean or of another version."""
    found = [image.name for image in tables.lacking(at.node)]
    return when(found, images=", ".join(found))


def of_later_version(at):
    """A later version of the extension made the node."""
    newer = not at.is_current and model_nodes.is_newer(at.node)
    return when(newer, version=model_nodes.made_by(at.node))


def of_version_kept(at):
    """Another version of the extension made the node, and an update can't change it."""
    kept = not at.is_current and not model_nodes.is_newer(at.node) and at.why_kept
    return when(kept, why=kept)


def of_another_version(at):
    """Another version of the extension made the node."""
    if at.is_current or model_nodes.is_newer(at.node) or at.why_kept:
        return []
    own = pack.manifest()["generator"]
    return when(True, maker=_maker(at.node, own), own=own)


def _maker(node, own):
    """What made a node's group, in words."""
    made_by = model_nodes.made_by(node)
    if not any(pack.version(made_by)):
        return say("a first version of brdfc")
    # A build of changed sources, or an extension that is cut to a scene.
    return say("another build of {version}", version=made_by) if made_by == own else made_by


def _is_within(value, limits):
    """Whether a value is within limits, each with a tolerance, as sockets hold single precision."""
    low, high = limits["min"], limits["max"]
    return low - 1e-6 * abs(low) <= value <= high + 1e-6 * abs(high)


def _outside(value, label, limits):
    return {
        "parameter": label,
        "value": f"{value:g}",
        "low": f"{limits['min']:g}",
        "high": f"{limits['max']:g}",
    }


def out_of_range(at):
    """A value is outside the limits of its parameter."""
    for name, parameter in at.schema.items():
        value = model_nodes.get_value(at.node, name)
        if parameter["kind"] == "choice" or value is None:
            continue
        for number in value if parameter["kind"] == "color" else (value,):
            if not _is_within(number, parameter):
                yield _outside(number, parameter["label"], parameter)


def no_effect(at):
    """A value was changed that the model does not read while a choice is as it is."""
    for name, choice in unused_parameters(at.schema, at.values).items():
        yield {
            "parameter": at.schema[name]["label"],
            "choice": at.schema[choice]["label"],
            "value": value_text(at.values[choice]),
        }


def out_of_fit(at):
    """A value is outside those for which the closures of a fitted form were found."""
    if axis := at.form.get("axis"):
        value = model_nodes.get_value(at.node, axis["name"])
        if value is not None and not _is_within(value, axis):
            form = "fitted" if model_nodes.identity(at.node).form == "fitted" else "twin"
            found = _outside(value, at.schema[axis["name"]]["label"], axis)
            yield found | {"form": form_name(form)}
