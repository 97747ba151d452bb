# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how Cycles' devices render the models; script/gpu runs it once per device.

Needs `bpy` with NumPy, and the files that script/gpu puts beside this one: the machine may have
neither the tool nor a network. `expect` computes the expected values, with the tool. `measure`
renders on one device and adds to a JSON file after each step, so that results survive a crash. The
devices' kernels may be compiled at the same time, but only one process at a time measures.
`compare` prints tables of such files.
"""

import argparse
import contextlib
import datetime
import fcntl
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

PACKAGE = "bl_ext.user_default.brdfc_shaders"
#: The device, and whether Open Shading Language runs there.
MODES = {
    "cpu": ("CPU", False),
    "cpu-osl": ("CPU", True),
    "cuda": ("CUDA", False),
    "optix": ("OPTIX", False),
    "optix-osl": ("OPTIX", True),
    "optix-osl-unoptimized": ("OPTIX", True),
}
#: The driver may take many minutes to optimise OptiX' kernel for OSL. Cycles can ask it not to
#: optimise; times have no meaning then.
UNOPTIMIZED = "optix-osl-unoptimized"
#: Direction towards the sun for the facets; the camera is above them.
SUN = (0.5, 0.2, 0.8)
FACETS = 100
#: Values far from the defaults, at which single precision becomes visible.
STIFF = {
    "ashikhmin_shirley": {"nu": 100.0, "nv": 1e4, "rs": 0.9, "rd": 0.0},
    "blinn": {"e": 2000.0},
    "cook_torrance": {"m": 0.03},
    "glossy_reflector": {"e": 10.0},
    "max_phong": {"e": 5.0},
    "phong": {"e": 5000.0},
    "radziszewski_alda": {"n": 50.0},
    "schlick": {"rough": 0.01, "p": 0.5},
    "ward": {"ax": 0.02, "ay": 0.3},
}
#: Models on the ball: the first ones under every number of lamps and the other lights, the others
#: under four lamps.
BALLS = {"ashikhmin_shirley": {}, "ward": {}, "microfacet": {}}
OTHERS = {
    "cook_torrance": {},
    "radziszewski_alda": {"n": 4.0},
    "coupled": {},
    "schlick": {},
    "eon": {},
    "oren_nayar": {},
    "phong": {"e": 100.0},
}
#: Numbers of point lamps, and names of conditions in noise_scenes.
LAMPS, LIGHTS = (0, 1, 2, 4, 8), ("area", "sun", "sky_texture")
#: The models of the picture, which people look at.
PICTURE = (
    "ashikhmin_shirley",
    "ward",
    "microfacet",
    "cook_torrance",
    "radziszewski_alda",
    "coupled",
    "eon",
    "glossy_reflector",
)
BLOCK = 8


def read(path):
    return json.loads(Path(path).read_text(encoding="utf-8"))


def install(folder):
    """Installs the extension from the folder, in separate user settings. Returns its modules by
    name."""
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="brdfc-gpu-")
    import bpy

    sys.path.insert(0, str(folder))
    (archive,) = Path(folder).glob("brdfc_shaders-*.zip")
    bpy.ops.preferences.addon_enable(module="bl_pkg")
    bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True
    )
    from scene_loader import SceneLoader

    modules = {n: import_module(f"{PACKAGE}.{n}") for n in ("api", "packs.pack")}
    return {n.split(".")[-1]: module for n, module in modules.items()} | {
        "scene_loader": SceneLoader(PACKAGE)
    }


def use_device(kind):
    """Makes Blender render on the devices of a kind. Returns their names."""
    import bpy

    preferences = bpy.context.preferences.addons["cycles"].preferences
    if kind == "CPU":
        preferences.compute_device_type = "NONE"
        return ["CPU"]
    preferences.compute_device_type = kind
    preferences.get_devices()
    for device in preferences.devices:
        device.use = device.type == kind
    return [device.name for device in preferences.devices if device.use]


def empty_scene():
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


def set_device(scene, mode):
    import bpy

    kind, osl = MODES[mode]
    if mode == UNOPTIMIZED:  # Cycles reads this setting of its developers only with these two
        bpy.context.preferences.view.show_developer_ui = True
        bpy.context.preferences.experimental.use_cycles_debug = True
        scene.cycles.debug_use_optix_debug = True
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU" if kind == "CPU" else "GPU"
    scene.cycles.shading_system = osl


# ---- facets: light without a size against the formula ------------------------------------------


def facet_cases(models, form):
    """[(model, values)] for models that have the form: at the defaults, and at extreme values."""
    cases = [(name, {}) for name in models if form in models[name]["representations"]]
    return cases + [(name, v) for name, v in STIFF.items() if (name, {}) in cases]


def facets(modules, cases, forms, mode, samples):
    """A Goniometer for cases under a sun with angle 0, and the index of each facet's case."""
    import numpy as np
    from goniometer import Goniometer, tilted, unit

    rng = np.random.default_rng(17)
    which = np.repeat(np.arange(len(cases)), FACETS)
    normals = tilted(rng.uniform(0.05, 1, len(which)), rng.uniform(0, 2 * math.pi, len(which)))
    near = unit(unit(unit(SUN) + (0, 0, 1)) + 0.1 * rng.normal(size=(len(which), 3)))
    normals = np.where((np.arange(len(which)) % 2 == 0)[:, None], near, normals)
    scene = empty_scene()
    modules["scene_loader"].apply_clean_settings(scene, max_bounces=0)
    made = [modules["api"].new_material(n, f, **v) for (n, v), f in zip(cases, forms, strict=True)]
    meter = Goniometer(scene, made, normals, samples=samples, which=which)
    set_device(scene, mode)
    wi = meter.local(meter.add_sun(unit(SUN)))
    modules["api"].see_lamps(scene)
    return meter, which, wi


