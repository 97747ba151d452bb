# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of Blender's own materials to the nearest model, and back."""

from importlib import import_module
from types import SimpleNamespace

import bpy
import helpers
import numpy as np
import pytest
from converting import (
    KINDS,
    OUTPUT,
    driven,
    flat,
    keyed,
    linked,
    material_of,
    only,
    picture_node,
    played,
)
from goniometer import Goniometer, tilted, unit

GOLD = (0.9, 0.6, 0.2)
BRIGHT = (1.5, 1.0, 0.5)


def nearest_model(convert):
    return import_module("..nearest.nearest_model", convert.__package__)


def misplaced_light(convert):
    return import_module("..nearest.misplaced_light", convert.__package__)


def test_no_other_model_is_examined_where_one_has_the_nodes_formulas(convert, monkeypatch):
    # A hundred different nodes took eight seconds.
    module = nearest_model(convert)
    bsdf = module.native_bsdf.Native
    monkeypatch.setattr(module, "_rough_width", lambda *_: pytest.fail("searched for a width"))
    for native in (
        bsdf("principled", GOLD, 0.43, metallic=1.0),
        bsdf("principled", GOLD, 0.43),
        bsdf("diffuse", GOLD),
    ):
        fit = module.nearest((native,), (), True, lambda model, values: True)
        assert fit.candidate.is_own and fit.found == ()
    with pytest.raises(pytest.fail.Exception):
        module.nearest(
            (bsdf("principled", GOLD, 0.43, metallic=0.5),), (), False, lambda model, values: True
        )


# ---- what Blender's nodes are taken for ----------------------------------------------------------

UNDER_A_SUN = [
    ("diffuse", None, {"Color": GOLD, "Roughness": 0.0}),
    ("diffuse", None, {"Color": GOLD, "Roughness": 0.7}),
    ("glossy", "GGX", {"Color": GOLD, "Roughness": 0.5}),
    ("glossy", "BECKMANN", {"Color": GOLD, "Roughness": 0.5}),
    ("glossy", "MULTI_GGX", {"Color": GOLD, "Roughness": 0.8}),
    ("principled", "GGX", {"Base_Color": GOLD, "Roughness": 0.5, "IOR": 1.6}),
    ("principled", "MULTI_GGX", {"Base_Color": GOLD, "Roughness": 0.6, "Metallic": 1.0}),
    ("principled", "GGX", {"Base_Color": GOLD, "Roughness": 0.5, "Metallic": 0.5}),
    # The light that rough facets hide, or reflect more than once, is not the base's.
    ("principled", "GGX", {"Base_Color": GOLD, "Roughness": 0.9}),
    ("principled", "MULTI_GGX", {"Base_Color": GOLD, "Roughness": 0.9}),
    ("principled", "MULTI_GGX", {"Base_Color": (0.0, 0.0, 0.0), "Roughness": 0.9, "IOR": 2.0}),
    # Interfaces whose Fresnel term falls before it rises, which Cycles' does not; importers of glTF
    # set the last IOR.
    *(
        ("principled", "MULTI_GGX", {"Base_Color": (0.3, 0.1, 0.0), "Roughness": 0.3, **inputs})
        for inputs in (
            {"IOR": 5.0},
            {"IOR": 8.0, "Specular_Tint": (1.0, 0.5, 0.1)},
            {"IOR": 20.0, "Specular_IOR_Level": 1.0},
            {"IOR": 1000.0, "Specular_Tint": (0.9, 0.5, 0.1)},
        )
    ),
    # An edge tint, which makes the reflectance of dark metal 0 at grazing views.
    *(
        (
            "principled",
            kind,
            {
                "Base_Color": color,
                "Metallic": 1.0,
                "Specular_Tint": (0.0, 0.5, 1.0),
                "Roughness": 0.3,
            },
        )
        for kind in ("GGX", "MULTI_GGX")
        for color in (GOLD, (0.05, 0.05, 0.05))
    ),
    # A tint of a dielectric at normal incidence. The base loses what the brightest channel takes.
    *(
        (
            "principled",
            kind,
            {
                "Base_Color": color,
                "Specular_Tint": (0.1, 0.5, tint),
                "Roughness": roughness,
                "IOR": 1.8,
            },
        )
        for kind in ("GGX", "MULTI_GGX")
        for color, tint, roughness in ((GOLD, 0.9, 0.3), ((0.0, 0.0, 0.0), 1.8, 0.8))
    ),
    # Colours above 1: all of some nodes, only the base of others.
    ("diffuse", None, {"Color": BRIGHT, "Roughness": 0.0}),
    ("diffuse", None, {"Color": BRIGHT, "Roughness": 0.7}),
    ("glossy", "MULTI_GGX", {"Color": BRIGHT, "Roughness": 0.8}),
    ("principled", "GGX", {"Base_Color": BRIGHT, "Roughness": 0.5, "Diffuse_Roughness": 0.6}),
    ("principled", "MULTI_GGX", {"Base_Color": BRIGHT, "Roughness": 0.6, "Metallic": 1.0}),
    ("principled", "MULTI_GGX", {"Base_Color": BRIGHT, "Roughness": 0.6, "Metallic": 0.5}),
]


@pytest.mark.parametrize(("kind", "distribution", "inputs"), UNDER_A_SUN)
def test_a_node_is_what_it_is_taken_for(extension, convert, empty, kind, distribution, inputs):
    material, node = material_of(kind, distribution, **inputs)
    (native,) = convert.natives(node)
    empty.cycles.shading_system = False  # as in new files
    rng = np.random.default_rng(3)
    cosines = rng.choice(misplaced_light(convert).VIEWS, 200)
    empty.cycles.max_bounces = 0
    meter = Goniometer(empty, material, tilted(cosines, rng.uniform(0, 6.28, 200)), 4)
    wi = meter.local(meter.add_sun(unit((0.4, -0.3, 0.85))))
    measured, wo = meter.measure(), meter.wo()
    lit = wi[:, 2] > 1e-2
    wi, wo = wi[lit], wo[lit]
    each, which = np.unique(wo, axis=0, return_inverse=True)
    expected = nearest_model(convert).native_bsdf.f_cos(native, wi, wo, (each, which.ravel()))
    error = np.abs(measured[lit] - expected).sum() / expected.sum()
    print(f"{kind} {distribution} {inputs}: relative L1 {error:.2g}")
    # Cycles takes these albedos from its own tables, which are coarse.
    tabled = kind == "principled" or distribution == "MULTI_GGX"
    assert error < (4e-3 if tabled else 1e-5)


# ---- which model, and how near -------------------------------------------------------------------


def test_the_setting_of_osl_counts_when_it_is_changed(extension, convert, empty, monkeypatch):
    """Formula Nodes lack a choice of Ashikhmin and Shirley's model that plastic is nearest to, as
    long as there is no layer over a base."""
    monkeypatch.setattr(nearest_model(convert), "_layered", lambda native, has: ())
    material, _ = material_of("principled", "GGX", Roughness=0.41)  # which no other test looks for
    chosen = []
    for osl in (False, True, False):
        empty.cycles.shading_system = osl
        (plan,) = extension.api.plan_conversion([material])
        chosen.append((plan.model, plan.values["diffuse"]))
    assert chosen == [("ashikhmin_shirley", c) for c in ("paper", "tabulated", "paper")]


def test_what_is_a_model_already_is_off_by_nothing(extension, convert):
    plan = only(convert.plan([material_of("diffuse", Color=GOLD)[0]]))
    assert plan.model == "lambert" and plan.error < 1e-6
    assert plan.values["rho"] == pytest.approx(GOLD, rel=1e-6)
    plan = only(convert.plan([material_of("glass", Color=(1.0, 1.0, 1.0), IOR=1.33)[0]]))
    assert (plan.model, plan.error) == ("fresnel_dielectric", 0)
    assert plan.values["ior"] == pytest.approx(1.33)


@pytest.mark.parametrize(
    ("kind", "inputs", "models", "worst"),
    [
        ("diffuse", {"Roughness": 0.5}, {"eon"}, 0.02),
        ("glossy", {"Roughness": 0.3}, {"microfacet"}, 0.05),
        ("glossy", {"Roughness": 0.0, "Color": (0.5, 0.5, 0.5)}, {"lambertian_specular"}, 1e-6),
        ("principled", {"Roughness": 0.4}, {"microfacet"}, 0.01),
        ("principled", {"Roughness": 0.4, "Diffuse_Roughness": 0.5}, {"microfacet"}, 0.03),
        ("principled", {"Roughness": 0.0}, {"coupled"}, 0.1),
        ("principled", {"Roughness": 0.4, "IOR": 1.0}, {"lambert"}, 1e-6),
        # Coloured mirrors.
        ("glossy", {"Roughness": 0.0, "Color": GOLD}, {"max_phong"}, 0.02),
        ("principled", {"Roughness": 0.0, "Metallic": 1.0, "Base_Color": GOLD}, {"schlick"}, 1e-6),
        (
            "principled",
            {"Roughness": 0.0, "Metallic": 0.5, "Base_Color": GOLD},
            {"coupled"},
            0.05,
        ),
        (
            "principled",
            {"Roughness": 0.3, "Metallic": 1.0},
            {"microfacet"},
            0.03,
        ),
    ],
)
def test_the_nearest_model(extension, convert, kind, inputs, models, worst):
    plan = only(convert.plan([material_of(kind, **inputs)[0]]))
    print(plan.line(), plan.values)
    assert plan.model in models
    assert plan.error < worst
    said = f"{100 * plan.error:.2g} % of the light in other" if plan.error > 1e-6 else "the same"
    assert said in plan.line()
    # Any other width must be worse.
    (native,) = convert.natives(plan.node)
    if plan.metal:
        return
    target, base = misplaced_light(convert).Target(native), None
    if plan.base:
        base = nearest_model(convert).Base(plan.base.model, plan.base.values, plan.rest)
    seen = target.error(plan.model, plan.values, base, plan.scale)
    assert seen == pytest.approx(plan.error, rel=1e-9)
    least = target.misplaced(plan.model, plan.values, base, plan.scale)
    for candidate in nearest_model(convert).candidates(native):
        if candidate.model == plan.model and candidate.width:
            for factor in (0.7, 1.4):
                other = dict(plan.values)
                other[candidate.width.name] *= factor
                assert target.misplaced(plan.model, other, base, plan.scale) >= least - 1e-6


@pytest.mark.sample(3)
@pytest.mark.parametrize("ior", [1.3, 1.5, 2.0])
@pytest.mark.parametrize("roughness", [0.1, 0.2, 0.5, 1.0])
def test_plastic_is_near_without_osl(convert, empty, roughness, ior):
    """A layer of microfacets over a matte base, which has the light that the layer leaves. For a
    black base only the two Fresnel terms differ."""
    empty.cycles.shading_system = False
    for color, worst in ((0.8, 0.015), (0.2, 0.035), (0.0, 0.1)):
        inputs = {"Base_Color": (color,) * 3, "Roughness": roughness, "IOR": ior}
        plan = only(convert.plan([material_of("principled", "GGX", **inputs)[0]]))
        print(plan.line(), plan.values)
        assert (plan.model, plan.base.model) == ("microfacet", "lambert")
        assert plan.error < worst


