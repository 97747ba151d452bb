# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares `brdfc render` with Mitsuba 3, in paths per second: same triangles, lamp and camera.

    python evidence/bench_reference.py [--brdfc build/brdfc [OTHER...]] [--json out.json]

Needs the Python packages mitsuba and numpy. Mitsuba's llvm_ad_rgb also needs a compatible LLVM
library (19 works, 14 does not; DRJIT_LIBLLVM_PATH selects one). In the scene everything is grey and
diffuse: a sphere of 32,512 triangles and two boxes on a floor under a rectangular lamp. Both
renderers use the same number of samples and the same path depth, and sample both lamp and BRDF. The
means of the two pictures are compared, to make sure that neither renderer computes less. All
renderers use the same number of threads, and the best of several runs counts. --cpu measures CPU
time, which is affected less by other load on the machine. Several tools after --brdfc, such as
those before and after a change, run in turns; --scene renders a scene file in place of that one, by
the tools alone. Exit status 1: the pictures differ.
"""

import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SCENE = {
    "name": "bench-lambert",
    "settings": {"seed": 1, "max_bounces": 4},
    "camera": {
        "type": "perspective",
        "position": [0, -6, 2.5],
        "look_at": [0, 0, 0.6],
        "fov_y_degrees": 40,
    },
    "materials": {"grey": {"model": "lambert", "parameters": {"rho": 0.6}}},
    "objects": [
        {"name": "floor", "shape": {"type": "quad", "size": [20, 20]}, "material": "grey"},
        {
            "name": "sphere",
            "shape": {"type": "sphere", "segments": 128, "rings": 128, "radius": 0.8},
            "transform": {"translate": [0, 0, 0.8]},
            "material": "grey",
        },
        {
            "name": "left",
            "shape": {"type": "box", "size": [0.8, 0.8, 1.2]},
            "transform": {"translate": [-1.6, 0.3, 0.6], "rotate_degrees": [0, 0, 25]},
            "material": "grey",
        },
        {
            "name": "right",
            "shape": {"type": "box", "size": [0.8, 0.8, 1.6]},
            "transform": {"translate": [1.7, 0.5, 0.8], "rotate_degrees": [0, 0, -20]},
            "material": "grey",
        },
    ],
    "lights": [
        {
            "type": "area",
            "position": [1, -1, 4],
            "direction": [-0.2, 0.2, -1],
            "size": [1.5, 1.0],
            "power": 300,
        }
    ],
}


def cpu_seconds(command):
    """CPU time of a program, until it ends."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(c) for c in command], check=True, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run_brdfc(brdfc, folder, args):
    """Seconds of tracing, the picture's mean, and the number of paths. For Mitsuba, too, the time
    begins when the scene is ready."""
    out = folder / "brdfc.exr"
    command = [brdfc, "render", args.scene or folder / "scene.json", "--out", out]
    command += ["--threads", args.threads, "--spp"]
    # For CPU times, the time with one sample, which includes loading, is subtracted.
    ready = cpu_seconds([*command, 1]) if args.cpu else 0
    seconds = cpu_seconds([*command, args.spp + 1 if args.cpu else args.spp]) - ready
    import mitsuba as mi

    bitmap = mi.Bitmap(str(out))
    if not args.cpu:
        seconds = float(bitmap.metadata()["brdfc:seconds_tracing"])
    names = [field.name for field in bitmap.struct_()]
    picture = np.array(bitmap)[..., [names.index(c) for c in "RGB"]]
    return seconds, float(picture.mean()), picture.shape[0] * picture.shape[1] * args.spp


def write_scene(brdfc, folder, args):
    """The scene file, and its meshes for Mitsuba."""
    scene = {**SCENE, "settings": SCENE["settings"] | {"width": args.size, "height": args.size}}
    (folder / "scene.json").write_text(json.dumps(scene))
    resolve = [brdfc, "scene", folder / "scene.json", "--out", folder / "resolved"]
    subprocess.run(resolve, check=True, stderr=subprocess.DEVNULL)


