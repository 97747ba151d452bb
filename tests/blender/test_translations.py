# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in other languages. The bpy module is built without translations
(bpy.app.build_options.international is False). So texts that Blender would look up are read from
the registered classes, and texts that the extension looks up are taken from the catalogues."""

import copy
import inspect
from importlib import import_module

import bpy
import helpers
import pytest

LOCALES = ("de_DE", "ja_JP")


@pytest.fixture
def i18n(extension):
    return import_module(f"{extension.package}.common.i18n")


@pytest.fixture
def speak(i18n, monkeypatch):
    """speak(locale): simulates Blender's look-up in that language."""

    def use(locale):
        known = i18n.catalogues()[locale]
        monkeypatch.setattr(i18n, "_look_up", lambda kind, text: known.get(("*", text), text))

    return use


@pytest.fixture
def phong(extension, empty):
    mesh = bpy.data.meshes.new("m")
    mesh.materials.append(extension.api.new_material("phong", "fitted"))
    item = bpy.data.objects.new("o", mesh)
    empty.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    return mesh.materials[0]


def classes(extension):
    """Every class of the extension that Blender draws."""
    kinds = (bpy.types.Operator, bpy.types.Panel, bpy.types.Menu, bpy.types.AddonPreferences)
    drawn = [
        import_module(f"{extension.package}.{name}") for name in ("panels.ui", "panels.plot_panel")
    ]
    yield from extension.ui._SUBMENUS
    for module in (*drawn, *helpers.modules_of_operators(extension)):
        for _, found in inspect.getmembers(module, inspect.isclass):
            if (
                issubclass(found, kinds)
                and found.__module__ == module.__name__
                and found.is_registered
            ):
                yield found


def looked_up(found):
    """(context, text) that Blender looks up for a registered class."""
    rna = found.bl_rna
    if hasattr(found, "bl_label"):
        yield rna.translation_context, found.bl_label
    if issubclass(found, bpy.types.Operator) and not hasattr(found, "description"):
        yield "*", rna.description
    names = {name for base in found.__mro__ for name in vars(base).get("__annotations__", ())}
    for prop in rna.properties:
        if prop.identifier in names and not prop.is_hidden:
            yield prop.translation_context, prop.name
            yield "*", prop.description


@pytest.mark.parametrize("locale", LOCALES)
def test_what_blender_looks_up_is_in_the_catalogue(extension, i18n, locale):
    known = i18n.catalogues()[locale]
    asked = {key for found in classes(extension) for key in looked_up(found)}
    assert ("Operator", "Turn On OSL") in asked
    assert ("*", "Reflection Model") in asked and ("*", "Program brdfc") in asked
    names = {"", "brdfc", "Text"}
    assert not {key for key in asked if key[1] not in names} - known.keys()


def test_tooltips_have_no_line_breaks(extension):
    for found in classes(extension):
        assert all("\n" not in text for _, text in looked_up(found)), found


@pytest.mark.parametrize(
    ("locale", "error", "cost", "off"),
    [
        ("de_DE", "Fehler: ", "Kosten: ", "Open Shading Language ist aus"),
        ("ja_JP", "誤差: ", "コスト: ", "Open Shading Language が無効です"),
    ],
)
def test_the_panel_in_other_languages(extension, empty, phong, speak, locale, error, cost, off):
    empty.cycles.shading_system = False
    english = helpers.Layout()
    extension.ui.draw_material(english, phong, empty)
    speak(locale)
    layout = helpers.Layout()
    extension.ui.draw_material(layout, phong, empty)
    text = "\n".join(layout.log)
    for part in (error, cost):
        assert part in text
    assert off.replace(" ", "") in "".join(text.split()), "over two lines"
    assert "Language is off" not in text and "Language is off" in " ".join(english.log)
    # Names of models and parameters are those of the papers.
    assert extension.pack.model("phong").label in text
    for label in (p["label"] for p in extension.pack.model("phong").parameters.values()):
        assert label in text
    (finding,) = [f for f in extension.api.warnings(phong, empty) if f.code == "osl_off"]
    assert finding.message.startswith("Open Shading Language is off"), "scripts have English"


def test_reports_in_german(extension, empty, speak):
    speak("de_DE")
    with pytest.raises(RuntimeError, match="Kein Material dieser Datei hat ein Reflexionsmodell"):
        bpy.ops.brdfc.bake()
    with pytest.raises(ValueError, match="No material of this file"):
        extension.api.plan()


def test_sentences_within_sentences(i18n, speak):
    inner = i18n.say("{socket} is animated", socket=i18n.Sentence("IOR"))
    outer = i18n.say("{material}, {node}: stays, {why}", material="M", node="Glass", why=inner)
    assert outer == "M, Glass: stays, IOR is animated"
    assert i18n.iface(copy.deepcopy(outer)) == outer
    speak("de_DE")
    assert i18n.iface(outer) == "M, Glass: bleibt, IOR ist animiert"
    assert i18n.iface("another text") == "another text"


def test_what_is_behind_a_sentence(extension, i18n, phong, empty):
    """Scripts get one text with everything, users a sentence and a button."""
    group = extension.model_nodes.group_nodes(phong)[0].node_tree
    script = next(n for n in group.nodes if n.bl_idname == "ShaderNodeScript")
    group.nodes.remove(script)
    (finding,) = [f for f in extension.api.warnings(phong, empty) if f.code == "script_failed"]
    assert finding.message.endswith(": has no script node")
    assert i18n.iface(finding.message).endswith("choose its render method again to make it anew")
    layout = helpers.Layout()
    extension.ui.draw_findings(layout, extension.checks.warnings(phong, empty))
    assert "operator brdfc.more " in layout.log
    assert "script node" not in "\n".join(layout.log)
    assert bpy.ops.brdfc.more(text="behind") == {"FINISHED"}
    # The suggested action fixes it.
    node = extension.model_nodes.group_nodes(phong)[0]
    assert bpy.ops.brdfc.switch(node=node.name, representation="fitted") == {"FINISHED"}
    assert "script_failed" not in {f.code for f in extension.api.warnings(phong, empty)}


@pytest.mark.parametrize("locale", [None, *LOCALES])
def test_lines_fit_the_panel(extension, i18n, locale):
    labels = import_module(f"{extension.package}.panels.labels")
    texts = (
        i18n.catalogues()[locale].values() if locale else [k[1] for k in i18n.catalogues()["de_DE"]]
    )
    for text in texts:
        lines = labels.lines_of(text, labels.room())
        assert "".join("".join(lines).split()) == "".join(text.split())
        for line in lines:
            # A word that can't be broken may exceed the width.
            assert labels.width(line) <= labels.room() or " " not in line, line
            assert not line.startswith(tuple(labels._CLOSING)), line


def test_percentages_have_two_digits_and_no_exponent(i18n):
    shares = {
        0.0025: "0.25",
        0.123: "12",
        0.994: "99",
        0.996: "100",
        12.3: "1230",
        0: "0",
        3e-17: "0",
    }
    assert {share: i18n.in_percent(share) for share in shares} == shares
