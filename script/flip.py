#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the mean HDR-FLIP of every picture of a report, as flip.json in each scene's folder.

Runs in an environment with OpenImageIO and flip-evaluator, the published implementation of P.
Andersson et al.: Visualizing and Communicating Errors in Rendered Images, Ray Tracing Gems II,
2021. `brdfc report` reads the numbers.
"""

import argparse
import json
import sys
from pathlib import Path

import flip_evaluator
import numpy as np
from pictures import read_rgb


def read(path):
    """R, G, B of an EXR. Negative values, which rounding leaves, become 0, because FLIP has no
    negative radiance."""
    try:
        return np.maximum(read_rgb(path), 0)
    except OSError as error:
        sys.exit(f"flip: {error}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of scenes, each with runs.json")
    options = parser.parse_args()
    scenes = sorted(p.parent for p in options.folder.glob("*/runs.json"))
    if not scenes:
        parser.error(f"{options.folder}: no folder in it holds a runs.json")
    for scene in scenes:
        runs = json.loads((scene / "runs.json").read_text(encoding="utf-8"))
        reference = read(scene / runs["reference"]["image"])
        means = {}
        for run in runs["runs"]:
            picture = np.mean([read(scene / image) for image in run["images"]], axis=0)
            _, mean, _ = flip_evaluator.evaluate(
                reference.astype(np.float32), picture.astype(np.float32), "HDR", applyMagma=False
            )
            means[run["form"]] = float(mean)
        beside = scene / ".flip.json.part"
        beside.write_text(json.dumps(means, indent=1) + "\n", encoding="utf-8")
        beside.replace(scene / "flip.json")
        print(
            f"    {scene.name}: {', '.join(f'{k} {v:.4f}' for k, v in means.items())}", flush=True
        )


if __name__ == "__main__":
    main()
