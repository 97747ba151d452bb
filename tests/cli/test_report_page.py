# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's page in a browser: nothing exceeds the window, the filter hides the right rows, and
hovering over a picture shows the reference in its place."""

import json
import re
import subprocess

import pytest
from support import CHROMIUM, TOOL, scene

WIDTH = 1280
#: Appends the page's state after layout to it, as text.
PROBE = """<script>
const select = document.getElementById("model");
const shown = () => [...document.querySelectorAll("section[data-models]")]
  .filter(s => getComputedStyle(s).display !== "none").map(s => s.id);
const found = {wide: document.documentElement.scrollWidth, window: innerWidth, all: shown()};
select.value = "phong";
select.dispatchEvent(new Event("change"));
found.phong = shown();
found.rows = [...document.querySelectorAll("table.summary tbody tr")]
  .filter(r => getComputedStyle(r).display !== "none").length;
select.value = "";
select.dispatchEvent(new Event("change"));
const under = document.querySelector(".flip .under");
found.before = getComputedStyle(under).opacity;
found.titles = document.querySelectorAll("#overview circle title").length;
// A busy machine may give the window its focus after it has shown the page.
let waits = 0;
(function finish() {
  document.querySelector(".flip").focus();
  found.after = getComputedStyle(under).opacity;
  document.body.setAttribute("data-found", JSON.stringify(found));
  if (found.after !== "1" && ++waits < 100) setTimeout(finish, 40);
})();
</script>"""


def made(folder, name, model):
    """A scene of the report, rendered by the tool in place of Blender. The names of its forms are
    as long as any."""
    (folder / name).mkdir(parents=True)
    file = folder / name / "scene.json"
    file.write_text(json.dumps(scene() | {"name": name}))

    def render(out, seed):
        command = [TOOL, "render", file, "--out", folder / name / out, "--spp", "4"]
        subprocess.run([*command, "--seed", str(seed)], check=True, capture_output=True)
        return out

    pictures = [render(f"{i}.exr", i) for i in (1, 2)]
    material = {"id": "a", "model": model, "representation": "aimed", "closures": 3, "error": None}
    forms = ("glossy", "principled", "metallic", "aimed", "sampled", "scene", "planned", "twin")
    runs = [
        {
            "form": form,
            "images": pictures,
            "spp": 4,
            "cpu_seconds": [2.0, 2.0 + i],
            "wall_seconds": [1.0, 1.0],
            "materials": [material],
        }
        for i, form in enumerate(forms)
    ]
    whole = {
        "format": 1,
        "scene": name,
        "description": "A scene. " * 30,
        "settings": {"width": 8, "height": 8, "max_bounces": 1},
        "reference": {"image": render("reference.exr", 3), "spp": 4, "wall_seconds": 1.0},
        "runs": runs,
        "provenance": {"Extension": "sha256 " + "0123456789abcdef" * 4},
        "commands": ["build/brdfc render " + "a" * 200],
    }
    (folder / name / "runs.json").write_text(json.dumps(whole))


def test_a_scene_that_was_not_rendered_is_left_out_and_named(tmp_path):
    made(tmp_path, "rendered", "phong")
    (tmp_path / "waiting").mkdir()
    (tmp_path / "waiting/scene.json").write_text("{}", encoding="utf-8")
    done = subprocess.run([TOOL, "report", tmp_path], capture_output=True, text=True)
    assert done.returncode == 0 and "rendered" in done.stdout
    assert f"{tmp_path / 'waiting'}: left out, it was not rendered" in done.stderr
    assert "1 scene" in (tmp_path / "index.html").read_text(encoding="utf-8")


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is missing: the page is seen by nobody")
def test_the_page_in_a_browser(tmp_path):
    made(tmp_path, "a-scene-with-a-long-name", "phong")
    made(tmp_path, "other", "ward")
    subprocess.run([TOOL, "report", tmp_path], check=True, capture_output=True)
    page = tmp_path / "index.html"
    text = page.read_text(encoding="utf-8")
    assert "2 scenes, 16 pictures" in text
    page.write_text(text.replace("</body>", PROBE + "</body>"), encoding="utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    command += [
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--window-size={WIDTH},900",
        "--virtual-time-budget=5000",
        page.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    match = re.search(r'data-found="([^"]*)"', done.stdout)
    assert match, f"{done.stderr[-2000:]}"
    found = json.loads(match[1].replace("&quot;", '"'))
    assert found["window"] == WIDTH and found["wide"] <= WIDTH
    assert found["all"] == ["a-scene-with-a-long-name", "other"]
    assert found["phong"] == ["a-scene-with-a-long-name"] and found["rows"] == 1
    assert (found["before"], found["after"]) == ("0", "1")
    assert found["titles"] == 16
