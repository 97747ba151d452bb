# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals and glass with measured n and k: the tool, the Python package and an independent source
agree in every working space; and both report errors in files with the same words."""

import importlib
import json
import re
import subprocess
import sys
import time

import numpy as np
import PyOpenColorIO as ocio
import pytest
from scipy.optimize import brentq
from support import CONFIG, ROOT, SPACES, TOOL, run, scene

#: X, Y, Z of the normal reflectance under D65 for the 1931 observer, relative to a perfect
#: reflector, computed by colour-science 0.4.7 from the same tables: from 360 to 830 nm in steps of
#: 1 nm.
COLOUR_SCIENCE = {
    "aluminium": (0.9134, 0.9145, 0.9214),
    "copper": (0.7377, 0.6811, 0.5406),
    "gold": (0.7935, 0.7679, 0.4164),
    "silver": (0.9851, 0.9847, 0.9787),
    "iron": (0.5168, 0.5154, 0.4969),
    "titanium": (0.5894, 0.5850, 0.5479),
    "diamond": (0.1727, 0.1728, 0.1758),
    "water": (0.0204, 0.0204, 0.0208),
}


@pytest.fixture(scope="module")
def optics(tmp_path_factory):
    """The module written by this `brdfc python`, and not an earlier one."""
    out = tmp_path_factory.mktemp("python")
    done = subprocess.run([TOOL, "python", "--out", out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    earlier = {n: sys.modules.pop(n) for n in list(sys.modules) if re.match(r"brdfc(\.|$)", n)}
    sys.path.insert(0, str(out))
    try:
        yield importlib.import_module("brdfc").optics  # an attribute, as users expect
    finally:
        sys.path.remove(str(out))
        for name in [n for n in sys.modules if re.match(r"brdfc(\.|$)", n)]:
            del sys.modules[name]
        sys.modules.update(earlier)


def config_in(folder, space):
    """Our configuration with another working space."""
    path = folder / f"{space.split()[-1]}.ocio"
    text = CONFIG.read_text(encoding="utf-8")
    path.write_text(text.replace("scene_linear: Linear Rec.709", f"scene_linear: {space}"))
    return path


def optical(*arguments, config=None):
    done = run("optical", *arguments, "--json", config=config)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def converted(config, first, second, colors):
    pixels = np.array(colors, np.float32, order="C")
    cpu = ocio.Config.CreateFromFile(str(config)).getProcessor(first, second)
    lossless = ocio.OptimizationFlags.OPTIMIZATION_LOSSLESS
    cpu.getOptimizedCPUProcessor(lossless).applyRGB(pixels.reshape(-1, 3))
    return pixels.astype(float)


XYZ = "Linear CIE-XYZ D65"


def test_colours_are_those_of_an_independent_source():
    found = {s["name"]: s["xyz"] for s in optical()}
    assert set(COLOUR_SCIENCE) <= set(found)
    for name, xyz in COLOUR_SCIENCE.items():
        np.testing.assert_allclose(found[name], xyz, atol=1e-4, err_msg=name)


@pytest.mark.parametrize("space", SPACES)
def test_a_substance_has_one_colour_in_every_working_space(tmp_path, optics, space):
    """Also as n and k by channel, except gold's red in Rec.709, which is outside that space."""
    config = config_in(tmp_path, space)
    white = converted(config, space, XYZ, [1, 1, 1])
    for s in optical(config=config):
        expected = np.array(s["xyz"]) * white
        in_space = converted(config, space, XYZ, s["reflectance"])
        np.testing.assert_allclose(in_space, expected, atol=1e-5, err_msg=s["name"])
        of_index = optics._optics.reflectance(optics.NUMPY, 1.0, np.array(s["n"]), np.array(s["k"]))
        in_space = converted(config, space, XYZ, of_index)
        off = np.abs(in_space - expected).max()
        if s["name"] == "gold" and space == SPACES[0]:
            assert s["reflectance"][0] > 1.03 and off > 0.01
        else:
            assert max(s["reflectance"]) < 1 and off < 1e-3, (s["name"], off)


@pytest.mark.parametrize("space", SPACES)
def test_the_package_and_the_tool_say_the_same(tmp_path, optics, space):
    config = config_in(tmp_path, space)
    white = converted(config, space, XYZ, [1, 1, 1])
    of_tool = {s["name"]: s for s in optical(config=config)}
    assert of_tool.keys() == optics.substances().keys()
    for name, s in optics.substances().items():
        values = s.values(lambda xyz: converted(config, XYZ, space, xyz * white))
        told = of_tool[name]
        np.testing.assert_allclose(s.xyz(), told["xyz"], rtol=1e-12)
        np.testing.assert_allclose(values.unclipped, told["reflectance"], atol=2e-6)
        np.testing.assert_allclose(values.n, told["n"], rtol=2e-3, atol=1e-4, err_msg=name)
        np.testing.assert_allclose(values.k, told["k"], rtol=2e-3, atol=1e-4, err_msg=name)
        assert s.conductor == told["conductor"] and s.index_d == pytest.approx(told["n_d"])
        # data/optical is a folder of such files.
        read = optics.read(ROOT / "data" / "optical" / f"{name}.csv")
        assert (read.label, read.source, read.n, read.k) == (s.label, s.source, s.n, s.k)


