#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes one picture of all previews of the library's materials, with their names and models."""

import argparse
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

COLUMNS, INCHES = 8, 1.25


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("list", type=Path, help="what asset_previews.py --list wrote")
    parser.add_argument("out", type=Path, help="a JPEG")
    options = parser.parse_args()
    entries = json.loads(options.list.read_text(encoding="utf-8"))
    rows = -(-len(entries) // COLUMNS)
    figure, axes = pyplot.subplots(rows, COLUMNS, figsize=(COLUMNS * INCHES, rows * INCHES * 1.25))
    for place in axes.flat:
        place.axis("off")
    for place, entry in zip(axes.flat, entries, strict=False):
        place.imshow(pyplot.imread(entry["preview"]))
        at = {"x": 0.5, "ha": "center", "transform": place.transAxes}
        place.text(y=-0.1, s=entry["name"], fontsize=6.5, **at)
        place.text(y=-0.2, s=entry["model"], fontsize=5, color="0.4", **at)
    figure.subplots_adjust(0.005, 0.02, 0.995, 0.998, 0.03, 0.22)
    figure.savefig(options.out, dpi=128, pil_kwargs={"quality": 88})


if __name__ == "__main__":
    main()