@pytest.mark.many
@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.6])
@pytest.mark.parametrize(
    "inputs",
    [
        {"IOR": 8.0},
        {"IOR": 4.0, "Specular_IOR_Level": 1.0},
        {"IOR": 1000.0, "Specular_Tint": (0.9, 0.5, 0.1)},
    ],
)
def test_a_picture_of_a_high_ior_is_as_before(extension, convert, empty, inputs, roughness):
    """In a white world, seen from 60 degrees above the horizon."""
    material, node = material_of(
        "principled", "MULTI_GGX", Base_Color=(0.5, 0.3, 0.1), Roughness=roughness, **inputs
    )
    bent = linked(material, node, "Normal", "ShaderNodeCombineXYZ")
    for i, value in enumerate((0.5, -0.866, 0.0)):
        bent.inputs[i].default_value = value
    before = flat(empty, material)
    plan = only(convert.plan([material]))
    print(plan.line())
    assert plan.error < 0.01
    assert convert.apply([plan]) == 1
    after = flat(empty, material)
    print(f"{before} and {after}")
    assert np.abs(np.array(after) - before).max() < 0.006


@pytest.mark.many
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("roughness", [0.3, "linked"])
@pytest.mark.parametrize("normal", [(0.3, -0.8, 0.5), (0.9, 0.1, 0.4)], ids=["bent", "away"])
def test_a_picture_of_plastic_is_as_before(extension, convert, empty, normal, roughness, osl):
    """In a white world, with a bent normal, also one that faces away from the viewer, which Cycles
    bends back, and back again."""
    if normal[1] > 0 and bpy.app.version >= (5, 0):
        pytest.skip("Blender 5 reflects up to 0.01 more than microfacets about such a normal")
    material, node = material_of("principled", "GGX", Base_Color=(0.5, 0.3, 0.1), Roughness=0.3)
    bent = linked(material, node, "Normal", "ShaderNodeCombineXYZ")
    for i, value in enumerate(normal):
        bent.inputs[i].default_value = value
    if roughness == "linked":
        picture = picture_node(material.node_tree, (0.2, 0.2, 0.2), (0.9, 0.9, 0.9))
        material.node_tree.links.new(picture.outputs["Color"], node.inputs["Roughness"])
    before = flat(empty, material)
    if osl:
        extension.api.enable_osl(empty)
    plan = only(convert.plan([material]))
    print(plan.line())
    assert plan.base and plan.base.links == {"rho": "Base Color"}
    names = {n.name for n in material.node_tree.nodes}
    assert convert.apply([plan]) == 1
    after = flat(empty, material)
    print(f"{before} and {after}")
    # Bent back, the normal is at 45 degrees. Only the layer is left there, whose Fresnel term is
    # Schlick's; and the polynomial in two numbers is less exact.
    away = 0.065 if roughness == "linked" else 0.025
    worst = away if normal[1] > 0 else 0.02
    for x, y in zip(before, after, strict=True):
        assert y == pytest.approx(x, rel=worst)
    assert convert.restore(material) == 1
    assert {n.name for n in material.node_tree.nodes} == names
    assert np.array(flat(empty, material)) == pytest.approx(np.array(before), rel=1e-3)


@pytest.mark.parametrize(("roughness", "anisotropic"), [(0.4, 0.8), (0.6, 0.8), (0.8, 1.0)])
def test_an_anisotropic_metal_is_the_microfacet_model(convert, roughness, anisotropic):
    """Also where Cycles clamps the width across or along the tangent to 1."""
    metal = {"Base_Color": GOLD, "Metallic": 1.0, "Anisotropic": anisotropic}
    material, _ = material_of("principled", "MULTI_GGX", Roughness=roughness, **metal)
    plan = only(convert.plan([material]))
    aspect = (1 - 0.9 * anisotropic) ** 0.5
    wide, narrow = min(roughness**2 / aspect, 1), roughness**2 * aspect
    print(plan.line(), plan.values)
    assert plan.model == "microfacet" and plan.error < 2e-3
    assert plan.values["ax"] == pytest.approx(wide, rel=0.01)
    assert plan.values["ay"] == pytest.approx(narrow, rel=0.01)


@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX", "BECKMANN"])
@pytest.mark.parametrize("anisotropy", [0.0, 0.8])
def test_a_glossy_node_has_no_fresnel_term(convert, distribution, anisotropy):
    """The Edge Tint of the model makes it flat up to grazing angles."""
    glossy = {"Color": (0.5, 0.3, 0.2), "Roughness": 0.8, "Anisotropy": anisotropy}
    plan = only(convert.plan([material_of("glossy", distribution, **glossy)[0]]))
    print(plan.line(), plan.values)
    assert plan.model == "microfacet" and plan.error < 0.01
    assert plan.scale == pytest.approx(0.5) and plan.values["tint"][2] < 0.6


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_a_metal_is_the_microfacet_model(convert, roughness):
    """Also the interreflection that Multiscatter GGX adds."""
    for distribution, chosen, worst in (
        ("GGX", None, 1e-6),
        ("MULTI_GGX", "multiscatter_ggx", 2e-3),
    ):
        material, _ = material_of(
            "principled", distribution, Base_Color=GOLD, Metallic=1.0, Roughness=roughness
        )
        plan = only(convert.plan([material]))
        print(distribution, plan.line(), plan.values)
        assert plan.model == "microfacet" and plan.error < worst
        assert plan.values.get("distribution") == chosen
        assert plan.values["ax"] == plan.values["ay"] == pytest.approx(roughness**2, rel=0.01)
        assert plan.values["f0"] == pytest.approx(GOLD)


@pytest.mark.slow
@pytest.mark.many
@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
@pytest.mark.parametrize("color", [(0.05, 0.05, 0.05), (0.05, 0.03, 0.01), GOLD])
def test_a_dark_glossy_node_is_near(extension, convert, empty, color, distribution):
    """The model of a bright colour, dimmed: it does not get bright at grazing angles. A linked
    colour is so as well, by nodes."""
    empty.cycles.shading_system = False  # as in new files
    errors = []
    for link in (False, True):
        material, node = material_of("glossy", distribution, Color=color, Roughness=0.3)
        if link:
            picture = picture_node(material.node_tree, color, color)
            picture.image.pixels[:4] = 0.0, 0.0, 0.0, 1.0  # not of a single colour
            material.node_tree.links.new(picture.outputs["Color"], node.inputs["Color"])
        before = flat(empty, material)[1]
        plan = only(extension.api.plan_conversion([material]))
        print(plan.line(), plan.values, plan.scale)
        errors.append(plan.error)
        assert plan.model == "microfacet" and bool(plan.flat) == link
        assert extension.api.convert_materials([plan]) == 1
        after = flat(empty, material)[1]
        print(f"{before} and {after}")
        assert after == pytest.approx(before, rel=0.015)
        assert convert.restore(material) == 1
        assert len(material.node_tree.nodes) == 2 + link
    assert max(errors) < 0.025


@pytest.mark.many
@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
@pytest.mark.parametrize(
    ("inputs", "worst"),
    [
        ({"Roughness": 0.3}, 0.03),
        ({"Roughness": 0.6, "Base_Color": (0.0, 0.0, 0.0)}, 0.13),
        ({"Roughness": 0.4, "Metallic": 0.3}, 0.04),
    ],
)
def test_a_tinted_plastic_is_near(extension, convert, empty, inputs, worst, distribution):
    """The tint colours the reflectance at normal incidence."""
    empty.cycles.shading_system = False  # as in new files
    tinted = {"Specular_Tint": (1.0, 0.5, 0.1), "IOR": 1.7, "Base_Color": (0.4, 0.3, 0.2)} | inputs
    material, _ = material_of("principled", distribution, **tinted)
    before = flat(empty, material)[0]
    plan = only(extension.api.plan_conversion([material]))
    print(plan.line(), plan.values)
    assert not plan.refusal and plan.error < worst
    red, green, blue = plan.values["f0"]
    assert blue < 0.3 * green < 0.3 * red
    assert extension.api.convert_materials([plan]) == 1
    after = flat(empty, material)[0]
    print(f"{before} and {after}")
    assert after == pytest.approx(before, rel=max(1.5 * worst, 0.03))


def test_beckmann_is_the_microfacet_model(convert):
    plan = only(
        convert.plan([material_of("glossy", "BECKMANN", Color=(1.0, 1.0, 1.0), Roughness=0.5)[0]])
    )
    assert plan.values["distribution"] == "beckmann" and plan.error < 1e-6


def test_a_plan_computes_interreflection_once(extension, convert, empty, monkeypatch):
    """For each width that was tried it was computed anew: two fifths of the time of a plan."""
    bsdf = import_module(f"{extension.package}.nearest.native_bsdf")
    calls, albedo = [], bsdf.facet_albedo
    monkeypatch.setattr(bsdf, "facet_albedo", lambda *a: calls.append(a) or albedo(*a))
    # A roughness that no other test has, as results are kept.
    plan = only(convert.plan([material_of("principled", Metallic=1.0, Roughness=0.4321)[0]]))
    assert plan.model == "microfacet" and plan.values["distribution"] == "multiscatter_ggx"
    assert 0 < len(calls) < 8


def test_a_plan_samples_facets_once_for_each_set_of_views(extension, convert, empty, monkeypatch):
    """Albedos of one surface share the samples: at its plan's views, at those of the layer's
    polynomial, and of the mean over all views."""
    native_bsdf, drawn = import_module(f"{extension.package}.nearest.native_bsdf"), []
    real = native_bsdf.draw_facets

    def draw_facets(u, alpha, *more):
        drawn.append(len(u))
        return real(u, alpha, *more)

    monkeypatch.setattr(native_bsdf, "draw_facets", draw_facets)
    # A roughness that no other test has, as results are kept.
    material, _ = material_of("principled", "MULTI_GGX", Base_Color=GOLD, Roughness=0.5678)
    assert not only(convert.plan([material])).refusal
    of_albedos = [count for count in drawn if count > 1000]  # fewer are light directions
    assert len(of_albedos) == 3


@pytest.mark.parametrize("alpha", [0.2, 0.5, 1.0])
def test_white_facets_lose_no_light(extension, convert, alpha):
    """Of multiscatter_ggx, whose albedo has no closed form."""
    formula = import_module("..brdfc", convert.__package__).model("microfacet")
    nodes, weights = np.polynomial.legendre.leggauss(200)
    z, phi = np.meshgrid((nodes + 1) / 2, 2 * np.pi * (np.arange(400) + 0.5) / 400, indexing="ij")
    r = np.sqrt(1 - z * z)
    wi = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).reshape(-1, 3)
    weight = (weights[:, None] / 2 * z * 2 * np.pi / 400).ravel()
    values = {"f0": 1.0, "ax": alpha, "ay": alpha, "distribution": "multiscatter_ggx"}
    for c in (1.0, 0.7, 0.4, 0.1):
        wo = np.broadcast_to([np.sqrt(1 - c * c), 0, c], wi.shape)
        albedo = weight @ formula.eval(wi, wo, **values)
        print(f"alpha {alpha}, cosine {c}: {albedo[0]:.5f}")
        assert albedo == pytest.approx(1, abs=1e-3)