def test_a_file_is_a_conductor_or_a_dielectric(tmp_path):
    """In the export format of refractiveindex.info, with Windows line ends, and in a single
    block."""
    file = tmp_path / "own.csv"
    rows = [(0.35, 0.2, 3.0), (0.5, 0.4, 3.5), (0.8, 0.3, 4.0)]
    n, k = ("".join(f"{r[0]},{r[i]}\r\n" for r in rows) for i in (1, 2))
    file.write_bytes(f"wl,n\r\n{n}\r\nwl,k\r\n{k}".encode())
    two = optical(file)
    assert two["conductor"] and two["label"] == "own"
    file.write_text("\ufeff# Mine\nwl,n,k\n" + "".join(f"{a}, {b}, {c}\n" for a, b, c in rows))
    one = optical(file)
    assert one["label"] == "Mine" and one["n"] == two["n"] and one["k"] == two["k"]
    file.write_text("wl,n\n0.3,1.53\n0.48613,1.52\n0.65627,1.515\n0.8,1.51\n")
    glass = optical(file)
    assert not glass["conductor"] and glass["abbe"] == pytest.approx(0.5170 / 0.005, rel=0.01)
    assert glass["k"] == [0, 0, 0] and glass["n"] == pytest.approx([1.516, 1.518, 1.521], abs=2e-3)


TABLE = "# Mine\nWL,N,K\n0.35,0.2,3\n0.5,0.4,3.5\n0.8,0.3,4\n"
ENCODED = {
    "capitals": TABLE.encode(),
    "line ends of old Macs": TABLE.replace("\n", "\r").encode(),
    "line ends of Windows": TABLE.replace("\n", "\r\n").encode(),
    "UTF-16 of Windows": TABLE.replace("\n", "\r\n").encode("utf-16"),
    "UTF-16, big-endian": "\ufeff".encode("utf-16-be") + TABLE.encode("utf-16-be"),
    "YAML": b"# this file is part of a database\n\nREFERENCES: |\n    A. Nyone.\n"
    b'    <a href="https://doi.org/1">Own data</a> (2020)\nCOMMENTS: |\n    DATA: none\nDATA:\n'
    b"  - type: tabulated nk\n    data: |\n        0.35 0.2 3\n        0.5 0.4 3.5\n"
    b"        0.8 0.3 4\nCONDITIONS:\n  temperature: 300\n",
    "YAML of two tables": b"DATA:\n- type: tabulated n\n  data: |\n    0.35 0.2\n    0.5 0.4\n"
    b"    0.8 0.3\n- type: tabulated k\n  data: |\n    0.35 3\n    0.5 3.5\n    0.8 4\n",
    # The styles in which libraries write the same.
    "YAML in double quotes": b'DATA:\n- "type": "tabulated nk"\n  "data": "0.35 0.2 3\\n'
    b'0.5 0.4 3.5\\n\\\n    \\ 0.8 0.3 4\\n"\n',
    "YAML in single quotes": b"'DATA':\n- data: '0.35 0.2 3\n\n    0.5 0.4 3.5\n\n    0.8 0.3 4\n\n"
    b"    '\n  type: 'tabulated nk'\n",
    "YAML in braces": b'DATA: # of a device\n  - {type: tabulated n, data: "0.35 0.2\\n0.5 0.4\\n'
    b'0.8 0.3"}\n'
    b"  - {data: [[0.35, 3], [0.5, 3.5],\n      [0.8, 4]], type: tabulated k}\n",
    "YAML as JSON": b'"DATA": [\n  {\n    "type": "tabulated nk",\n'
    b'    "data": "0.35 0.2 3\\n0.5 0.4 3.5\\n0.8 0.3 4\\n"\n  }\n]\n',
}


@pytest.mark.parametrize("way", ENCODED)
def test_a_table_is_read_however_it_is_written(tmp_path, optics, way):
    file = tmp_path / ("own.yml" if "YAML" in way else "own.csv")
    plain = tmp_path / "plain.csv"
    plain.write_text(TABLE.lower())
    file.write_bytes(ENCODED[way])
    told, wanted = optical(file), optical(plain)
    package = optics.read(file)
    assert (told["n"], told["k"]) == (wanted["n"], wanted["k"])
    assert package.n.values == (0.2, 0.4, 0.3) and package.k.values == (3, 3.5, 4)
    label = "own" if "YAML" in way else "Mine"
    assert told["label"] == package.label == label
    if way == "YAML":
        assert package.source == told["source"] == "A. Nyone. Own data (2020)"


