# SPDX-License-Identifier: GPL-3.0-or-later
"""Lean materials: groups of shaders that hold no more than the open file needs.

What can be left out the program brdfc knows, which the extension does not contain; see program().
"""

import contextlib
import json
import os
import re
import shutil
import sysconfig
from pathlib import Path

import bpy

from . import lamp_checks, lamps, nodes, pack
from .i18n import say
from .jobs import Job, ProgramJob

#: Forms that a budget does not choose: they are for who asks for them.
ASKED_FOR = ("twin",)


class PlanError(RuntimeError):
    """The program brdfc is missing, of another version, or refused to plan."""


def program():
    """Path of brdfc: of the extension's preferences, of the environment variable BRDFC_TOOL, found
    on the PATH, or where pip puts programs for the Python that runs. Raises PlanError."""
    addon = bpy.context.preferences.addons.get(__package__)
    named = getattr(addon.preferences, "program", "") if addon and addon.preferences else ""
    for what, path in (
        (say("the extension's preferences name it"), bpy.path.abspath(named)),
        (say("BRDFC_TOOL names it"), os.environ.get("BRDFC_TOOL", "")),
    ):
        if not path:
            continue
        # By name in a folder: so "brdfc" finds brdfc.exe on Windows with every version of Python.
        folder, name = os.path.split(path)
        if found := shutil.which(name, path=folder or None):
            return found
        raise PlanError(say("{path} is not the program brdfc; {who}", path=path, who=what))
    for folders in (None, sysconfig.get_path("scripts")):
        if found := shutil.which("brdfc", path=folders):
            return found
    raise PlanError(
        say(
            "The program brdfc was not found: give its path in the extension's preferences, or put "
            "it on the PATH"
        )
    )


def needs(materials):
    """Content of a file for `brdfc build --materials`: `materials` as those of a scene file, and
    what of the lamps of the open file its forms hang on: which have no size, and how many there
    are to aim at."""
    found = {"materials": materials}
    if sizeless := lamp_checks.sizeless_lamps():
        found["sizeless_lamps"] = sizeless
    if pack.has_aimed():
        found["lamps"] = lamps.count()
    return found


class Planning(ProgramJob):
    """The program brdfc at work on a Plan, beside Blender."""

    failure = PlanError

    def __init__(self, used, error=None, time=None, fit=False):
        """`used`: [(id, group node, entry)], entries as `materials` of a scene file has them.
        Budgets leave the form open; without one each keeps its own. `fit`: aimed forms get closures
        fitted to the materials for a base. Raises PlanError."""
        budget = error is not None or time is not None
        self._used = [(node, _open(entry) if budget else entry) for _, node, entry in used]
        options = [] if error is None else ["--error", f"{error:.17g}"]
        options += [] if time is None else ["--time", f"{time:.17g}x"]
        options += ["--fit"] if fit else []
        materials = {name: entry for (name, _, _), (_, entry) in zip(used, self._used, strict=True)}
        self._program = program()
        content = json.dumps(needs(materials))
        folder = self._open_folder("brdfc-lean-", {"materials.json": content})
        command = [self._program, "build", "--materials", folder / "materials.json", "--explain"]
        command += [*options, "--out", folder]
        self._said = folder / "said.json"
        try:
            self._start(command, self._said)
        except OSError as failed:
            more = f"{command[0]}: {failed}"
            raise PlanError(say("The program brdfc does not start", more=more)) from failed

    def _ended(self, status):
        if status != 0:
            raise PlanError(say("The program brdfc made no plan", more=self._last_words(status)))
        try:
            explanation = json.loads(self._said.read_text(encoding="utf-8"))
        except ValueError as bad:
            more = f"{self._program}: expected an explanation: {bad}"
            raise PlanError(say("The program brdfc made no plan", more=more)) from bad
        return Plan(self._used, explanation, self._folder)

    def _share(self, log):
        """Of the models that the program says it has begun."""
        counted = re.findall(r"^brdfc build: (\d+)/(\d+) ", log, re.M)
        return int(counted[-1][0]) / max(int(counted[-1][1]), 1) if counted else 0.0


def _open(entry):
    asked = entry["representation"] in ASKED_FOR
    return entry if asked else entry | {"representation": "auto"}


class Plan:
    """What a pack of the open file alone holds, and the pack."""

    def __init__(self, used, explanation, folder):
        self.used, self.explanation, self._folder = used, explanation, folder
        self.pack = Path(folder.name) / "brdfc_shaders"

    def lines(self):
        """What is taken and left out, and what that saves, in words."""
        out = []
        for model in self.explanation["models"]:
            names = ", ".join(model["materials"])
            out.append(say("{model}, for {materials}", model=model["model"], materials=names))
            for choice in model["choices"]:
                known = choice["cost"] is not None
                cost = f"{choice['cost']:.2f} x" if known else say("cost not measured")
                taken = say("taken") if choice["taken"] else say("not taken")
                # Why, and what is left out, are the program's words, which are English.
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
    """Puts the lean groups of a Plan into the materials; values and links stay. The result is how
    many nodes have one now. Steps raise PlanError, CompileError, PackError."""

    def __init__(self, plan, afterwards):
        """`afterwards` is called when all is in place."""
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
        """A group a step, and then all of them at once into their nodes."""
        before, swaps = pack.manifest(), []
        for node, entry in self._plan.used:
            with _taken(self._plan.pack):
                swaps.append((node, self._group(node, entry, before)))
            yield len(swaps) / len(self._plan.used)
        for node, group in swaps:
            nodes.replace_group(node, group)
        nodes.remove_unused_groups()
        self._afterwards()
        self.result = sum(nodes.is_baked(node) for node, _ in swaps)

    def _group(self, node, entry, before):
        if pack.manifest()["generator"] != before["generator"]:
            raise PlanError(
                say(
                    "{program} is {version}, the extension was made by {own}",
                    program=program(),
                    version=pack.manifest()["generator"],
                    own=before["generator"],
                )
            )
        # A linked value is None to pack.refusal().
        given = {k: None if isinstance(v, dict) else v for k, v in entry["parameters"].items()}
        model = entry["model"]
        form = pack.resolve(model, entry["representation"], given)
        known = set(bpy.data.node_groups)
        albedo = nodes.uses_albedo(node)
        group = nodes.ensure_group(model, form, baked=before["hash"], albedo=albedo)
        # The list of lamps, which may be new as well, goes with the last group that reads it.
        self._made += [group] if group not in known else []
        return group


@contextlib.contextmanager
def _taken(folder):
    """Another pack in place of the extension's, for a moment: panels are drawn between two."""
    whole = pack.root
    pack.use(folder)
    try:
        yield
    finally:
        pack.use(whole)
