# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages: in a browser nothing exceeds the window, the filter hides the right rows, and hovering
over a picture shows the reference in its place; names in charts lie beside each other; texts are
escaped, and nothing is loaded but pictures beside the page."""

import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest
from pages import charts, report, stability
from pages.page import scientific
from support import CHROMIUM, ROOT, TOOL, scene

#: Browsers have no narrower windows than this.
WIDE, NARROW = 1280, 500
#: Appends the page's state after layout to it, as text.
PROBE = """<script>
const select = document.getElementById("model");
const shown = () => [...document.querySelectorAll("section[data-models]")]
  .filter(s => getComputedStyle(s).display !== "none").map(s => s.id);
const found = {wide: document.documentElement.scrollWidth, window: innerWidth, all: shown()};
found.dots = document.querySelectorAll("#overview a.point").length;
found.titles = document.querySelectorAll("#overview a.point title").length;
found.charts = [...document.querySelectorAll("svg.chart:not(#overview)")].map(chart => {
  const box = element => {
    const r = element.getBoundingClientRect();
    return [r.left, r.right, r.top, r.bottom];
  };
  return {box: box(chart), names: [...chart.querySelectorAll(".name text")].map(box),
          texts: [...chart.querySelectorAll(".name text")].map(t => t.textContent)};
});
found.ink = getComputedStyle(document.querySelector(".name text")).fill;
found.ids = [...document.querySelectorAll("[id]")].map(e => e.id);
select.value = "phong";
select.dispatchEvent(new Event("change"));
found.phong = shown();
found.rows = [...document.querySelectorAll("table.summary tbody tr")]
  .filter(r => getComputedStyle(r).display !== "none").length;
found.left = [...document.querySelectorAll("#overview a.point")]
  .filter(r => getComputedStyle(r).display !== "none").length;
