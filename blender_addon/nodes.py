# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups around an OSL script node, and for twins around Blender's own nodes.

A group is made once per model, representation and version of the shader, and reused. Source and
bytecode both lie inside the .blend, so a saved file renders where the extension is not installed.
"""

import contextlib
import json

import bpy

from . import (
    animation,
    compiler,
    device,
    editable,
    formula_nodes,
    lamps,
    pack,
    shader_trees,
    stand_in,
    twin,
)
from .compiler import CompileError
from .group_sockets import VECTORS, Interface
from .i18n import say
from .pack import choice_label
from .wiring import Wiring

TAG = pack.TAG
OUTPUTS = {"BSDF": "SHADER", "Albedo": "RGBA"}
ALBEDO = "Albedo"
#: In the tag of a group that suits itself to the scene: its form where that has Open Shading
#: Language.
AUTO = "auto"
#: What the tag of a group says of its scripts.
_OF_SCRIPTS = ("script_inputs", "albedo_apart", "albedo_inputs", "stands_in")
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
    items = group.interface.items_tree
    present = {i.name for i in items if i.item_type == "SOCKET" and i.in_out == "OUTPUT"}
    for name in (n for n in OUTPUTS if n in outputs and n not in present):
        group.interface.new_socket(name, in_out="OUTPUT", socket_type=kinds[OUTPUTS[name]])


def _start_group(group, outputs):
    """Output sockets, and the nodes that stand for the group's inputs and outputs."""
    _add_outputs(group, outputs)
    return group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")


def _outputs(model_name, representation, albedo):
    """Names of the outputs of a form of scripts; `albedo` as in ensure_group()."""
    apart = has_albedo_script(model_name, representation)
    return [name for name in OUTPUTS if albedo or not apart or name != ALBEDO]


def _fill_native_group(group, model_name, representation, source, twin_group):
    """Forms of Blender's own nodes have the sockets of the others; what a twin looks like does not
    hang on a tangent. `twin_group`: that of the model's twin, or None."""
    data = json.loads(source)
    label = pack.model(model_name)["label"]
    # A twin's sockets keep the identifiers that files have: outputs come first.
    _add_outputs(group, OUTPUTS if representation == "twin" else ())
    group_input = group.nodes.new("NodeGroupInput")
    group_input.location = (-300, 0)
    interface = Interface(group, group_input, {})
    parameters = _relays(group, interface, pack.socket_parameters(model_name, representation))
    normal, tangent = map(interface.vector, VECTORS)
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
            instead = _instance(group, twin_group, sources)
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
    group[TAG]["sockets"] = interface.identifiers()


def _relays(group, interface, parameters):
    """An output within the group for each of these parameters."""
    found = {}
    for name, parameter in parameters.items():
        relay = group.nodes.new("NodeReroute")
        relay.location = (-100, -40 * len(found))
        interface.parameter(name, relay.inputs[0], parameter)
        found[name] = relay.outputs[0]
    return found


def _fill_by_form(group, model_name, native, with_osl):
    """Fills a group that takes the place of another form with Blender's own nodes: those of the
    form `native`; where a choice is one that it lacks, the model's twin. Sockets stay."""
    form = ensure_group(model_name, native)
    tag = group[TAG]
    _add_outputs(group, _outputs(model_name, with_osl, tag["with_albedo"]))
    group_input, group_output = (group.nodes.new(f"NodeGroup{end}") for end in ("Input", "Output"))
    group_input.location, group_output.location = (-500, 0), (400, 0)
    interface = Interface(group, group_input, tag.get("sockets", {}))
    sources = _relays(group, interface, pack.socket_parameters(model_name, with_osl))
    sources |= {name: interface.vector(name) for name in VECTORS}
    made = _instance(group, form, sources)
    limits = {n: v for n, v in pack.form_values(model_name, native).items() if n in sources}
    if limits:
        made = _only_where(group, model_name, limits, sources, made)
    for socket in group_output.inputs:
        if socket.name in made:
            group.links.new(made[socket.name], socket)
    group_output.is_active_output = True
    tag["sockets"] = interface.identifiers()
    for name in _OF_SCRIPTS:
        tag.pop(name, None)


def _instance(group, inner, sources):
    """The outputs, by name, of a group within another. `sources`: outputs by parameter."""
    inputs = {i: sources.get(name) for name, i in inner[TAG]["sockets"].items()}
    return stand_in.twin_of(group, inner, inputs)