@pytest.mark.many
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("roughness", [0.8, "linked"])
def test_a_picture_of_a_rough_metal_is_as_before(extension, convert, empty, roughness, osl):
    """In a white world, with a linked colour, and back again."""
    material, node = material_of("principled", "MULTI_GGX", Metallic=1.0, Roughness=0.8)
    tree = material.node_tree
    picture = picture_node(tree, (0.9, 0.6, 0.2), (0.4, 0.9, 1.0))
    tree.links.new(picture.outputs["Color"], node.inputs["Base Color"])
    if roughness == "linked":
        other = picture_node(tree, (0.5, 0.5, 0.5), (0.9, 0.9, 0.9))
        tree.links.new(other.outputs["Color"], node.inputs["Roughness"])
    names = {n.name for n in tree.nodes}
    before = flat(empty, material)
    if osl:
        extension.api.enable_osl(empty)
    plan = only(convert.plan([material]))
    print(plan.line())
    assert convert.apply([plan]) == 1
    after = flat(empty, material)
    print(f"{before} and {after}")
    for x, y in zip(before, after, strict=True):
        assert y == pytest.approx(x, rel=0.01)
    assert convert.restore(material) == 1
    assert {n.name for n in tree.nodes} == names


FOLLOWED = {
    "Specular IOR Level": ((0.03, 0.03, 0.03), (1.4, 1.4, 1.4)),
    "Specular Tint": ((1.0, 0.6, 0.1), (0.1, 0.3, 0.2)),
    "Diffuse Roughness": ((0.1, 0.1, 0.1), (0.9, 0.9, 0.9)),
}


@pytest.mark.many
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
@pytest.mark.parametrize("socket", FOLLOWED)
def test_a_plastic_follows_its_linked_inputs(extension, convert, empty, socket, distribution, osl):
    """In a white world: as plastics with these values do, whose errors other tests compare with
    pictures; and back again."""
    given, held = {"Base_Color": GOLD, "Roughness": 0.4}, FOLLOWED[socket]
    material, node = material_of("principled", distribution, **given)
    tree = material.node_tree
    picture = picture_node(tree, *held)
    tree.links.new(picture.outputs["Color"], node.inputs[socket])
    names = {n.name for n in tree.nodes}
    empty.cycles.shading_system = osl
    before = flat(empty, material)
    plan = only(extension.api.plan_conversion([material]))
    print(plan.line())
    assert extension.api.convert_materials([plan]) == 1 and plan.error < 0.03
    after = flat(empty, material)
    for i, value in enumerate(held):
        alone, other = material_of("principled", distribution, **given)
        is_color = other.inputs[socket].type == "RGBA"
        other.inputs[socket].default_value = (*value, 1.0) if is_color else value[0]
        assert extension.api.convert_materials(extension.api.plan_conversion([alone])) == 1
        wanted = flat(empty, alone)[i]
        print(f"{value}: Blender {before[i]}, as one value {wanted}, linked {after[i]}")
        assert after[i] == pytest.approx(wanted, abs=0.001)
    assert convert.restore(material) == 1
    assert {n.name for n in tree.nodes} == names


CLEAR = {"Transmission_Weight": 1.0, "Roughness": 0.0, "IOR": 1.4}


def ball_before_a_sky(scene, material, size, samples, osl):
    """A ball that light may pass through, before a sky whose colour is its direction."""
    helpers.sphere_scene(scene, material, size=size, samples=samples)
    tree = scene.world.node_tree
    back = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], back.inputs["Color"])
    scene.cycles.shading_system, scene.cycles.max_bounces = osl, 12


@pytest.mark.many
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize(
    ("color", "more"),
    [
        ((1.0, 1.0, 1.0), {}),
        ((0.9, 0.3, 0.1), {"Alpha": 0.6, "Emission_Strength": 0.1}),
    ],
)
def test_a_picture_of_clear_plastic_is_that_of_glass(extension, convert, empty, color, more, osl):
    """A Principled node that transmits everything: a ball before a sky of two colours."""
    material, node = material_of("principled", "GGX", Base_Color=color, **CLEAR, **more)
    ball_before_a_sky(empty, material, 24, 512, osl)

    def ball():
        """Blocks of pixels of the ball, for less noise where the alpha chooses paths."""
        return helpers.render(empty)[6:18, 6:18, :3].reshape(3, 4, 3, 4, 3).mean((1, 3))

    before = ball()
    plan = only(extension.api.plan_conversion([material]))
    assert (plan.model, plan.values["ior"]) == ("fresnel_dielectric", pytest.approx(1.4))
    assert plan.error == 0
    assert extension.api.convert_materials([plan]) == 1
    off = np.abs(ball() - before).sum() / before.sum()
    print(f"{color} {more}: {off:.3g}, said {plan.error:.3g}")
    # Where the alpha chooses paths, another seed changes 3 %.
    assert off < (0.04 if more else 0.005)
    assert convert.restore(material) == 1 and node.outputs[0].is_linked


@pytest.mark.parametrize("color", [(1.0, 0.7, 0.3), (0.8, 0.1, 0.1)])
@pytest.mark.parametrize(
    ("roughness", "model"), [(0.1, "blinn"), (0.3, "blinn"), (0.5, "microfacet")]
)
def test_a_coloured_beckmann_node_takes_the_nearer_lobe(
    extension, convert, color, roughness, model
):
    """`microfacet` has the node's own facets, but reflects a colour that changes with the angle;
    `blinn` has one colour, and nearly the same lobe if it is narrow."""
    (plan,) = convert.plan([material_of("glossy", "BECKMANN", Color=color, Roughness=roughness)[0]])
    errors = {}
    for name in ("blinn", "microfacet"):
        node = material_of("glossy", "BECKMANN", Color=color, Roughness=roughness)[1]
        fit = nearest_model(convert).nearest(
            tuple(convert.natives(node)), (color,), False, lambda m, _, name=name: m == name
        )
        (((_, errors[name]),),) = fit.found
    print(errors, plan.line())
    assert plan.model == model == min(errors, key=errors.get)
    assert plan.error == pytest.approx(errors[model], abs=1e-6) and plan.error < 0.011


def tinted_glass(kind, color):
    """Glass of a colour; None: one that varies over the surface, beyond 0 and 1."""
    given = {"Roughness": 0.0, "IOR": 1.4} if kind == "glass" else CLEAR
    name = "Color" if kind == "glass" else "Base_Color"
    material, node = material_of(kind, "GGX", **given, **({name: color} if color else {}))
    if not color:
        tree = material.node_tree
        place = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        wider = tree.nodes.new("ShaderNodeVectorMath")
        wider.operation, wider.inputs[1].default_value = "MULTIPLY_ADD", (1.4, 1.4, 1.4)
        wider.inputs[2].default_value = (-0.2, -0.2, -0.2)
        tree.links.new(place, wider.inputs[0])
        tree.links.new(wider.outputs[0], node.inputs[name.replace("_", " ")])
    return material, node


@pytest.mark.many
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("color", [(0.8, 0.8, 0.8), (0.9, 0.3, 0.05), None])
@pytest.mark.parametrize("kind", ["glass", "principled"])
def test_tinted_glass_is_the_same_block_by_block(extension, convert, empty, kind, color, osl):
    """A Glass node tints what it reflects and refracts; a Principled node what it refracts."""
    material, node = tinted_glass(kind, color)
    ball_before_a_sky(empty, material, 48, 64, osl)

    def blocks():
        """Means of 8 x 8 pixels."""
        return helpers.render(empty)[..., :3].reshape(6, 8, 6, 8, 3).mean((1, 3))

    before = blocks()
    plan = only(extension.api.plan_conversion([material]))
    print(plan.line(), plan.values)
    assert (plan.model, plan.error) == ("fresnel_dielectric", 0)
    assert extension.api.convert_materials([plan]) == 1
    off = np.abs(blocks() - before)
    print(f"mean {off.sum() / before.sum():.2g}, worst block {off.max():.2g} of {before.max():.2g}")
    assert off.max() < 0.004 and off.sum() < 0.002 * before.sum()
    assert convert.restore(material) == 1 and node.outputs[0].is_linked


TINTED = [
    (GOLD, 0.3, 0.02),
    (GOLD, 0.0, 0.025),
    ((0.95, 0.9, 0.8), 0.5, 0.003),
    ((0.1, 0.1, 0.1), 0.3, 0.1),
]


@pytest.mark.parametrize(("color", "roughness", "worst"), TINTED)
def test_a_tinted_metal_is_the_microfacet_model(convert, color, roughness, worst):
    """Whose tint is a factor, not a term that is subtracted. The darker the metal, the more the two
    differ."""
    tint = (1.0, 0.7, 0.4)
    given = {"Base_Color": color, "Metallic": 1.0, "Roughness": roughness, "Specular_Tint": tint}
    material, node = material_of("principled", "GGX", **given)
    plan = only(convert.plan([material]))
    print(plan.line(), plan.values)
    assert plan.model == "microfacet" and plan.values["tint"] == pytest.approx(tint)
    assert plan.error < worst
    node.inputs["Metallic"].default_value = 0.5
    plan = only(convert.plan([material]))
    assert not plan.refusal and plan.metal.values["tint"] == pytest.approx(tint)


def test_the_error_is_that_of_the_bright_colour(convert):
    """No model reflects more than all light: the part of the colour above 1 is lost. The error is
    relative to the light that the node reflects."""
    plan = only(convert.plan([material_of("diffuse", Color=(1.5, 1.0, 1.0), Roughness=0.0)[0]]))
    assert plan.model == "lambert" and plan.values["rho"] == (1.0, 1.0, 1.0)
    assert plan.error == pytest.approx(0.5 / 3.5, rel=1e-6)
    smooth = material_of("glossy", "GGX", Color=(1.5, 1.5, 1.5), Roughness=0.0)[0]
    assert only(convert.plan([smooth])).error == pytest.approx(0.5 / 1.5, rel=1e-6)


