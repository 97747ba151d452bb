#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures cost and noise of the form made of Blender's nodes; evidence/nodes runs it.

Needs `bpy`. Cycles reports the number of words in its instructions and of floats on its stack in
its log, which GLOG_v=3 enables and which is read from stderr. The CPU time is user time; forms take
turns in one process, and the minimum of several runs counts. Scenes and the unit of noise are those
of evidence/noise.
"""

import argparse
import os
import re
import statistics
import sys
import tempfile
from pathlib import Path

import noise_table
import numpy as np

NODES = "nodes"
UNIT = (noise_table.Case(noise_table.UNIT), noise_table.NODE)


def set_up(condition, case, form, size):
    scene, ball, mask = noise_table.set_up(condition, size, None)
    scene.cycles.shading_system = form not in (NODES, noise_table.NODE)
    noise_table.set_material(scene, ball, lambda: noise_table.material_of(case, form))
    return scene, mask


def instructions(condition, case):
    """Number of SVM words, and largest number of floats on SVM's stack, for the material made of
    nodes; (0, 0) if Cycles does not report them."""
    scene, _ = set_up(condition, case, NODES, 8)
    with tempfile.TemporaryFile() as sink:
        saved = os.dup(2)
        os.dup2(sink.fileno(), 2)
        try:
            noise_table.render(scene, 2, 1, read=False)
        finally:
            os.dup2(saved, 2)
            os.close(saved)
        sink.seek(0)
        log = sink.read().decode(errors="replace")
    found = re.findall(r"Number of SVM nodes: *(\d+)\nPeak stack usage: *(\d+)", log)
    return max(((int(a), int(b)) for a, b in found), default=(0, 0))


def seconds(condition, turns, repeat, size, samples):
    """User seconds of each (case, form): the minimum of several runs, minus the fixed time of a
    picture."""
    taken = {turn: [] for turn in turns}
    for _ in range(repeat):
        for turn in turns:
            scene, _ = set_up(condition, *turn, size)
            noise_table.render(scene, 2, 1, read=False)  # compiles
            few, _ = noise_table.render(scene, 2, 2, read=False)
            many, _ = noise_table.render(scene, samples, 3, read=False)
            taken[turn].append(many - few)
    return {turn: min(times) for turn, times in taken.items()}


def noise(condition, case, form, size, seeds):
    """Mean and mean relative variance of a picture of 64 samples."""
    scene, mask = set_up(condition, case, form, size)
    made = np.stack([noise_table.render(scene, 64, s)[1] for s in range(1, seeds + 1)])
    mean, variance = made.mean(0), made.var(0, ddof=1)
    by = noise_table.smoothed(mean, mask) ** 2 + noise_table.FLOOR
    return mean[mask].mean(), (variance / by)[mask].mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("size", "cost", "noise"))
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--model", action="append", required=True, help="NAME or NAME:P=V,P=V")
    parser.add_argument("--condition", action="append", required=True)
    parser.add_argument("--size", type=int, default=28)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    terminal = os.fdopen(os.dup(1), "w")
    cases = []
    for text in options.model:
        name, _, values = text.partition(":")
        cases.append(noise_table.Case(name, values.replace(",", " ")))
    with tempfile.TemporaryDirectory() as cache:
        noise_table.start(options.extension.resolve(), Path(cache))
        rows = {case: [] for case in cases}
        for condition in options.condition:
            if options.what == "noise":
                _, unit = noise(condition, *UNIT, options.size, options.seeds)
            for case in cases:
                if options.what == "size":
                    rows[case].append("{} ({})".format(*instructions(condition, case)))
                elif options.what == "noise":
                    mean, found = noise(condition, case, NODES, options.size, options.seeds)
                    rows[case].append(found / unit)
                else:
                    turns = [(case, NODES), (case, "aimed")]
                    found = seconds(condition, turns, options.repeat, 2 * options.size, 64)
                    rows[case].append(found[turns[0]] / found[turns[1]])
        print("| | " + " | ".join(options.condition) + " |", file=terminal)
        print("|---" * (1 + len(options.condition)) + "|", file=terminal)
        if options.what != "size":
            columns = list(zip(*rows.values(), strict=True))
            rows = {"median": map(statistics.median, columns), "worst": map(max, columns)} | rows
        for case, row in rows.items():
            texts = (v if isinstance(v, str) else f"{v:.2f}" for v in row)
            print(f"| {case} | " + " | ".join(texts) + " |", file=terminal, flush=True)


if __name__ == "__main__":
    sys.exit(main())