def _only_where(group, model_name, limits, sources, made):
    """Outputs by name: `made` where choices are these, and those of the twin elsewhere."""
    w, chosen = Wiring(group), None
    for name, only in limits.items():
        index = pack.parameters(model_name)[name]["choices"].index(only)
        same = w.math("COMPARE", sources[name], index, 0.25)
        chosen = same if chosen is None else w.math("MULTIPLY", chosen, same)
    if "twin" not in pack.model(model_name)["representations"]:
        return made | {"BSDF": w.shown(chosen, made["BSDF"])}
    twin_ = _instance(group, ensure_group(model_name, "twin"), sources)
    return twin_ | made | stand_in.choose(group, chosen, twin_, made)


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
    outputs = _outputs(model_name, representation, len(texts) > 1)
    group_input, group_output = _start_group(group, outputs)
    group_output.is_active_output = True
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
    interface = Interface(group, group_input, tag.get("sockets", {}))
    for name, parameter in pack.socket_parameters(model_name, representation).items():
        interface.parameter(name, inputs[name], parameter)
    for name in VECTORS:
        group.links.new(interface.vector(name), inputs[name])
    if lamp_inputs := _lamp_inputs(model_name, representation):
        shared = _add_lamps(group)
        for name in lamp_inputs:
            group.links.new(shared.outputs[name], inputs[name])
    sources = {name: s.links[0].from_socket for name, s in inputs.items() if s.is_linked}
    instead = None
    if twin_group is not None:
        instead = _instance(group, twin_group, sources)
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
    tag["sockets"] = interface.identifiers()


def is_ours(node):
    """Whether a node is a group of this extension, also of another version of it."""
    tree = getattr(node, "node_tree", None)
    return node.bl_idname == "ShaderNodeGroup" and tree is not None and TAG in tree


def find_group(model_name, representation, albedo=False, automatic=None):
    """The group of the current version of a shader, if the file has a sound one; `albedo` as in
    ensure_group. `automatic`: the form with Open Shading Language, of a group that suits itself to
    the scene."""
    albedo = albedo and has_albedo_script(model_name, automatic or representation)
    digest = pack.digest(model_name, representation)
    for group in bpy.data.node_groups:
        tag = group.get(TAG)
        if group.library is None and tag is not None and tag.get("digest") == digest:
            same = (tag["model"], tag["representation"]) == (model_name, representation)
            has_albedo = tag["with_albedo"] if AUTO in tag else "albedo_inputs" in tag
            if same and tag.get(AUTO) == automatic and has_albedo == albedo and is_sound(group):
                return group
    return None


def is_sound(group):
    """Whether a group has all that it was made with."""
    return bool(group.nodes) and script_problem(group) is None


def with_parts(groups):
    """These groups, and those of this extension within them."""
    found, new = set(), set(groups)
    while new:
        found |= new
        new = {n.node_tree for group in new for n in group.nodes if is_ours(n)} - found
    return found


def unite(groups):
    """Has groups that came from another file give way to equal ones of the open file."""
    stand_in.keep_one_text()

    # Parts of others first: of all forms their twins, of automatic ones their forms.
    def depth(group):
        return 2 if AUTO in group[TAG] else int(group[TAG]["representation"] != "twin")

    for group in sorted(groups, key=depth):
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


def ensure_group(model_name, representation="auto", baked=None, albedo=False, values=None):
    """Node group of a model, made if the file has none. Raises ValueError, CompileError.

    Nothing is left in the file when it fails. That of "auto" suits itself to the scene, where the
    model has a form for that: see suit(). `values` of parameters tell which forms there are.
    `baked`: hash of the extension that a pack of the open file alone, which pack.use() has taken,
    stands in for. `albedo`: with the Albedo output, also where that takes a script of large tables.
    """
    if representation == "auto" and not baked:
        with_osl = pack.automatic(model_name, values)
        if pack.native_form(model_name) and not pack.is_native(model_name, with_osl):
            return _ensure_automatic(model_name, with_osl, albedo)
    representation = pack.resolve(model_name, representation, values)
    if group := find_group(model_name, representation, albedo):
        _let_go(group)
        return group
    with _new_group(model_name, representation, representation, albedo) as group:
        if baked:
            # The pack will be gone.
            entry = {
                "of": baked,
                "form": pack.representation(model_name, representation),
                "parameters": pack.parameters(model_name),
            }
            group[TAG]["baked"] = json.dumps(entry)
        _fill(group, model_name, representation, albedo)
    return group


