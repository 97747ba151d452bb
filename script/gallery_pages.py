#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the gallery: one page per paper, with pictures of Blender and the reference renderer.

    python script/gallery_pages.py REPORT-FOLDER PAGES-FOLDER COMMAND

Each scene is shown by Blender's picture, the reference and their difference, side by side, from the
results of `script/demo_render.py` and `brdfc report`. COMMAND is the command, shown to readers,
that makes these pages of all scenes. Sections of scenes that were not rendered this time stay as
they are.
"""

import json
import sys
from pathlib import Path

import OpenImageIO as oiio
from markdown_table import heading, line

#: Pages: file, title, prefixes of the scenes' names.
PAGES = (
    ("radziszewski-alda", "Radziszewski and Alda 2008: reflection that loses no light", ("ra-",)),
    ("suffern", "Suffern 2007: glossy reflection", ("gl-",)),
    ("shirley", "Shirley, Smits, Hu and Lafortune 1997: matte and specular, coupled", ("sh-",)),
    ("ashikhmin-shirley", "Ashikhmin and Shirley 2000: an anisotropic Phong model", ("as-",)),
    ("more", "More scenes", ("",)),
)
#: Pixels between pictures; JPEG quality.
GAP, QUALITY = 6, 90
SCENES = Path(__file__).resolve().parent.parent / "scenes"
#: The pixel test's result for two pictures that it can't distinguish.
SAME = "the same within noise"


def page_of(scene):
    """The page that a scene is on."""
    return next(file for file, _, prefixes in PAGES if scene.startswith(prefixes))


def strip(folder, scene, out):
    """Blender's picture, the reference and their difference side by side on white."""
    form = scene["forms"][0]["form"]
    names = (f"{form}.png", "reference.png", f"{form}-difference.png")
    files = [folder / scene["scene"] / name for name in names]
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


def has_one_direction(scene):
    """Whether each pixel of the reference picture uses the same sample, which is no noise that the
    pixel test could compare with: Suffern shows patterns of a single sample. Scenes of the models'
    pages are none of scenes/, and have many samples."""
    file = SCENES / f"{scene}.json"
    if not file.is_file():
        return False
    settings = json.loads(file.read_text(encoding="utf-8"))["settings"]
    return settings["spp"] == 1 and settings.get("pattern") in ("regular", "hammersley")


def verdict(scene, form):
    """The result of the pixel test, as a table cell."""
    if has_one_direction(scene):
        return "none: every pixel of the reference has the same sample"
    test = form["test"]
    passed = SAME if test["passed"] else "**differs**"
    tiles = f"{test['rejected_tiles']} of {test['tiles']} tiles rejected"
    return f"{passed}: {100 * test['accepted']:.2f} % of pixels accepted, {tiles}"


def measured(scene):
    """The measurements of a scene, as a table."""
    form = scene["forms"][0]
    names = sorted({m["representation"] for m in form["materials"]})
    cpu = sum(form["cpu_seconds"])
    return [
        *heading("Blender", "Reference", "Pixel test", "relMSE", "from noise", "bias"),
        line(
            f"{' and '.join(names)}, {form['spp']} samples, {cpu:.1f} s CPU",
            f"{scene['reference']['spp']} samples, {scene['reference']['wall_seconds']:.1f} s",
            verdict(scene["scene"], form),
            f"{form['rel_mse']:.2g}",
            f"{form['noise_floor']:.2g}",
            f"{100 * form['bias']:.2g} ± {100 * form['bias_standard_error']:.2g} %",
        ),
    ]


def section(folder, pages, scene):
    name = scene["scene"]
    strip(folder, scene, pages / f"{name}.jpg")
    return [
        f"![{name}: Blender, reference, difference]({name}.jpg)",
        "",
        scene["description"],
        "",
        *measured(scene),
    ]


def kept(page):
    """The sections of an existing page, by scene, without scenes that no longer exist."""
    if not page.is_file():
        return {}
    parts = page.read_text(encoding="utf-8").rsplit("\n*", 1)[0].split("\n## ")[1:]
    sections = {}
    for part in parts:
        name, text = part.split("\n", 1)
        if (SCENES / f"{name}.json").is_file():
            sections[name] = text.strip().split("\n")
    return sections


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    folder, pages = map(Path, sys.argv[1:3])
    command = sys.argv[3]
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    pages.mkdir(parents=True, exist_ok=True)
    index = ["# Papers' scenes, compared", ""]
    index += [
        "Scenes of the papers, and a few of ours. Left: Blender, with the form that *auto*",
        "selects. Middle: the reference renderer, which evaluates the models themselves. Right:",
        "the difference, red where Blender is brighter and blue where it is darker. Several",
        "pictures with different seeds distinguish error from noise: the pixel test is Welch's,",
        "at 0.01 for the whole picture, and requires 99.75 % of the pixels and all tiles of 16 x",
        f"16 pixels to agree. `{command}` makes these pages and their pictures.",
        "",
        *heading("Page", "Scenes", "same within noise"),
    ]
    for file, title, _ in PAGES:
        new = [s for s in report["scenes"] if page_of(s["scene"]) == file]
        sections = kept(pages / f"{file}.md")
        sections |= {s["scene"]: section(folder, pages, s) for s in new}
        if not sections:
            continue
        if new:
            text = [f"# {title}", ""]
            text += [f"`{command}` made this page; [how to read it](overview.md).", ""]
            for name in sorted(sections):
                text += [f"## {name}", "", *sections[name], ""]
            made = new[0]["provenance"]
            text += [f"*{made['Blender']}; {made['Processor']}.*"]
            (pages / f"{file}.md").write_text("\n".join(text) + "\n", encoding="utf-8")
        same = sum(any(SAME in row for row in rows) for rows in sections.values())
        index.append(line(f"[{title}]({file}.md)", len(sections), same))
    (pages / "overview.md").write_text("\n".join(index) + "\n", encoding="utf-8")
    print(f"{len(report['scenes'])} scenes in {pages / 'overview.md'}")


if __name__ == "__main__":
    main()
