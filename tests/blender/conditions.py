# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how settings and scenes of users affect each form, relative to clean ones.

The scene consists of grooves: each cell of a grid is a V of two quads with closed ends, so that
light bounces inside it but does not reach other cells. One render shows every form in many cells.
In half of them both walls have the form's material, in the others one wall is white, to show
caustics. A condition is a change to this scene; its bias is the resulting change in the mean
radiance of a form's cells.
"""

import dataclasses
import math
import re

import bpy
import numpy as np
from goniometer import DISTANCE, Goniometer, frame, tilted, unit
from helpers import (
    add_camera,
    add_world,
    albedo_and_mirror,
    draw,
    node_material,
    render,
    render_passes,
)
from mathutils import Quaternion, Vector
from worlds import gradient

#: Number of cells for each form and kind.
REPLICAS = 40
#: Distance between cells, and thereby the size of a pixel; a groove is 1 wide and 1/2 deep.
PITCH = 2.0
#: Direction towards the sun.
SUN = (0.3, -0.25, 0.9)
#: A bias counts if it is at least this fraction and at least this many standard errors.
BIASED, SIGNIFICANT = 0.02, 5.0


#: Values other than the models' defaults: a coat whose mirror reflects enough to matter.
VALUES = {"coupled": {"r0": 0.5}}


@dataclasses.dataclass(frozen=True)
class Form:
    model: str
    form: str
    mirror: bool = False

    @property
    def values(self):
        return VALUES.get(self.model, {})

    def __str__(self):
        return f"{self.model} ({self.form})"


#: Blender's own nodes, for comparison.
NATIVE = DIFFUSE, GLOSSY = Form("Diffuse", "node"), Form("Glossy", "node")


def representatives(extension, listed, nodes=False):
    """Forms that represent all others, by what they consist of; or Formula Nodes, which are made
    otherwise (docs/nodes-measured.md: results). `listed`: from `brdfc list --json`."""
    models = {m["name"]: m for m in listed}
    forms = {}

    def has_ramp(entry):
        return entry["representations"]["exact"]["slots"] > 1

    def of_facets(entry):
        warnings = entry["representations"]["fitted"]["warnings"]
        return any(code.startswith("filter_glossy") for code in warnings)

    def pick(name, form, key):
        fitting = [
            m
            for m, e in extension.api.models().items()
            if form in e["representations"] and m in models and key(models[m], e)
        ]
        if fitting:
            model = sorted(fitting)[0]
            forms[name] = Form(model, form, models[model]["mirror"])

    if nodes:
        # Bases: microfacets, none, cones, microfacets and Diffuse.
        for model in ("cook_torrance", "radziszewski_alda", "coupled", "schlick"):
            pick(f"nodes, {model}", "nodes", lambda m, e, model=model: m["name"] == model)
        return list(forms.values())
    pick("closures and a mirror", "exact", lambda m, e: m["mirror"] and e["auto"] == "exact")
    pick("closures alone", "exact", lambda m, e: not m["mirror"])
    pick("closures with a ramp", "exact", lambda m, e: not m["mirror"] and has_ramp(e))
    pick("drawn, with a mirror", "sampled", lambda m, e: m["mirror"])
    pick("drawn, anisotropic", "sampled", lambda m, e: not e["isotropic"])
    pick("fitted, with facets", "fitted", lambda m, e: of_facets(e))
    pick("fitted, of lobes", "fitted", lambda m, e: not of_facets(e))
    # Bases: microfacets below the sampled directions, none, with a mirror, ramps.
    for model in ("cook_torrance", "radziszewski_alda", "schlick_double", "phong_material"):
        pick(f"aimed, {model}", "aimed", lambda m, e, model=model: m["name"] == model)
    pick(
        "drawn alone",
        "sampled",
        lambda m, e: not m["mirror"] and "exact" not in e["representations"] and e["isotropic"],
    )
    return list(dict.fromkeys(forms.values()))


def material_of(extension, form):
    if form == DIFFUSE:
        return node_material("ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8, 1))
    if form == GLOSSY:
        return node_material("ShaderNodeBsdfAnisotropic", Color=(0.8, 0.8, 0.8, 1), Roughness=0.3)
    return extension.api.new_material(form.model, form.form, **form.values)


def _plain(grey):
    return node_material("ShaderNodeBsdfDiffuse", Color=(grey, grey, grey, 1))


class Grooves:
    """The scene. `copies`: number of materials for each form; `flip`: faces point away from the
    viewer; `inset`: distance by which the walls are moved against their normals."""

    def __init__(
        self,
        extension,
        forms,
        samples=64,
        copies=1,
        flip=False,
        inset=0.0,
        offset=(0.0, 0.0, 0.0),
    ):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        self.extension, self.scene, self.forms = extension, bpy.context.scene, forms
        extension.scene_loader.apply_clean_settings(self.scene, samples=samples, max_bounces=4)
        self.materials = [[material_of(extension, f) for _ in range(copies)] for f in forms]
        flat = [m for group in self.materials for m in group]
        count = len(forms) * 2 * REPLICAS
        self.side = math.ceil(math.sqrt(count))
        cells = np.random.default_rng(3).permutation(self.side**2)[:count]
        self.columns, self.rows = cells % self.side, cells // self.side
        centre = (self.side - 1) / 2
        vertices, faces, slots = [], [], []
        white, black = len(flat), len(flat) + 1
        s = inset * math.sqrt(0.5)
        # Walls, whose normals point up and towards each other; then the ends.
        quads = [
            [(-0.5, -0.5, 0.5), (0, -0.5, 0), (0, 0.5, 0), (-0.5, 0.5, 0.5)],
            [(0, -0.5, 0), (0.5, -0.5, 0.5), (0.5, 0.5, 0.5), (0, 0.5, 0)],
        ]
        shifts = [(-s, 0, -s), (s, 0, -s)]
        ends = [
            [(-0.6, y, 0.6), (0, y, -0.1), (0.6, y, 0.6)][:: 1 if y > 0 else -1]
            for y in (-0.5, 0.5)
        ]
        for k in range(count):
            form, kind = divmod(k // REPLICAS, 2)
            at = np.array([(self.columns[k] - centre), (self.rows[k] - centre), 0]) * PITCH
            mine = form * copies + k % copies
            other = mine if kind == 0 else white
            for quad, shift, slot in zip(quads, shifts, (mine, other), strict=True):
                moved = np.array(shift) if slot == mine else np.zeros(3)
                corners = [np.add(c, moved) + at for c in quad]
                faces.append([len(vertices) + i for i in range(4)][:: -1 if flip else 1])
                vertices += corners
                slots.append(slot)
            for end in ends:
                faces.append([len(vertices) + i for i in range(3)])
                vertices += [np.array(c) + at for c in end]
                slots.append(black)
        mesh = bpy.data.meshes.new("grooves")
        mesh.from_pydata([tuple(v) for v in vertices], [], faces)
        for material in (*flat, _plain(0.8), _plain(0.0)):
            mesh.materials.append(material)
        mesh.polygons.foreach_set("material_index", np.array(slots, np.int32))
        mesh.update()
        self.object = bpy.data.objects.new("grooves", mesh)
        self.object.location = offset
        self.scene.collection.objects.link(self.object)
        self._view(np.array(offset))
        self._lights()

    def _view(self, offset):
        size = PITCH * self.side
        height = DISTANCE * size
        camera = add_camera(self.scene, tuple(offset + (0, 0, height)), (0, 0, 0))
        camera.sensor_fit = "VERTICAL"
        camera.angle = 2 * math.atan(0.5 / DISTANCE)
        camera.clip_start, camera.clip_end = 0.01, 10 * height
        self.scene.render.resolution_x = self.scene.render.resolution_y = self.side
        self.scene.render.film_transparent = True

    def _lights(self):
        tree, background = add_world(self.scene)
        gradient(tree, background)
        data = bpy.data.lights.new("Sun", "SUN")
        # Bright enough for clamps to have an effect.
        data.energy, data.angle = 3.0, 0.3
        self.sun = bpy.data.objects.new("Sun", data)
        self.sun.rotation_mode = "QUATERNION"
        self.sun.rotation_quaternion = Vector(SUN).to_track_quat("Z", "Y")
        self.scene.collection.objects.link(self.sun)

    def add_sun(self, towards, name="Other"):
        """Adds another sun like the first one, in the direction `towards`."""
        other = self.sun.copy()
        other.data, other.name = self.sun.data.copy(), name
        other.rotation_quaternion = Vector(towards).to_track_quat("Z", "Y")
        self.scene.collection.objects.link(other)
        return other

    def measure(self):
        """Radiance of each form's cells, (forms, 2, replicas)."""
        # Forms that aim at lamps need the lamps in their slots.
        lamps = self.extension.api.see_lamps(self.scene)
        if any(f.form == "aimed" for f in self.forms):
            assert any(lamp.slot for lamp in lamps)
        picture = render(self.scene)[self.rows, self.columns]
        colour = picture[:, :3].mean(-1) / np.maximum(picture[:, 3], 1e-6)
        return colour.reshape(len(self.forms), 2, REPLICAS)