@pytest.mark.parametrize("style", ["quotes", "brackets", "open"])
def test_long_tables_of_yaml_are_read_in_linear_time(tmp_path, optics, style):
    rows = [f"{0.3 + i / 20000:.5f} 1.5" for i in range(12000)]
    if style == "quotes":
        data = "'" + "\n\n    ".join(rows) + "'"
    else:
        data = "[" + ",\n    ".join(f"[{row.replace(' ', ', ')}]" for row in rows)
        data += "]" if style == "brackets" else ""
    file = tmp_path / "own.yml"
    file.write_text(f"DATA:\n  - type: tabulated n\n    data: {data}\n")
    before = time.process_time()
    if style == "open":
        with pytest.raises(ValueError, match="line 3: expected a string, a list"):
            optics.read(file)
        assert run("optical", file).returncode == 2
    else:
        assert len(optics.read(file).n.nm) == 12000 and optical(file)["n_d"] == 1.5
    assert time.process_time() - before < 5


D2 = 0.58756**2
LITHIUM_TRIBORATE = (2.4542 + 0.01125 / (D2 - 0.01135) - 0.01388 * D2) ** 0.5
HERZBERGER = 1.5 + 0.004 / (D2 - 0.028) + 1e-4 / (D2 - 0.028) ** 2 - 1e-3 * D2 + 2e-3 * D2**2
HERZBERGER -= 5e-4 * D2**3
#: The n of which (n^2 - 1) / (n^2 + 2) is this number.
CLAUSIUS_MOSSOTTI = 0.25 + 0.03 * D2 / (D2 - 0.02) - 1e-3 * D2
CLAUSIUS_MOSSOTTI = brentq(lambda n: (n * n - 1) / (n * n + 2) - CLAUSIUS_MOSSOTTI, 1, 3)
#: Published coefficients, and n at the line d (587.56 nm) from the same publications: fused silica
#: (Malitson 1965), water at 20 C (Daimon and Masumura 2007), lithium triborate (Chen and others
#: 1989), air (Ciddor 1996), urea (Rosker and others 1985); and own ones.
FORMULAS = {
    1: ("0 0.6961663 0.0684043 0.4079426 0.1162414 0.8974794 9.896161", 1.45846),
    2: (
        "0 5.684027565E-1 5.101829712E-3 1.726177391E-1 1.821153936E-2 2.086189578E-2 "
        "2.620722293E-2 1.130748688E-1 1.069792721E1",
        1.33340,
    ),
    3: ("2.25 0.01 -2 -0.01 2", (2.25 + 0.01 / 0.58756**2 - 0.01 * 0.58756**2) ** 0.5),
    5: ("1.5 0.004 -2", 1.5 + 0.004 / 0.58756**2),
    4: ("2.4542 0.01125 0 0.01135 1 0 0 0 1 -0.01388 2", LITHIUM_TRIBORATE),
    6: ("0 0.05792105 238.0185 0.00167917 57.362", 1.000277),
    7: ("1.5 0.004 0.0001 -0.001 0.002 -0.0005", HERZBERGER),
    8: ("0.25 0.03 0.02 -0.001", CLAUSIUS_MOSSOTTI),
    9: ("2.51527 0.0240 0.0300 0.0202 1.52 0.08771", 1.60366),
}


@pytest.mark.parametrize("formula", FORMULAS)
def test_formulas_of_the_database_are_tabulated(tmp_path, optics, formula):
    coefficients, index = FORMULAS[formula]
    file = tmp_path / "own.yml"
    of_k = "  - type: tabulated k\n    data: |\n        0.38 1E-7\n        0.75 2E-7\n"
    plain = (
        f"  - type: formula {formula}\n    wavelength_range: 0.35 1.1\n"
        f"    coefficients: {coefficients}\n"
    )
    listed = coefficients.replace(" ", ", ")
    styled = (
        f'  - {{type: "formula {formula}", wavelength_range: [0.35, 1.1],\n'
        f"     coefficients: [{listed}]}}\n"
    )
    file.write_text(f"DATA:\n{styled}{of_k}")
    told = optical(file)
    file.write_text(f"DATA:\n{plain}{of_k}")
    assert optical(file) == told
    told, package = optical(file), optics.read(file)
    assert told["n_d"] == pytest.approx(index, abs=1e-5)
    assert package.index_d == pytest.approx(told["n_d"], rel=1e-12)
    assert package.n.nm[0] == 380 and package.n.nm[-1] == 780 and len(package.n.nm) == 81
    assert package.k.values == (1e-7, 2e-7)


def spectrum(rows):
    """At the observer's wavelengths in nm: interpolated linearly, and constant beyond the ends."""
    um, values = zip(*rows, strict=True)
    return lambda nm: np.interp(nm, 1000 * np.array(um), values)


