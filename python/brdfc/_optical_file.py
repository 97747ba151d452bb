# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads files of a refractive index n + i k over the wavelength: exports of refractiveindex.info
and other tables, files of its database, and spectra. generator/model/optical_file.cpp does the
same, and says the same."""

import math
import re

from . import _optics
from . import _yaml_styles as yaml_styles

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


def _add_row(found, columns, fields, text, where, line, unit=1.0):
    """Adds a row of a table with these columns beside the wavelength."""
    row = [_number(f) for f in fields]
    if None in row or len(row) != len(columns) + 1:
        raise ValueError(
            f"{where}: expected {len(columns) + 1} numbers, a wavelength and "
            f"{' and '.join(columns)}, got '{text}'"
        )
    for letter, value in zip(columns, row[1:], strict=True):
        found[letter].append((row[0] * unit, value, line))


def _check_once(found, letter, where):
    if found[letter]:
        raise ValueError(f"{where}: expected {letter} once")


# ---- tables with a header, such as exports -------------------------------------------------------

_NM = dict.fromkeys(("nm", "nanometer", "nanometers", "nanometre"), 1e-3)
_UM = dict.fromkeys(
    ("um", "µm", "\u03bcm", "micron", "microns", "micrometer", "micrometers", "micrometre"), 1.0
)
_ANGSTROMS = dict.fromkeys(("a", "angstrom", "angstroms", "\xc5", "\xe5", "\u212b"), 1e-4)
#: Units of wavelengths, in micrometres.
_UNITS = {"": 0.0, **_NM, **_UM, **_ANGSTROMS}
_N = ("n", "index", "refractive index", "index of refraction")
_K = ("k", "kappa", "extinction coefficient")
_LETTERS = {**dict.fromkeys(_N, "n"), **dict.fromkeys(_K, "k")}
_AROUND = " _/()[]"
#: Lower-case letters for capitals of ASCII alone, as the tool has them.
_LOWER = {ord(c): ord(c.lower()) for c in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"}


def _wavelength_unit(field):
    """What a header says of its first column: None if these are not wavelengths; otherwise their
    unit in micrometres, or 0 if the header does not state it."""
    for name in ("wavelengths", "wavelength", "wl", "lambda", "λ", ""):
        rest = field.removeprefix(name)
        unit = rest.strip(_AROUND)
        apart = not rest or rest[0] in _AROUND if name else len(unit.encode()) > 1
        if field.startswith(name) and apart and unit in _UNITS:
            return _UNITS[unit]
    return None


def _header(fields, found, where):
    """The columns beside the wavelength, none if that is no header."""
    block = []
    for field in fields:
        letter = _LETTERS.get(field)
        if letter is None:
            return []
        if found[letter] or letter in block:
            raise ValueError(f"{where}: expected {letter} once")
        block.append(letter)
    return block


def _fields(line, separator):
    return [f.strip(' \t"') for f in line.split("," if "," in line else separator)]


def _read_table(lines, path):
    comments, block, unit, separator = [], [], 0.0, "\t"
    found = {"n": [], "k": []}
    for number, line in enumerate(lines, 1):
        line, where = line.strip(" \t"), f"{path} line {number}"
        if not line:
            continue
        if line.startswith("#"):
            comments.append(line[1:].strip(" \t"))
            continue
        here = ";" if ";" in line and "\t" not in line else "\t"
        header = [f.translate(_LOWER) for f in _fields(line, here)]
        stated = _wavelength_unit(header[0])
        if stated is not None:
            block = _header(header[1:], found, where)
            if (found["n"] or found["k"]) and (unit > 0) != (stated > 0):
                said = "the unit of wavelengths in each header or in none"
                raise ValueError(f"{where}: expected {said}, got '{line}'")
            unit, separator = stated, here
        if not block:
            raise ValueError(f"{where}: expected the header wl,n or wl,k or wl,n,k, got '{line}'")
        if stated is None:
            _add_row(found, block, _fields(line, separator), line, where, number, unit or 1.0)
    label, source = [*comments, "", ""][:2]
    return label, source, found, unit > 0


# ---- spectra -------------------------------------------------------------------------------------


def _spectrum(path):
    """Pairs of a wavelength in nm and a value, separated by spaces, in lines of any length."""
    expected = "expected pairs of a wavelength in nm and a value"
    numbers = []
    for number, line in enumerate(_plain_text(path).split("\n"), 1):
        for word in line.split("#")[0].split():
            value = _number(word)
            if value is None:
                raise ValueError(f"{path} line {number}: {expected}, got '{word}'")
            numbers.append((value, number))
    if len(numbers) % 2:
        raise ValueError(f"{path}: {expected}, got an odd count")
    pairs = zip(numbers[::2], numbers[1::2], strict=True)
    return [(nm / 1000, value, line) for (nm, _), (value, line) in pairs]


def _read_spectra(path):
    """The spectra of n and of k, by the end of their names; only that of n must exist."""
    match = re.fullmatch(r"(.*)([.\-_])(eta|k)", path.stem, re.IGNORECASE)
    if match is None:
        said = "expected the name NAME.eta.spd, for the spectrum of n, with that of k in NAME.k.spd"
        raise ValueError(f"{path}: {said}")
    label, separator, which = match.groups()
    n, k = (
        path if which.lower() == end else path.with_name(f"{label}{separator}{end}{path.suffix}")
        for end in ("eta", "k")
    )
    found = {"n": _spectrum(n), "k": _spectrum(k) if k.exists() else []}
    return label, "", found, True


# ---- files of the database -----------------------------------------------------------------------


#: The fewest coefficients of each formula, and the most of those that are not sums of equal terms.
_FEWEST = {4: 9, 7: 3, 8: 4, 9: 6}
_MOST = {4: 17, 7: 6, 8: 4, 9: 6}


def _count_of_coefficients(formula, count):
    """What is expected of their count; empty if it is so."""
    fewest, most = _FEWEST.get(formula, 1), _MOST.get(formula)
    paired = most is None or formula == 4
    if fewest <= count <= (most or count) and not (paired and count % 2 == 0):
        return ""
    if most is None:
        return "a number and pairs of numbers"
    if formula == 4:
        return "9 numbers and up to 4 pairs of numbers"
    return f"{most} numbers" if fewest == most else f"{fewest} to {most} numbers"


def _root(square):
    return math.sqrt(square) if square >= 0 else math.nan


def _of_formula(formula, c, um):
    """n by the formula of this number at a wavelength: those of refractiveindex.info's database,
    "Dispersion formulas". Sums have a constant and pairs of coefficients."""
    square = um * um
    if formula == 4:
        n2 = c[0]
        for i in (1, 5):
            n2 += c[i] * um ** c[i + 1] / (square - c[i + 2] ** c[i + 3])
        return _root(n2 + sum(a * um**b for a, b in zip(c[9::2], c[10::2], strict=True)))
    if formula == 7:  # Herzberger
        part = 1 / (square - 0.028)
        n = c[0] + c[1] * part + c[2] * part * part
        return n + sum(a * square ** (i + 1) for i, a in enumerate(c[3:]))
    if formula == 8:  # Clausius-Mossotti: a = (n^2 - 1) / (n^2 + 2)
        a = c[0] + c[1] * square / (square - c[2]) + c[3] * square
        return _root((1 + 2 * a) / (1 - a))
    if formula == 9:
        apart = um - c[4]
        return _root(c[0] + c[1] / (square - c[2]) + c[3] * apart / (apart * apart + c[5]))
    sum_ = c[0]
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
    return _root(sum_ if formula == 3 else 1 + sum_)


def _add_formula(found, formula, entry, where):
    words = [w for words, _, _ in entry.get("coefficients", ()) for w in words]
    ends = entry.get("wavelength_range") or entry.get("range", ())
    ends = [w for words, _, _ in ends for w in words]
    c, span = [_number(w) for w in words], [_number(w) for w in ends]
    expected = _count_of_coefficients(formula, 0 if None in c else len(c))
    if expected:
        raise ValueError(f"{where}: expected coefficients of formula {formula}, {expected}")
    if None in span or len(span) != 2 or not span[0] < span[1]:
        raise ValueError(f"{where}: expected a wavelength_range of two numbers in µm")
    first, last = (end / 1000 for end in _optics.NEEDED)
    if span[0] > first or span[1] < last:
        raise ValueError(
            f"{where}: expected a formula for {first:g} to {last:g} µm, got one for {span[0]:g} to "
            f"{span[1]:g} µm"
        )
    low, high = max(1000 * span[0], _optics.SEEN[0]), min(1000 * span[1], _optics.SEEN[1])
    count = max(math.ceil((high - low) / _STEP), 0)
    for nm in (*(low + _STEP * i for i in range(count)), high):
        found["n"].append((nm / 1000, _of_formula(formula, c, nm / 1000), entry["line"]))


class _Database:
    """The list under DATA, and the text under REFERENCES. An entry has its type and its line, and
    by key (words, text, line) of each line of its value."""

    def __init__(self, lines, path):
        self.entries, self._references = [], []
        self._path, self._section, self._key = path, "", ""
        self._open, self._unclosed, self._give, self._since = [], 0, None, 0
        for number, full in enumerate(lines, 1):
            if self._give:
                self._open.append(full)
                self._unclosed += yaml_styles.unclosed(full)
                # Reading a long table anew at each line would take long.
                if yaml_styles.may_end(self._open[0], full, self._unclosed):
                    self._styled("\n".join(self._open), self._give, self._since)
            else:
                self._read(full, number)
        if self._give:
            self._fail(self._since, self._open[0])

    @property
    def source(self):
        return " ".join(self._references)

    def _fail(self, line, text, expected="a string, a list or a mapping of YAML"):
        got = text.split("\n")[0].strip(" \t")
        raise ValueError(f"{self._path} line {line}: expected {expected}, got '{got}'")

    def _read(self, full, number):
        line = full.strip(" \t")
        if not line or line.startswith("#"):
            return
        key, rest = yaml_styles.key_and_rest(full)
        if key:
            self._section, self._key, line = key, "", rest.strip(" \t")
            if key == "REFERENCES" and yaml_styles.is_styled(line):
                self._styled(line, self._refer, number)
                return
            line = "" if line in _BLOCKS or line.startswith("#") else line
        if self._section == "REFERENCES" and line:
            self._refer(line, number)
        elif self._section == "DATA" and line:
            self._entry(line, number)

    def _refer(self, text, number):
        self._references.append(re.sub(r"<[^>]*(>|$)", "", str(text)).strip())

    def _entry(self, line, number):
        """A line under DATA."""
        if line.startswith("["):
            self._styled(line, self._add_all, number)
            return
        if line.startswith("- "):
            self.entries.append({"type": "", "line": number})
            line = line[2:].strip(" \t")
        if not self.entries:
            self._fail(number, line, "'- type: ...'")
        if line.startswith("{"):
            self._styled(line, self._add_keys, number)
            return
        key, rest = yaml_styles.key_and_rest(line)
        if key:
            self._key, line = key, rest.strip(" \t")
            if yaml_styles.is_styled(line):
                self._styled(line, self._add, number)
                return
            if line in _BLOCKS:
                return
        self._add(line, number)

    def _styled(self, text, give, number):
        """Gives the value that a text is to a function, perhaps after further lines."""
        try:
            value = yaml_styles.value(text)
        except yaml_styles.Open:
            self._open, self._unclosed = [text], yaml_styles.unclosed(text)
            self._give, self._since = give, number
            return
        except ValueError:
            self._fail(number, text)
        self._give = None
        give(value, number)

    def _add_all(self, found, number):
        for keys in found:
            self.entries.append({"type": "", "line": number})
            self._add_keys(keys, number)

    def _add_keys(self, keys, number):
        if not isinstance(keys, dict):
            self._fail(number, str(keys), "'- type: ...'")
        for self._key, value in keys.items():
            self._add(value, number)

    def _add(self, value, number):
        """Adds lines to the value of the present key."""
        if isinstance(value, dict):
            self._fail(number, self._key, "numbers")
        if isinstance(value, list):
            rows = value if value and isinstance(value[0], list) else [value]
            value = "\n".join(" ".join(map(str, row)) for row in rows)
        entry = self.entries[-1]
        if self._key == "type":
            entry |= {"type": value.strip(" \t"), "line": number}
            return
        lines = [line for line in value.split("\n") if line.strip(" \t")]
        # A file may not set the number of the line.
        place = entry.setdefault("_" if self._key == "line" else self._key, [])
        place += [(line.split(), line.strip(" \t"), number) for line in lines]


def _read_database(lines, path):
    found = {"n": [], "k": []}
    database = _Database(lines, path)
    for entry in database.entries:
        where = f"{path} line {entry['line']}"
        kind, _, which = entry["type"].partition(" ")
        if kind == "tabulated" and which in ("n", "k", "nk"):
            for letter in which:
                _check_once(found, letter, where)
            for words, text, line in entry.get("data", ()):
                _add_row(found, which, words, text, f"{path} line {line}", line)
        elif kind == "formula" and which in tuple("123456789"):
            _check_once(found, "n", where)
            _add_formula(found, int(which), entry, where)
        else:
            raise ValueError(
                f"{where}: expected tabulated n, k or nk, or formula 1 to 9, got "
                f"'{entry['type']}'; the page of the substance on refractiveindex.info has its "
                "table under Data > CSV"
            )
    return "", database.source, found, False


def _is_database(lines, path):
    """Whether a file has a list DATA. By its name it has to."""
    if any(yaml_styles.key_and_rest(line)[0] == "DATA" for line in lines):
        return True
    if path.suffix.lower() in (".yml", ".yaml"):
        raise ValueError(
            f"{path}: expected a file of refractiveindex.info's database (YAML), with a list DATA, "
            "found none"
        )
    return False


def read_file(path):
    """(label, source, {"n": rows, "k": rows}, whether wavelengths are known to be in µm) of a file;
    a row is (wavelength, value, line). Raises OSError, and ValueError naming file, line and what
    was expected."""
    if path.suffix.lower() == ".spd":
        return _read_spectra(path)
    lines = _plain_text(path).split("\n")
    is_database = _is_database(lines, path)
    label, source, found, in_um = (_read_database if is_database else _read_table)(lines, path)
    if not found["n"] and is_database:
        raise ValueError(f"{path}: expected n under DATA, found none")
    if not found["n"]:
        raise ValueError(f"{path}: expected a line wl,n and rows below it, found no n")
    return label, source, found, in_um