@pytest.mark.parametrize("color", [(1.5, 1.0, 1.0), (3.0, 0.5, 0.5)])
def test_a_picture_of_a_bright_colour_is_off_as_is_said(extension, convert, empty, color):
    material, _ = material_of("principled", "GGX", Base_Color=color, Roughness=0.5)
    pictures, plan = [], only(convert.plan([material]))
    copy = material.copy()
    assert convert.apply(convert.plan([copy])) == 1
    extension.api.enable_osl(empty)
    empty.cycles.max_bounces = 1
    helpers.sphere_scene(empty, material, samples=64)
    for shown in (material, copy):
        bpy.data.objects["Sphere"].data.materials[0] = shown
        pictures.append(helpers.render(empty)[6:10, 6:10, :3])  # only the ball
    off = np.abs(pictures[0] - pictures[1]).sum() / pictures[0].sum()
    print(f"light of the ball that is another: {off:.3g}, said: {plan.error:.3g}")
    assert off == pytest.approx(plan.error, rel=0.1)  # whose views are different ones


SEEN = [
    ("glossy", {"Color": GOLD, "Roughness": 0.0}),
    ("glossy", {"Color": GOLD, "Roughness": 0.05}),
    ("glossy", {"Color": GOLD, "Roughness": 0.3}),
    ("principled", {"Base_Color": GOLD, "Roughness": 0.0, "Metallic": 1.0}),
    ("principled", {"Base_Color": GOLD, "Roughness": 0.0, "Metallic": 0.5}),
    ("principled", {"Base_Color": GOLD, "Roughness": 0.5}),
]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("kind", "inputs"), SEEN)
def test_a_picture_under_a_wide_lamp_is_off_as_is_said(extension, convert, empty, kind, inputs):
    """For a ball, which has fewer grazing views than the stated error assumes."""
    material, _ = material_of(kind, "GGX", **inputs)
    plan = only(convert.plan([material]))
    copy = material.copy()
    assert extension.api.convert_materials(convert.plan([copy])) == 1
    extension.api.enable_osl(empty)
    empty.cycles.max_bounces = 1
    helpers.sphere_scene(empty, material, size=12, samples=2048)
    empty.world = None
    width = 4 * misplaced_light(convert).LAMP
    helpers.add_lamp(empty, "SUN", turn=(0.7, 0.5, 0), energy=1, angle=width)
    pictures = []
    for shown in (material, copy):
        bpy.data.objects["Sphere"].data.materials[0] = shown
        pictures.append(helpers.render(empty)[..., :3])
    off = np.abs(pictures[0] - pictures[1]).sum() / pictures[0].sum()
    print(f"{kind} {inputs}: {plan.model}, seen {off:.3g}, said {plan.error:.3g}")
    assert plan.error / 3 - 0.01 < off < 3 * plan.error + 0.02  # mirrored lamps are noisy


def test_the_error_is_that_of_the_pictures(extension, convert, empty):
    """Compared with many suns on many facets, within the precision of each sun."""
    material, _ = material_of("principled", "GGX", Roughness=0.5)
    plan = only(convert.plan([material]))
    copy = material.copy()
    assert convert.apply(convert.plan([copy])) == 1
    extension.api.enable_osl(empty)
    pictures = []
    for shown in (material, copy):
        bpy.context.scene.cycles.max_bounces = 0
        rng = np.random.default_rng(8)
        normals = tilted(rng.choice(misplaced_light(convert).VIEWS, 600), rng.uniform(0, 6.28, 600))
        meter = Goniometer(empty, shown, normals, 64, perspective=True)
        meter.add_sun(unit((0.4, -0.3, 0.85)))
        pictures.append(meter.measure())
        for block in list(empty.objects):
            bpy.data.objects.remove(block)
    off = np.abs(pictures[0] - pictures[1]).sum() / pictures[0].sum()
    print(f"one sun: {off:.3g}, all directions: {plan.error:.3g}")
    assert off < 3 * plan.error + 0.02


# ---- what stays ----------------------------------------------------------------------------------


def test_links_stay(extension, convert):
    material, node = material_of("principled", "GGX", Roughness=0.4)
    colour = linked(material, node, "Base Color")
    bump = linked(material, node, "Normal", "ShaderNodeBump")
    plans = convert.plan([material])
    assert convert.apply(plans) == 1
    gloss, base = (
        extension.model_nodes.sockets(g) for g in extension.model_nodes.group_nodes(material)
    )
    assert base["rho"].links[0].from_node == colour
    view = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeLayerWeight")
    bend = view.inputs["Normal"].links[0].from_node
    for socket in (gloss["Normal"], base["Normal"], bend.inputs["Normal"]):
        assert socket.links[0].from_node == bump
    output = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    assert output.inputs["Surface"].links[0].from_node.bl_idname == "ShaderNodeAddShader"
    assert not node.outputs[0].is_linked


@pytest.mark.parametrize(
    ("kind", "inputs", "name"),
    [
        ("principled", {"Roughness": 0.0, "Metallic": 1.0}, "Base Color"),
        ("glossy", {"Roughness": 0.0}, "Color"),
    ],
)
def test_the_colour_of_a_mirror_may_be_linked(extension, convert, kind, inputs, name):
    material, node = material_of(kind, **inputs)
    colour = linked(material, node, name)
    plan = only(convert.plan([material]))
    assert convert.apply([plan]) == 1
    (group,) = extension.model_nodes.group_nodes(material)
    (socket,) = (s for s in group.inputs if s.is_linked)
    assert socket.links[0].from_node == colour and socket.type == "RGBA"


ANIMATED = [
    ("principled", {"Metallic": 0.5}, "IOR", driven),
    ("principled", {"Coat_Weight": 0.5}, "Coat IOR", keyed),
    ("glossy", {}, "Anisotropy", played),
    ("glass", {}, "Roughness", keyed),
]


@pytest.mark.parametrize(("kind", "inputs", "socket", "animate"), ANIMATED)
def test_what_no_animation_can_move_stays_and_is_said(
    extension, convert, kind, inputs, socket, animate
):
    material, node = material_of(kind, **inputs)
    animate(node.inputs[socket])
    plan = only(extension.api.plan_conversion([material]))
    assert plan.refusal == f"{socket} is animated"
    assert extension.api.convert_materials([plan]) == 0 and node.outputs[0].is_linked


def test_coat_and_sheen_stay_blenders_own(extension, convert):
    """Also where their weight, roughness and normal are linked or animated, and over what glows.
    What was added is not converted again, and goes with the model."""
    material, node = material_of(
        "principled",
        Coat_Weight=0.7,
        Coat_IOR=1.8,
        Metallic=0.5,
        Emission_Strength=0.2,
        Sheen_Weight=0.3,
        Sheen_Tint=(0.2, 0.5, 0.4),
    )
    keyed(node.inputs["Coat Weight"])
    for socket in ("Coat Roughness", "Coat Normal"):
        linked(material, node, socket, "ShaderNodeTexNoise")
    plan = only(extension.api.plan_conversion([material]))
    assert set(plan.kept) >= {"Coat Weight", "Coat Roughness", "Coat Normal"}
    uncoated = only(convert.plan([material_of("principled", Metallic=0.5)[0]]))
    assert 0 < plan.least_error < plan.error <= uncoated.error
    count = len(material.node_tree.nodes)
    assert extension.api.convert_materials([plan]) == 1
    coats = [n for n in material.node_tree.nodes if n.bl_idname == node.bl_idname and n != node]
    (coat,) = coats
    assert coat.inputs["Coat IOR"].default_value == pytest.approx(1.8)
    assert coat.inputs["Sheen Weight"].default_value == pytest.approx(0.3)
    assert coat.inputs["Sheen Tint"].default_value[1] == pytest.approx(0.5)
    assert coat.inputs["Base Color"].default_value[:3] == (0, 0, 0)
    assert coat.inputs["IOR"].default_value == 1 and coat.outputs[0].is_linked
    for socket in ("Coat Weight", "Coat Roughness", "Coat Normal", "Emission Strength"):
        held = coat.inputs[socket]
        assert held.is_linked or held.default_value == pytest.approx(0.2)
    assert not convert.plan([material])
    assert convert.restore(material) == 1
    assert len(material.node_tree.nodes) == count and node.outputs[0].is_linked


def test_subsurface_scattering_and_transmission_stay_blenders_own(extension, convert):
    """Also where their inputs are linked or animated: the scattering beneath the highlight, the
    glass beside the model."""
    material, node = material_of(
        "principled",
        Subsurface_Weight=0.7,
        Subsurface_Scale=0.3,
        Subsurface_Radius=(0.5, 0.2, 0.1),
        Transmission_Weight=0.4,
        IOR=1.8,
        Specular_IOR_Level=0.3,
    )
    keyed(node.inputs["Subsurface Weight"])
    sources = {
        socket: linked(material, node, socket, "ShaderNodeTexNoise")
        for socket in ("Subsurface Scale", "Transmission Weight", "Roughness", "Normal")
    }
    plan = only(extension.api.plan_conversion([material]))
    assert set(plan.kept) >= {"Subsurface Weight", "Subsurface Radius", *sources}
    assert plan.least_error == 0 < plan.error  # all light may pass, or none
    count = len(material.node_tree.nodes)
    assert extension.api.convert_materials([plan]) == 1
    nodes = [n for n in material.node_tree.nodes if n != node and n.outputs]
    (scattering,) = (n for n in nodes if n.bl_idname == "ShaderNodeSubsurfaceScattering")
    (glass,) = (n for n in nodes if n.bl_idname == node.bl_idname)
    assert scattering.falloff == node.subsurface_method
    assert tuple(scattering.inputs["Radius"].default_value) == pytest.approx((0.5, 0.2, 0.1))
    # What the level makes of the IOR is that of the interface.
    f0 = ((1.8 - 1) / (1.8 + 1)) ** 2 * 2 * 0.3
    ior = (1 + f0**0.5) / (1 - f0**0.5)
    assert scattering.inputs["IOR"].default_value == pytest.approx(ior, rel=1e-5)
    assert scattering.inputs["Scale"].links[0].from_node == sources["Subsurface Scale"]
    assert scattering.inputs["Normal"].links[0].from_node == sources["Normal"]
    assert glass.inputs["Transmission Weight"].default_value == 1
    assert glass.inputs["IOR"].default_value == pytest.approx(1.8)
    for socket in ("Roughness", "Normal"):
        assert glass.inputs[socket].links[0].from_node == sources[socket]
    assert not convert.plan([material])
    assert convert.restore(material) == 1
    assert len(material.node_tree.nodes) == count and node.outputs[0].is_linked


@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
def test_a_metallic_node_becomes_what_a_metal_does(extension, convert, distribution):
    shared = {"Base_Color": (0.8, 0.5, 0.3), "Roughness": 0.4}
    white = (1.0, 1.0, 1.0)
    metallic, node = material_of(
        "metallic", distribution, **shared, Anisotropy=0.5, Edge_Tint=white
    )
    metal, _ = material_of("principled", distribution, **shared, Metallic=1.0, Anisotropic=0.5)
    made, wanted = (only(convert.plan([m])) for m in (metallic, metal))
    assert (made.model, made.values, made.error) == (wanted.model, wanted.values, wanted.error)
    node.inputs["Edge Tint"].default_value = (0.5, 0.5, 0.5, 1.0)
    assert only(convert.plan([metallic])).values["tint"] != wanted.values["tint"]
    node.inputs["Edge Tint"].default_value = (*white, 1.0)
    linked(metallic, node, "Anisotropy", "ShaderNodeTexNoise")
    linked(metallic, node, "Base Color")
    plan = only(extension.api.plan_conversion([metallic]))
    assert set(plan.kept) >= {"Anisotropy", "Rotation", "Base Color"}
    assert extension.api.convert_materials([plan]) == 1
    assert convert.restore(metallic) == 1 and node.outputs[0].is_linked
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    assert only(convert.plan([metallic])).refusal == "its metal is given by IOR and Extinction"


