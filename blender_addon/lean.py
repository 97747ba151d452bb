# SPDX-License-Identifier: GPL-3.0-or-later
"""Lean materials: groups of shaders that hold no more than the open file needs.

What can be left out the program brdfc knows, which the extension does not contain; see program().
"""

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import bpy

from . import checks, lamps, nodes, pack

#: Forms that a budget does not choose: they are for who asks for them.
ASKED_FOR = ("twin",)


class PlanError(RuntimeError):
    """The program brdfc is missing, of another version, or refused to plan."""


def program():
    """Path of brdfc: of the extension's preferences, of the environment variable BRDFC_TOOL, or
    found on the PATH. Raises PlanError."""
    addon = bpy.context.preferences.addons.get(__package__)
    named = getattr(addon.preferences, "program", "") if addon and addon.preferences else ""
    for what, path in (
        ("the extension's preferences", bpy.path.abspath(named)),
        ("BRDFC_TOOL", os.environ.get("BRDFC_TOOL", "")),
    ):
        if not path:
            continue
        if shutil.which(path) is None:
            raise PlanError(f"{path}: expected the program brdfc, which {what} name here")
        return path
    if found := shutil.which("brdfc"):
        return found
    raise PlanError(
        "the program brdfc was not found: give its path in the extension's preferences, or put it "
        "on the PATH"
    )


def needs(materials):
    """Content of a file for `brdfc build --materials`: `materials` as those of a scene file, and
    what of the lamps of the open file its forms hang on: which have no size, and how many there
    are to aim at."""
    found = {"materials": materials}
    if sizeless := checks.sizeless_lamps():
        found["sizeless_lamps"] = sizeless
    if pack.has_aimed():
        found["lamps"] = lamps.count()
    return found


class Plan:
    """What a pack of the open file alone holds, and the pack."""

    def __init__(self, used, error=None, time=None, fit=False):
        """`used`: [(id, group node, entry)], entries as `materials` of a scene file has them.
        Budgets leave the form open; without one each keeps its own. `fit`: aimed forms get closures
        fitted to the materials for a base. Raises PlanError."""
        self._budget = error is not None or time is not None
        self.used = [(node, self._open(entry)) for _, node, entry in used]
        options = [] if error is None else ["--error", f"{error:.17g}"]
        options += [] if time is None else ["--time", f"{time:.17g}x"]
        options += ["--fit"] if fit else []
        materials = {name: entry for (name, _, _), (_, entry) in zip(used, self.used, strict=True)}
        self._folder = tempfile.TemporaryDirectory(prefix="brdfc-lean-")
        folder = Path(self._folder.name)
        file = folder / "materials.json"
        file.write_text(json.dumps(needs(materials)), encoding="utf-8")
        command = [program(), "build", "--materials", file, "--explain", *options, "--out", folder]
        try:
            done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
        except OSError as failed:
            raise PlanError(f"{command[0]}: {failed}") from failed
        if done.returncode != 0:
            said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
            raise PlanError(said[-1])
        try:
            self.explanation = json.loads(done.stdout)
        except ValueError as bad:
            raise PlanError(f"{command[0]}: expected an explanation: {bad}") from bad
        self.pack = folder / "brdfc_shaders"

    def _open(self, entry):
        if self._budget and entry["representation"] not in ASKED_FOR:
            return entry | {"representation": "auto"}
        return entry

    def lines(self):
        """What is taken and left out, and what that saves, in words."""
        out = []
        for model in self.explanation["models"]:
            out.append(f"{model['model']}, for {', '.join(model['materials'])}")
            for choice in model["choices"]:
                cost = "cost not measured" if choice["cost"] is None else f"{choice['cost']:.2f} x"
                taken = "taken" if choice["taken"] else "not taken"
                out.append(f"    {choice['form']}, {cost}: {taken}, {choice['why']}")
            out += [f"    without {reason}" for reason in model["left_out"]]
            for form in model["forms"]:
                parts = [
                    f"{form['before'][key]} to {form['after'][key]} {words}"
                    for key, words in (
                        ("bytes", "bytes"),
                        ("operations", "operations"),
                        ("closures", "closures"),
                        ("table_floats", "numbers in tables"),
                    )
                ]
                out.append(f"    {form['form']}: {', '.join(parts)}")
        if unused := self.explanation["unused_models"]:
            out.append(f"without the models that no material uses: {', '.join(unused)}")
        return out

    def bake(self):
        """Puts the lean groups into the materials; values and links stay. Returns how many nodes
        have one now. Raises PlanError, CompileError, PackError; the file is then as it was."""
        whole, before = pack.root, pack.manifest()
        known = set(bpy.data.node_groups)
        swaps = []
        pack.use(self.pack)
        try:
            if pack.manifest()["generator"] != before["generator"]:
                raise PlanError(
                    f"{program()} is {pack.manifest()['generator']}, the extension was made by "
                    f"{before['generator']}"
                )
            for node, entry in self.used:
                model = entry["model"]
                # A linked value is None to pack.refusal().
                given = {
                    k: None if isinstance(v, dict) else v for k, v in entry["parameters"].items()
                }
                form = pack.resolve(model, entry["representation"], given)
                albedo = nodes.uses_albedo(node)
                group = nodes.ensure_group(model, form, baked=before["hash"], albedo=albedo)
                swaps.append((node, group))
        except BaseException:
            for group in set(bpy.data.node_groups) - known:
                nodes.remove_group(group)
            raise
        finally:
            pack.use(whole)
        for node, group in swaps:
            nodes.replace_group(node, group)
        nodes.remove_unused_groups()
        return sum(nodes.is_baked(node) for node, _ in swaps)
