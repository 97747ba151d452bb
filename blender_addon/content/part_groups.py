# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes node groups of the lists of operations that the tool writes. Equal groups are made once for
all materials; the others are removed when nothing uses them."""

import contextlib
import hashlib
import json
import threading

import bpy

from . import kept_groups, svm_constants
from .wiring import Wiring

#: Custom property of a part's group: hash of its operations. Equal parts share one group.
PART = "brdfc_part"
_SOCKETS = {
    "FLOAT": "NodeSocketFloat",
    "VECTOR": "NodeSocketVector",
    "SHADER": "NodeSocketShader",
}
#: The only vector operation with a scalar result.
_DOT = "V_DOT_PRODUCT"
#: Maximum number of operations in a group.
_STEP = 60


class _Formula:
    """Adds the nodes for a list of operations."""

    def __init__(self, wiring, inputs):
        self.w, self.inputs = wiring, inputs
        self.results, self.parts = [], {}

    def operand(self, value, vector=False):
        if isinstance(value, str):
            return self.results[int(value[1:])] if value[0] == "$" else self.inputs[value]
        return (value,) * 3 if vector and not isinstance(value, list) else value

    def add(self, kind, *operands):
        w = self.w
        if kind in ("X", "Y", "Z"):
            (source,) = operands
            if source not in self.parts:
                node = w.node("ShaderNodeSeparateXYZ")
                w.give(node.inputs[0], self.operand(source))
                self.parts[source] = node.outputs
            return self.parts[source][kind]
        if kind == "COMBINE":
            node = w.node("ShaderNodeCombineXYZ")
            for socket, value in zip(node.inputs, operands, strict=True):
                w.give(socket, self.operand(value))
            return node.outputs[0]
        if kind in ("MIX", "V_MIX"):
            vector = kind == "V_MIX"
            at_0, at_1 = (self.operand(o, vector) for o in operands[1:])
            return w.mix(self.operand(operands[0]), at_0, at_1, vector)
        if kind == "V_SCALE":
            return w.scaled(self.operand(operands[0], True), self.operand(operands[1]))
        if kind == _DOT:
            return w.vector(kind[2:], *(self.operand(o, True) for o in operands), output="Value")
        if kind.startswith("V_"):
            return w.vector(kind[2:], *(self.operand(o, True) for o in operands))
        return w.math(kind, *map(self.operand, operands))

    def wire(self, data):
        for operation in data["operations"]:
            self.results.append(self.add(*operation))
        return {
            name: self.operand(value, kind == "VECTOR") for name, kind, value in data["outputs"]
        }


def is_part(group):
    """Whether a group of the open file is a part."""
    return group.library is None and PART in group


def _contains(group, sought, seen):
    if group in sought:
        return True
    seen.add(group)
    inner = {getattr(node, "node_tree", None) for node in group.nodes}
    return any(_contains(each, sought, seen) for each in inner - seen if each is not None)


def _emptied():
    return {each for each in bpy.data.node_groups if not each.nodes}


def lacks_nodes(group):
    """Whether somebody has deleted all nodes of a group, or of one inside it."""
    # To look at all groups of the file takes less time than to look at the nodes of one.
    emptied = _emptied()
    return bool(emptied) and _contains(group, emptied, set())


def _find(digest, among=None):
    for group in bpy.data.node_groups if among is None else among:
        if is_part(group) and group[PART] == digest and not lacks_nodes(group):
            return group
    return None


def _appended(digest):
    """The kept group of a part, or None. If the file already has an equal part, that one stays."""
    made = kept_groups.append(digest)
    wanted = _find(digest, made)
    if wanted is None:
        bpy.data.batch_remove(made)
        return None
    merge_copies(made)
    return wanted


def merge_copies(made):
    """Replaces parts among groups that were just appended by equal parts that the file had."""
    new, emptied = set(made), _emptied()
    own = {g[PART]: g for g in bpy.data.node_groups if is_part(g) and g not in new}
    if emptied:
        own = {part: g for part, g in own.items() if not _contains(g, emptied, set())}
    # Nodes of these groups alone can use them. Blender's own function, user_remap, and the removal
    # of single groups examine the whole file for each group.
    extra = {group: own[group[PART]] for group in made if group.get(PART) in own}
    for group in made:
        for node in group.nodes if group not in extra else ():
            inner = getattr(node, "node_tree", None)
            if inner in extra:
                node.node_tree = extra[inner]
    bpy.data.batch_remove(extra)


def make_group(title, content, inputs, outputs, fill, kept=False):
    """Finds or makes the group with this content. `inputs` and `outputs`: names and kinds;
    fill(wiring, inputs by name) returns the outputs by name. `kept`: see kept_groups."""
    content = [kept_groups.version(), content]
    digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]
    if group := _find(digest) or (_appended(digest) if kept else None):
        return group
    with _wait_cursor() if kept else contextlib.nullcontext():
        # Names that begin with a dot are not in Blender's menus and searches.
        group = _filled(f".brdfc {title}", inputs, outputs, fill)
    group[PART] = digest
    if kept:
        kept_groups.keep(group, digest)
    return group


@contextlib.contextmanager
def _wait_cursor():
    """Shows that Blender is busy, as long as a model's nodes are built for the first time."""
    # Handlers of renders run in other threads, which must not touch windows.
    of_interface = threading.current_thread() is threading.main_thread()
    windows = list(bpy.context.window_manager.windows) if of_interface else []
    for window in windows:
        window.cursor_modal_set("WAIT")
    try:
        yield
    finally:
        for window in windows:
            window.cursor_modal_restore()