def seen(config, space, of_nm):
    """A spectrum's colour, by the test's own summation over the CIE's tables."""
    table = np.genfromtxt(ROOT / "data/color/observer.csv", delimiter=",", names=True)
    weights = np.stack([table[c] * table["d65"] for c in "xyz"], -1)
    xyz = of_nm(table["nm"]) @ weights / weights.sum(0)
    return converted(config, XYZ, space, xyz * converted(config, space, XYZ, [1, 1, 1]))


#: k of a fictitious green glass, by micrometres.
GREEN = ((0.38, 6e-6), (0.45, 3e-6), (0.52, 4e-7), (0.56, 5e-7), (0.62, 3e-6), (0.7, 8e-6))


def green_glass(folder, n=(1.53, 1.51)):
    file = folder / "green.csv"
    k = "".join(f"{um},{value}\n" for um, value in GREEN)
    file.write_text(f"wl,n\n0.3,{n[0]}\n0.8,{n[1]}\nwl,k\n{k}", encoding="utf-8")
    return file


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("metres", [0.001, 0.01])
def test_absorption_is_beers_law_over_the_spectrum(tmp_path, optics, space, metres):
    """alpha = 4 pi k / lambda, both lengths in metres."""
    config, file = config_in(tmp_path, space), green_glass(tmp_path)
    k = spectrum(GREEN)

    def exact(distance):
        return seen(config, space, lambda nm: np.exp(-4 * np.pi * k(nm) / (nm * 1e-9) * distance))

    told = optical(file, "--thickness", metres, config=config)["absorption"]
    np.testing.assert_allclose(told["transmittance"], exact(metres), atol=1e-5)
    assert told["thickness"] == metres and 0.05 < told["xyz"][1] < 0.99
    # A power of it is exact at that distance only.
    stated = np.clip(exact(metres), 1e-4, 1)
    for row in told["power_law"]:
        power = stated ** (row["distance"] / metres)
        assert row["off"] == pytest.approx(np.abs(power - exact(row["distance"])).max(), abs=2e-5)
    assert len(told["power_law"]) == 4 and max(r["off"] for r in told["power_law"]) > 0.01
    white = converted(config, space, XYZ, [1, 1, 1])
    package = optics.read(file)
    np.testing.assert_allclose(package.transmittance(metres), told["xyz"], rtol=1e-12)
    left = package.attenuation(lambda xyz: converted(config, XYZ, space, xyz * white), metres)
    np.testing.assert_allclose(left, stated, atol=1e-5)


def test_what_has_k_absorbs(tmp_path, optics):
    """Water, as measured by G. M. Hale and M. R. Querry: 0.0448 per metre at 550 nm."""
    found = {s["name"]: s for s in optical()}
    for name, s in found.items():
        package = optics.substance(name)
        assert ("absorption" in s) is not s["conductor"]
        if not s["conductor"]:
            assert (s["absorption"] is not None) is package.absorbs is bool(package.k.nm)
    assert {n for n, s in found.items() if s.get("absorption")} == {"bk7", "f2", "sf11", "water"}
    water = optics.substance("water")
    at_550 = optics._optics.transmittance(optics.NUMPY, 550.0, float(water.k.at(550.0)), 1.0)
    assert -np.log(at_550) == pytest.approx(0.0448, abs=1e-4)
    red, green, blue = optical("water", "--thickness", 1)["absorption"]["transmittance"]
    assert 0.7 < red < 0.76 and 0.95 < green < blue < 0.98
    # A k of 0 does not absorb.
    file = tmp_path / "clear.csv"
    file.write_text("wl,n,k\n0.3,1.5,0\n0.8,1.5,0\n", encoding="utf-8")
    assert optical(file)["absorption"] is None and not optics.read(file).absorbs


