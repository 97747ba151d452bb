# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups around an OSL script node, and for twins around Blender's own nodes.

A group is made once per model, representation and version of the shader, and reused. Source and
bytecode both lie inside the .blend, so a saved file renders where the extension is not installed.
"""

import json

import bpy

from . import (
    animation,
    compiler,
    editable,
    formula_nodes,
    lamps,
    pack,
    shader_trees,
    stand_in,
    twin,
)
from .compiler import CompileError
from .group_sockets import VECTORS, add_parameter, vector_socket
from .i18n import say
from .pack import choice_label

TAG = pack.TAG
OUTPUTS = {"BSDF": "SHADER", "Albedo": "RGBA"}
ALBEDO = "Albedo"
_SOCKET_TYPES = {"number": "VALUE", "color": "RGBA", "choice": "INT"}


def empty_tree(owner):
    """The node tree of a new material or world, without a node."""
    if owner.node_tree is None:  # before 5.0 it starts without nodes
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def is_native(group):
    """Whether a group of this extension is made of Blender's own nodes, without a script."""
    return "script_inputs" not in group[TAG]


def is_fitted(node):
    """Whether the form of a group node is closures, or Blender's own, fitted to the model; others
    reflect what the model does, on average."""
    return identity(node)[1] in ("twin", "fitted")


def source_text(group):
    """The source of a group's shader, which the file holds; "" of a group that has lost it."""
    script, _ = _scripts(group)
    return script.script.as_string() if script is not None and script.script else ""


def has_albedo_script(model_name, representation):
    """Whether the Albedo output of a form is a script of its own, which a group has if asked."""
    return pack.representation(model_name, representation).get("albedo_shader") is not None


def expected_inputs(model_name, representation):
    """Identifiers of the script node's inputs and the types of their sockets."""
    inputs = {
        p["name"]: _SOCKET_TYPES[p["kind"]]
        for p in pack.socket_parameters(model_name, representation).values()
    }
    inputs |= {pack.NORMAL: "VECTOR", pack.TANGENT: "VECTOR"}
    inputs |= dict.fromkeys(_lamp_inputs(model_name, representation), "VECTOR")
    return inputs


def _lamp_inputs(model_name, representation):
    """Inputs of a form that the shared group of lamps feeds; a form may have fewer slots."""
    slots = pack.representation(model_name, representation).get("lamps") or 0
    if slots > lamps.SLOTS:
        raise pack.PackError(
            f"manifest.json: {model_name} ({representation}): expected at most {lamps.SLOTS} "
            f"lamps, got {slots}"
        )
    return lamps.part_names(slots)


def _scripts(group):
    """The script node that gives the closure, and the one of the Albedo output, if it has one."""
    found = [n for n in group.nodes if n.bl_idname == "ShaderNodeScript"]
    albedo = next((n for n in found if n.name == ALBEDO), None)
    others = (n for n in found if n.name not in (ALBEDO, stand_in.NODE))
    return next(others, None), albedo


def _script_problem(script, inputs, outputs):
    if script is None:
        return "has no script node"
    if not script.bytecode:
        return "is not compiled"
    for sockets, expected in ((script.inputs, inputs), (script.outputs, outputs)):
        found = {s.identifier: s.type for s in sockets}
        if missing := sorted(set(expected) - set(found)):
            return f"lacks the sockets {', '.join(missing)}"
        for name, kind in expected.items():
            if found[name] != kind:
                return f"has a socket {name} of type {found[name]}, expected {kind}"
    return None


def script_problem(group):
    """What is wrong with a group's script nodes, or None.

    A shader that fails to compile raises nothing in Cycles: it leaves a node without sockets.
    """
    if is_native(group):
        return None
    tag = group[TAG]
    script, albedo = _scripts(group)
    inputs, albedo_inputs = dict(tag["script_inputs"]), tag.get("albedo_inputs")
    # Files of older versions have both outputs in one script, as have forms of small tables.
    alone = tag.get("albedo_apart", False)
    outputs = {n: k for n, k in OUTPUTS.items() if not alone or n != ALBEDO}
    if problem := _script_problem(script, inputs, outputs):
        return problem
    if tag.get("stands_in") and _script_problem(*stand_in.expected(group)):
        return f"has lost its node {stand_in.NODE}"
    if albedo_inputs is None:
        return None
    problem = _script_problem(albedo, dict(albedo_inputs), {ALBEDO: OUTPUTS[ALBEDO]})
    return problem and f"of the Albedo output {problem}"


