# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads files of a refractive index n + i k over the wavelength: exports of refractiveindex.info,
and files of its database. generator/model/optical_file.cpp does the same, and says the same."""

import math
import re

from . import _optics

#: Distance in nm of the wavelengths at which a formula is tabulated: that of the observer's tables.
_STEP = 5
_BLOCKS = ("|", "|-", ">")


def _plain_text(path):
    """Its text with the line ends of any system, in UTF-8, or UTF-16 with a byte-order mark."""
    data = path.read_bytes()
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = data.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    if "\0" in text:
        said = "expected text, in UTF-8, or in UTF-16 with a byte-order mark"
        raise ValueError(f"{path}: {said}")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _number(text):
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _add_row(found, columns, fields, text, where, line):
    """Adds a row of a table with these columns beside the wavelength."""
    row = [_number(f) for f in fields]
    if None in row or len(row) != len(columns) + 1:
        raise ValueError(
            f"{where}: expected {len(columns) + 1} numbers, a wavelength in µm and "
            f"{' and '.join(columns)}, got '{text}'"
        )
    for letter, value in zip(columns, row[1:], strict=True):
        found[letter].append((row[0], value, line))


def _check_once(found, letter, where):
    if found[letter]:
        raise ValueError(f"{where}: expected {letter} once")


# ---- exports -------------------------------------------------------------------------------------


def _header(fields, found, where):
    """The columns beside wl, none if that is no header."""
    block = fields[1:]
    if not block or any(f not in found for f in block):
        return []
    for at, letter in enumerate(block):
        if found[letter] or letter in block[:at]:
            raise ValueError(f"{where}: expected {letter} once")
    return block


def _read_export(lines, path):
    comments, block = [], []
    found = {"n": [], "k": []}
    for number, line in enumerate(lines, 1):
        line, where = line.strip(" \t"), f"{path} line {number}"
        if not line:
            continue
        if line.startswith("#"):
            comments.append(line[1:].strip(" \t"))
            continue
        separator = "," if "," in line else "\t"
        fields = [f.strip(' \t"') for f in line.split(separator)]
        is_header = fields[0].lower() == "wl"
        if is_header:
            block = _header([f.lower() for f in fields], found, where)
        if not block:
            raise ValueError(f"{where}: expected the header wl,n or wl,k or wl,n,k, got '{line}'")
        if not is_header:
            _add_row(found, block, fields, line, where, number)
    label, source = [*comments, "", ""][:2]
    return label, source, found


# ---- files of the database -----------------------------------------------------------------------


def _of_formula(formula, c, um):
    """n by the formula of this number at a wavelength. The coefficients are a constant and
    pairs."""
    square, sum_ = um * um, c[0]
    for a, b in zip(c[1::2], c[2::2], strict=True):
        if formula == 1:
            sum_ += a * square / (square - b * b)
        elif formula == 2:
            sum_ += a * square / (square - b)
        elif formula == 6:
            sum_ += a / (b - 1 / square)
        else:
            sum_ += a * um**b
    if formula == 5:
        return sum_
    if formula == 6:
        return 1 + sum_
    squared = sum_ if formula == 3 else 1 + sum_
    return math.sqrt(squared) if squared >= 0 else math.nan


def _add_formula(found, formula, entry, where):
    words = [w for words, _, _ in entry.get("coefficients", ()) for w in words]
    ends = entry.get("wavelength_range") or entry.get("range", ())
    ends = [w for words, _, _ in ends for w in words]
    c, span = [_number(w) for w in words], [_number(w) for w in ends]
    if None in c or len(c) % 2 == 0:
        raise ValueError(
            f"{where}: expected coefficients of formula {formula}, a number and pairs of numbers"
        )
    if None in span or len(span) != 2 or not span[0] < span[1]:
        raise ValueError(f"{where}: expected a wavelength_range of two numbers in µm")
    low, high = max(1000 * span[0], _optics.SEEN[0]), min(1000 * span[1], _optics.SEEN[1])
    count = max(math.ceil((high - low) / _STEP), 0)
    for nm in (*(low + _STEP * i for i in range(count)), high):
        found["n"].append((nm / 1000, _of_formula(formula, c, nm / 1000), entry["line"]))


def _entries(lines, path):
    """The list under DATA, and the text under REFERENCES. An entry has its type and its line, and
    by key (words, text, line) of each line of its value."""
    entries, references, section, key = [], [], "", ""
    for number, full in enumerate(lines, 1):
        line = full.strip(" \t")
        if not line or line.startswith("#"):
            continue
        if re.match(r"[A-Za-z][^:]*:", full):
            section, line = (part.strip(" \t") for part in full.split(":", 1))
            line, key = "" if line in _BLOCKS else line, ""
        if section == "REFERENCES" and line:
            references.append(re.sub(r"<[^>]*(>|$)", "", line))
        if section != "DATA" or not line:
            continue
        if line.startswith("- "):
            entries.append({"type": "", "line": number})
            line = line[2:].strip(" \t")
        if not entries:
            raise ValueError(f"{path} line {number}: expected '- type: ...', got '{line}'")
        if ":" in line:
            key, line = line.split(":", 1)
            line = line.strip(" \t").replace('"', "")
            if key == "type":
                entries[-1] |= {"type": line, "line": number}
            if key in ("type", "line") or line in _BLOCKS:
                continue
        entries[-1].setdefault(key, []).append((line.split(), line, number))
    return entries, " ".join(references)


def _read_database(lines, path):
    found = {"n": [], "k": []}
    entries, source = _entries(lines, path)
    for entry in entries:
        where = f"{path} line {entry['line']}"
        kind, _, which = entry["type"].partition(" ")
        if kind == "tabulated" and which in ("n", "k", "nk"):
            for letter in which:
                _check_once(found, letter, where)
            for words, text, line in entry.get("data", ()):
                _add_row(found, which, words, text, f"{path} line {line}", line)
        elif kind == "formula" and which in ("1", "2", "3", "5", "6"):
            _check_once(found, "n", where)
            _add_formula(found, int(which), entry, where)
        else:
            raise ValueError(
                f"{where}: expected tabulated n, k or nk, or formula 1, 2, 3, 5 or 6, got "
                f"'{entry['type']}'; the page of the substance on refractiveindex.info has its "
                "table under Data > CSV"
            )
    return "", source, found


def read_file(path):
    """(label, source, {"n": rows, "k": rows}) of a file; a row is (wavelength, value, line). Raises
    OSError, and ValueError naming file, line and what was expected."""
    lines = _plain_text(path).split("\n")
    is_database = any(line.rstrip(" \t") == "DATA:" for line in lines)
    label, source, found = (_read_database if is_database else _read_export)(lines, path)
    if not found["n"] and is_database:
        raise ValueError(f"{path}: expected n under DATA, found none")
    if not found["n"]:
        raise ValueError(f"{path}: expected a line wl,n and rows below it, found no n")
    return label, source, found