def mitsuba_scene(mi, folder, args):
    """The resolved scene for Mitsuba, in the same units."""
    resolved = json.loads((folder / "resolved" / "scene.json").read_text())
    camera, lamp = resolved["camera"], resolved["lights"][0]
    transform = mi.ScalarTransform4f

    def mesh(entry):
        shape, move = entry["shape"], entry["transform"]
        vertices = np.load(folder / "resolved" / shape["vertices"])
        faces = np.load(folder / "resolved" / shape["triangles"]).astype(np.uint32)
        angle = math.radians(move["rotate_degrees"][2])  # this scene turns about z alone
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        world = vertices @ turn.T + np.array(move["translate"])
        smooth = "normals" in shape
        out = mi.Mesh(entry["name"], len(vertices), len(faces), has_vertex_normals=smooth)
        parameters = mi.traverse(out)
        parameters["vertex_positions"] = world.astype(np.float32).ravel()
        parameters["faces"] = faces.ravel()
        if smooth:
            normals = np.load(folder / "resolved" / shape["normals"]) @ turn.T
            parameters["vertex_normals"] = normals.astype(np.float32).ravel()
        parameters.update()
        path = folder / f"{entry['name']}.ply"
        out.write_ply(str(path))
        grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.6}}
        # Both sides reflect, as in brdfc.
        bsdf = {"type": "twosided", "bsdf": grey}
        return {"type": "ply", "filename": str(path), "face_normals": not smooth, "bsdf": bsdf}

    width, height = lamp["size"]
    position, direction = np.array(lamp["position"]), np.array(lamp["direction"])
    radiance = lamp["power"] / (math.pi * width * height)
    film = {
        "type": "hdrfilm",
        "width": args.size,
        "height": args.size,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
    }
    # Mitsuba's depth counts path segments: one scattering event is depth 2.
    depth = resolved["settings"]["max_bounces"] + 2
    scene = {
        "type": "scene",
        # Neither renderer lets rays pass through the edges between triangles.
        "embree_use_robust_intersections": True,
        "integrator": {"type": "path", "max_depth": depth, "rr_depth": 5, "hide_emitters": True},
        "sensor": {
            "type": "perspective",
            "fov": camera["fov_y_degrees"],
            "fov_axis": "y",
            "to_world": transform().look_at(
                origin=camera["position"], target=camera["look_at"], up=camera["up"]
            ),
            "film": film,
            "sampler": {"type": "independent", "sample_count": args.spp},
        },
        "lamp": {
            "type": "rectangle",
            "to_world": transform().look_at(
                origin=list(position), target=list(position + direction), up=lamp["up"]
            )
            @ transform().scale([width / 2, height / 2, 1]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
        },
    }
    for entry in resolved["objects"]:
        scene[entry["name"]] = mesh(entry)
    return mi.load_dict(scene)


def time_mitsuba(variant, folder, args):
    """Runs in its own process. Prints seconds and mean."""
    import drjit as dr
    import mitsuba as mi

    mi.set_variant(variant)
    dr.set_thread_count(args.threads)
    scene = mitsuba_scene(mi, folder, args)
    best, mean = math.inf, 0.0
    clock = time.process_time if args.cpu else time.perf_counter
    for seed in range(args.runs):
        start = clock()
        picture = np.array(mi.render(scene, spp=args.spp, seed=seed))
        best = min(best, clock() - start)  # the first run compiles; the best does not
        mean = float(picture[..., :3].mean())
    print(json.dumps([best, mean]))


def run_mitsuba(variant, folder, args):
    """(seconds, mean), or None. It runs in another process, because an unsuitable LLVM aborts the
    process."""
    command = [sys.executable, __file__, "--size", args.size, "--spp", args.spp]
    command += ["--runs", args.runs, "--threads", args.threads, *["--cpu"] * args.cpu]
    command += ["--in-process", variant, folder]
    try:
        done = subprocess.run(
            [str(c) for c in command], capture_output=True, text=True, timeout=600
        )
    except subprocess.TimeoutExpired:
        print(f"bench_reference: mitsuba {variant}: no result in 600 s", file=sys.stderr)
        return None
    if done.returncode == 0:
        return tuple(json.loads(done.stdout.splitlines()[-1]))
    lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
    error = next((line for line in lines if "rror" in line), lines[-1])
    print(f"bench_reference: mitsuba {variant} did not run: {error}", file=sys.stderr)
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    root = Path(__file__).resolve().parents[1]
    parser.add_argument("--brdfc", nargs="+", default=[str(root / "build" / "brdfc")])
    parser.add_argument("--scene", help="a scene file, rendered by brdfc alone")
    parser.add_argument("--size", type=int, default=256, help="pixels along each side")
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--cpu", action="store_true", help="CPU time instead of time")
    parser.add_argument("--json", help="write the table here as well")
    parser.add_argument("--in-process", nargs=2, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.in_process:
        time_mitsuba(args.in_process[0], Path(args.in_process[1]), args)
        return 0
    for path in [*args.brdfc, *filter(None, [args.scene])]:
        if not Path(path).is_file():
            print(f"bench_reference: {path}: no such file", file=sys.stderr)
            return 2
    try:
        import mitsuba as mi
    except ImportError:
        print("bench_reference: this Python has no mitsuba package", file=sys.stderr)
        return 2
    mi.set_variant("scalar_rgb")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_scene(args.brdfc[-1], folder, args)
        turns = [[run_brdfc(tool, folder, args) for tool in args.brdfc] for _ in range(args.runs)]
        for tool, runs in zip(args.brdfc, zip(*turns, strict=True), strict=True):
            seconds, mean, paths = min(runs)
            rows.append((tool if len(args.brdfc) > 1 else "brdfc", seconds, mean))
            middle = statistics.median(run[0] for run in runs)
            print(f"{rows[-1][0]}: median of {args.runs} runs {middle:.3f} s", file=sys.stderr)
        for variant in () if args.scene else ("scalar_rgb", "llvm_ad_rgb"):
            result = run_mitsuba(variant, folder, args)
            if result:
                rows.append((f"mitsuba {variant}", *result))
    width = max(20, *(len(row[0]) for row in rows))
    print(f"{'renderer':<{width}} {'seconds':>8} {'Mpaths/s':>9} {'speed':>6} {'mean':>9}")
    base = next((row[1] for row in rows if row[0].endswith("scalar_rgb")), rows[0][1])
    for label, seconds, mean in rows:
        rate = paths / seconds * 1e-6
        print(f"{label:<{width}} {seconds:8.3f} {rate:9.3f} {base / seconds:6.2f} {mean:9.6f}")
    if args.json:
        table = [
            {"renderer": r, "seconds": s, "paths_per_second": paths / s, "mean": m}
            for r, s, m in rows
        ]
        record = {"size": args.size, "spp": args.spp, "threads": args.threads, "rows": table}
        Path(args.json).write_text(json.dumps(record, indent=2) + "\n")
    means = [row[2] for row in rows]
    if max(means) > 1.02 * min(means):
        print("bench_reference: the pictures disagree by more than 2 %", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