def _add_outputs(group, outputs):
    kinds = {"SHADER": "NodeSocketShader", "RGBA": "NodeSocketColor"}
    for name in (n for n in OUTPUTS if n in outputs):
        group.interface.new_socket(name, in_out="OUTPUT", socket_type=kinds[OUTPUTS[name]])


def _start_group(group, outputs):
    """Output sockets, and the nodes that stand for the group's inputs and outputs."""
    _add_outputs(group, outputs)
    return group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")


def _fill_native_group(group, model_name, representation, source, twin_group):
    """Forms of Blender's own nodes have the sockets of the others; what a twin looks like does not
    hang on a tangent. `twin_group`: that of the model's twin, or None."""
    data = json.loads(source)
    label = pack.model(model_name)["label"]
    # A twin's sockets keep the identifiers that files have: outputs come first.
    _add_outputs(group, OUTPUTS if representation == "twin" else ())
    group_input = group.nodes.new("NodeGroupInput")
    group_input.location = (-300, 0)
    sockets, parameters = {}, {}
    for name, parameter in pack.socket_parameters(model_name, representation).items():
        relay = group.nodes.new("NodeReroute")
        relay.location = (-100, -40 * len(parameters))
        sockets[name] = add_parameter(group, group_input, relay.inputs[0], parameter)
        parameters[name] = relay.outputs[0]
    sockets |= {name: vector_socket(group, name, text) for name, text in VECTORS.items()}
    normal, tangent = (group_input.outputs[name] for name in VECTORS)
    if representation == "twin":
        made = dict(
            zip(OUTPUTS, twin.wire(group, data, normal, parameters, f"{label} (twin)"), strict=True)
        )
    else:
        slots = []
        if names := _lamp_inputs(model_name, representation):
            shared = _add_lamps(group)
            slots = lamps.by_slot([shared.outputs[name] for name in names])
        constants = pack.constants(model_name, representation)
        made = formula_nodes.wire(
            group,
            data,
            normal,
            tangent,
            parameters | formula_nodes.numbers(constants),
            slots,
            label,
        )
        instead = None
        if twin_group is not None:
            sources = parameters | {pack.NORMAL: normal, pack.TANGENT: tangent}
            inputs = {i: sources.get(name) for name, i in twin_group[TAG]["sockets"].items()}
            instead = stand_in.twin_of(group, twin_group, inputs)
        elif stand_in.has_node(model_name) and "baked" not in group[TAG]:
            instead = stand_in.node_of(group, model_name, parameters, constants)
        if instead is not None:
            made = stand_in.add_in_eevee(group, made, instead)
    if representation != "twin":
        _add_outputs(group, made)
    group_output = group.nodes.new("NodeGroupOutput")
    for name, output in made.items():
        group.links.new(output, group_output.inputs[name])
    group_output.location = (200 + max(n.location.x for n in group.nodes), 0)
    group[TAG]["sockets"] = {name: socket.identifier for name, socket in sockets.items()}


def _add_lamps(group):
    """The node that tells where the lamps are."""
    shared = group.nodes.new("ShaderNodeGroup")
    shared.node_tree = lamps.ensure_group()
    shared.location = (-500, -400)
    return shared


def _add_script(group, text, what):
    script = group.nodes.new("ShaderNodeScript")
    script.mode = "INTERNAL"
    compiler.compile_script(script, text, what)
    return script