# ---- the conditions ---------------------------------------------------------------------------


def _cycles(**settings):
    def change(grooves):
        for name, value in settings.items():
            setattr(grooves.scene.cycles, name, value)

    return change


#: Settings of a new file that differ from those of a clean scene.
FACTORY = {
    "use_adaptive_sampling": True,
    "adaptive_threshold": 0.01,
    "blur_glossy": 1.0,
    "sample_clamp_indirect": 10.0,
    "light_sampling_threshold": 0.01,
    "caustics_reflective": True,
    "use_guiding": False,
}


def _instance(grooves):
    """Shows the grooves through an instance of a collection that lies elsewhere."""
    collection = bpy.data.collections.new("source")
    collection.objects.link(grooves.object)
    grooves.scene.collection.objects.unlink(grooves.object)
    empty = bpy.data.objects.new("instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    collection.instance_offset = (5.0, 3.0, 1.0)
    empty.location = (5.0, 3.0, 1.0)
    grooves.scene.collection.objects.link(empty)


def _moving(grooves):
    grooves.scene.render.use_motion_blur = True
    grooves.scene.frame_set(1)
    for time, x in ((0, -0.4), (2, 0.4)):
        grooves.object.location.x = x
        grooves.object.keyframe_insert("location", frame=time)


def _deforming(grooves):
    grooves.scene.render.use_motion_blur = True
    grooves.scene.frame_set(1)
    grooves.object.shape_key_add(name="rest")
    key = grooves.object.shape_key_add(name="moved")
    for point in key.data:
        point.co.x += 0.8
    for time, value in ((0, 0.0), (2, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=time)
    # In the middle of the motion it is where the still one is.
    grooves.object.location.x -= 0.4


INSET = 0.05


def _displaced(grooves):
    for group in grooves.materials:
        for material in group:
            tree = material.node_tree
            output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
            node = tree.nodes.new("ShaderNodeDisplacement")
            node.inputs["Height"].default_value = INSET
            node.inputs["Midlevel"].default_value = 0.0
            node.inputs["Scale"].default_value = 1.0
            tree.links.new(node.outputs[0], output.inputs["Displacement"])
            material.displacement_method = "DISPLACEMENT"


#: Small, but large enough to be hit by random rays.
SMALL_SUN = 0.02


def _small_sun(grooves):
    grooves.sun.data.angle = SMALL_SUN


def _no_size(grooves):
    grooves.sun.data.angle = 0.0


def _overhead(grooves):
    """A sun that no wall hides, and the ends of the grooves only slightly."""
    grooves.sun.rotation_quaternion = (1, 0, 0, 0)
    grooves.sun.data.angle = 0.05


def _shadowless(grooves):
    _overhead(grooves)
    grooves.sun.data.use_shadow = False


def _wide(grooves):
    """A sun that BSDF sampling hits as often as light sampling does."""
    grooves.sun.data.angle = 1.0


def _without_multiple_importance(grooves):
    _wide(grooves)
    grooves.sun.data.cycles.use_multiple_importance_sampling = False


def _hidden_lamp(grooves):
    grooves.sun.visible_camera = False


def _turning_lamp(grooves):
    grooves.scene.render.use_motion_blur = True
    grooves.scene.frame_set(1)
    middle = grooves.sun.rotation_quaternion.copy()
    for time, angle in ((0, -0.4), (2, 0.4)):
        grooves.sun.rotation_quaternion = middle @ Quaternion((1, 0, 0), angle)
        grooves.sun.keyframe_insert("rotation_quaternion", frame=time)


def _collection_of(item, name):
    collection = bpy.data.collections.new(name)
    collection.objects.link(item)
    return collection


def _linked_elsewhere(grooves):
    """Adds another sun that is linked to another object only (light linking)."""
    mesh = bpy.data.meshes.new("elsewhere")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    elsewhere = bpy.data.objects.new("elsewhere", mesh)
    elsewhere.location.z = -100
    grooves.scene.collection.objects.link(elsewhere)
    other = grooves.add_sun((-0.2, 0.3, 0.9))
    other.light_linking.receiver_collection = _collection_of(elsewhere, "receivers")


def _linked_here(grooves):
    here = _collection_of(grooves.object, "here")
    grooves.sun.light_linking.receiver_collection = here
    grooves.sun.light_linking.blocker_collection = here


def _portal(grooves):
    data = bpy.data.lights.new("Portal", "AREA")
    data.size = 4 * PITCH * grooves.side
    data.cycles.is_portal = True
    portal = bpy.data.objects.new("Portal", data)
    portal.location.z = 2
    grooves.scene.collection.objects.link(portal)


def _nine_suns(grooves):
    """Replaces the sun by nine, more than the list of lamps can hold, with the same total light."""
    grooves.sun.data.energy /= 9
    for i in range(8):
        grooves.add_sun(SUN, f"Sun{i}")


@dataclasses.dataclass(frozen=True)
class Condition:
    """`change` alters the clean grooves, which are built with `build`. `clean`, if given, alters
    the grooves that these are compared with. `code`: prefix of the panel's codes where a form is
    affected. `light_from_a_point`: the lamp has no size, so mirrors do not show it, in the model
    neither. Forms that sample directions show it as rare bright dots, so they are judged by the
    median cell, as a user would. Closures do show it, and are compared with a very small lamp
    instead, because a narrow highlight looks different under a wide lamp."""

    name: str
    change: object = None
    build: tuple = ()
    code: str | tuple = ""
    quick: bool = False
    light_from_a_point: bool = False
    clean: object = None


CONDITIONS = [
    Condition("default settings", _cycles(**FACTORY), code=("clamp", "filter_glossy"), quick=True),
    Condition("clamp indirect 10", _cycles(sample_clamp_indirect=10.0), code="clamp"),
    Condition("clamp indirect 1", _cycles(sample_clamp_indirect=1.0), code="clamp"),
    Condition("clamp direct 10", _cycles(sample_clamp_direct=10.0), code="clamp_direct"),
    Condition("filter glossy 1", _cycles(blur_glossy=1.0), code="filter_glossy", quick=True),
    Condition("path guiding", _cycles(use_guiding=True), code="path_guiding"),
    Condition("caustics off", _cycles(caustics_reflective=False), code="caustics", quick=True),
    Condition(
        "sun without size", _no_size, (), "zero_size_lights", quick=True, light_from_a_point=True
    ),
    Condition("lamp without shadows", _shadowless, clean=_overhead),
    Condition(
        "lamp without multiple importance",
        _without_multiple_importance,
        code="multiple_importance",
        clean=_wide,
    ),
    Condition("lamp that cameras can't see", _hidden_lamp),
    Condition("lamp that turns", _turning_lamp),
    Condition("lamp linked elsewhere", _linked_elsewhere),
    Condition("lamp linked here", _linked_here),
    Condition("nine lamps for one", _nine_suns),
    Condition("no light tree", _cycles(use_light_tree=False)),
    Condition("portal", _portal),
    Condition("backfaces", build=(("flip", True),), quick=True),
    Condition("instance", _instance),
    Condition("object motion", _moving),
    Condition("deformation motion", _deforming),
    Condition("true displacement", _displaced, build=(("inset", INSET),)),
    Condition("10 km from the origin", build=(("offset", (1e4, 1e4, 0.0)),)),
    Condition("40 materials", build=(("copies", 8),)),
]


def is_warned(row):
    codes = row["code"] if isinstance(row["code"], tuple | list) else (row["code"],)
    return any(w.startswith(c) for w in row["warned"] for c in codes if c)


def panel_warns(extension, grooves):
    """Codes of the panel's findings for each form."""
    return [
        {f.code for f in extension.api.warnings(group[0], grooves.scene)}
        for group in grooves.materials
    ]


def measure(extension, forms, names, samples):
    """Measures these conditions (None: all). Returns rows with the condition, the form, the bias
    relative to the clean radiance, its standard error, and the panel's codes.
    """
    rows = []
    chosen = [c for c in CONDITIONS if names is None or c.name in names]
    unchanged = {}
    for change in {c.clean: None for c in chosen} | {None: None, _small_sun: None}:
        grooves = Grooves(extension, forms, samples)
        if change:
            change(grooves)
        unchanged[change] = grooves.measure()
    small = unchanged[_small_sun]
    for condition in chosen:
        before = unchanged[condition.clean]
        grooves = Grooves(extension, forms, samples, **dict(condition.build))
        if condition.change:
            condition.change(grooves)
        after = grooves.measure()
        warned = panel_warns(extension, grooves)
        for i, form in enumerate(forms):
            if condition.light_from_a_point and form.mirror and form.form != "sampled":
                continue
            if condition.light_from_a_point and form.form == "sampled":
                bias, error = change_of_median(before[i], after[i])
            else:
                # The same cells are compared: with equal random numbers, the noise cancels.
                clear = small[i] if condition.light_from_a_point else before[i]
                mean = clear.mean()
                off = after[i] - clear
                bias = off.mean() / mean
                error = np.sqrt(off.var(1, ddof=1).sum() / REPLICAS) / (2 * mean)
            biased = abs(bias) > BIASED and abs(bias) > SIGNIFICANT * error
            rows.append(
                {
                    "condition": condition.name,
                    "form": str(form),
                    "bias": float(bias),
                    "error": float(error),
                    "biased": bool(biased),
                    "code": condition.code,
                    "warned": sorted(warned[i]),
                }
            )
    return rows


def change_of_median(before, after):
    """Relative change of the median cell for each kind, and its standard error."""
    middle = [np.median(x, 1).sum() for x in (before, after)]
    # The standard error of the median, from the median deviation of a normal distribution.
    variances = [
        (1.2533 * 1.4826 * np.median(np.abs(x - np.median(x, 1)[:, None]), 1)) ** 2 / REPLICAS
        for x in (before, after)
    ]
    return middle[1] / middle[0] - 1, np.sqrt(np.sum(variances)) / middle[0]


# ---- passes -----------------------------------------------------------------------------------


def passes(extension, tool, forms):
    """The render passes for denoisers and compositors, by form, under a white sky and a sun: their
    differences from the model's albedo, the normal and the picture."""
    rows = []
    cosines = np.tile((0.2, 0.5, 0.8, 1.0), 64)
    normals = tilted(cosines, np.linspace(0, 6, len(cosines)))
    for form in forms:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        extension.scene_loader.apply_clean_settings(scene, max_bounces=1)
        material = material_of(extension, form)
        meter = Goniometer(scene, material, normals, samples=64, perspective=True)
        meter.add_world()
        data = bpy.data.lights.new("Sun", "SUN")
        data.angle = 0.3
        sun = bpy.data.objects.new("Sun", data)
        scene.collection.objects.link(sun)
        layer = scene.view_layers[0]
        for owner, group in ((scene.world, "sky"), (sun, "sun")):
            layer.lightgroups.add(name=group)
            owner.lightgroup = group
        extension.api.see_lamps(scene)
        layer.cycles.denoising_store_passes = True
        layer.use_pass_diffuse_color = layer.use_pass_glossy_color = True
        layer.use_pass_transmission_color = True
        found = render_passes(scene)
        at = (meter.rows, meter.columns)
        alpha = np.maximum(found["Combined"][at][:, 3:], 1e-6)

        def value(*names, found=found, at=at, alpha=alpha):
            # Passes were renamed in 5.0.
            name = next(n for n in names if n in found)
            return found[name][at][:, :3] / alpha

        wo = meter.wo()
        if form in NATIVE:
            expected = scattered = np.full_like(wo, 0.8)
        else:
            first, mirrors = albedo_and_mirror(tool, form.model, form.values, wo[:4, 2])
            expected = np.tile(first, (64, 1))
            # Denoisers see through mirrors, whose weight is not in this pass.
            scattered = np.tile(first - mirrors, (64, 1))
        colours = (
            value("DiffCol", "Diffuse Color")
            + value("GlossCol", "Glossy Color")
            + value("TransCol", "Transmission Color")
        )
        # In camera space; the camera looks along its z axis.
        normal = unit(value("Denoising Normal")) * (1, 1, -1)
        angle = np.degrees(np.arccos(np.clip((normal * meter.normals).sum(-1), -1, 1)))
        # The closures of a fit lean, and so does their mean, alike in neighbouring pixels. Only
        # normals that differ at random mislead a denoiser.
        uneven = angle.reshape(64, 4).std(0).mean()
        warned = {f.code for f in extension.api.warnings(material, scene)}
        combined = value("Combined")
        groups = value("Combined_sky") + value("Combined_sun")
        for name, bias, biased in (
            ("denoising albedo", (value("Denoising Albedo") - scattered).mean(), None),
            ("colour passes", (colours - expected).mean(), None),
            ("denoising normal, degrees", np.median(angle), np.median(angle) > 5 and uneven > 0.5),
            ("light group", np.abs(groups - combined).max(), None),
        ):
            rows.append(
                {
                    "condition": name,
                    "form": str(form),
                    "bias": float(bias),
                    "error": 0.0,
                    "biased": bool(abs(bias) > BIASED if biased is None else biased),
                    "code": "normal_pass" if "normal" in name else "albedo_passes",
                    "warned": sorted(warned),
                }
            )
    return rows


# ---- tilted normals ---------------------------------------------------------------------------

TILT = 0.3
#: Approximate albedo of Blender's nodes, with the values in material_of(), about any normal: at
#: this roughness the Glossy node loses little light.
NATIVE_ALBEDO = {DIFFUSE: 0.8, GLOSSY: 0.8}
#: Name of the condition, whether the mesh's own normals are tilted, and whether Bump Map Correction
#: is on.
TILTED = (
    ("smooth normals", True, False),
    ("Normal input", False, False),
    ("bump correction", False, True),
)


def normals(extension, tool, forms):
    """Tilts the shading normal, by the mesh or by the input Normal, in a white world.

    Returns the fraction of the light that is lost, in the worst of some views, relative to the
    light that the model reflects about the corrected normal. Rays below the true surface are lost,
    as with Blender's own nodes. It is a bias if the loss differs from that of the model's samples
    in double precision or, where the setting darkens diffuse closures, from that of Blender's
    Diffuse node."""
    rows, softened, unsoftened = [], 0.0, 0.0
    cosines = np.array((0.4, 0.7, 0.95))
    replicas = 64
    flat = tilted(np.repeat(cosines, replicas), 0.5)
    which = np.arange(len(cosines)) * replicas
    for form in [*NATIVE, *forms]:
        whole = lit = None
        of_fit = 0.0 if form in NATIVE else _error_of_fit(extension, form)
        for condition, smooth, correction in TILTED:
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            scene = bpy.context.scene
            extension.scene_loader.apply_clean_settings(scene, max_bounces=1)
            material = material_of(extension, form)
            material.cycles.use_bump_map_correction = correction
            meter = Goniometer(scene, material, flat, samples=2048, perspective=True)
            meter.add_world()
            axis = unit((0.4, -0.9, 0.2))
            bent = unit(meter.normals + math.tan(TILT) * unit(np.cross(meter.normals, axis)))
            _bend(meter, material, bent, smooth)
            found = meter.measure().mean(-1).reshape(len(cosines), replicas)
            if whole is None:
                surfaces, seen = meter.normals[which], bent[which]
                if form in NATIVE or extension.api.models()[form.model]["look"] != "matte":
                    seen = [corrected(n, s) for n, s in zip(seen, surfaces, strict=True)]
                if form in NATIVE:  # relative to its untilted brightness
                    whole = np.full(len(cosines), NATIVE_ALBEDO[form])
                else:
                    whole, lit = _lit_from_above(tool, form, surfaces, np.array(seen))
            error = found.std(1, ddof=1) / math.sqrt(replicas) / whole
            bias = found.mean(1) / whole - 1
            off = bias if lit is None else bias - (lit / whole - 1)
            if form == DIFFUSE:
                if correction:
                    softened = np.abs(bias - unsoftened).max()
                unsoftened = bias
            k = np.abs(off).argmax()
            allowed = BIASED + of_fit + (softened if correction else 0.0)
            warned = {f.code for f in extension.api.warnings(material, scene)}
            rows.append(
                {
                    "condition": condition,
                    "form": str(form),
                    "bias": float(bias[k]),
                    "error": float(error[k]),
                    "biased": bool(
                        lit is not None and abs(off[k]) > max(allowed, SIGNIFICANT * error[k])
                    ),
                    "code": "bump_correction" if correction else "",
                    "warned": sorted(warned),
                }
            )
    return rows


def _error_of_fit(extension, form):
    """The largest error that the form states for a view: the fraction of the light that a fit
    reflects in other directions, which a tilted surface may cut off."""
    note = extension.api.models()[form.model]["representations"][form.form]["error"]["note"]
    stated = re.search(r"error at most ([0-9.e-]+)", note)
    return float(stated[1]) if stated else 0.0


def corrected(normal, surface, view=(0.0, 0.0, 1.0)):
    """A shading normal rotated towards the surface's until the mirror direction is above the
    surface by the amount that Cycles requires; found by bisection."""
    least = min(0.9 * np.dot(surface, view), 0.01)

    def rises(n):
        return 2 * np.dot(n, view) * np.dot(n, surface) - np.dot(surface, view) >= least

    if rises(normal):
        return normal
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        if rises(unit(normal + middle * (surface - normal))):
            high = middle
        else:
            low = middle
    return unit(normal + high * (surface - normal))


def _bend(meter, material, bent, smooth):
    """Gives each facet its normal in `bent`."""
    if smooth:
        mesh = meter.mesh
        mesh.polygons.foreach_set("use_smooth", np.ones(len(bent), bool))
        attribute = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", np.repeat(bent, 4, 0).astype(np.float32).ravel())
        mesh.update()
        return
    meter._add_attribute("bent", bent.astype(np.float32))
    tree = material.node_tree
    read = tree.nodes.new("ShaderNodeAttribute")
    read.attribute_name = "bent"
    shader = next(n for n in tree.nodes if "Normal" in n.inputs)
    tree.links.new(read.outputs["Vector"], shader.inputs["Normal"])


def _lit_from_above(tool, form, flat, bent):
    """Fraction of a white world's light that a model reflects about the normals `bent`, seen from
    above: in total, and without rays that end below `flat`."""
    whole, lit = [], []
    mirrors = np.zeros((len(bent), 3))
    if form.mirror:
        mirrors = albedo_and_mirror(tool, form.model, form.values, bent[:, 2])[1]
    for n, surface, mirror in zip(bent, flat, mirrors, strict=True):
        axes = np.stack([*(a[0] for a in frame(n[None])), n])
        wi, weight = draw(tool, form.model, form.values, axes @ (0.0, 0.0, 1.0), 1 << 14)
        above = (wi @ axes) @ surface > 0
        reflected = 2 * axes[2, 2] * n - np.array([0.0, 0.0, 1.0])
        whole.append((weight.sum(0) + mirror).mean())
        lit.append((weight[above].sum(0) + mirror * (reflected @ surface > 0)).mean())
    return np.array(whole), np.array(lit)
