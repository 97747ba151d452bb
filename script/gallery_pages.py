#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages of pictures, a page a paper, from what `script/demo_render.py` rendered and `brdfc report`
measured: of each scene Blender's picture, the reference and their difference side by side.

    python script/gallery_pages.py REPORT-FOLDER PAGES-FOLDER COMMAND

COMMAND is what a reader types for the same pages.
"""

import json
import sys
from pathlib import Path

import OpenImageIO as oiio
from markdown_table import heading, line

#: Pages: file, title, prefixes of scenes.
PAGES = (
    ("radziszewski-alda", "Radziszewski and Alda 2008: reflection that loses no light", ("ra-",)),
    ("suffern", "Suffern 2007: glossy reflection", ("gl-",)),
    ("shirley", "Shirley, Smits, Hu and Lafortune 1997: matte and specular, coupled", ("sh-",)),
    ("ashikhmin-shirley", "Ashikhmin and Shirley 2000: an anisotropic Phong model", ("as-",)),
    ("more", "More scenes", ("",)),
)
#: Pixels between pictures, quality of JPEG.
GAP, QUALITY = 6, 90


def strip(files, out):
    """Pictures of one size side by side on white."""
    pictures = [oiio.ImageBuf(str(f)) for f in files]
    width, height = pictures[0].spec().width, pictures[0].spec().height
    total = width * len(pictures) + GAP * (len(pictures) - 1)
    sheet = oiio.ImageBufAlgo.fill((1.0, 1.0, 1.0), oiio.ROI(0, total, 0, height, 0, 1, 0, 3))
    for i, picture in enumerate(pictures):
        if picture.has_error:
            sys.exit(f"{files[i]}: {picture.geterror()}")
        oiio.ImageBufAlgo.paste(sheet, i * (width + GAP), 0, 0, 0, picture)
    sheet.specmod().attribute("compression", f"jpeg:{QUALITY}")
    if not sheet.write(str(out), "uint8"):
        sys.exit(f"{out}: {sheet.geterror()}")


def verdict(form):
    """What the pixel test says, as a cell."""
    test = form["test"]
    passed = "the same within noise" if test["passed"] else "**differs**"
    tiles = f"{test['rejected_tiles']} of {test['tiles']} tiles rejected"
    return f"{passed}: {100 * test['accepted']:.2f} % of pixels accepted, {tiles}"


def section(folder, pages, scene):
    form = scene["forms"][0]
    name = scene["scene"]
    parts = [
        folder / name / f
        for f in (f"{form['form']}.png", "reference.png", f"{form['form']}-difference.png")
    ]
    strip(parts, pages / f"{name}.jpg")
    names = sorted({m["representation"] for m in form["materials"]})
    cpu = sum(form["cpu_seconds"])
    return [
        f"## {name}",
        "",
        f"![{name}: Blender, reference, difference]({name}.jpg)",
        "",
        scene["description"],
        "",
        *heading("Blender", "Reference", "Pixel test", "relMSE", "of it noise", "bias"),
        line(
            f"{' and '.join(names)}, {form['spp']} samples, {cpu:.1f} s CPU",
            f"{scene['reference']['spp']} samples, {scene['reference']['wall_seconds']:.1f} s",
            verdict(form),
            f"{form['rel_mse']:.2g}",
            f"{form['noise_floor']:.2g}",
            f"{100 * form['bias']:.2g} ± {100 * form['bias_standard_error']:.2g} %",
        ),
        "",
    ]


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    folder, pages = map(Path, sys.argv[1:3])
    command = sys.argv[3]
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    pages.mkdir(parents=True, exist_ok=True)
    left = {s["scene"]: s for s in report["scenes"]}
    index = ["# Gallery", ""]
    index += [
        "Scenes of the papers, and a few of ours: on the left in Blender, in the form that *auto*",
        "takes, then by the reference renderer, which evaluates the models themselves, and the",
        "difference, red where Blender is brighter and blue where it is darker. Four pictures with",
        "other seeds tell error from noise: the pixel test is Welch's, at 0.01 for the whole",
        "picture, and wants 99.75 % of the pixels and all tiles of 16 x 16.",
        "With few samples rare bright ones follow no normal distribution, which the test supposes:",
        "scenes of sparse noise may fail it with a bias within its error.",
        f"`{command}` makes these pages and their pictures.",
        "",
        *heading("Page", "Scenes", "same within noise"),
    ]
    for file, title, prefixes in PAGES:
        scenes = [left.pop(n) for n in sorted(left) if n.startswith(prefixes)]
        if not scenes:
            continue
        text = [
            f"# {title}",
            "",
            f"`{command}` made this page; [how to read it](overview.md).",
            "",
        ]
        for scene in scenes:
            text += section(folder, pages, scene)
        made = scenes[0]["provenance"]
        text += [f"*{made['Blender']}; {made['Processor']}.*"]
        (pages / f"{file}.md").write_text("\n".join(text) + "\n", encoding="utf-8")
        same = sum(s["forms"][0]["test"]["passed"] for s in scenes)
        index.append(line(f"[{title}]({file}.md)", len(scenes), same))
    (pages / "overview.md").write_text("\n".join(index) + "\n", encoding="utf-8")
    print(f"{len(report['scenes'])} scenes in {pages / 'overview.md'}")


if __name__ == "__main__":
    main()