def _fill_group(group, model_name, representation, texts, twin_group):
    """`texts`: of the script and, where the Albedo output has one of its own that was asked for, of
    that. `twin_group`: that of the model's twin, or None."""
    what = f"{model_name} ({representation})"
    apart = has_albedo_script(model_name, representation)
    outputs = [n for n in OUTPUTS if not apart or n != ALBEDO or len(texts) > 1]
    group_input, group_output = _start_group(group, outputs)
    group_input.location, group_output.location = (-500, 0), (300, 0)
    script = _add_script(group, texts[0], what)
    from_scripts = {s.identifier: s for s in script.outputs}
    tag = group[TAG]
    tag["script_inputs"] = expected_inputs(model_name, representation)
    tag["albedo_apart"] = apart
    if len(texts) > 1:
        albedo = _add_script(group, texts[1], f"{what}, the Albedo output")
        albedo.name = albedo.label = ALBEDO
        albedo.location = (0, -400)
        only_light = {pack.TANGENT, *_lamp_inputs(model_name, representation)}
        tag["albedo_inputs"] = {
            name: kind for name, kind in tag["script_inputs"].items() if name not in only_light
        }
        from_scripts |= {s.identifier: s for s in albedo.outputs}
    if problem := script_problem(group):
        raise CompileError(
            say(
                "Blender could not compile the shader of a model",
                more=f"{what}: the compiled shader {problem}",
            )
        )

    inputs = {s.identifier: s for s in script.inputs}
    sockets = {}
    for name, parameter in pack.socket_parameters(model_name, representation).items():
        sockets[name] = add_parameter(group, group_input, inputs[name], parameter)
    for name, text_ in VECTORS.items():
        sockets[name] = vector_socket(group, name, text_)
        group.links.new(group_input.outputs[-2], inputs[name])
    if lamp_inputs := _lamp_inputs(model_name, representation):
        shared = _add_lamps(group)
        for name in lamp_inputs:
            group.links.new(shared.outputs[name], inputs[name])
    sources = {name: s.links[0].from_socket for name, s in inputs.items() if s.is_linked}
    instead = None
    if twin_group is not None:
        of_twin = {i: sources.get(name) for name, i in twin_group[TAG]["sockets"].items()}
        instead = stand_in.twin_of(group, twin_group, of_twin)
    elif stand_in.has_node(model_name) and "baked" not in tag:
        constants = pack.constants(model_name, representation)
        instead = stand_in.node_of(group, model_name, sources, constants)
    if instead is not None:
        tag["stands_in"] = True
        runs = _add_script(group, stand_in.text(), "what tells where shaders run")
        for name, output in stand_in.add(group, runs, from_scripts, instead).items():
            from_scripts[name] = output
        group_output.location.x += 100
    for output in outputs:
        group.links.new(from_scripts[output], group_output.inputs[output])
    if len(texts) > 1:
        for socket in albedo.inputs:
            group.links.new(sources[socket.identifier], socket)
    tag["sockets"] = {name: socket.identifier for name, socket in sockets.items()}


def is_ours(node):
    """Whether a node is a group of this extension, also of another version of it."""
    tree = getattr(node, "node_tree", None)
    return node.bl_idname == "ShaderNodeGroup" and tree is not None and TAG in tree


def find_group(model_name, representation, albedo=False):
    """The group of the current version of a shader, if the file has a sound one; `albedo` as in
    ensure_group."""
    albedo = albedo and has_albedo_script(model_name, representation)
    digest = pack.digest(model_name, representation)
    for group in bpy.data.node_groups:
        tag = group.get(TAG)
        if group.library is None and tag is not None and tag.get("digest") == digest:
            same = (tag["model"], tag["representation"]) == (model_name, representation)
            if same and ("albedo_inputs" in tag) == albedo and script_problem(group) is None:
                return group
    return None


def unite(groups):
    """Has groups that came from another file give way to equal ones of the open file."""
    stand_in.keep_one_text()
    # Twins first: they are parts of the others.
    for group in sorted(groups, key=lambda group: group[TAG]["representation"] != "twin"):
        _give_way(group)


def _give_way(group):
    """Puts the group of the open file that is equal in its place, if there is one."""
    tag = group[TAG].to_dict()
    for other in bpy.data.node_groups:
        same = other != group and other.library is None and TAG in other
        if same and other[TAG].to_dict() == tag and script_problem(other) is None:
            group.user_remap(other)
            remove_group(group)
            return


