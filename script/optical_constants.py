# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes data/optical/: refractive indices over the visible spectrum, one file per substance.

    python3 script/optical_constants.py CHECKOUT

CHECKOUT: a clone of https://github.com/polyanskiy/refractiveindex.info-database, whose data are in
the public domain (CC0 1.0). Tables are copied unchanged, from the last wavelength before the
visible range to the first one after it; formulas are sampled every 10 nm. The files have the site's
export format, preceded by two lines: the substance, and who measured it.
"""

import re
import sys
from pathlib import Path

import numpy as np

DATA = Path(__file__).resolve().parents[1] / "data" / "optical"
LOW, HIGH = 0.38, 0.78

NOBLE = "P. B. Johnson, R. W. Christy: Optical constants of the noble metals, Phys. Rev. B 6, 1972"
TRANSITION = (
    "P. B. Johnson, R. W. Christy: Optical constants of transition metals, Phys. Rev. B 9, 1974"
)
RAKIC_95 = (
    "A. D. Rakic: Algorithm for the determination of intrinsic optical constants of metal films: "
    "application to aluminum, Appl. Opt. 34, 1995"
)
RAKIC_98 = (
    "A. D. Rakic, A. B. Djurisic, J. M. Elazar, M. L. Majewski: Optical properties of metallic "
    "films for vertical-cavity optoelectronic devices, Appl. Opt. 37, 1998 (Lorentz-Drude)"
)
HALE = "G. M. Hale, M. R. Querry: Optical constants of water, Appl. Opt. 12, 1973 (25 °C)"
MALITSON = (
    "I. H. Malitson: Interspecimen comparison of the refractive index of fused silica, "
    "J. Opt. Soc. Am. 55, 1965"
)
DODGE = (
    "I. H. Malitson, M. J. Dodge: Refractive index and birefringence of synthetic sapphire, "
    "J. Opt. Soc. Am. 62, 1972 (ordinary ray)"
)
SCHOTT = "SCHOTT Zemax catalog 2017-01-20b"
PETER = (
    "F. Peter: Über Brechungsindizes und Absorptionskonstanten des Diamanten, "
    "Zeitschrift für Physik 15, 1923"
)

#: File: label, source, and path in the database.
SUBSTANCES = {
    "aluminium": ("Aluminium", RAKIC_95, "main/Al/nk/Rakic"),
    "bk7": ("Crown glass N-BK7", SCHOTT, "specs/schott/optical/N-BK7"),
    "chromium": ("Chromium", TRANSITION, "main/Cr/nk/Johnson"),
    "cobalt": ("Cobalt", TRANSITION, "main/Co/nk/Johnson"),
    "copper": ("Copper", NOBLE, "main/Cu/nk/Johnson"),
    "diamond": ("Diamond", PETER, "main/C/nk/Peter"),
    "f2": ("Flint glass F2", SCHOTT, "specs/schott/optical/F2"),
    "gold": ("Gold", NOBLE, "main/Au/nk/Johnson"),
    "iron": ("Iron", TRANSITION, "main/Fe/nk/Johnson"),
    "nickel": ("Nickel", TRANSITION, "main/Ni/nk/Johnson"),
    "palladium": ("Palladium", TRANSITION, "main/Pd/nk/Johnson"),
    "platinum": ("Platinum", RAKIC_98, "main/Pt/nk/Rakic-LD"),
    "sapphire": ("Sapphire", DODGE, "main/Al2O3/nk/Malitson-o"),
    "sf11": ("Dense flint glass N-SF11", SCHOTT, "specs/schott/optical/N-SF11"),
    "silica": ("Fused silica", MALITSON, "main/SiO2/nk/Malitson"),
    "silver": ("Silver", NOBLE, "main/Ag/nk/Johnson"),
    "titanium": ("Titanium", TRANSITION, "main/Ti/nk/Johnson"),
    "tungsten": ("Tungsten", RAKIC_98, "main/W/nk/Rakic-LD"),
    "water": ("Water", HALE, "main/H2O/nk/Hale"),
}


def cut(rows):
    """Rows of wavelength and number, from the last below LOW to the first above HIGH."""
    first = max(np.searchsorted([x for x, _ in rows], LOW, "right") - 1, 0)
    last = np.searchsorted([x for x, _ in rows], HIGH)
    return rows[first : last + 1]


def sellmeier(kind, coefficients, micrometres):
    """The database's formulas 1 to 3: Sellmeier's with resonances, with their squares, a power
    series of n^2."""
    constant, *rest = coefficients
    if kind == 3:
        return np.sqrt(
            constant + sum(a * micrometres**b for a, b in zip(rest[::2], rest[1::2], strict=True))
        )
    square = micrometres**2
    total = 1 + constant
    for strength, resonance in zip(rest[::2], rest[1::2], strict=True):
        total = total + strength * square / (square - resonance ** (2 if kind == 1 else 1))
    return np.sqrt(total)


def blocks(text, file):
    """n and k as rows; k is empty if none was measured."""
    n, k = [], []
    for entry in re.split(r"(?m)^  - type: ", text)[1:]:
        what = entry.split("\n", 1)[0].strip()
        if what.startswith("tabulated"):
            lines = re.search(r"data: \|\n((?: {8}.*\n?)*)", entry)[1].splitlines()
            rows = [line.split() for line in lines if line.strip()]
            columns = what.removeprefix("tabulated ")
            for target, letter in ((n, "n"), (k, "k")):
                if letter in columns:
                    column = 1 + columns.index(letter)
                    target += [(float(r[0]), r[column]) for r in rows]
        elif what in {"formula 1", "formula 2", "formula 3"}:
            numbers = re.search(r"coefficients: (.*)", entry)[1].split()
            low, high = map(float, re.search(r"wavelength_range: (\S+) (\S+)", entry).groups())
            for x in np.arange(round(LOW * 100), round(HIGH * 100) + 1) / 100:
                if low <= x <= high:
                    index = sellmeier(int(what[-1]), [float(c) for c in numbers], x)
                    n.append((x, f"{index:.6f}"))
        else:
            sys.exit(f"{file}: expected a table or one of the formulas 1 to 3, got {what!r}")
    return cut(n), cut(k)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for name, (label, source, page) in SUBSTANCES.items():
        file = Path(sys.argv[1]) / "database" / "data" / f"{page}.yml"
        text = file.read_text(encoding="utf-8")
        n, k = blocks(text, file)
        out = [f"# {label}", f"# {source}; refractiveindex.info: {page}"]
        for letter, rows in (("n", n), ("k", k)):
            if rows:
                out += [f"wl,{letter}", *(f"{x:g},{value}" for x, value in rows), ""]
        (DATA / f"{name}.csv").write_text("\n".join(out), encoding="utf-8")
        print(f"{name}: {len(n)} n, {len(k)} k, {n[0][0]:g} to {n[-1][0]:g} µm")


if __name__ == "__main__":
    main()
