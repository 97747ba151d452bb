# SPDX-License-Identifier: GPL-3.0-or-later
"""Lean materials: shader groups that hold only what the open file needs.

The program brdfc decides what can be left out. It is not part of the extension; see program().
"""

import contextlib
import json
import math
from numbers import Real
from pathlib import Path

import bpy

from . import lamps
from .common.i18n import say
from .common.jobs import Job
from .common.program import ToolJob, find
from .groups import exchange, model_nodes, nodes, usage
from .packs import pack

#: Forms that a budget never chooses; users can still ask for them.
ASKED_FOR = ("twin", "nodes")


class PlanError(RuntimeError):
    """The program brdfc is missing, has another version, or refused to plan."""


def program():
    """See find() of common/program.py. Raises PlanError."""
    return find(PlanError)


def budget(error, time):
    """Parses a budget into (percent or None, units of Blender's Glossy node or None). Accepts the
    program's notation: 5, "5" or "5%"; 1.2, "1.2" or "1.2x". Raises ValueError."""
    percent = _number(error, "%")
    if error is not None and not (percent is not None and 0 <= percent <= 100):
        raise ValueError(f"error: expected percent from 0 to 100, as 5 or '5%', got {error!r}")
    units = _number(time, "x")
    if time is not None and not (units is not None and 0 < units < math.inf):
        raise ValueError(f"time: expected a positive number, as 1.2 or '1.2x', got {time!r}")
    return percent, units


def _number(given, unit):
    if isinstance(given, bool) or not isinstance(given, str | Real):
        return None
    try:
        return float(given.removesuffix(unit) if isinstance(given, str) else given)
    except ValueError:
        return None


def needs(materials):
    """Content of the file for `brdfc build --materials`. `materials`: as in a scene file. Includes
    the facts about lamps that the forms depend on: which have no size, and how many can be aimed
    at."""
    found = {"materials": materials}
    if sizeless := lamps.sizeless():
        found["sizeless_lamps"] = sizeless
    if pack.has_aimed():
        found["lamps"] = lamps.count()
    return found


class Planning(ToolJob):
    """Runs the program brdfc to make a Plan, while Blender stays usable."""

    failure, command = PlanError, "build"

    def __init__(self, used, error=None, time=None, fit=False):
        """`used`: {name: usage.Use}. With `error` or `time`, as for budget(), brdfc chooses the
        forms; without them each material keeps its own. `fit`: aimed forms use closures fitted to
        the materials as their base. Raises PlanError."""
        options = [] if error is None else ["--error", f"{error:.17g}"]
        options += [] if time is None else ["--time", f"{time:.17g}x"]
        materials = {name: use.entry | {"representation": use.form} for name, use in used.items()}
        if options:
            materials = {name: _open(entry) for name, entry in materials.items()}
        # Lean groups have a single form, chosen for the settings of the file.
        options += ["--osl-only", *(["--fit"] if fit else [])]
        super().__init__()
        asked = needs(materials)
        self._used, self._materials, self._lamps = used, materials, asked.get("lamps")
        content = json.dumps(asked)
        folder = self._open_folder("brdfc-lean-", {"materials.json": content})
        listed = folder / "materials.json"
        self._run("--materials", listed, "--explain", *options, "--out", folder)

    def _ended(self, status):
        if status != 0:
            raise PlanError(say("The program brdfc made no plan", more=self._last_words(status)))
        try:
            explanation = json.loads(self._said.read_text(encoding="utf-8"))
        except ValueError as bad:
            more = f"{self._program}: expected an explanation: {bad}"
            raise PlanError(say("The program brdfc made no plan", more=more)) from bad
        return Plan(self._used, self._materials, self._lamps, explanation, self._folder)


def _open(entry):
    asked = entry["representation"] in ASKED_FOR
    return entry if asked else entry | {"representation": "auto"}