def test_a_scene_states_the_thickness(tmp_path):
    green_glass(tmp_path)
    path = tmp_path / "s.json"

    def resolved(**material):
        objects = [{"name": "o", "shape": {"type": "sphere"}, "material": "m"}]
        path.write_text(json.dumps(scene(materials={"m": material}, objects=objects)))
        done = run("scene", path, "--out", tmp_path / "out")
        if done.returncode:
            assert done.returncode == 2
            return done.stderr
        found = json.loads((tmp_path / "out" / "scene.json").read_text())
        return found["materials"]["m"]["parameters"]

    for metres, options in ((0.01, {}), (0.003, {"thickness": 0.003})):
        got = resolved(model="glass", optical="green.csv", **options)
        told = optical(tmp_path / "green.csv", "--thickness", metres)["absorption"]
        assert got["density"] == pytest.approx(1 / metres)
        assert got["attenuation"] == pytest.approx(np.clip(told["transmittance"], 1e-4, 1))
    # A surface without an inside does not absorb.
    assert "attenuation" not in resolved(model="fresnel_dielectric", optical="green.csv")
    # Without k nothing is absorbed, unless the scene says so.
    clear = resolved(model="glass", optical="silica")
    assert set(clear) == {"ior", "dispersion", "attenuation"} and clear["attenuation"] == [1, 1, 1]
    green = {"attenuation": [0.2, 0.9, 0.3], "density": 2}
    found = resolved(model="glass", optical="silica", parameters=green)
    assert {name: found[name] for name in green} == green
    for material, expected in (
        ({"optical": "silica", "thickness": 1}, "silica has no k to absorb by"),
        ({"thickness": 1}, 'materials.m.thickness: expected "optical" beside it'),
        ({"optical": "green.csv", "thickness": 0}, "materials.m.thickness: expected"),
        (
            {"optical": "green.csv", "parameters": {"density": 1}},
            'density: "optical" says what it is',
        ),
    ):
        error = resolved(model="glass", **material)
        assert isinstance(error, str) and "s.json" in error and expected in error, error
    error = resolved(model="fresnel_dielectric", optical="green.csv", thickness=1)
    assert "fresnel_dielectric has no parameter for absorption" in error