def _let_go(group):
    """Has the texts of a group, which older versions kept for good, go with their last user."""
    for text in (n.script for n in group.nodes if n.bl_idname == "ShaderNodeScript" and n.script):
        text.use_fake_user = False


def ensure_group(model_name, representation="auto", baked=None, albedo=False):
    """Node group of a model, made if the file has none. Raises ValueError, CompileError.

    Nothing is left in the file when it fails. `baked`: hash of the extension that a pack of the
    open file alone, which pack.use() has taken, stands in for. `albedo`: with the Albedo output,
    also where that takes a script of large tables.
    """
    representation = pack.resolve(model_name, representation)
    if group := find_group(model_name, representation, albedo):
        _let_go(group)
        return group
    stem, source = pack.source(model_name, representation)
    sources = {stem: source}
    native = pack.is_native(model_name, representation)
    if albedo and (of_albedo := pack.albedo_source(model_name, representation)):
        sources |= dict([of_albedo])
    # Lean ones hold no more than a render needs.
    has_twin = "twin" in pack.model(model_name)["representations"]
    stands_in = representation != "twin" and not baked and has_twin
    known = set(bpy.data.node_groups)
    twin_group = ensure_group(model_name, "twin") if stands_in else None
    texts = [] if native else [stand_in.new_text(f"{stem}.osl") for stem in sources]
    names = [text.name for text in texts]
    form = ", ".join([representation, *([ALBEDO] if len(texts) > 1 else [])])
    group = bpy.data.node_groups.new(
        f"{pack.model(model_name)['label']} ({form})", "ShaderNodeTree"
    )
    try:
        group.color_tag = "SHADER"
        group.description = pack.model(model_name)["doc"]
        group[TAG] = {
            "model": model_name,
            "representation": representation,
            "digest": pack.digest(model_name, representation),
            "made_by": pack.manifest()["generator"],
            "choices": json.dumps(pack.form_choices(model_name, representation)),
            "only": json.dumps(pack.constants(model_name, representation)),
        }
        if baked:
            # The pack will be gone.
            entry = {
                "of": baked,
                "form": pack.representation(model_name, representation),
                "parameters": pack.parameters(model_name),
            }
            group[TAG]["baked"] = json.dumps(entry)
        if native:
            _fill_native_group(group, model_name, representation, source, twin_group)
        else:
            for text, source in zip(texts, sources.values(), strict=True):
                text.write(source)
                text.cursor_set(0)
            _fill_group(group, model_name, representation, texts, twin_group)
    except BaseException:
        remove_group(group)
        for name in set(names) & set(bpy.data.texts.keys()):
            bpy.data.texts.remove(bpy.data.texts[name])
        remove_unused_groups(known)  # a twin that was made for it
        raise
    return group


def add_group_node(tree, model_name, representation="auto"):
    """Adds a group node to a shader tree and returns it."""
    group = ensure_group(model_name, representation)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.width = 200
    node.label = pack.model(model_name)["label"]
    return node


def identity(node):
    """(model, representation) of a group node."""
    tag = node.node_tree[TAG]
    return tag["model"], tag["representation"]


def is_baked(node):
    """Whether the group was made for the open file alone; see lean.py."""
    return "baked" in node.node_tree[TAG]


def made_by(node):
    """Which version made a node's group, as "brdfc 1.2.3"; the first ones did not say."""
    return node.node_tree[TAG].get("made_by", "brdfc 0")


def is_newer(node):
    """Whether a later version than the installed one made a node's group."""
    return pack.version(made_by(node)) > pack.version(pack.manifest()["generator"])


def manifest_entry(node):
    """What the manifest says of a node's form, and its parameters by name; None where the group is
    of another version of the extension."""
    model_name, representation = identity(node)
    tag = node.node_tree[TAG]
    if is_baked(node):
        entry = json.loads(tag["baked"])
        same = entry["of"] == pack.manifest()["hash"]
        return (entry["form"], entry["parameters"]) if same else None
    try:
        if tag["digest"] != pack.digest(model_name, representation):
            return None
    except ValueError:  # a model or form that the installed version does not have
        return None
    return pack.representation(model_name, representation), pack.parameters(model_name)