def expect(folder, tool):
    """Writes facets.json: f cos of every case at every facet, computed by the tool."""
    modules = install(folder)
    from helpers import evaluate

    def run(*arguments, stdin=""):
        done = subprocess.run(
            [tool, *map(str, arguments)], input=stdin, text=True, capture_output=True
        )
        if done.returncode:
            raise RuntimeError(done.stderr)
        return done.stdout

    cases = facet_cases(modules["pack"].manifest()["models"], "nodes")
    meter, which, wi = facets(modules, cases, ["nodes"] * len(cases), "cpu", 1)
    wo = meter.wo()
    out = []
    for i, (name, values) in enumerate(cases):
        lit = (which == i) & (wi[:, 2] > 1e-3)
        f = evaluate(run, name, values, wi[lit], wo[lit]) * wi[lit, 2:]
        out.append({"model": name, "values": values, "f": f.tolist()})
    (Path(folder) / "facets.json").write_text(json.dumps(out), encoding="utf-8")


def measure_facets(folder, modules, mode):
    """[{model, values, form, relative L1}] of every case."""
    import numpy as np

    expected = read(Path(folder) / "facets.json")
    cases = [(e["model"], e["values"]) for e in expected]
    forms = [form_of(modules, n, mode) for n, _ in cases]
    start = time.perf_counter()
    meter, which, wi = facets(modules, cases, forms, mode, 64)
    made = time.perf_counter()
    picture = meter.measure()
    rendered = time.perf_counter()
    rows = []
    for i, e in enumerate(expected):
        lit = (which == i) & (wi[:, 2] > 1e-3)
        f = np.array(e["f"])
        row = {"model": e["model"], "values": e["values"], "form": forms[i]}
        if f.sum() > 0:  # 0 for mirrors, which don't show a sun without an angle
            error = np.sort(np.abs(picture[lit] - f).sum(1))
            # About once in 1e5 samples, a sampled direction's lobe contains the sun, which affects
            # one facet in thirty.
            row["off"] = float(error[: len(error) - len(error) // 30].sum() / f.sum())
            row["worst_facet"] = float(error[-1] / f.sum() * len(f))
        row["finite"] = bool(np.isfinite(picture[lit]).all())
        rows.append(row)
    return {"rows": rows, "make_s": made - start, "render_s": rendered - made}


# ---- balls: noise, time and means under lamps --------------------------------------------------


def ball_scene(modules, model, values, form, lamps, size, mode):
    """A ball with a material on a floor, under this number of point lamps, or another light, and a
    dim sky."""
    import noise_scenes
    from mathutils import Vector

    scene = empty_scene()
    noise_scenes.settings(scene, size)
    scene.render.threads_mode = "AUTO"
    scene.render.use_persistent_data = True
    if lamps != "sky_texture":
        noise_scenes.world(scene, 0.2)
    floor = [noise_scenes.rectangle(-20, 20, -20, 20, 0)]
    noise_scenes.quads(scene, "Floor", noise_scenes.grey("Floor", 0.5), floor)
    ball = noise_scenes.sphere(scene, "Ball", None, 1.0, noise_scenes.CENTRE)
    distance = (noise_scenes.CAMERA - noise_scenes.CENTRE).length
    angle = 2 * math.atan(math.tan(math.asin(1 / distance)) * 7 / 6)
    noise_scenes.camera(scene, noise_scenes.CAMERA, noise_scenes.CENTRE, angle)
    if lamps in LIGHTS:
        noise_scenes.CONDITIONS[lamps].light(scene, None)
    for index in range(0 if lamps in LIGHTS else lamps):
        turn = 2.4 * index
        towards = Vector((math.sin(turn), -math.cos(turn), 0.4 + 0.15 * index)).normalized()
        noise_scenes.lamp(
            scene, "POINT", f"Lamp {index}", towards, share=1 / lamps, shadow_soft_size=0.1
        )
    if form == "glossy":
        material = noise_scenes.node_material("Glossy", "ShaderNodeBsdfAnisotropic", Roughness=0.3)
    else:
        material = modules["api"].new_material(model, form, **values)
    ball.data.materials.append(material)
    set_device(scene, mode)
    modules["api"].see_lamps(scene)
    return scene


def measure_ball(modules, mode, case, size, samples):
    """Time, noise and means by blocks for one ball."""
    import numpy as np
    from helpers import render

    model, values, form, lamps = case
    start = time.perf_counter()
    scene = ball_scene(modules, model, values, form, lamps, size, mode)
    made = time.perf_counter() - start
    times, pictures = {}, []
    # GPUs render as many samples at once as fit, so only a longer picture shows the time.
    timed = samples * (1 if MODES[mode][0] == "CPU" or mode == UNOPTIMIZED else 16)
    for name, seed, count in (
        ("first", 1, 1),
        ("shortest", 1, 1),
        ("one", 2, samples),
        ("other", 3, samples),
        ("timed", 4, timed),
    ):
        if name == "timed" and timed == samples:
            times[name] = min(times["one"], times["other"])
            continue
        scene.cycles.seed, scene.cycles.samples = seed, count
        start = time.perf_counter()
        picture = render(scene)[..., :3]
        times[name] = time.perf_counter() - start
        if name in ("one", "other"):
            pictures.append(picture)
    a, b = pictures
    blocks = [
        p.reshape(size // BLOCK, BLOCK, size // BLOCK, BLOCK, 3).mean((1, 3)) for p in pictures
    ]
    mean = (a + b) / 2
    noise = ((a - b) ** 2 / 2 / (mean**2 + 1e-2)).mean() * samples
    per_sample = (times["timed"] - times["shortest"]) / ((timed - 1) * size * size)
    return {
        "model": model,
        "values": values,
        "form": form,
        "lamps": lamps,
        "make_s": made,
        "seconds": times,
        "ns_per_sample": per_sample * 1e9,
        "rel_mse_of_one_sample": float(noise),
        "mean": mean.mean((0, 1)).tolist(),
        "finite": bool(np.isfinite(mean).all()),
        "blocks": [np.round(x, 7).tolist() for x in blocks],
    }


def form_of(modules, model, mode):
    """`nodes` without OSL; with OSL `aimed`, or what `auto` chooses for models that are exact."""
    if not MODES[mode][1]:
        return "nodes"
    forms = modules["pack"].manifest()["models"][model]["representations"]
    return "aimed" if "aimed" in forms else "auto"


def ball_cases(modules, mode, tiny):
    """[(model, values, form, lamps)], the most important first."""
    osl = MODES[mode][1]
    cpu = MODES[mode][0] == "CPU"  # slow, and only there to be compared with
    lamps = (1, 4) if tiny else ((4,) if cpu else LAMPS) + LIGHTS
    cases = [("glossy", {}, "glossy", n) for n in lamps]
    some = dict(list(BALLS.items())[:1]) if tiny else BALLS
    cases += [(m, v, form_of(modules, m, mode), n) for m, v in some.items() for n in lamps]
    if tiny:
        return cases
    if osl:  # the other forms
        models = modules["pack"].manifest()["models"]
        forms = [f for f in models["ashikhmin_shirley"]["representations"] if f != "aimed"]
        cases += [("ashikhmin_shirley", {}, f, 4) for f in forms]
    return cases + [(m, v, form_of(modules, m, mode), 4) for m, v in OTHERS.items()]


def write_picture(modules, mode, path, size, samples):
    """Renders balls of PICTURE's models under an area lamp and a point lamp, to look at."""
    import bpy
    import noise_scenes
    from mathutils import Vector

    scene = empty_scene()
    noise_scenes.settings(scene, size)
    scene.render.resolution_x = 2 * size
    scene.cycles.samples = samples
    noise_scenes.world(scene, 0.3)
    floor = [noise_scenes.rectangle(-40, 40, -40, 40, 0)]
    noise_scenes.quads(scene, "Floor", noise_scenes.grey("Floor", 0.4), floor)
    for index, model in enumerate(PICTURE):
        place = (2.3 * (index % 4 - 1.5), 2.6 * (index // 4), 1)
        material = modules["api"].new_material(model, form_of(modules, model, mode))
        noise_scenes.sphere(scene, model, material, 1.0, place)
    noise_scenes.area(scene, None)
    towards = Vector((-0.7, -0.4, 0.6)).normalized()
    noise_scenes.lamp(scene, "POINT", "Point", towards, share=0.6, shadow_soft_size=0.1)
    noise_scenes.camera(scene, Vector((0, -12, 6)), Vector((0, 1, 1)), math.radians(24))
    set_device(scene, mode)
    modules["api"].see_lamps(scene)
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "PNG", "RGB", "8"
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


@contextlib.contextmanager
def turn(folder):
    """Waits until no other process measures."""
    with open(Path(folder) / "turn", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def compile_kernel(mode):
    """Renders one pixel. Returns the seconds, which with a GPU are those of its kernel."""
    import noise_scenes
    from helpers import render

    scene = empty_scene()
    noise_scenes.settings(scene, 1)
    scene.cycles.samples = 1
    noise_scenes.world(scene)
    noise_scenes.camera(scene, noise_scenes.CAMERA, noise_scenes.CENTRE, 1)
    set_device(scene, mode)
    start = time.perf_counter()
    render(scene)
    return time.perf_counter() - start


def driver():
    """What nvidia-smi reports about cards and driver."""
    command = [
        "nvidia-smi",
        "--query-gpu=name,driver_version,memory.total",
        "--format=csv,noheader",
    ]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def measure(folder, mode, out, tiny):
    modules = install(folder)
    import bpy

    kind, osl = MODES[mode]
    result = {
        "mode": mode,
        "osl": osl,
        "blender": bpy.app.version_string,
        "extension": modules["pack"].manifest()["generator"],
        "date": datetime.datetime.now().isoformat(timespec="seconds"),
        "cores": os.cpu_count(),
        "nvidia": driver(),
        "balls": [],
    }

    def keep():
        Path(out).write_text(json.dumps(result) + "\n", encoding="utf-8")

    try:
        result["devices"] = use_device(kind)
    except Exception as error:  # a build without that device
        result["devices"], result["error"] = [], repr(error)
    keep()
    if not result["devices"]:
        print(f"{mode}: no device")
        return
    print(f"{mode}: {', '.join(result['devices'])}", flush=True)
    result["kernel_s"] = compile_kernel(mode)
    print(f"  first pixel after {result['kernel_s']:.1f} s", flush=True)
    keep()
    with turn(Path(out).parent):
        measure_all(folder, modules, mode, out, result, keep, tiny)


def measure_all(folder, modules, mode, out, result, keep, tiny):
    """Adds facets and balls to the result, and keeps it after each of them."""
    osl = MODES[mode][1]
    size, samples = (64, 16) if tiny else (160, 32 if MODES[mode][0] == "CPU" else 128)

    def measure_the_facets():
        result["facets"] = measure_facets(folder, modules, mode)
        keep()
        for row in result["facets"]["rows"]:
            print(f"  {row['model']} {row['values'] or ''} {row['form']}: {row.get('off', 0):.2g}")

    def look():
        path = Path(out).with_suffix(".png")
        write_picture(modules, mode, path, 3 * size, (4 if mode.startswith("cpu") else 512))

    # With OSL every shader is compiled for the device, which may take minutes.
    if not osl:
        measure_the_facets()
        look()
    for case in ball_cases(modules, mode, tiny):
        try:
            row = measure_ball(modules, mode, case, size, samples)
        except Exception as error:  # continues with the next case
            row = {"model": case[0], "form": case[2], "lamps": case[3], "error": repr(error)}
        result["balls"].append(row)
        keep()
        shown = row.get("error") or f"{row['ns_per_sample']:.0f} ns, mean {row['mean'][1]:.5f}"
        print(f"  {case[0]} {case[2]} {case[3]} lamps: {shown}", flush=True)
    if osl:
        look()
        measure_the_facets()
    result["complete"] = True
    keep()


# ---- comparison --------------------------------------------------------------------------------


def compared(row, other):
    """The relative difference of means with its standard error; and the mean squared difference of
    blocks divided by what their noise explains, which is 1 if both are the same picture."""
    import numpy as np

    (a, b), (c, d) = (np.array(r["blocks"]) for r in (row, other))
    difference = (a + b) / 2 - (c + d) / 2
    noise = ((a - b) ** 2 + (c - d) ** 2) / 4
    mean = ((c + d) / 2).mean()
    count = math.sqrt(difference.size / 3)
    return {
        "mean": float(difference.mean() / mean),
        "error": float(difference.mean(-1).std() / count / mean),
        "blocks": float((difference**2).sum() / max(noise.sum(), 1e-30)),
    }


def find(results, mode, row, form=None):
    key = (row["model"], form or row["form"], row["lamps"])
    for other in results.get(mode, {}).get("balls", []):
        if "blocks" in other and (other["model"], other["form"], other["lamps"]) == key:
            return other
    return None


def compare(files, out):
    """Writes one file with all results, without blocks, and prints tables."""
    results = {r["mode"]: r for r in map(read, files)}
    for mode, result in results.items():
        print(f"== {mode}: {', '.join(result['devices']) or 'no device'} {result['nvidia'] or ''}")
        rows = result.get("facets", {}).get("rows", [])
        off = [r["off"] for r in rows if "off" in r]
        if off:
            worst = max((r for r in rows if "off" in r), key=lambda r: r["off"])
            print(
                f"   facets under a sun of angle 0: {len(off)} cases, worst relative L1 "
                f"{worst['off']:.2g} ({worst['model']} {worst['values']})"
            )
        for row in result["balls"]:
            if "blocks" not in row:
                print(f"   {row['model']} {row['form']} {row['lamps']} lamps: {row['error']}")
                continue
            line = f"   {row['model']:18} {row['form']:8} {row['lamps']} lamps"
            line += f" {row['ns_per_sample']:8.1f} ns  noise {row['rel_mse_of_one_sample']:.3g}"
            glossy = find(results, mode, {"model": "glossy", "lamps": row["lamps"]}, "glossy")
            if glossy:
                row["time_over_glossy"] = row["ns_per_sample"] / glossy["ns_per_sample"]
                line += f"  {row['time_over_glossy']:.2f} x Glossy"
            others = {"cpu": find(results, "cpu", row)}
            others["aimed on the CPU"] = find(results, "cpu-osl", row, "aimed")
            for name, other in others.items():
                if other is None or other is row:
                    continue
                c = compared(row, other)
                row.setdefault("against", {})[name] = c
                line += (
                    f"  {name}: {100 * c['mean']:+.2f}±{100 * c['error']:.2f} % ({c['blocks']:.2f})"
                )
            print(line)
    for result in results.values():
        for row in result["balls"]:
            row.pop("blocks", None)
    Path(out).write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("expect")
    command.add_argument("tool")
    command = commands.add_parser("measure")
    command.add_argument("mode", choices=MODES)
    command.add_argument("out")
    command.add_argument("--tiny", action="store_true")
    command = commands.add_parser("compare")
    command.add_argument("out")
    command.add_argument("files", nargs="+")
    options = parser.parse_args()
    folder = Path(__file__).resolve().parent
    if options.command == "expect":
        expect(folder, options.tool)
    elif options.command == "measure":
        measure(folder, options.mode, options.out, options.tiny)
    else:
        compare(options.files, options.out)


if __name__ == "__main__":
    main()
