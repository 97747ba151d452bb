# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the node group of a model: with script nodes or Blender's own nodes, the sockets of
parameters and lamps, and the nodes that stand in where scripts do not run. nodes.py creates and
manages the groups themselves.
"""

import json

from .. import lamps
from ..common.i18n import say
from ..packs import pack
from ..packs.parameter_values import choice_label
from . import closure_nodes, compiler, formula_nodes, part_groups, stand_in, twin
from .compiler import CompileError
from .group_sockets import VECTORS, Interface, has_menus
from .wiring import Wiring

TAG = pack.TAG
OUTPUTS = {"BSDF": "SHADER", "Albedo": "RGBA"}
ALBEDO = "Albedo"
#: Entries of a group's tag that describe its scripts.
_OF_SCRIPTS = ("script_inputs", "albedo_apart", "albedo_inputs", "stands_in")
_SOCKET_TYPES = {"number": "VALUE", "color": "RGBA", "choice": "INT"}


def is_native(group):
    """Whether a group of this extension consists of Blender's own nodes, without a script."""
    return "script_inputs" not in group[TAG]


def expected_inputs(form):
    """Identifiers of the script node's inputs, with the types of their sockets."""
    inputs = {p["name"]: _SOCKET_TYPES[p["kind"]] for p in form.socket_parameters.values()}
    inputs |= {pack.NORMAL: "VECTOR", pack.TANGENT: "VECTOR"}
    inputs |= dict.fromkeys(_lamp_inputs(form), "VECTOR")
    return inputs


def _lamp_inputs(form, room=lamps.WHOLE):
    """A form's inputs that the shared group of lamps feeds, as far as there is room; a form may
    have fewer slots than the group."""
    if form.lamps > lamps.SLOTS:
        raise pack.PackError(
            f"manifest.json: {form.model.name} ({form.name}): expected at most {lamps.SLOTS} "
            f"lamps, got {form.lamps}"
        )
    return lamps.part_names(min(form.lamps, room.lamps))


def scripts(group):
    """The script node of the closure, and that of the Albedo output if there is one."""
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


def _has_lost_groups(group):
    """Whether a group inside it, or inside a form inside it, was deleted."""
    inner = [n.node_tree for n in group.nodes if n.bl_idname == "ShaderNodeGroup"]
    return None in inner or any(_has_lost_groups(g) for g in inner if TAG in g)


def script_problem(group):
    """What is wrong with a group's script nodes and the groups inside it, or None.

    Cycles raises no error when a shader fails to compile: the node is left without sockets.
    """
    if _has_lost_groups(group):
        return "has lost a group inside it"
    if part_groups.lacks_nodes(group):
        return "has lost the nodes of a group inside it"
    if is_native(group):
        return None
    tag = group[TAG]
    script, albedo = scripts(group)
    inputs, albedo_inputs = dict(tag["script_inputs"]), tag.get("albedo_inputs")
    # Groups of older versions, and forms with small tables, have one script for both outputs.
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
    """Adds the output sockets, and the group's input and output nodes."""
    _add_outputs(group, outputs)
    return group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")


def outputs_of(form, albedo):
    """Names of the outputs of a script form; `albedo` as in ensure_group()."""
    if not form.model.has_albedo:
        return [name for name in OUTPUTS if name != ALBEDO]
    return [name for name in OUTPUTS if albedo or not form.has_albedo_script or name != ALBEDO]


def bent_normal_group(model_name):
    """The group that bends a normal as Cycles' glossy nodes bend theirs; None if the pack has no
    Formula Nodes of this model, whose part it is."""
    form = pack.model(model_name).forms.get("nodes")
    if form is None:
        return None
    _, source = form.source()
    return formula_nodes.bent_normal_group(json.loads(source))


def fill_with_nodes(group, form, source, twin_group, room=lamps.WHOLE):
    """Fills a group with a form of Blender's own nodes. Its sockets are those of the other forms;
    but a twin has no use for a tangent. `twin_group`: the group of the model's twin, or None.
    `room`: for lamps."""
    data = json.loads(source)
    label, is_twin = form.model.label, form.name == "twin"
    # Outputs come first, so that a twin's sockets keep the identifiers that existing files have.
    _add_outputs(group, OUTPUTS if is_twin else ())
    group_input = group.nodes.new("NodeGroupInput")
    group_input.location = (-300, 0)
    interface = Interface(group, group_input, {})
    parameters = _relays(group, interface, form.socket_parameters)
    normal, tangent = map(interface.vector, VECTORS)
    if is_twin:
        wire = closure_nodes.wire if closure_nodes.has_formulas(data) else twin.wire
        found = wire(group, data, normal, parameters, f"{label} (twin)")
        made = dict(zip(OUTPUTS, found, strict=True))
    else:
        of_slots = []
        if names := _lamp_inputs(form, room):
            shared = _add_lamps(group)
            of_slots = lamps.by_slot([shared.outputs[name] for name in names])
        made = formula_nodes.wire(
            group,
            data,
            normal,
            tangent,
            parameters | formula_nodes.numbers(form.constants),
            of_slots,
            room.cones,
            label,
        )
        sources = parameters | {pack.NORMAL: normal, pack.TANGENT: tangent}
        if instead := _stand_in(group, form, twin_group, sources):
            made = stand_in.add_in_eevee(group, made, instead)
    if not is_twin:
        _add_outputs(group, made)
    group_output = group.nodes.new("NodeGroupOutput")
    for name, output in made.items():
        group.links.new(output, group_output.inputs[name])
    group_output.location = (200 + max(n.location.x for n in group.nodes), 0)
    group[TAG]["sockets"] = interface.identifiers()