def sockets(node):
    """Input sockets of a group node by parameter name, and Normal, Tangent."""
    by_identifier = {s.identifier: s for s in node.inputs}
    return {
        name: by_identifier[identifier]
        for name, identifier in node.node_tree[TAG]["sockets"].items()
        if identifier in by_identifier
    }


def _choices(node, name):
    return json.loads(node.node_tree[TAG]["choices"])[name]


def _only(node):
    """Values of the parameters that a form has one value of; files of older versions lack them."""
    return pack.canonical(json.loads(node.node_tree[TAG].get("only", "{}")))


def set_value(node, name, value):
    """Sets a socket to a value in the canonical form of pack.check_value."""
    socket = sockets(node).get(name)
    if socket is None:  # there is one value
        return
    if socket.type == "RGBA":
        value = (*value, 1.0)
    elif socket.type == "MENU":
        value = choice_label(value)
    elif socket.type == "INT" and isinstance(value, str):
        value = _choices(node, name).index(value)
    socket.default_value = value


def get_value(node, name):
    """Value of a socket in the same form; None where a node's output reaches it, and of a vector.
    Links that Cycles ignores do not count."""
    socket = sockets(node).get(name)
    if socket is None:
        only = _only(node)
        return only[name] if name in only else _choices(node, name)[0]
    reached = shader_trees.reach(socket)
    if reached.output is not None or socket.type == "VECTOR":
        return None
    if socket.type == "RGBA":
        return tuple(socket.default_value)[:3] if reached.holder else (0.0, 0.0, 0.0)
    if socket.type == "MENU":
        labels = {choice_label(c): c for c in _choices(node, name)}
        return labels.get(socket.default_value)
    if socket.type == "INT":
        choices, index = _choices(node, name), socket.default_value if reached.holder else 0
        return choices[min(max(index, 0), len(choices) - 1)]
    return socket.default_value if reached.holder else 0.0


def varying(node):
    """Parameters of a group node that are not constant: what a link controls, a curve animates or a
    driver sets. Links that Cycles ignores do not count."""
    moved = animation.inputs(node)
    return {
        name
        for name, s in sockets(node).items()
        if s.identifier in moved or shader_trees.is_driven(s)
    }


def _trees(tree, seen):
    if tree is None or tree in seen:
        return
    seen.append(tree)
    for node in tree.nodes:
        if hasattr(node, "node_tree") and not is_ours(node):
            _trees(node.node_tree, seen)


def trees_within(node):
    """The trees of a group node, nested groups included; those of this extension have none."""
    trees = []
    if not is_ours(node):
        _trees(getattr(node, "node_tree", None), trees)
    return trees


def all_nodes(owner):
    """Every node of a material or world, those in nested groups included, but for what groups of
    this extension hold."""
    trees = []
    _trees(owner.node_tree, trees)
    return [node for tree in trees for node in tree.nodes]


def group_nodes(material):
    """Every group node of this extension in a material, nested groups included."""
    return [node for node in all_nodes(material) if is_ours(node)]


def shown_nodes(material):
    """The same of those that Cycles shows: what is muted, lies behind links that are, or reaches no
    active output is not among them."""
    found = (shown.node for shown in shader_trees.shown(material))
    return list(dict.fromkeys(node for node in found if is_ours(node)))


def make_local(tree):
    """Makes the groups, scripts and images that a tree of this file is made of this file's own."""
    for node in tree.nodes:
        for name in ("node_tree", "script", "image"):
            inner = getattr(node, name, None)
            if inner is not None and editable.refusal(inner):
                inner.make_local()
        if getattr(node, "node_tree", None) is not None:
            make_local(node.node_tree)


def all_values(node):
    """Value of each parameter by name, as get_value() has it."""
    choices = json.loads(node.node_tree[TAG]["choices"])
    names = dict.fromkeys((*choices, *_only(node), *sockets(node)))
    return {name: get_value(node, name) for name in names}