class Plan:
    """What a pack for the open file alone contains, and the pack itself.

    `materials`: the materials it was made for, by name, as `materials` in a scene file; the form is
    "auto" where the budget may choose. `explanation`: the output of `brdfc build --explain`.
    """

    def __init__(self, used, materials, lamps_, explanation, folder):
        self.materials, self.explanation = materials, explanation
        self._used, self._lamps, self._folder = used, lamps_, folder
        self.pack = Path(folder.name) / "brdfc_shaders"

    def nodes(self):
        """{name: group node} in the open file. Raises ValueError if the file has changed since the
        plan was made."""
        found = usage.check(self._used)
        forms = {form["form"] for model in self.explanation["models"] for form in model["forms"]}
        if "aimed" in forms and (count := lamps.count()) != self._lamps:
            raise ValueError(
                say(
                    "The lamps have changed since the plan was made: there were {before} and there "
                    "are {after}. Make a new plan",
                    before=self._lamps,
                    after=count,
                )
            )
        return {name: use.node for name, use in found.items()}

    def lines(self):
        """What the pack contains, what it leaves out and what that saves, in words."""
        out = []
        for model in self.explanation["models"]:
            names = ", ".join(model["materials"])
            out.append(say("{model}, for {materials}", model=model["model"], materials=names))
            for choice in model["choices"]:
                known = choice["cost"] is not None
                cost = f"{choice['cost']:.2f} x" if known else say("cost not measured")
                taken = say("taken") if choice["taken"] else say("not taken")
                # The reason and the parts left out are the program's own text, which is in English.
                out.append(
                    say(
                        "    {form}, {cost}: {taken}, {why}",
                        form=choice["form"],
                        cost=cost,
                        taken=taken,
                        why=choice["why"],
                    )
                )
            out += [say("    without {part}", part=reason) for reason in model["left_out"]]
            out += [
                say(
                    "    {form}: {bytes} bytes, {operations} operations, {closures} closures, "
                    "{table_floats} numbers in tables",
                    form=form["form"],
                    **{
                        key: say("{before} to {after}", before=before, after=form["after"][key])
                        for key, before in form["before"].items()
                    },
                )
                for form in model["forms"]
            ]
        if unused := self.explanation["unused_models"]:
            names = ", ".join(unused)
            out.append(say("without the models that no material uses: {models}", models=names))
        return out


class Baking(Job):
    """Puts the lean groups of a Plan into the materials; values and links stay. The result is the
    number of nodes that now have a lean group. Steps raise ValueError where the file has changed
    since the plan was made, PlanError, CompileError and PackError."""

    def __init__(self, plan, afterwards):
        """`afterwards` is called when all groups are in place."""
        self._plan, self._afterwards = plan, afterwards
        self._made, self._steps = [], self._work()

    def step(self):
        if self.result is not None:
            return None
        try:
            return next(self._steps)
        except StopIteration:
            return None
        except BaseException:
            self.cancel()
            raise

    def cancel(self):
        self._steps.close()
        if self.result is None:
            for group in self._made:
                nodes.remove_group(group)
            self._made = []

    def _work(self):
        """Makes one group per step, then puts all of them into their nodes at once."""
        before, groups = pack.manifest(), {}
        albedo = {name: model_nodes.uses_albedo(node) for name, node in self._plan.nodes().items()}
        for name, entry in self._plan.materials.items():
            groups[name] = self._group(entry, albedo[name], before)
            yield len(groups) / len(albedo)
        found = self._plan.nodes()  # the file may have changed meanwhile
        for name, node in found.items():
            if (has := model_nodes.uses_albedo(node)) != albedo[name]:
                groups[name] = self._group(self._plan.materials[name], has, before)
        put = {node: groups[name] for name, node in found.items()}
        self._put(put)
        nodes.remove_unused_groups()
        self._afterwards()
        self.result = sum(map(model_nodes.is_baked, put))
        self.whole = len(put) - self.result

    def _put(self, groups):
        """Puts all groups into their nodes, or none. A node keeps its own group if another shader
        reads an output that the lean one lacks: Albedo, which Formula Nodes take from the twin."""
        before = {node: node.node_tree for node in groups}
        try:
            for node, group in groups.items():
                if exchange.has_linked_outputs(node, group):
                    exchange.replace_group(node, group)
        except BaseException:
            for node, group in before.items():
                exchange.replace_group(node, group)
            raise

    def _group(self, entry, albedo, before):
        with _taken(self._plan.pack):
            if pack.manifest()["generator"] != before["generator"]:
                raise PlanError(
                    say(
                        "{program} is {version}, the extension was made by {own}",
                        program=program(),
                        version=pack.manifest()["generator"],
                        own=before["generator"],
                    )
                )
            # Form.refusal() expects None for parameters that vary.
            given = {k: None if v == usage.VARIES else v for k, v in entry["parameters"].items()}
            form = pack.model(entry["model"]).resolve(entry["representation"], given)
            known = set(bpy.data.node_groups)
            group = nodes.ensure_group(
                entry["model"], form.name, baked=before["hash"], albedo=albedo
            )
        # The list of lamps may be new as well; it is removed with the last group that reads it.
        self._made += [group] if group not in known else []
        return group


@contextlib.contextmanager
def _taken(folder):
    """Uses another pack in place of the extension's for a moment; panels are never drawn
    meanwhile."""
    whole = pack.root
    pack.use(folder)
    try:
        yield
    finally:
        pack.use(whole)