def test_a_slab_of_the_stated_thickness_has_the_exact_colour(tmp_path):
    """Seen straight through by the reference renderer; its surfaces reflect R repeatedly."""
    green_glass(tmp_path, n=(1.5, 1.5))
    content = scene(
        camera={
            "type": "orthographic",
            "height": 0.01,
            "position": [0, 0, 1],
            "look_at": [0, 0, 0],
            "up": [0, 1, 0],
        },
        settings={"width": 4, "height": 4, "spp": 1024, "seed": 1, "max_bounces": 32},
        materials={"m": {"model": "glass", "optical": "green.csv", "thickness": 0.01}},
        objects=[{"name": "o", "shape": {"type": "box", "size": [4, 4, 0.01]}, "material": "m"}],
    )
    (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
    done = run("render", tmp_path / "s.json", "--out", tmp_path / "s.exr")
    assert done.returncode == 0, done.stderr
    import OpenImageIO as oiio

    pixels = oiio.ImageBuf(str(tmp_path / "s.exr")).get_pixels(oiio.FLOAT)[..., :3]
    found = optical(tmp_path / "green.csv")
    left = np.array(found["absorption"]["transmittance"])
    # The transmitted light, plus reflections from the near and the far side, in a white world.
    reflected = ((found["n_d"] - 1) / (found["n_d"] + 1)) ** 2
    inside = (1 - reflected) ** 2 / (1 - (reflected * left) ** 2)
    expected = inside * left + reflected + inside * reflected * left**2
    np.testing.assert_allclose(pixels.mean((0, 1)), expected, atol=3e-3)


def test_spectra_as_pbrt_has_them(tmp_path, optics):
    """Pairs in lines of any length, with comments. The end of a name says whether it is n or k."""
    n, k = tmp_path / "Ag.eta.spd", tmp_path / "Ag.k.spd"
    n.write_text("# silver, n\n298.76 1.519 400 0.173\n\n600 0.124 # red\n900 0.04\n")
    k.write_text("298.76 1.08\n400 1.95\n600 3.73\n900 6.3\n")
    table = tmp_path / "ag.csv"
    table.write_text("nm,n,k\n298.76,1.519,1.08\n400,.173,1.95\n600,.124,3.73\n900,.04,6.3\n")
    expected = optical(table)
    for file in (n, k):
        told, read = optical(file), optics.read(file)
        assert told["label"] == read.label == "Ag"
        for key in ("n", "k", "reflectance", "conductor"):
            assert told[key] == expected[key]
        assert read.index_d == pytest.approx(told["n_d"], rel=1e-12)
    k.unlink()
    assert not optical(n)["conductor"] and not optics.read(n).k.nm
    alone = tmp_path / "glass_ETA.SPD"
    alone.write_text("400 1.53 700 1.51")
    assert optical(alone)["label"] == "glass" and optics.read(alone).notes == ()
    for name, text, message in (
        ("Au.k.spd", "400 1", "Au.eta.spd: cannot be read"),
        ("Au.spd", "400 1", "Au.spd: expected the name NAME.eta.spd, for the spectrum of n"),
        ("x.eta.spd", "400 1\n700", "x.eta.spd: expected pairs of a wavelength in nm and a value"),
        ("y.eta.spd", "400 1\n700 n", "y.eta.spd line 2: expected pairs of a wavelength in nm"),
    ):
        file = tmp_path / name
        file.write_text(text)
        done = run("optical", file)
        assert done.returncode == 2 and message in done.stderr
        with pytest.raises((OSError, ValueError), match=re.escape(message.split(":")[0])):
            optics.read(file)


#: A file, and variants that must be read in the same way, with the resulting message.
GOOD = "wl,n,k\n0.38,1.54,0.001\n0.6,1.5,0.0005\n1.2,1.4,0.002\n"
ODD = {
    GOOD.replace("0.38", "0.42"): ("n from 0.42 to 1.2 µm: taken for constant", "k from 0.42"),
    GOOD.replace("0.38", "380").replace("0.6,", "600,").replace("1.2,", "1200,"): (
        "wavelengths of 100 and more are taken for nanometres",
    ),
    GOOD + "1.2,1.42,0.004\n1.4,1.4,0\n": ("1 wavelength of n stands twice", "1 wavelength of k"),
    GOOD.replace(",", "\t"): (),
    GOOD.replace(",", ";"): (),
    GOOD.replace("wl,n,k", "Wavelength (µm),n,k"): (),
    GOOD.replace("wl,n,k", "lambda [um]\tN\tK").replace(",", "\t"): (),
    GOOD.replace("wl,n,k", "Wavelength(nm),Refractive Index,Extinction Coefficient")
    .replace("0.38", "380")
    .replace("0.6,", "600,")
    .replace("1.2,", "1200,"): (),
    GOOD.replace("wl,n,k", "nm,n,k")
    .replace("0.38", "380")
    .replace("0.6,", "600,")
    .replace("1.2,", "1200,")
    + "90,1,0\n": (),
    GOOD.replace("wl,n,k", "wavelength_angstrom,n,k")
    .replace("0.38", "3800")
    .replace("0.6,", "6000,")
    .replace("1.2,", "12000,"): (),
    GOOD.replace("wl,n,k", '"wl","n","k"'): (),
    "wl,n,k\n" + "\n".join(reversed(GOOD.split("\n")[1:-1])): (),
    GOOD + "2,1.4,-1.6e-9\n": ("1 value of k is below 0, the least -1.6e-09: taken for 0",),
    GOOD + "20,1.4,180\n": ("1 value of k outside of [0, 100] and of the visible: left out",),
    GOOD + "20,-1,0\n": ("1 value of n outside of (0, 100] and of the visible: left out",),
    GOOD.replace("wl,n,k", "wl,n")
    .replace(",0.001", "")
    .replace(",0.0005", "")
    .replace(",0.002", "")
    + "wl,k\n2,0.1\n3,0.2\n": ("k from 2 to 3 µm, outside of the visible: left out",),
}


@pytest.mark.parametrize("text", ODD, ids=range(len(ODD)))
def test_what_files_of_others_have_is_assumed_and_said(tmp_path, optics, text):
    """Visible wavelengths are not affected by the variation; the tool and the package report the
    same."""
    file = tmp_path / ("odd.TXT" if "\t" in text else "odd.csv")
    file.write_text(GOOD, encoding="utf-8")
    plain = optical(file)
    file.write_text(text, encoding="utf-8")
    done = run("optical", file, "--json")
    assert done.returncode == 0, done.stderr
    said, read = done.stderr.splitlines(), optics.read(file)
    assert said == [f"brdfc: {note}" for note in read.notes] and len(said) == len(ODD[text])
    for line, words in zip(said, ODD[text], strict=True):
        assert line.startswith(f"brdfc: {file}: ") and words in line, line
    told = json.loads(done.stdout)[0] if done.stdout.startswith("[") else json.loads(done.stdout)
    assert told["n_d"] == pytest.approx(plain["n_d"], abs=2e-3)
    assert read.index_d == pytest.approx(told["n_d"])
    np.testing.assert_allclose(told["reflectance"], plain["reflectance"], atol=1e-3)
    assert (told["absorption"] is not None) is read.absorbs is ("wl,k" not in text)


#: Errors, and the messages without the file's name.
BAD = {
    "": ": expected a line wl,n and rows below it, found no n",
    "wl,k\n0.3,1\n0.8,1\n": ": expected a line wl,n and rows below it, found no n",
    "0.3,1\n": " line 1: expected the header wl,n or wl,k or wl,n,k, got '0.3,1'",
    "metre,n\n380,1\n": " line 1: expected the header wl,n or wl,k or wl,n,k, got 'metre,n'",
    "wl (foot),n\n": " line 1: expected the header wl,n or wl,k or wl,n,k, got 'wl (foot),n'",
    "nm,n\n300,1.5\n\nwl,k\n": " line 4: expected the unit of wavelengths in each header or in "
    "none, got 'wl,k'",
    "wl,n,x\n": " line 1: expected the header wl,n or wl,k or wl,n,k, got 'wl,n,x'",
    "wl\n": " line 1: expected the header wl,n or wl,k or wl,n,k, got 'wl'",
    "wl,n,n\n": " line 1: expected n once",
    "wl,n\n0.3,1.5\n\nwl,n\n": " line 4: expected n once",
    "wl,n\n\n0.3,one\n": " line 3: expected 2 numbers, a wavelength and n, got '0.3,one'",
    "wl,n\n0.3;1.5\n": " line 2: expected 2 numbers, a wavelength and n, got '0.3;1.5'",
    "wl,n\n0.3,1.5,2\n": " line 2: expected 2 numbers, a wavelength and n, got '0.3,1.5,2'",
    "wl,n\n0.3,nan\n": " line 2: expected 2 numbers, a wavelength and n, got '0.3,nan'",
    "wl,n,k\n0.3,1\n": " line 2: expected 3 numbers, a wavelength and n and k, got '0.3,1'",
    "wl,n\n0,1.5\n0.4,1.5\n": " line 2: expected a wavelength above 0, got 0",
    "wl,n\n0.4,0\n": " line 2: expected n in (0, 100], got 0",
    "wl,n\n0.3,1\n0.8,1\nwl,k\n0.4,-2\n": " line 5: expected k in [0, 100], got -2",
    "wl,n\n0.45,1.5\n0.78,1.5\n": ": expected n from 0.43 to 0.65 µm, got 0.45 to 0.78",
    "wl,n\n1,0\n2,0\n": ": expected n in the visible, found none",
    "wl,n\n0.3,1\n0.8,1\nwl,k\n0.5,1\n": ": expected k from 0.43 to 0.65 µm, got 0.5 to 0.5",
    "w\0l\0": ": expected text, in UTF-8, or in UTF-16 with a byte-order mark",
    "DATA:\n  type: tabulated n\n": " line 2: expected '- type: ...', got 'type: tabulated n'",
    "DATA:\n  - type: tabulated n2\n    data: |\n      0.3 1\n": " line 2: expected tabulated n, k "
    "or nk, or formula 1 to 9, got 'tabulated n2'; the page of the substance on "
    "refractiveindex.info has its table under Data > CSV",
    "DATA:\n  - type: tabulated k\n    data: |\n      0.3 1\n      0.8 1\n": ": expected n under "
    "DATA, found none",
    "DATA:\n  - type: tabulated nk\n    data: |\n      0.3 1\n": " line 4: expected 3 numbers, a "
    "wavelength and n and k, got '0.3 1'",
    "DATA:\n  - type: formula 2\n    wavelength_range: 0.3 1\n    coefficients: 0 1\n": " line 2: "
    "expected coefficients of formula 2, a number and pairs of numbers",
    "DATA:\n- type: formula 4\n  wavelength_range: 0.3 1\n  coefficients: 2 1 0.1\n": " line 2: "
    "expected coefficients of formula 4, 9 numbers and up to 4 pairs of numbers",
    "DATA:\n  - type: formula 7\n    wavelength_range: 0.3 1\n    coefficients: 2 1\n": " line 2: "
    "expected coefficients of formula 7, 3 to 6 numbers",
    "DATA:\n  - type: formula 9\n    wavelength_range: 0.3 1\n    coefficients: 2 1\n": " line 2: "
    "expected coefficients of formula 9, 6 numbers",
    "DATA:\n  - type: formula 2\n    coefficients: 0 1 0.1\n": " line 2: expected a "
    "wavelength_range of two numbers in µm",
    # The range of a formula, as it stands in the file.
    "DATA:\n- type: formula 2\n  wavelength_range: 1 5\n  coefficients: 0 1 0.1\n": " line 2: "
    "expected a formula for 0.43 to 0.65 µm, got one for 1 to 5 µm",
    "DATA:\n- type: formula 2\n  wavelength_range: 0.2 0.5\n  coefficients: 0 1 0.1\n": " line 2: "
    "expected a formula for 0.43 to 0.65 µm, got one for 0.2 to 0.5 µm",
    'DATA:\n- type: "tabulated n\n  data: |\n    0.3 1\n': " line 2: expected a string, a list or "
    "a mapping of YAML, got '\"tabulated n'",
    "DATA:\n  - {type tabulated n}\n": " line 2: expected a string, a list or a mapping of YAML, "
    "got '{type tabulated n}'",
    "DATA:\n  - type: tabulated n\n    data: {a: 1}\n": " line 3: expected numbers, got 'data'",
    "DATA: [1, 2]\n": " line 1: expected '- type: ...', got '1'",
    f"DATA: {'[' * 100_000}\n": f" line 1: expected a string, a list or a mapping of YAML, got "
    f"'{'[' * 100_000}'",
}


@pytest.mark.parametrize("ending", ["yml", "YAML"])
@pytest.mark.parametrize("text", ["", "wl,n\n0.3,1.5\n", "BOOK: glass\n", '{"DATA": []}'])
def test_a_yaml_file_without_data_is_told_its_format(tmp_path, optics, text, ending):
    file = tmp_path / f"own.{ending}"
    file.write_text(text, encoding="utf-8")
    done = run("optical", file)
    message = (
        f"{file}: expected a file of refractiveindex.info's database (YAML), with a list DATA, "
        "found none"
    )
    assert done.returncode == 2 and done.stderr == f"brdfc: {message}\n"
    with pytest.raises(ValueError, match=re.escape(message)):
        optics.read(file)


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_what_is_wrong_in_a_file_is_said(tmp_path, optics, text):
    file = tmp_path / "bad.csv"
    file.write_text(text, encoding="utf-8")
    done = run("optical", file)
    assert done.returncode == 2 and f"{file}{BAD[text]}" in done.stderr
    with pytest.raises(ValueError, match=re.escape(f"{file}{BAD[text]}") + "$"):
        optics.read(file)


def test_names_that_there_are_not_are_errors(tmp_path, optics):
    for name, expected in (
        (
            "unobtainium",
            "expected a file NAME.csv, NAME.txt, NAME.yml or NAME.eta.spd, or one of aluminium",
        ),
    ):
        done = run("optical", name)
        assert done.returncode == 2 and expected in done.stderr and name in done.stderr
    done = run("optical", tmp_path / "none.csv")
    assert done.returncode == 2 and "none.csv: cannot be read" in done.stderr
    with pytest.raises(ValueError, match="expected one of aluminium.*unobtainium"):
        optics.substance("unobtainium")


def test_a_scene_names_a_substance_or_a_file(tmp_path):
    (tmp_path / "own.csv").write_text("wl,n\n0.3,1.5\n0.8,1.5\n", encoding="utf-8")
    materials = {
        "a": {"model": "fresnel_conductor", "optical": "gold"},
        "b": {"model": "glass", "optical": "own.csv", "parameters": {"density": 0}},
    }
    path = tmp_path / "s.json"

    def resolved(**changes):
        content = {"materials": {**materials, **changes}}
        objects = [{"name": "o", "shape": {"type": "sphere"}, "material": "a"}]
        path.write_text(json.dumps(scene(**content, objects=objects)), encoding="utf-8")
        return run("scene", path, "--out", tmp_path / "out")

    assert resolved().returncode == 0
    found = json.loads((tmp_path / "out" / "scene.json").read_text())["materials"]
    gold = optical("gold")
    of_channels = [found["a"]["parameters"][f"{q}_{c}"] for q in "nk" for c in "rgb"]
    assert of_channels == pytest.approx([*gold["n"], *gold["k"]])
    clear = {"ior": 1.5, "dispersion": 0, "density": 0, "attenuation": [1, 1, 1]}
    assert found["b"]["parameters"] == clear
    # 20 divided by the Abbe number.
    assert resolved(b={"model": "fresnel_dielectric", "optical": "sf11"}).returncode == 0
    found = json.loads((tmp_path / "out" / "scene.json").read_text())["materials"]
    flint = optical("sf11")
    assert found["b"]["parameters"]["dispersion"] == pytest.approx(20 / flint["abbe"])
    assert flint["abbe"] == pytest.approx(25.68, abs=0.05), "as the maker's catalogue has it"
    for change, expected in (
        (
            {"optical": "mithril"},
            "materials.a.optical: expected a file NAME.csv, NAME.txt, NAME.yml or NAME.eta.spd, or "
            "one of",
        ),
        ({"optical": "none.csv"}, "materials.a.optical: "),
        ({"parameters": {"n_r": 1}}, 'n_r: "optical" says what it is'),
        ({"model": "glass"}, "glass has no parameter that says which metal"),
    ):
        done = resolved(a=materials["a"] | change)
        assert done.returncode == 2 and "s.json" in done.stderr and expected in done.stderr, (
            done.stderr
        )


@pytest.mark.parametrize("space", SPACES)
def test_a_patch_has_one_colour_in_every_working_space(tmp_path, space):
    """A mirror of copper under a white sky, by the reference renderer."""
    content = scene(
        camera={
            "type": "orthographic",
            "height": 1,
            "position": [0, 0, 4],
            "look_at": [0, 0, 0],
            "up": [0, 1, 0],
        },
        materials={"m": {"model": "fresnel_conductor", "optical": "copper"}},
        objects=[{"name": "o", "shape": {"type": "quad", "size": [4, 4]}, "material": "m"}],
    )
    (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
    config = config_in(tmp_path, space)
    done = run("render", tmp_path / "s.json", "--out", tmp_path / "s.exr", config=config)
    assert done.returncode == 0, done.stderr
    import OpenImageIO as oiio

    pixel = oiio.ImageBuf(str(tmp_path / "s.exr")).get_pixels(oiio.FLOAT)[4, 4, :3]
    white = converted(config, space, XYZ, [1, 1, 1])
    expected = np.array(optical("copper")["xyz"]) * white
    np.testing.assert_allclose(converted(config, space, XYZ, pixel), expected, atol=1e-3)