def _filled(name, inputs, outputs, fill):
    """A new group of nodes; arguments as of make_group()."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for in_out, sockets in (("INPUT", inputs), ("OUTPUT", outputs)):
        for name, kind in sockets:
            group.interface.new_socket(name, in_out=in_out, socket_type=_SOCKETS[kind])
    w = Wiring(group)
    start = w.node("NodeGroupInput")
    made = fill(w, {s.name: s for s in start.outputs if s.name})
    end = w.node("NodeGroupOutput")
    for name, value in made.items():
        w.give(end.inputs[name], value)
    w.place_nodes()
    return group


def add_group(w, group, inputs, label):
    """Adds a group node to a tree; returns its outputs by name."""
    node = w.node("ShaderNodeGroup")
    node.node_tree = group
    node.label = label
    for socket in node.inputs:
        w.give(socket, inputs[socket.name])
    return {socket.name: socket for socket in node.outputs}


def _steps(data):
    """Splits a long list of operations into short ones, each taking the results of those before it:
    Blender's time for each new link grows with the size of the tree."""
    operations = data["operations"]
    kinds = dict(data["inputs"])
    for index, (kind, *_) in enumerate(operations):
        vector = kind == "COMBINE" or (kind.startswith("V_") and kind != _DOT)
        kinds[f"${index}"] = "VECTOR" if vector else "FLOAT"
    wanted = [value for _, _, value in data["outputs"] if isinstance(value, str)]
    for first in range(0, len(operations), _STEP):
        last = min(first + _STEP, len(operations))
        here = operations[first:last]
        own = {f"${i}" for i in range(first, last)}
        taken = list(dict.fromkeys(o for op in here for o in op[1:] if isinstance(o, str)))
        later = {o for op in operations[last:] for o in op[1:] if isinstance(o, str)} | {*wanted}
        given = [name for name in sorted(own, key=lambda n: int(n[1:])) if name in later]
        names = {f"${first + i}": f"${i}" for i in range(len(here))}
        names |= {o: f"before_{o[1:]}" for o in taken if o[0] == "$" and o not in own}
        yield {
            "inputs": [[names.get(o, o), kinds[o], o] for o in taken if o not in own],
            "operations": [
                [kind, *(names.get(o, o) if isinstance(o, str) else o for o in operands)]
                for kind, *operands in here
            ],
            "outputs": [[f"result_{o[1:]}", kinds[o], names[o], o] for o in given],
        }


def _part_group(title, data):
    """The node group of a part."""
    inputs = data["inputs"]
    outputs = [output[:2] for output in data["outputs"]]
    if len(data["operations"]) <= _STEP:
        return make_group(
            title, data, inputs, outputs, lambda w, given: _Formula(w, given).wire(data)
        )

    def fill(w, given):
        known = dict(given)
        for step in _steps(data):
            short = {
                "inputs": [entry[:2] for entry in step["inputs"]],
                "operations": step["operations"],
                "outputs": [entry[:3] for entry in step["outputs"]],
            }
            group = _part_group(title, short)
            made = add_group(w, group, {e[0]: known[e[2]] for e in step["inputs"]}, "")
            known |= {e[3]: made[e[0]] for e in step["outputs"]}
        return {
            name: known[value] if isinstance(value, str) else value
            for name, _, value in data["outputs"]
        }

    return make_group(title, data, inputs, outputs, fill)


class Parts:
    """The parts of a model, which add themselves as nodes to its group."""

    def __init__(self, wiring, parts, title, constants):
        """`constants`: the outputs of svm_constants.add_values()."""
        self.w, self.data, self.title, self.constants = wiring, parts, title, constants

    def has(self, name):
        return name in self.data

    def add(self, name, **inputs):
        """Adds a part; returns its outputs by name. `inputs`: numbers and outputs by name."""
        group = _part_group(f"{self.title}: {name}", self.data[name])
        return add_group(self.w, group, self.constants | inputs, name)

    def inputs(self, name):
        """Names and kinds of a part's inputs."""
        return {name: kind for name, kind in self.data[name]["inputs"]}

    def on(self, wiring, found):
        """The same parts in another tree, whose group inputs are `found`."""
        constants = {name: found[name] for name in svm_constants.VALUES if name in found}
        return Parts(wiring, self.data, self.title, constants)


def remove_unused_parts():
    """Removes the part groups that no model uses from the file."""
    # Removing a group may leave further ones without a user.
    while unused := [g for g in bpy.data.node_groups if is_part(g) and g.users == 0]:
        bpy.data.batch_remove(unused)