select.value = "";
select.dispatchEvent(new Event("change"));
const under = document.querySelector(".flip .under");
found.before = getComputedStyle(under).opacity;
// A busy machine may give the window its focus after it has shown the page.
let waits = 0;
(function finish() {
  document.querySelector(".flip").focus();
  found.after = getComputedStyle(under).opacity;
  document.body.setAttribute("data-found", JSON.stringify(found));
  if (found.after !== "1" && ++waits < 100) setTimeout(finish, 40);
})();
</script>"""


def made(folder, name, model, **changes):
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
    } | changes
    (folder / name / "runs.json").write_text(json.dumps(whole))


def reported(folder):
    """The text of the page about rendered scenes."""
    subprocess.run([TOOL, "report", folder], check=True, capture_output=True)
    report.write(folder)
    return (folder / "index.html").read_text(encoding="utf-8")


class Addresses(HTMLParser):
    """What a page loads or links to, by kind; and its texts."""

    def __init__(self, text):
        super().__init__()
        self.loaded, self.linked, self.texts = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("src", "srcset", "data", "poster", "background"):
                self.loaded.append(value)
            elif name in ("href", "xlink:href"):
                (self.linked if tag == "a" else self.loaded).append(value)

    def handle_data(self, data):
        self.texts.append(data)


@pytest.mark.slow
def test_a_scene_that_was_not_rendered_is_left_out_and_named(tmp_path):
    made(tmp_path, "rendered", "phong")
    (tmp_path / "waiting").mkdir()
    (tmp_path / "waiting/scene.json").write_text("{}", encoding="utf-8")
    done = subprocess.run([TOOL, "report", tmp_path], capture_output=True, text=True)
    assert done.returncode == 0 and "rendered" in done.stdout
    assert f"{tmp_path / 'waiting'}: left out, it was not rendered" in done.stderr
    assert "1 scene" in reported(tmp_path)


@pytest.mark.slow
def test_texts_are_escaped_and_only_pictures_beside_the_page_are_loaded(tmp_path):
    name = "a 100% <ball> & #1"
    made(
        tmp_path,
        name,
        'x"><script>alert(1)</script>',
        description="a <ball> & more",
        provenance={"<Blender>": "4.5 & more"},
        commands=["brdfc render <a> && echo 'done'"],
    )
    made(tmp_path, "other", "ward")
    text = reported(tmp_path)
    assert "a &lt;ball&gt; &amp; more" in text and "<ball>" not in text and "alert(1)<" not in text
    found = Addresses(text)
    assert "brdfc render <a> && echo 'done'" in "".join(found.texts)
    assert not [a for a in found.loaded + found.linked if re.match(r"\w+:|//", a)]
    assert "http" not in text and "url(" not in re.sub(r"url\(#[\w-]+\)", "", text)
    pictures = [a for a in found.loaded if not a.startswith("#")]
    assert len(pictures) == 2 * (1 + 8 * 3)
    assert "a%20100%25%20%3Cball%3E%20%26%20%231/glossy.png" in pictures
    for address in (*pictures, *(a for a in found.linked if not a.startswith("#"))):
        assert (tmp_path / unquote(address)).is_file(), address
    assert not list(tmp_path.glob(".*")), "an unfinished file was left"


@pytest.mark.slow
def test_other_versions_of_blender_are_linked(tmp_path):
    made(tmp_path, "ball", "phong")
    assert "The same scenes in" not in reported(tmp_path)
    links = tmp_path / "links.json"
    links.write_text(json.dumps({"Blender 5.0": "../demo-5.0/index.html", "<x>": 'a"b'}))
    text = reported(tmp_path)
    assert '<a href="../demo-5.0/index.html">Blender 5.0</a>' in text
    assert '<a href="a&#34;b">&lt;x&gt;</a>' in text
    for content, says in (
        ('{"Blender 5.0": 5}', "links.json: Blender 5.0: expected a text, got 5"),
        ('["a"]', "links.json: the top level: expected an object"),
        ("{", "links.json: expected JSON"),
    ):
        links.write_text(content)
        with pytest.raises(ValueError, match=says):
            report.write(tmp_path)
    assert (tmp_path / "index.html").read_text(encoding="utf-8") == text, "the old page stays"


def test_the_page_needs_a_report_of_its_version(tmp_path):
    with pytest.raises(ValueError, match="report.json: missing: `brdfc report"):
        report.write(tmp_path)
    (tmp_path / "report.json").write_text('{"format": 1, "scenes": []}')
    command = [sys.executable, "-m", "pages.report", tmp_path]
    scripts = os.environ | {"PYTHONPATH": str(ROOT / "script")}
    done = subprocess.run(command, capture_output=True, text=True, env=scripts)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "report.json: format: expected 2" in done.stderr


@pytest.mark.slow
def test_the_page_shows_what_the_closures_of_each_version_do(tmp_path):
    pages, folder = tmp_path / "report", tmp_path / "conformance"
    made(pages, "ball", "phong")
    assert "Closures of Cycles" not in reported(pages)
    folder.mkdir()
    agrees = {
        "closure": "diffuse",
        "evaluation_l1": 1e-7,
        "sampling_share": 0.0,
        "verdict": "ok",
        "sampling_resolution": 4e-3,
    }
    wrong = {
        "closure": "wrong",
        "sampling_share": 0.43,
        "verdict": "fault",
        "sampling_resolution": 0.01,
        "fault": "differs <much>",
    }
    (folder / "4.5.json").write_text(json.dumps({"blender": "4.5.15", "closures": [agrees, wrong]}))
    (folder / "5.0.json").write_text(json.dumps({"blender": "5.0.1", "closures": [agrees]}))
    text = reported(pages)
    assert "<th>4.5.15<br>evaluation</th>" in text and "<th>5.0.1<br>evaluation</th>" in text
    assert "<td>1.0·10<sup>−7</sup></td>" in text and "agrees (0.4 %)" in text
    assert 'class="bad" title="differs &lt;much&gt;">+43.0 % (1.0 %)' in text
    assert re.search(r">wrong</td>.*?<td>–</td>\s*<td>–</td>\s*</tr>", text, re.S), "not in 5.0"
    for key, value in (("verdict", "fine"), ("sampling_share", "much"), ("closure", 3)):
        closures = [agrees | {key: value}]
        (folder / "5.0.json").write_text(json.dumps({"blender": "5.0.1", "closures": closures}))
        with pytest.raises(ValueError, match=f"5.0.json: closures.0.{key}: expected"):
            report.write(pages)


def test_numbers_read_as_in_papers():
    assert str(scientific(0.00123)) == "1.2·10<sup>−3</sup>"
    assert str(scientific(9.96e-5)) == "1.0·10<sup>−4</sup>", "rounds up into the next decade"
    assert str(scientific(-250)) == "−2.5·10<sup>2</sup>"
    assert str(scientific(0)) == "0"


def form(name, cost, rel_mse, noise=0.0, pareto=True):
    return {
        "form": name,
        "label": name,
        "native": name == "glossy",
        "cost": cost,
        "rel_mse": rel_mse,
        "noise_floor": noise,
        "pareto": pareto,
    }


def tokens(svg):
    return ElementTree.fromstring(str(svg))


def test_charts_take_their_colours_and_font_from_the_page():
    forms = [form("glossy", 1, 0.1, 0.01), form("aimed", 2.5, 0.02, 0.02, pareto=False)]
    svg = charts.scene({"scene": "ball", "forms": forms})
    assert "font-family:" not in svg and "<style" not in svg and "metadata" not in svg
    assert not re.search(r"#[0-9a-f]{6}", svg), "a colour that does not follow the dark mode"
    root = tokens(svg)
    dots = root.findall(".//g[@class='point']")
    assert [dot.find("title").text.split(";")[0] for dot in dots] == [
        "relMSE 0.1, of which noise 0.01",
        "relMSE 0.02, of which noise 0.02",
    ]
    fills = [dot.find(".//use").get("style") for dot in dots]
    assert "fill: var(--accent)" in fills[0] and "fill: var(--card)" in fills[1]
    texts = ["".join(t.itertext()) for t in root.iter("text")]
    assert {"10⁻²", "10⁻¹", "2.5", "relMSE", "glossy", "aimed"} <= set(texts)
    # Higher is worse, and to the right is slower.
    at = [tuple(float(dot.find(".//use").get(k)) for k in "xy") for dot in dots]
    (x0, y0), (x1, y1) = at
    assert x0 < x1 and y0 < y1


def test_names_in_a_chart_lie_beside_each_other():
    names = ["Blender's Glossy node", "exact", "sampled", "planned", "aimed", "twin", "scene"]
    forms = [form(name, 1 + i // 4, 0.1 + 0.001 * (i % 4), 0.1) for i, name in enumerate(names)]
    chart = tokens(charts.scene({"scene": "s", "forms": forms}))
    _, _, width, height = map(float, chart.get("viewBox").split())
    placed = []
    for text in chart.findall(".//g[@class='name']/text"):
        x, y, letters = float(text.get("x")), float(text.get("y")), len(text.text)
        assert "text-anchor: start" in text.get("style")
        # Letters are 12 pixels high, and about half as wide.
        assert 0 <= x and x + 6 * letters <= width and 12 <= y <= height
        for other_x, other_y, other in placed:
            apart = x + 6 * letters < other_x or other_x + 6 * len(other) < x
            assert apart or abs(y - other_y) >= 12, f"{text.text} lies on {other}"
        placed.append((x, y, text.text))
    assert sorted(name for *_, name in placed) == sorted(names)


def test_the_overview_links_each_dot_to_its_scene():
    scenes = [
        {"scene": f"s{i}", "models": ["ward", "phong"], "forms": [form("aimed", 2 + i, 0.1)]}
        for i in range(3)
    ]
    forms = [{"form": "aimed", "label": "aimed", "native": False}]
    root = tokens(charts.scenes(forms, scenes))
    dots = root.findall(".//a[@class='point']")
    assert [dot.get("href") for dot in dots] == ["#s0", "#s1", "#s2"]
    assert dots[0].get("data-models") == "ward phong"
    assert dots[1].find("title").text.startswith("s1, aimed: relMSE 0.1")


def test_charts_need_two_forms_with_cost_and_error():
    unknown, perfect = form("a", None, 0.1), form("b", 1, 0)
    assert charts.scene({"scene": "s", "forms": [form("c", 1, 0.1), unknown, perfect]}) == ""
    assert charts.scenes([], [{"scene": "s", "forms": [unknown, perfect]}]) == ""


def test_more_forms_than_colours_differ_in_their_marks():
    forms = [form(f"f{i}", 1 + i, 0.1) for i in range(8)]
    root = tokens(charts.scenes(forms, [{"scene": "s", "models": [], "forms": forms}]))
    marks = {}
    for dot in root.findall(".//a[@class='point']"):
        use = dot.find(".//use")
        path = root.find(f".//path[@id='{use.get('href')[1:]}']").get("d")
        marks[path, use.get("style")] = dot
    assert len(marks) == 8


@pytest.fixture(scope="module")
def two_scenes(tmp_path_factory):
    """The folder of a report, and its page."""
    folder = tmp_path_factory.mktemp("report")
    made(folder, "a-scene-with-a-long-name", "phong")
    made(folder, "other", "ward")
    return folder, reported(folder)


@pytest.mark.many
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is missing: the page is seen by nobody")
@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_the_page_in_a_browser(tmp_path, two_scenes, width):
    folder, text = two_scenes
    page = folder / f"{width}.html"
    assert "2 scenes, 16 pictures" in text
    page.write_text(text.replace("</body>", PROBE + "</body>"), encoding="utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    command += [
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--window-size={width},900",
        "--virtual-time-budget=5000",
    ]
    if width == NARROW:
        command.append("--blink-settings=preferredColorScheme=0")  # dark
    done = subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=120)
    match = re.search(r'data-found="([^"]*)"', done.stdout)
    assert match, f"{done.stderr[-2000:]}"
    found = json.loads(match[1].replace("&quot;", '"'))
    assert found["window"] == width and found["wide"] <= width
    assert found["all"] == ["a-scene-with-a-long-name", "other"]
    assert found["phong"] == ["a-scene-with-a-long-name"] and found["rows"] == 1
    assert (found["before"], found["after"]) == ("0", "1")
    assert found["dots"] == found["titles"] == 16 and found["left"] == 8
    assert found["ink"] == ("rgb(29, 31, 33)" if width == WIDE else "rgb(232, 233, 234)")
    assert len(set(found["ids"])) == len(found["ids"])
    assert len(found["charts"]) == 2
    for chart in found["charts"]:
        left, right, top, bottom = chart["box"]
        assert len(chart["names"]) == 8
        for i, (name, text) in enumerate(zip(chart["names"], chart["texts"], strict=True)):
            assert left <= name[0] and name[1] <= right and top <= name[2] and name[3] <= bottom
            for other, covered in zip(chart["names"][:i], chart["texts"], strict=False):
                # Boxes of lines touch; letters have some room in them.
                apart_y = name[3] - 2 <= other[2] or other[3] - 2 <= name[2]
                apart_x = name[1] <= other[0] or other[1] <= name[0]
                assert apart_x or apart_y, f"{text} lies on {covered}"


def test_maps_of_rounding_errors_have_their_page(tmp_path):
    figure = {"picture": "a b.png", "title": "<Phong>", "x": "cos theta_i", "y": "e & more"}
    maps = {
        "format": 1,
        "generator": "brdfc",
        "width": 480,
        "height": 320,
        "colors": [{"exponent": e, "rgb": [9, 8, 7]} for e in (-16, 0)],
        "printed": [figure],
        "models": [figure | {"title": "Ward"}],
    }
    (tmp_path / "maps.json").write_text(json.dumps(maps))
    stability.write(tmp_path)
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "<b>&lt;Phong&gt;</b><br>→ cos theta_i<br>↑ e &amp; more" in text
    assert (
        '<li style="background:rgb(9,8,7)">10<sup>−16</sup></li>' in text and "<b>Ward</b>" in text
    )
    assert 'src="a%20b.png"' in text and "http" not in text
    assert "as printed" in text
    (tmp_path / "maps.json").write_text(json.dumps(maps | {"printed": []}))
    stability.write(tmp_path)
    assert "as printed" not in (tmp_path / "index.html").read_text(encoding="utf-8")
    (tmp_path / "maps.json").write_text(json.dumps(maps | {"format": 2}))
    with pytest.raises(ValueError, match="maps.json: format: expected one of 1, got 2"):
        stability.write(tmp_path)