@pytest.mark.parametrize("method", ["BURLEY", "RANDOM_WALK", "RANDOM_WALK_SKIN"])
def test_every_method_of_subsurface_scattering_stays(extension, convert, method):
    """With sockets that the others lack."""
    material, node = material_of("principled", Subsurface_Weight=0.7, IOR=1.8)
    node.subsurface_method = method
    own = "Subsurface IOR" in node.inputs
    if own:
        node.inputs["Subsurface IOR"].default_value = 1.3
    assert extension.api.convert_materials(extension.api.plan_conversion([material])) == 1
    nodes = material.node_tree.nodes
    (made,) = (n for n in nodes if n.bl_idname == "ShaderNodeSubsurfaceScattering")
    assert made.falloff == method and own == (method == "RANDOM_WALK_SKIN")
    if "IOR" in made.inputs:
        assert made.inputs["IOR"].default_value == pytest.approx(1.3 if own else 1.8)
    else:
        assert method == "BURLEY"


def test_metal_neither_scatters_nor_transmits(extension, convert):
    inputs = {"Metallic": 1.0, "Subsurface_Weight": 0.7, "Transmission_Weight": 0.4}
    material, _ = material_of("principled", "GGX", **inputs)
    plan = only(convert.plan([material]))
    assert plan.error < 1e-6 and not plan.subsurface and not plan.transmits


def test_an_animated_distribution_is_said(convert):
    material, node = material_of("glossy")
    keyed(node, "distribution")
    assert only(convert.plan([material])).refusal == "Distribution is animated"


def test_animation_that_shows_nothing_is_no_reason(convert):
    material, node = material_of("principled")
    keyed(node.inputs["Coat Roughness"])  # of a coat with weight 0
    keyed(node.inputs["Base Color"])
    linked(material, node, "Base Color")
    keyed(node.inputs["Roughness"])
    for layer in material.node_tree.animation_data.action.layers:
        for curve in layer.strips[0].channelbags[0].fcurves:
            curve.mute = curve.data_path == node.inputs["Roughness"].path_from_id("default_value")
    assert not only(convert.plan([material])).refusal


def test_a_strip_still_moves_a_parameter_in_another_form(extension, convert, empty):
    material = extension.api.new_material("phong_material", "sampled", kd=0.1)
    helpers.add_sphere(empty, material)  # so that Blender evaluates it
    (group,) = extension.model_nodes.group_nodes(material)
    socket = extension.model_nodes.sockets(group)["kr"]
    for frame, value in ((1, 0.2), (10, 0.6)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    data = material.node_tree.animation_data
    action, slot = data.action, data.action_slot
    data.nla_tracks.new().strips.new("Strip", 1, action).action_slot = slot
    data.action = None
    extension.api.switch_representation(material, "twin")
    for frame, value in ((1, 0.2), (10, 0.6)):
        empty.frame_set(frame)
        now = extension.api.get_parameters(material)["kr"]
        assert now == pytest.approx(value)


def test_a_limit_is_a_reason(extension, convert):
    material, node = material_of("diffuse", Roughness=0.5)
    (plan,) = extension.api.plan_conversion([material])
    assert not plan.refusal and 0.004 < plan.error < 0.35
    (plan,) = extension.api.plan_conversion([material], limit=0.004)
    assert plan.line() == (
        f"{material.name}, Diffuse BSDF: stays, its nearest model, EON Rough Diffuse, sends "
        f"{100 * plan.error:.2g} % of the light in other directions than the node"
    )
    assert extension.api.convert_materials([plan]) == 0 and node.outputs[0].is_linked
    with pytest.raises(ValueError, match="Expected a number, got 'much'"):
        extension.api.plan_conversion([material], limit="much")
    with pytest.raises(ValueError, match="Expected a number from 0, got nan"):
        extension.api.plan_conversion([material], limit=float("nan"))
    with pytest.raises(ValueError, match="Expected a number from 0, got -1"):
        extension.api.plan_conversion([material], limit=-1)
    # A colour far above 1, which no model can reflect.
    (plan,) = extension.api.plan_conversion([material_of("diffuse", Color=(9.0, 0.0, 0.0))[0]])
    assert "sends 89 % of the light" in plan.refusal


CAUSES = [
    ("diffuse", {"Color": (9.0, 0.0, 0.0)}, "Color"),
    ("principled", {"Roughness": 0.0, "Diffuse_Roughness": 1.0}, "Diffuse Roughness"),
    ("principled", {"Roughness": 0.0}, "Roughness"),
]


@pytest.mark.parametrize(("kind", "inputs", "cause"), CAUSES)
def test_the_input_that_makes_an_error_large_is_said(extension, convert, kind, inputs, cause):
    plan = only(extension.api.plan_conversion([material_of(kind, **inputs)[0]], limit=0.02))
    assert plan.refusal.startswith("its nearest model, ")
    assert plan.refusal.endswith(
        f" % of the light in other directions than the node, because of its {cause}"
    )


def test_what_the_extension_lacks_is_said(extension, convert, empty, monkeypatch):
    """The nearest models, if it was built for one scene; and whether they need OSL."""
    plans = import_module(".plans", convert.__package__)
    metal = material_of("principled", "GGX", Metallic=1.0, Roughness=0.37)[0]
    monkeypatch.setattr(plans, "_shown", lambda without_osl: lambda model, values: False)
    why = only(convert.plan([metal])).refusal
    assert why.startswith(
        "this extension lacks the models that are near: cook_torrance, microfacet"
    )
    shown = {False: lambda model, values: True, True: lambda model, values: False}
    monkeypatch.setattr(plans, "_shown", shown.get)
    empty.cycles.shading_system = False
    why = only(convert.plan([metal])).refusal
    assert why.startswith("its nearest model, Microfacet, which sends ")
    assert why.endswith(" needs Open Shading Language for its values")


def test_what_has_no_effect_is_no_reason(extension, convert):
    """Inputs of the plastic part of a metal, and of a highlight that there is none of. A roughness
    that is linked is not that of the base."""
    for inputs in ({"Metallic": 1.0}, {"IOR": 1.0, "Diffuse_Roughness": 0.5}):
        material, node = material_of("principled", **inputs, Anisotropic=0.5)
        for name in ("IOR", "Specular IOR Level") if "Metallic" in inputs else ("Roughness",):
            linked(material, node, name, "ShaderNodeTexNoise")
        plan = only(convert.plan([material]))
        print(plan.line())
        assert not plan.refusal and not plan.base and not plan.widths


@pytest.mark.parametrize("anisotropy", [-1.0, 1.0, 1.8])
def test_the_anisotropy_of_a_glossy_node_is_clamped_as_by_cycles(convert, anisotropy):
    one, other = (
        only(convert.plan([material_of("glossy", "GGX", Roughness=0.5, Anisotropy=a)[0]]))
        for a in (anisotropy, 0.99 if anisotropy > 0 else -0.99)
    )
    assert one.values == other.values and not one.refusal


def test_a_linked_roughness_is_followed(extension, convert):
    material, node = material_of("glossy", "GGX", Color=GOLD)
    value = linked(material, node, "Roughness", "ShaderNodeValue")
    value.outputs[0].default_value = 0.4  # 0 would become a mirror, which has no roughness
    plan = only(convert.plan([material]))
    ((name, factor, power, low, high, stretched), *_) = plan.widths
    assert stretched == 0
    assert convert.apply([plan]) == 1
    (group,) = extension.model_nodes.group_nodes(material)
    at, operations = extension.model_nodes.sockets(group)[name], []
    while at.is_linked:
        here = at.links[0].from_node
        if here == value:
            break
        operations.insert(0, (here.operation, here.inputs[1].default_value))
        at = here.inputs[0]
    assert here == value

    def followed(x):
        for operation, operand in operations:
            x = {
                "MAXIMUM": max,
                "MINIMUM": min,
                "POWER": lambda a, b: a**b,
                "MULTIPLY": lambda a, b: a * b,
            }[operation](x, operand)
        return x

    for r in (0.0, 0.3, 0.5, 1.0):
        wanted = min(max(factor * max(r, 1e-3) ** power, low), high)
        assert followed(r) == pytest.approx(wanted, rel=1e-5)


REFUSED = [
    ("principled", {"Coat_Weight": 0.5, "Coat_Tint": (1.0, 0.5, 0.5)}, "it has Coat Tint"),
    ("principled", {"Transmission_Weight": 1.0, "Metallic": 0.5}, "it has Transmission"),
    ("principled", {"Transmission_Weight": 1.0}, "the model of rough glass is darker under lamps"),
    (
        "principled",
        {"Transmission_Weight": 1.0, "Roughness": 0.0, "Specular_IOR_Level": 0.4},
        "it has Specular IOR Level",
    ),
    ("principled", {"Thin_Film_Thickness": 300.0}, "it has Thin Film"),
    ("glass", {"Roughness": 0.3}, "the model of rough glass is darker under lamps"),
    ("glass", {"Color": (2.0, 1.0, 1.0)}, "Tint of Fresnel Dielectric would be 2, and may be 0 to"),
    # Values outside the range of a model, or of what Blender's formulas are taken for.
    ("glass", {"IOR": 0.0}, "IOR of Fresnel Dielectric would be 0, and may be 0.1 to 10"),
    ("glass", {"IOR": 12.0}, "IOR of Fresnel Dielectric would be 12, and may be 0.1 to 10"),
    ("principled", {"IOR": 0.7}, "its IOR is below 1"),
]


def test_a_black_base_needs_no_roughness(extension, convert):
    material, node = material_of("principled", Base_Color=(0.0, 0.0, 0.0))
    linked(material, node, "Diffuse Roughness", "ShaderNodeTexNoise")
    assert not only(convert.plan([material])).refusal


#: Links beside a noisy Roughness, or to what has no model that follows them.
TWO_LINKS = [
    ({}, ("Specular IOR Level", "Roughness"), "Specular IOR Level and Roughness are linked, and"),
    ({}, ("Specular IOR Level", "Specular Tint"), "Level and Specular Tint are linked, and only"),
    ({"Roughness": 0.0}, ("Specular IOR Level",), "Level is linked, and converts only as one"),
    ({"Roughness": 0.0}, ("Diffuse Roughness",), "Roughness is linked, and converts only as one"),
    ({"Subsurface_Weight": 0.5}, ("Specular IOR Level",), "Level is linked, and converts only as"),
    ({"Metallic": 1.0}, ("Specular Tint",), "Tint is linked, and converts only as one value"),
    ({"Metallic": 0.5}, ("Specular Tint",), "Tint is linked, and converts only as one value"),
]


@pytest.mark.parametrize(("inputs", "sockets", "why"), TWO_LINKS)
def test_links_that_no_model_follows_are_named(extension, convert, inputs, sockets, why):
    material, node = material_of("principled", **inputs)
    for socket in sockets:
        linked(material, node, socket, "ShaderNodeTexNoise")
    assert why in only(convert.plan([material])).line()


LINKED = [
    ("principled", {"Metallic": 0.5}, "IOR"),
    ("principled", {"Coat_Weight": 0.5}, "Coat IOR"),
    ("principled", {"Sheen_Weight": 0.5}, "Sheen Roughness"),
]


@pytest.mark.parametrize(("kind", "inputs", "socket"), LINKED)
def test_a_link_that_could_not_stay_is_a_reason(extension, convert, kind, inputs, socket):
    material, node = material_of(kind, **inputs)
    linked(material, node, socket, "ShaderNodeTexNoise")
    assert f"{socket} is linked" in only(convert.plan([material])).line()


@pytest.mark.parametrize(("kind", "inputs", "why"), REFUSED)
def test_what_no_model_has_stays_and_is_said(extension, convert, kind, inputs, why):
    material, node = material_of(kind, **inputs)
    before = helpers.counts()
    plan = only(convert.plan([material]))
    assert why in plan.line() and "stays" in plan.line()
    assert convert.apply([plan]) == 0
    assert helpers.counts() == before
    assert node.outputs[0].is_linked


def test_a_plan_changes_nothing_and_a_failure_neither(extension, convert, monkeypatch):
    materials = [material_of("diffuse", Color=GOLD)[0], material_of("principled")[0]]
    before = helpers.counts()
    plans = convert.plan(materials)
    assert helpers.counts() == before
    compiler = import_module(f"{extension.package}.content.compiler")
    compile_, calls = compiler.compile_script, []

    def fail_second(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise extension.api.CompileError("as if it could not")
        compile_(*arguments)

    monkeypatch.setattr(compiler, "compile_script", fail_second)
    with pytest.raises(RuntimeError, match="as if it could not"):
        convert.apply(plans)
    assert helpers.counts() == before
    for material in materials:
        assert not extension.model_nodes.group_nodes(material)


def test_functions_take_one_of_several_models(extension, convert):
    """As Convert makes them of a plastic."""
    material, _ = material_of("principled", "GGX", Base_Color=GOLD, Roughness=0.4)
    assert convert.apply(convert.plan([material])) == 1
    gloss, base = extension.model_nodes.group_nodes(material)
    api, several = (
        extension.api,
        "has 2 reflection models: expected node=, one of 'Group', 'Group.001'",
    )
    for call in (api.get_parameters, api.set_parameters, api.add_albedo):
        with pytest.raises(ValueError, match=several):
            call(material)
    with pytest.raises(ValueError, match=several):
        api.set_substance(material, "gold")
    assert api.get_parameters(material, node=base.name)["rho"] == pytest.approx(GOLD)
    assert api.get_parameters(material, node=gloss)["ax"] == pytest.approx(0.16)
    api.set_parameters(material, node=base.name, rho=0.25)
    assert api.get_parameters(material, node=base)["rho"] == (0.25, 0.25, 0.25)
    with pytest.raises(ValueError, match="has no model node 'Lambert', only Group, Group.001"):
        api.get_parameters(material, node="Lambert")
    other = api.new_material("lambert")
    with pytest.raises(ValueError, match="is no model of material"):
        api.get_parameters(material, node=extension.model_nodes.group_nodes(other)[0])
    api.add_albedo(material, node=base.name)
    assert "Albedo" in base.outputs and "Albedo" not in gloss.outputs
    assert "f0" in api.set_substance(material, "gold", node=gloss.name)
    # Forms are those of all, if none is named.
    api.switch_representation(material, "sampled")
    assert [extension.model_nodes.identity(n).form for n in (gloss, base)] == ["sampled", "sampled"]
    api.switch_representation(material, "exact", node=base.name)
    with pytest.raises(ValueError, match="no render method 'exact'"):
        api.switch_representation(material, "exact")
    assert [extension.model_nodes.identity(n).form for n in (gloss, base)] == ["sampled", "exact"]


# ---- what Blender ignores ------------------------------------------------------------------------


def values_of(plan):
    return {name: pytest.approx(value) for name, value in plan.values.items()}


def mute_link(material, node, source):
    material.node_tree.links[-1].is_muted = True


def mute_source(material, node, source):
    source.mute = True


def dangle(material, node, source):
    """A reroute without an input; before 5.0 Cycles uses 0 for it."""
    tree = material.node_tree
    tree.links.new(tree.nodes.new("NodeReroute").outputs[0], node.inputs["Base Color"])
    tree.nodes.remove(source)


def mute_behind_a_reroute(material, node, source):
    tree = material.node_tree
    reroute = tree.nodes.new("NodeReroute")
    link = tree.links.new(source.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], node.inputs["Base Color"])
    link.is_muted = True


IGNORED = [mute_link, mute_source, dangle, mute_behind_a_reroute]


def look(scene, material):
    """Colour of a ball with this material in a white world."""
    if "Sphere" not in bpy.data.objects:
        helpers.sphere_scene(scene, material, samples=64)
        scene.cycles.max_bounces = 1
    bpy.data.objects["Sphere"].data.materials[0] = material
    return helpers.render(scene)[6:10, 6:10, :3].mean((0, 1))


@pytest.mark.parametrize("ignore", IGNORED)
def test_a_link_that_blender_ignores_is_no_link(extension, convert, empty, ignore):
    inputs = {"Base_Color": (0.8, 0.1, 0.1), "Roughness": 0.5}
    material, node = material_of("principled", **inputs)
    source = linked(material, node, "Base Color")
    source.outputs[0].default_value = (0.0, 0.9, 0.0, 1.0)
    ignore(material, node, source)
    extension.api.enable_osl(empty)
    before, plan = look(empty, material), only(convert.plan([material]))
    assert convert.apply([plan]) == 1
    after = look(empty, material)
    print(f"{ignore.__name__}: {before} and {after}, said {plan.error}")
    assert after == pytest.approx(before, rel=0.06, abs=0.01)
    _, base = extension.model_nodes.group_nodes(material)
    assert extension.model_nodes.constants(base)["rho"] is not None


@pytest.mark.many
@pytest.mark.parametrize("kind", ["VolumeAbsorption", "VolumeScatter", "VolumePrincipled"])
def test_a_volume_in_a_surface_shows_nothing_and_is_no_reason(extension, convert, empty, kind):
    """glTF's importer adds one to the surface of glass."""
    material, node = material_of("principled", Base_Color=GOLD, Roughness=0.6)
    before, tree = flat(empty, material), material.node_tree
    volume, add = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeAddShader")
    output = node.outputs[0].links[0].to_socket
    tree.links.new(node.outputs[0], add.inputs[0])
    tree.links.new(volume.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], output)
    np.testing.assert_allclose(flat(empty, material), before, rtol=1e-6)
    plan = only(convert.plan([material]))
    assert plan.node == node and convert.apply([plan]) == 1
    assert volume.outputs[0].is_linked
    np.testing.assert_allclose(flat(empty, material), before, rtol=0.02)


