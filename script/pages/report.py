# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes DIR/index.html about the report in DIR: error against run time of each scene and form.

    python -m pages.report DIR

`brdfc report DIR` measures, and writes report.json and the pictures. Optional files are

  DIR/links.json             {"TEXT": "ADDRESS", ...}: pages of the same scenes in other versions of
                             Blender, which are linked at the top
  DIR/../conformance/*.json  what closures do in each version of Blender, which
                             tests/blender/test_conformance.py writes
"""

import json_view

from pages import charts, page


def read_report(folder):
    file = folder / "report.json"
    if not file.exists():
        raise ValueError(f"{file}: missing: `brdfc report {folder}` writes it")
    report = json_view.read(file)
    if report.get("format").value != 2:
        expected = f"2, as `brdfc report {folder}` of this version writes"
        raise report.get("format").error(expected)
    return report.value


def read_links(folder):
    """Addresses of other pages, by their text; none if the folder has no links.json."""
    file = folder / "links.json"
    if not file.exists():
        return {}
    links = json_view.read(file)
    if not isinstance(links.value, dict):
        raise links.error("an object")
    return {name: address.text() for name, address in links.items()}


def read_closure(view):
    l1 = view.get("evaluation_l1").number() if view.has("evaluation_l1") else None
    verdict = view.get("verdict").choice("ok", "mended", "fault")
    return {
        "verdict": verdict,
        # Evaluation against our definition, relative L1; closures that are a delta have none.
        "evaluation_l1": l1,
        # Light by sampling / light by evaluation - 1, or 0 if noise explains the difference; and
        # the least difference that would have been detected.
        "sampling_share": view.get("sampling_share").number(),
        "sampling_resolution": view.get("sampling_resolution").number(),
        "fault": view.get("fault").text() if verdict == "fault" else "",
    }


def read_conformance(folder):
    """What each closure does, by version of Blender; none if there is no such folder."""
    versions = {}
    for file in sorted(folder.glob("*.json")):
        top = json_view.read(file)
        versions[top.get("blender").text()] = {
            row.get("closure").text(): read_closure(row) for row in top.get("closures").elements()
        }
    return versions


def models_text(form):
    """The models of a form's materials, each once: "ward (aimed), lambert (exact)"."""
    names = (f"{m['model']} ({m['representation']})" for m in form["materials"])
    return ", ".join(dict.fromkeys(names))


def shared(provenances):
    """What all scenes have in common, which the page says once."""
    first, *others = provenances
    return {k: v for k, v in first.items() if all(other.get(k) == v for other in others)}


def write(folder):
    report = read_report(folder)
    scenes = report["scenes"]
    closures = read_conformance(folder.resolve().parent / "conformance")
    page.write_page(
        folder,
        "report.html.j2",
        report=report,
        scenes=scenes,
        links=read_links(folder),
        closures=closures,
        closure_names=list(dict.fromkeys(name for rows in closures.values() for name in rows)),
        models=sorted({model for scene in scenes for model in scene["models"]}),
        models_text=models_text,
        shared=shared([scene["provenance"] for scene in scenes]),
        overview=charts.scenes(report["forms"], scenes),
        scene_chart=charts.scene,
    )


if __name__ == "__main__":
    page.main(__doc__, write)