def _ensure_automatic(model_name, with_osl, albedo):
    """Node group that suits itself to the scene; `with_osl`: its form where that has OSL."""
    native = pack.native_form(model_name)
    for form in (with_osl, native):
        if group := find_group(model_name, form, albedo, with_osl):
            _let_go(group)
            suit(group, device.lacks_osl(lamps.current_scene()))
            return group
    with _new_group(model_name, "auto", with_osl, albedo) as group:
        tag = group[TAG]
        tag[AUTO], tag["with_albedo"] = with_osl, albedo and has_albedo_script(model_name, with_osl)
        tag["native_only"] = json.dumps(pack.form_values(model_name, native))
        _suit(group, native if device.lacks_osl(lamps.current_scene()) else with_osl)
    return group


#: Groups that are being made. Lamps are looked for then, and Blender calls handlers.
_unfinished = []


def is_at_work():
    """Whether a group is being made."""
    return bool(_unfinished)


@contextlib.contextmanager
def _new_group(model_name, name, form, albedo):
    """A new group with the sockets of a form, for the body to fill; where that raises, it and what
    it was made of are taken out of the file again."""
    known = set(bpy.data.node_groups)
    parts = [name, *([ALBEDO] if albedo and has_albedo_script(model_name, form) else [])]
    title = f"{pack.model(model_name)['label']} ({', '.join(parts)})"
    group = bpy.data.node_groups.new(title, "ShaderNodeTree")
    _unfinished.append(group)
    try:
        group.color_tag = "SHADER"
        group.description = pack.model(model_name)["doc"]
        group[TAG] = {
            "model": model_name,
            "representation": form,
            "digest": pack.digest(model_name, form),
            "made_by": pack.manifest()["generator"],
            "choices": json.dumps(pack.form_choices(model_name, form)),
            "only": json.dumps(pack.constants(model_name, form)),
        }
        yield group
    except BaseException:
        remove_group(group)
        remove_unused_groups(known)  # a twin that was made for it
        raise
    finally:
        _unfinished.pop()


def _fill(group, model_name, representation, albedo):
    """Makes the nodes of a form in a group. Raises CompileError; texts that were made are gone
    then."""
    stem, source = pack.source(model_name, representation)
    sources = {stem: source}
    if albedo and (of_albedo := pack.albedo_source(model_name, representation)):
        sources |= dict([of_albedo])
    # Lean ones hold no more than a render needs.
    has_twin = "twin" in pack.model(model_name)["representations"]
    stands_in = representation != "twin" and "baked" not in group[TAG] and has_twin
    twin_group = ensure_group(model_name, "twin") if stands_in else None
    if pack.is_native(model_name, representation):
        _fill_native_group(group, model_name, representation, source, twin_group)
        return
    before = list(group.nodes)
    texts = [stand_in.new_text(f"{stem}.osl", source) for stem, source in sources.items()]
    names = [text.name for text in texts]
    try:
        _fill_group(group, model_name, representation, texts, twin_group)
    except BaseException:
        _remove_others(group, before)
        for name in set(names) & set(bpy.data.texts.keys()):
            bpy.data.texts.remove(bpy.data.texts[name])
        raise


def _remove_others(group, kept):
    for node in [node for node in group.nodes if node not in kept]:
        group.nodes.remove(node)


def form_in_script(node):
    """The form that says which values a node's sockets can have; of an automatic one that with
    Open Shading Language."""
    tag = node.node_tree[TAG]
    return tag.get(AUTO, tag["representation"])


def automatic_groups():
    """Groups of this file that suit themselves to the scene."""
    return [g for g in bpy.data.node_groups if g.library is None and AUTO in g.get(TAG, ())]


def _is_current(group):
    tag = group[TAG]
    try:
        return tag["digest"] == pack.digest(tag["model"], tag["representation"])
    except ValueError:  # a model or form that the installed version does not have
        return False


def suit(group, lacks_osl):
    """Has an automatic group be the form that a scene with or without Open Shading Language can
    render, if the installed version made it; sockets stay. Returns whether it was another. Raises
    CompileError; it is then as it was."""
    tag = group[TAG]
    # Handlers ask at each change of the scene, and to tell the version takes a hash.
    if group.nodes and (tag["representation"] == tag[AUTO]) != lacks_osl:
        return False
    if not _is_current(group):
        return False
    wanted = pack.native_form(tag["model"]) if lacks_osl else tag[AUTO]
    if wanted is None:
        return False
    _suit(group, wanted)
    return True