def test_a_muted_node_is_not_converted(extension, convert, empty):
    material, node = material_of("principled", Base_Color=(0.8, 0.1, 0.1))
    node.mute = True
    assert convert.plan([material]) == []
    node.mute = False
    tree = material.node_tree
    tree.nodes["Material Output"].inputs["Surface"].links[0].is_muted = True
    assert convert.plan([material]) == []


def test_a_node_of_an_inactive_output_is_not_converted(convert):
    material, node = material_of("principled")
    tree = material.node_tree
    diffuse, active = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new(OUTPUT)
    tree.links.new(diffuse.outputs[0], active.inputs["Surface"])
    active.is_active_output = True
    assert only(convert.plan([material])).node == diffuse
    active.target = "EEVEE"
    assert only(convert.plan([material])).node == node


def test_a_node_that_is_muted_after_the_plan_was_made_is_stale(convert):
    material, node = material_of("principled")
    plans = convert.plan([material])
    node.mute = True
    with pytest.raises(ValueError, match="nothing shows the node any more"):
        convert.apply(plans)


def test_a_constant_behind_a_link_that_changes_is_stale(convert):
    material, node = material_of("principled")
    source = linked(material, node, "Metallic", "ShaderNodeValue")
    plans = convert.plan([material])
    source.outputs[0].default_value = 1.0
    with pytest.raises(ValueError, match="Metallic is another one"):
        convert.apply(plans)


def test_muted_links_stay_at_the_node_of_before(convert):
    """The original node stays unconnected, as it was."""
    material, node = material_of("principled")
    tree = material.node_tree
    other = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(node.outputs[0], other.inputs[0]).is_muted = True
    assert convert.apply(convert.plan([material])) == 1
    assert [link.to_node for link in node.outputs[0].links] == [other]
    assert convert.restore(material) == 1
    assert {link.to_node.bl_idname for link in node.outputs[0].links} == {OUTPUT, other.bl_idname}


@pytest.mark.parametrize("named", ["the original node", "the model", "both"])
def test_back_after_nodes_got_other_names(extension, convert, named):
    """The names may belong to other nodes meanwhile."""
    material, node = material_of("principled", Metallic=0.5, Coat_Weight=0.5)
    tree, source = material.node_tree, node.name
    link = next(k for k in tree.links if k.from_node == node)
    output, shown = link.to_node, set(tree.nodes.keys())
    assert convert.apply(convert.plan([material])) == 1
    renamed = [node] if named != "the model" else []
    if named != "the original node":
        renamed += extension.model_nodes.group_nodes(material)
    taken = []
    for one in renamed:
        name, one.name = one.name, f"Renamed {one.name}"
        taken.append(tree.nodes.new("ShaderNodeBsdfDiffuse"))
        taken[-1].name = name
    assert convert.restore(material) == 1
    for one in taken:
        tree.nodes.remove(one)
    node.name = source
    assert set(tree.nodes.keys()) == shown
    assert output.inputs["Surface"].links[0].from_node == node


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="from 5.0 nodes are always used")
def test_nodes_that_are_not_used_are_not_converted(extension, convert):
    material, node = material_of("principled")
    material.use_nodes = False
    plan = only(convert.plan([material]))
    assert "Use Nodes is off" in plan.line()
    assert convert.apply([plan]) == 0 and node.outputs[0].is_linked