def constants(node):
    """The same, and None for what is varying()."""
    return all_values(node) | dict.fromkeys(varying(node))


def remove_group(group):
    """Takes a group out of the file, and its texts, images and twin, if nothing else has them."""
    texts = {n.script for n in group.nodes if n.bl_idname == "ShaderNodeScript" and n.script}
    texts |= {*stand_in.texts()}
    images = {n.image for n in group.nodes if n.bl_idname == "ShaderNodeTexImage" and n.image}
    inner = {n.node_tree for n in group.nodes if is_ours(n)}
    bpy.data.node_groups.remove(group)
    for image in images:
        if image.users == 0:
            bpy.data.images.remove(image)
    trees = [*bpy.data.node_groups, *(m.node_tree for m in bpy.data.materials if m.node_tree)]
    used = {getattr(node, "script", None) for tree in trees for node in tree.nodes}
    for text in texts:
        if text not in used:
            bpy.data.texts.remove(text)
    for tree in inner:
        if tree.users == 0:
            remove_group(tree)
    formula_nodes.remove_unused_parts()
    lamps.remove_unused_group()


def remove_unused_groups(kept=()):
    """Takes every group of this extension that no node has out of the file, but for those."""

    def unused(group):
        ours = TAG in group and group.library is None
        return ours and group.users == 0 and group not in kept

    while group := next(filter(unused, bpy.data.node_groups), None):
        remove_group(group)


def switch(node, representation):
    """Puts another representation of the same model into a group node; values and links stay.

    Raises ValueError, also where the file would not keep that, CompileError; the node is then as it
    was.
    """
    editable.check(node.id_data)
    model_name, _ = identity(node)
    form = pack.resolve(model_name, representation, constants(node))
    _exchange(node, ensure_group(model_name, form, albedo=uses_albedo(node)))


def _exchange(node, group):
    """Puts another group into a node; that of before goes where nothing else has it."""
    before = node.node_tree
    replace_group(node, group)
    if before.users == 0 and before.library is None:
        remove_group(before)


def uses_albedo(node):
    """Whether something is linked to a group node's Albedo output."""
    return ALBEDO in node.outputs and node.outputs[ALBEDO].is_linked


def add_albedo(node):
    """Gives a group node the Albedo output, if it lacks that; values and links stay.

    Raises ValueError for one that lacks it and is not of the installed extension, and where the
    file would not keep that; CompileError.
    """
    editable.check(node.id_data)
    if ALBEDO in node.outputs:
        return
    if is_baked(node) or manifest_entry(node) is None:
        name = node.label or node.name
        if is_baked(node):
            raise ValueError(
                say(
                    "{node} is lean: choose a render method first, which brings the whole model "
                    "back",
                    node=name,
                )
            )
        raise ValueError(
            say("{node} is of another version of the extension: update it first", node=name)
        )
    _exchange(node, ensure_group(*identity(node), albedo=True))


def replace_group(node, group):
    """Puts another group of the same model into a group node; values, links and animation stay.
    Animation of what the group has no socket of is muted."""
    if group == node.node_tree:
        return
    tree = node.id_data
    names = {s.identifier: name for name, s in sockets(node).items()}
    animated = [(*moves, names.get(identifier)) for *moves, identifier in animation.hold(node)]
    values = all_values(node)
    incoming = [
        (link.from_socket, name, link.is_muted)
        for name, s in sockets(node).items()
        for link in s.links
    ]
    outgoing = [(s.name, link.to_socket, link.is_muted) for s in node.outputs for link in s.links]
    for link in [link for s in (*node.inputs, *node.outputs) for link in s.links]:
        tree.links.remove(link)
    node.node_tree = group
    present = sockets(node)
    for name, value in values.items():
        if name in present and value is not None:
            set_value(node, name, value)
    for source, name, muted in incoming:
        if name in present:
            tree.links.new(source, present[name]).is_muted = muted
    for name, target, muted in outgoing:
        tree.links.new(node.outputs[name], target).is_muted = muted
    for curve, owner, name in animated:  # which knows sockets by their number
        if name in present:
            animation.follow(curve, owner, present[name])
        else:
            curve.mute = True