def _suit(group, form):
    tag, before = group[TAG].to_dict(), list(group.nodes)
    inner = {n.node_tree.session_uid for n in before if is_ours(n)}
    texts = {n.script for n in before if n.bl_idname == "ShaderNodeScript" and n.script}
    model_name, with_osl = tag["model"], tag[AUTO]
    try:
        if form == with_osl:
            _fill(group, model_name, form, tag["with_albedo"])
        else:
            _fill_by_form(group, model_name, form, with_osl)
    except BaseException:
        _remove_others(group, before)
        group[TAG] = tag
        raise
    for node in before:
        group.nodes.remove(node)
    group[TAG]["representation"] = form
    group[TAG]["digest"] = pack.digest(model_name, form)
    _clear_away(inner, texts)


def empty(group):
    """Takes all nodes out of an automatic group; suit() makes them again."""
    group.nodes.clear()


def add_group_node(tree, model_name, representation="auto", values=None):
    """Adds a group node to a shader tree and returns it; `values` as in ensure_group()."""
    group = ensure_group(model_name, representation, values=values)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.width = 200
    node.label = pack.model(model_name)["label"]
    return node


def identity(node):
    """(model, representation) of a group node. Of an automatic one the form that it has now, for
    its choices."""
    tag = node.node_tree[TAG]
    if _lacks_choice(node):
        return tag["model"], tag[AUTO]
    return tag["model"], tag["representation"]


def is_automatic(node):
    """Whether a node has the form that the scene can render, whichever that is."""
    return AUTO in node.node_tree[TAG]


def _lacks_choice(node):
    """Whether an automatic node stands where there is no Open Shading Language, with a choice that
    its form lacks there: its twin is shown."""
    tag = node.node_tree[TAG]
    if tag.get(AUTO, tag["representation"]) == tag["representation"]:
        return False
    only = pack.canonical(json.loads(tag["native_only"]))
    return any(not pack.same(get_value(node, name), value) for name, value in only.items())


def runs_anywhere(node):
    """Whether what a node shows needs no Open Shading Language."""
    return is_native(node.node_tree) and not _lacks_choice(node)


def is_stood_in_for(node):
    """Whether Blender's own nodes stand in for a node where its form does not run."""
    inner = [n.node_tree[TAG]["representation"] for n in node.node_tree.nodes if is_ours(n)]
    has_twin = "twin" in inner
    return stand_in.is_in(node.node_tree) or (has_twin and _lacks_choice(node))


def made_of(group):
    """The group that has the nodes of a form: an automatic one may have another in it."""
    if AUTO in group[TAG] and group[TAG][AUTO] != group[TAG]["representation"]:
        form = group[TAG]["representation"]
        inner = (n.node_tree for n in group.nodes if is_ours(n))
        return next((g for g in inner if g[TAG]["representation"] == form), group)
    return group


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
    if not _is_current(node.node_tree):
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
    images = {n.image for n in group.nodes if n.bl_idname == "ShaderNodeTexImage" and n.image}
    inner = {n.node_tree.session_uid for n in group.nodes if is_ours(n)}
    bpy.data.node_groups.remove(group)
    for image in images:
        if image.users == 0:
            bpy.data.images.remove(image)
    _clear_away(inner, texts)


def _clear_away(uids, texts):
    """Takes what were parts of a group out of the file where nothing else has them: groups with
    these session_uids, and texts."""
    trees = [*bpy.data.node_groups, *(m.node_tree for m in bpy.data.materials if m.node_tree)]
    used = {getattr(node, "script", None) for tree in trees for node in tree.nodes}
    for text in {*texts, *stand_in.texts()}:
        if text not in used:
            bpy.data.texts.remove(text)
    # Those that go take what only they have with them.
    while unused := [g for g in bpy.data.node_groups if g.session_uid in uids and g.users == 0]:
        remove_group(unused[0])
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
    values = constants(node)
    if representation != "auto":
        pack.resolve(model_name, representation, values)
    group = ensure_group(model_name, representation, albedo=uses_albedo(node), values=values)
    _exchange(node, group)


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
    tag = node.node_tree[TAG]
    if is_automatic(node):
        _exchange(node, _ensure_automatic(tag["model"], tag[AUTO], albedo=True))
        return
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