@pytest.mark.many
@pytest.mark.parametrize("mapped", [None, "Base Color", "Metallic", "Roughness", "Normal"])
def test_an_object_that_glows_stays_a_lamp(extension, convert, empty, mapped):
    """Whatever varies in the rest of its material."""
    material, node = material_of("principled", Emission_Strength=5.0, Emission_Color=GOLD)
    helpers.add_sphere(empty, material).scale = (0.3, 0.3, 0.3)
    helpers.add_sphere(empty, extension.api.new_material("ward", "nodes")).location = (3, 0, 0)
    if mapped:
        kind = "ShaderNodeBump" if mapped == "Normal" else "ShaderNodeTexNoise"
        linked(material, node, mapped, kind)
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]
    assert convert.apply(convert.plan([material])) == 1
    assert [(lamp.slot, lamp.why) for lamp in extension.api.see_lamps(empty)] == [(1, "")]


# ---- as importers leave them ---------------------------------------------------------------------


def of_old_versions(material, node):
    """As Blender converts files of versions 2.91 to 3.6."""
    node.inputs["Emission Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    node.inputs["Emission Strength"].default_value = 1.0


def of_fbx(material, node):
    """The same, with the colour from an image whose alpha, always 1, is linked as well."""
    of_old_versions(material, node)
    links = material.node_tree.links
    picture = picture_node(material.node_tree, (0.8, 0.2, 0.1), (0.4, 0.3, 0.1), data=False)
    links.new(picture.outputs["Color"], node.inputs["Base Color"])
    links.new(picture.outputs["Alpha"], node.inputs["Alpha"])


def of_obj(material, node):
    """Without an emission map."""
    of_old_versions(material, node)
    value = linked(material, node, "Metallic", "ShaderNodeValue")
    value.outputs[0].default_value = 0.0


def of_gltf(material, node):
    """Base colour; metallic and roughness from blue and green of one image; a normal map; and alpha
    1."""
    tree, links = material.node_tree, material.node_tree.links
    of_old_versions(material, node)
    color = picture_node(tree, (0.8, 0.2, 0.1), (0.9, 0.8, 0.6), data=False)
    links.new(color.outputs["Color"], node.inputs["Base Color"])
    parts, packed = (
        tree.nodes.new("ShaderNodeSeparateColor"),
        picture_node(tree, (1.0, 0.5, 0.0), (1.0, 0.3, 1.0)),
    )
    links.new(packed.outputs["Color"], parts.inputs["Color"])
    links.new(parts.outputs["Green"], node.inputs["Roughness"])
    links.new(parts.outputs["Blue"], node.inputs["Metallic"])
    bump, normals = tree.nodes.new("ShaderNodeNormalMap"), picture_node(tree, (0.5, 0.5, 1.0))
    links.new(normals.outputs["Color"], bump.inputs["Color"])
    links.new(bump.outputs["Normal"], node.inputs["Normal"])
    alpha = linked(material, node, "Alpha", "ShaderNodeValue")
    alpha.outputs[0].default_value = 1.0


def without_metal(material, node):
    """As of_gltf(), with the metallic channel multiplied by 0."""
    of_gltf(material, node)
    tree, socket = material.node_tree, node.inputs["Metallic"]
    factor = tree.nodes.new("ShaderNodeMath")
    factor.operation = "MULTIPLY"
    factor.inputs[1].default_value = 0.0
    tree.links.new(socket.links[0].from_socket, factor.inputs[0])
    tree.links.new(factor.outputs[0], socket)


def of_a_library(material, node):
    """A metallic map that is black everywhere."""
    picture = picture_node(material.node_tree, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    material.node_tree.links.new(picture.outputs["Color"], node.inputs["Metallic"])


IMPORTED = [
    (of_old_versions, 2),
    (of_fbx, 2),
    (of_obj, 2),
    (of_gltf, 3),
    (without_metal, 2),
    (of_a_library, 2),
]


@pytest.mark.parametrize(("imported", "models"), IMPORTED)
def test_what_importers_make_is_converted(extension, convert, imported, models):
    material, node = material_of("principled")
    imported(material, node)
    plan = only(extension.api.plan_conversion([material]))
    print(plan.line())
    assert not plan.refusal and len(plan.parts) == models
    assert not plan.glows and not plan.transparent
    assert convert.apply([plan]) == 1
    assert len(extension.model_nodes.group_nodes(material)) == models


def is_half_metal(material, node):
    tree = material.node_tree
    picture = picture_node(tree, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    tree.links.new(picture.outputs["Color"], node.inputs["Metallic"])


def is_half_clear(material, node):
    tree = material.node_tree
    picture = picture_node(tree, (1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 0.25))
    tree.links.new(picture.outputs["Alpha"], node.inputs["Alpha"])


def is_clear(material, node):
    node.inputs["Alpha"].default_value = 0.5


def glows(material, node):
    tree = material.node_tree
    picture = picture_node(tree, (0.2, 0.3, 0.0), (0.0, 0.0, 0.5))
    tree.links.new(picture.outputs["Color"], node.inputs["Emission Color"])
    node.inputs["Emission Strength"].default_value = 2.0


def glows_behind_alpha(material, node):
    glows(material, node)
    is_clear(material, node)


def has_a_colour_by_an_image(material, node):
    """With a Metallic of a half, for which no model has a single colour."""
    node.inputs["Metallic"].default_value = 0.5
    tree = material.node_tree
    picture = picture_node(tree, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8))
    tree.links.new(picture.outputs["Color"], node.inputs["Base Color"])


@pytest.mark.many
@pytest.mark.parametrize(
    "change",
    [
        is_half_metal,
        is_half_clear,
        is_clear,
        glows,
        glows_behind_alpha,
        has_a_colour_by_an_image,
    ],
)
def test_a_picture_of_what_is_mixed_is_as_before(extension, convert, empty, change):
    material, node = material_of("principled", Base_Color=GOLD, Roughness=0.5)
    change(material, node)
    plan = only(extension.api.plan_conversion([material]))
    print(plan.line())
    before = flat(empty, material)
    extension.api.enable_osl(empty)
    assert extension.api.convert_materials([plan]) == 1
    after = flat(empty, material)
    print(f"{change.__name__}: before {before}, after {after}")
    # Where an image chooses between two models, the error is that of both in its mean colour.
    change_of_all = np.abs(np.array(after) - before).mean(0)
    assert (change_of_all <= max(plan.error, 0.02) * np.mean(before, 0) + 0.01).all()
    nodes = {n.name for n in material.node_tree.nodes}
    assert convert.restore(material) == 1
    assert np.array(flat(empty, material)) == pytest.approx(np.array(before), rel=1e-3)
    assert len(nodes) > len(material.node_tree.nodes)


def test_back_where_the_node_of_a_mix_is_gone_is_a_twin_of_each(extension, convert):
    """Or nothing, if one of the models has no twin for its values."""
    material, node = material_of("principled", Roughness=0.5, Base_Color=GOLD)
    is_half_metal(material, node)
    assert convert.apply(convert.plan([material])) == 1
    material.node_tree.nodes.remove(node)
    groups = extension.model_nodes.group_nodes(material)
    assert len(groups) == 3
    before = [extension.model_nodes.identity(g) for g in groups]
    with pytest.raises(ValueError, match="Blender Nodes is only for"):
        convert.restore(material)
    assert [extension.model_nodes.identity(g) for g in groups] == before
    for group in groups:
        model = extension.pack.model(extension.model_nodes.identity(group).model)
        for name, parameter in model.parameters.items():
            default = parameter["default"]
            extension.model_nodes.set_value(
                group, name, tuple(default) if isinstance(default, list) else default
            )
    assert convert.restore(material) == 1
    groups = extension.model_nodes.group_nodes(material)
    assert [extension.model_nodes.identity(g).form for g in groups] == ["twin"] * 3
    assert not any(convert.is_converted(g) for g in groups)


# ---- what a linked colour does to the error ------------------------------------------------------


def test_the_error_of_a_linked_colour_is_a_range(convert):
    material, node = material_of("principled", Roughness=0.5)
    linked(material, node, "Base Color", "ShaderNodeTexNoise")
    plan = only(convert.plan([material]))
    low, high = f"{100 * plan.least_error:.2g}", f"{100 * plan.error:.2g}"
    assert f"{low} to {high} % of the light" in plan.line()
    for color in ((0.0, 0.0, 0.0), (0.04, 0.04, 0.04), (0.5, 0.2, 0.1), (1.0, 1.0, 1.0)):
        same = only(convert.plan([material_of("principled", Base_Color=color, Roughness=0.5)[0]]))
        print(f"{color}: {same.error:.3g}, said {plan.line()}")
        assert plan.least_error * 0.9 < same.error < plan.error * 1.1
    assert "in other directions than the node" in plan.within(plan.error - 1e-6).refusal


def errors_of(convert, kind, socket, values, **inputs):
    """Those of nodes with each value in turn."""
    name = socket.replace(" ", "_")
    return [
        only(convert.plan([material_of(kind, of_kind(kind), **inputs | {name: v})[0]])).error
        for v in values
    ]


def of_kind(kind):
    return None if kind == "diffuse" else "GGX"


def grey(value):
    return (value,) * 3


#: A node with pixels of an image at one of its inputs.
OF_IMAGES = [
    ("principled", "Base Color", (grey(0.0), grey(0.08)), {"Roughness": 0.5}),
    ("principled", "Base Color", (grey(0.5), (3.0, 1.0, 0.5)), {"Roughness": 0.5}),
    ("principled", "Roughness", (0.1, 0.9), {"Base_Color": grey(0.0)}),
    ("principled", "Specular IOR Level", (0.1, 2.0), {"Base_Color": grey(0.2)}),
    ("principled", "Specular IOR Level", (0.1, 1.0), {"Base_Color": grey(0.0)}),
    ("principled", "Specular Tint", (grey(0.1), grey(1.6)), {"Base_Color": grey(0.1)}),
    ("principled", "Diffuse Roughness", (0.0, 1.0), {"Base_Color": grey(0.8)}),
    ("glossy", "Roughness", (0.05, 1.0), {"Color": GOLD}),
    ("diffuse", "Color", ((1.5, 1.0, 1.0), grey(2.0)), {"Roughness": 0.0}),
]


@pytest.mark.parametrize(("kind", "socket", "values", "inputs"), OF_IMAGES)
def test_the_error_of_an_image_is_a_range_over_its_pixels(convert, kind, socket, values, inputs):
    material, node = material_of(kind, of_kind(kind), **inputs)
    pixels = [v if isinstance(v, tuple) else grey(v) for v in values]
    picture = picture_node(material.node_tree, *pixels)
    material.node_tree.links.new(picture.outputs["Color"], node.inputs[socket])
    plan = only(convert.plan([material]))
    errors = errors_of(convert, kind, socket, values, **inputs)
    print(f"{errors}, said {plan.line()}")
    for error in errors:
        assert plan.least_error * 0.9 - 0.003 < error < plan.error * 1.1 + 0.003
    assert plan.error < 2 * max(errors) + 0.01, "a range that says nothing"


def bounded(tree, name):
    """A node whose value lies within known bounds, and these."""
    node = tree.nodes.new(f"ShaderNode{name}")
    if name == "Math":
        node.operation = "MULTIPLY"
        noise = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(noise.outputs[0], node.inputs[0])
        node.inputs[1].default_value = 3.0
        return node, (0.0, 3.0)
    if name == "ValToRGB":
        noise = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(noise.outputs[0], node.inputs[0])
        for element, value in zip(node.color_ramp.elements, (0.2, 0.7), strict=True):
            element.color = (value, value, value, 1.0)
        return node, (0.2, 0.7)
    if name == "MapRange":
        node.inputs["To Min"].default_value, node.inputs["To Max"].default_value = 0.3, 0.1
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs[0], node.inputs[0])
        return node, (0.1, 0.3)
    if name == "TexChecker":
        node.inputs["Color1"].default_value = (0.1, 0.1, 0.1, 1.0)
        node.inputs["Color2"].default_value = (0.6, 0.6, 0.6, 1.0)
        return node, (0.1, 0.6)
    return node, (0.0, 1.0)  # of an attribute: unknown


@pytest.mark.parametrize(
    "name", ["Math", "ValToRGB", "MapRange", "TexChecker", "TexNoise", "Attribute"]
)
def test_the_error_of_nodes_is_a_range_over_their_values(convert, name):
    inputs = {"Base_Color": grey(0.2), "Roughness": 0.4}
    material, node = material_of("principled", "GGX", **inputs)
    source, (low, high) = bounded(material.node_tree, name)
    material.node_tree.links.new(source.outputs[0], node.inputs["Specular IOR Level"])
    plan = only(convert.plan([material]))
    values = [max(low, 0.1), (low + high) / 2, high]
    errors = errors_of(convert, "principled", "Specular IOR Level", values, **inputs)
    print(f"{errors}, said {plan.line()}")
    assert not plan.refusal and plan.varying.top == pytest.approx(high, rel=1e-5)
    for error in errors:
        assert plan.least_error * 0.9 - 0.003 < error < plan.error * 1.1 + 0.003


@pytest.mark.many
@pytest.mark.parametrize("color", [0.0, 0.04, 0.5, 1.0])
def test_a_picture_of_a_linked_colour_is_off_as_is_said(extension, convert, empty, color):
    """Under a lamp as wide as windows, for which the error is stated."""
    material, node = material_of("principled", "GGX", Roughness=0.5)
    noise = linked(material, node, "Base Color", "ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 0.0
    plan = only(convert.plan([material]))
    sockets = []
    copy = material.copy()
    assert convert.apply(convert.plan([copy])) == 1
    for shown in (material, copy):
        tree = shown.node_tree
        value = tree.nodes.new("ShaderNodeValue")
        value.outputs[0].default_value = color
        (source,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeTexNoise")
        for link in list(source.outputs[0].links):
            sockets.append(tree.links.new(value.outputs[0], link.to_socket))
    assert len(sockets) >= 2
    extension.api.enable_osl(empty)
    empty.cycles.max_bounces = 1
    helpers.sphere_scene(empty, material, size=12, samples=1024)
    empty.world = None
    helpers.add_lamp(
        empty, "SUN", turn=(0.7, 0.5, 0), energy=1, angle=4 * misplaced_light(convert).LAMP
    )
    pictures = []
    for shown in (material, copy):
        bpy.data.objects["Sphere"].data.materials[0] = shown
        pictures.append(helpers.render(empty)[..., :3])
    off = np.abs(pictures[0] - pictures[1]).sum() / pictures[0].sum()
    print(f"{color}: seen {off:.3g}, said {plan.least_error:.3g} to {plan.error:.3g}")
    assert plan.least_error / 3 - 0.01 < off < 1.5 * plan.error + 0.02


# ---- what later versions add ---------------------------------------------------------------------


def test_a_socket_that_is_not_known_is_refused_by_name_when_it_is_set(convert, monkeypatch):
    """As in a later version of Blender with an additional socket."""
    known = convert.KNOWN_SOCKETS["principled"] - {"Coat IOR"}
    monkeypatch.setitem(convert.KNOWN_SOCKETS, "principled", known)
    material, node = material_of("principled")
    assert not only(convert.plan([material])).refusal
    node.inputs["Coat IOR"].default_value = 1.7
    assert only(convert.plan([material])).refusal == "it has Coat IOR"
    node.inputs["Coat IOR"].default_value = 1.5
    linked(material, node, "Coat IOR", "ShaderNodeValue")
    assert only(convert.plan([material])).refusal == "it has Coat IOR"


@pytest.mark.parametrize("kind", KINDS)
def test_every_socket_of_this_version_is_known(convert, kind):
    _, node = material_of(kind)
    assert {s.name for s in node.inputs} <= convert.KNOWN_SOCKETS[kind]


@pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="came with 5.2")
def test_a_thin_wall_is_refused_by_name(convert):
    material, node = material_of("principled")
    assert not only(convert.plan([material])).refusal
    node.inputs["Thin Wall"].default_value = True
    assert only(convert.plan([material])).refusal == "it has Thin Wall"


@pytest.mark.parametrize("kind", ["Translucent", "Toon", "Sheen", "Refraction", "RayPortal"])
def test_other_shaders_stay_and_are_said(convert, kind):
    material, node = material_of("principled")
    tree = material.node_tree
    other = tree.nodes.new(f"ShaderNodeBsdf{kind}")
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(node.outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    plans = {plan.node: plan for plan in convert.plan([material])}
    assert set(plans) == {node, other}, "what only mixes is not named"
    assert not plans[node].refusal
    assert plans[other].refusal == (
        "only Principled, Glossy, Metallic, Diffuse and Glass nodes convert"
    )


# ---- by the buttons ------------------------------------------------------------------------------


@pytest.fixture
def item(convert, empty):
    """An object of two materials, selected."""
    mesh = bpy.data.meshes.new("Mesh")
    made = bpy.data.objects.new("Item", mesh)
    empty.collection.objects.link(made)
    for kind in ("diffuse", "principled"):
        mesh.materials.append(material_of(kind)[0])
    made.select_set(True)
    bpy.context.view_layer.objects.active = made
    bpy.ops.ed.undo_push(message="Start")
    return made.name


def shown_nodes():
    found = {}
    for material in bpy.data.materials:
        for node in material.node_tree.nodes:
            if node.bl_idname == "ShaderNodeOutputMaterial":
                found[material.name] = node.inputs["Surface"].links[0].from_node.name
    return found


def test_there_and_back_are_one_step_of_undo_each(extension, item):
    start, before = shown_nodes(), helpers.counts()
    assert bpy.ops.brdfc.convert() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Convert")
    converted = shown_nodes()
    assert all(converted[name] != start[name] for name in start)
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert shown_nodes() == start and helpers.counts() == before
    assert bpy.ops.ed.redo() == {"FINISHED"}
    assert shown_nodes() == converted
    bpy.ops.ed.undo_push(message="Again")
    layout = helpers.Layout()
    active = bpy.data.objects[item].active_material
    extension.ui.draw_material(layout, active, bpy.context.scene)
    assert any(line.startswith("operator brdfc.convert_back") for line in layout.log)
    assert bpy.ops.brdfc.convert_back() == {"FINISHED"}
    assert shown_nodes()[active.name] == start[active.name]


@pytest.mark.parametrize("redone", [False, True])
def test_back_can_be_undone(extension, item, redone):
    assert bpy.ops.brdfc.convert() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Convert")
    converted = shown_nodes()
    if redone:
        assert bpy.ops.ed.undo() == {"FINISHED"}
        assert bpy.ops.ed.redo() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="Again")
    assert bpy.ops.brdfc.convert_back() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Back")
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert shown_nodes() == converted


def test_back_where_the_node_of_before_is_gone_is_the_twin(extension, convert):
    material, node = material_of("diffuse", Color=(0.5, 0.5, 0.5))
    assert convert.apply(convert.plan([material])) == 1
    material.node_tree.nodes.remove(node)
    assert convert.restore(material) == 1
    (group,) = extension.model_nodes.group_nodes(material)
    assert extension.model_nodes.identity(group) == ("lambert", "twin")


def test_the_button_has_a_limit(extension, item):
    start = shown_nodes()
    node = bpy.data.materials["principled"].node_tree.nodes["Principled BSDF"]
    assert bpy.ops.brdfc.convert(limit=0.5) == {"FINISHED"}
    shown = shown_nodes()
    assert shown["principled"] == start["principled"] and node.outputs[0].is_linked
    assert shown["diffuse"] != start["diffuse"]


def test_a_limit_that_is_changed_afterwards_plans_anew(extension, item):
    """In the panel of the last operator, which first undoes it: original nodes may be gone."""
    operator = import_module(f"{extension.package}.operators.convert").BRDFC_OT_convert
    said = []
    last = SimpleNamespace(limit=35.0, _plans=None, report=lambda kind, text: said.append(text))
    last.layout = helpers.Layout()
    last._within = lambda: operator._within(last)
    assert operator.execute(last, bpy.context) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Convert")
    assert bpy.ops.ed.undo() == {"FINISHED"}
    last.limit = 0.5
    operator.draw(last, bpy.context)
    assert last.layout.log == ["value : 0.5"]
    assert operator.execute(last, bpy.context) == {"FINISHED"}
    rows = [line for line in said if ": " in line]
    assert ["stays" in line for line in rows] == [False, False, False, True]


@pytest.mark.parametrize("osl", [True, False])
def test_the_dialog_says_what_the_new_nodes_cost(extension, convert, item, osl):
    scene = bpy.context.scene
    scene.cycles.shading_system = osl

    def of(name):
        return extension.pack.model(name).automatic(osl=osl).entry["cost"]

    plans = convert.plan([bpy.data.materials[kind] for kind in ("diffuse", "principled")])
    assert [[part.model for part in plan.parts] for plan in plans] == [
        ["lambert"],
        ["microfacet", "lambert"],
    ]
    low, high = of("lambert"), of("microfacet") + of("lambert") - 1
    assert 0.9 < low < high < 8
    said = f"about {low:.1f} to {high:.1f} times as long as a Glossy node"
    assert said in convert.cost(plans, scene)
    assert f"about {low:.1f} times" in convert.cost(plans[:1], scene)
    layout = helpers.Layout()
    operator = import_module(f"{extension.package}.operators.convert").BRDFC_OT_convert
    drawn = SimpleNamespace(layout=layout, limit=35.0, _within=lambda: plans)
    operator.draw(drawn, bpy.context)
    assert said in " ".join(layout.log)
    scene.render.engine = "BLENDER_WORKBENCH"  # renders no models
    assert convert.cost(plans, scene) is None


def test_nothing_to_convert(extension, item):
    for material in bpy.data.materials:
        material.node_tree.nodes.clear()
    before = helpers.counts()
    assert bpy.ops.brdfc.convert() == {"CANCELLED"}
    assert helpers.counts() == before