def _stand_in(group, form, twin_group, sources):
    """Outputs by name of what stands in for a form, if anything does: those of the twin, or of
    nodes in its place."""
    made = _instance(group, twin_group, sources) if twin_group is not None else {}
    if "baked" in group[TAG]:
        return made
    if stand_in.has_node(form.model):
        return made | stand_in.node_of(group, form, sources)
    return made | (stand_in.albedo_of(group, form, sources) if made else {})


def _relays(group, interface, parameters, without=()):
    """Makes the sockets of these parameters, in this order: one group's content may be replaced by
    that of another form. Returns an output inside the group for each, except for `without`."""
    found = {}
    for name, parameter in parameters.items():
        if name in without:
            interface.require(name, parameter)
            continue
        relay = group.nodes.new("NodeReroute")
        relay.location = (-100, -40 * len(found))
        interface.parameter(name, relay.inputs[0], parameter)
        found[name] = relay.outputs[0]
    return found


def fill_with_form(group, native, with_osl, group_of):
    """Fills a group with the form `native` of Blender's own nodes, in place of another form. For
    choices that this form lacks, the group shows the model's twin. Sockets stay. `group_of`: finds
    or makes the group of a form."""
    inner = group_of(native)
    tag = group[TAG]
    _add_outputs(group, outputs_of(with_osl, tag["with_albedo"]))
    group_input, group_output = (group.nodes.new(f"NodeGroup{end}") for end in ("Input", "Output"))
    group_input.location, group_output.location = (-500, 0), (400, 0)
    interface = Interface(group, group_input, tag.get("sockets", {}))
    parameters = with_osl.socket_parameters
    # The form has its own sockets for choices. Where those are menus they take no number.
    menus = {
        name
        for name in inner[TAG]["sockets"].keys() & parameters.keys()
        if has_menus() and parameters[name]["kind"] == "choice"
    }
    new_menus = menus - interface.sockets.keys()
    sources = _relays(group, interface, parameters, without=menus)
    sources |= {name: interface.vector(name) for name in VECTORS}
    made = _instance(group, inner, sources | {name: interface.output(name) for name in menus})
    for name in new_menus:  # a menu has its items, of which one is the default, from its link
        interface.sockets[name].default_value = choice_label(parameters[name]["default"])
    limits = {n: v for n, v in native.only.items() if n in sources}
    if limits:
        made = _only_where(group, native.model, limits, sources, made, group_of)
    for socket in group_output.inputs:
        if socket.name in made:
            group.links.new(made[socket.name], socket)
    group_output.is_active_output = True
    tag["sockets"] = interface.identifiers()
    for name in _OF_SCRIPTS:
        tag.pop(name, None)


def _instance(group, inner, sources):
    """Puts a group inside another; returns its outputs by name. `sources`: outputs by parameter."""
    inputs = {i: sources.get(name) for name, i in inner[TAG]["sockets"].items()}
    return stand_in.twin_of(group, inner, inputs)


def _only_where(group, model, limits, sources, made, group_of):
    """Outputs by name: `made` where the choices have these values, those of the twin elsewhere."""
    w, chosen = Wiring(group), None
    for name, only in limits.items():
        index = model.parameters[name]["choices"].index(only)
        same = w.math("COMPARE", sources[name], index, 0.25)
        chosen = same if chosen is None else w.math("MULTIPLY", chosen, same)
    if "twin" not in model.forms:
        return made | {"BSDF": w.shown(chosen, made["BSDF"])}
    twin_ = _instance(group, group_of(model.forms["twin"]), sources)
    return twin_ | made | stand_in.choose(group, chosen, twin_, made)


def _add_lamps(group):
    """Adds the shared group that outputs the positions of the lamps."""
    shared = group.nodes.new("ShaderNodeGroup")
    shared.node_tree = lamps.ensure_group()
    shared.location = (-500, -400)
    return shared


def _add_script(group, text, what):
    script = group.nodes.new("ShaderNodeScript")
    script.mode = "INTERNAL"
    compiler.compile_script(script, text, what)
    return script


def fill_with_scripts(group, form, texts, twin_group):
    """`texts`: of the script, and of the Albedo output's own script where that exists and was
    requested. `twin_group`: the group of the model's twin, or None."""
    what = f"{form.model.name} ({form.name})"
    outputs = outputs_of(form, len(texts) > 1)
    group_input, group_output = _start_group(group, outputs)
    group_output.is_active_output = True
    group_input.location, group_output.location = (-500, 0), (300, 0)
    script = _add_script(group, texts[0], what)
    from_scripts = {s.identifier: s for s in script.outputs}
    tag = group[TAG]
    tag["script_inputs"] = expected_inputs(form)
    tag["albedo_apart"] = form.has_albedo_script or not form.model.has_albedo
    if len(texts) > 1:
        albedo = _add_script(group, texts[1], f"{what}, the Albedo output")
        albedo.name = albedo.label = ALBEDO
        albedo.location = (0, -400)
        only_light = {pack.TANGENT, *_lamp_inputs(form)}
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
    for name, parameter in form.socket_parameters.items():
        interface.parameter(name, inputs[name], parameter)
    for name in VECTORS:
        group.links.new(interface.vector(name), inputs[name])
    if lamp_inputs := _lamp_inputs(form):
        shared = _add_lamps(group)
        for name in lamp_inputs:
            group.links.new(shared.outputs[name], inputs[name])
    sources = {name: s.links[0].from_socket for name, s in inputs.items() if s.is_linked}
    if instead := _stand_in(group, form, twin_group, sources):
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
