# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of YAML in quotes, brackets and braces, as libraries write them: strings, lists and
mappings of these. generator/model/yaml_styles.cpp does the same.

This is no reader of YAML: the files of refractiveindex.info's database are lists of blocks, which
_optical_file.py reads. Blender brings no library for YAML."""

import re

_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "0": "\0", " ": " ", '"': '"', "\\": "\\", "/": "/"}


class Open(Exception):
    """The value goes on in the next line."""


#: Files have lists of mappings of lists of rows.
_MOST_DEEP = 8


class _Reader:
    def __init__(self, text):
        self._text, self._at, self._depth = text, 0, 0

    def _peek(self):
        while self._at < len(self._text) and self._text[self._at] in " \t\n":
            self._at += 1
        if self._at == len(self._text):
            raise Open
        return self._text[self._at]

    def is_over(self):
        rest = self._text[self._at :].strip(" \t\n")
        return not rest or rest.startswith("#")

    def value(self):
        first = self._peek()
        if first == "{":
            return self._mapping()
        if first == "[":
            return self._list()
        return self._quoted(first) if first in "\"'" else self._plain()

    def _plain(self):
        """Within brackets: up to what ends it."""
        found = re.compile(r"[^,\[\]{}\n]*?(?=\s*([,\[\]{}\n]|:[\s,\[\]{}]|:$|$))").match(
            self._text, self._at
        )
        self._at = found.end()
        return found.group().strip(" \t")

    def _quoted(self, quote):
        start = self._at + 1
        end = start
        while end < len(self._text):
            here = self._text[end]
            if here == "\\" and quote == '"':
                end += 2
            elif here == quote:
                if quote == '"' or self._text[end + 1 : end + 2] != quote:
                    break
                end += 2
            else:
                end += 1
        if end >= len(self._text):
            raise Open
        self._at = end + 1
        raw = self._text[start:end]
        return _folded(_without_escapes(raw) if quote == '"' else raw.replace("''", "'"))

    def _items(self, end, add):
        self._depth += 1
        if self._depth > _MOST_DEEP:
            raise ValueError
        self._at += 1
        while self._peek() != end:
            add()
            if self._peek() == ",":
                self._at += 1
            elif self._peek() != end:
                raise ValueError
        self._at += 1
        self._depth -= 1

    def _list(self):
        found = []
        self._items("]", lambda: found.append(self.value()))
        return found

    def _mapping(self):
        found = {}

        def add():
            key = self.value()
            if not isinstance(key, str) or self._peek() != ":":
                raise ValueError
            self._at += 1
            found[key] = self.value() if self._peek() not in ",}" else ""

        self._items("}", add)
        return found


#: Stands for a line end that is written as an escape, which folding leaves.
_LINE_END = "\v"


def _without_escapes(raw):
    """A line end after a backslash is none."""
    raw = re.sub(r"\\\n[ \t]*", "", raw)

    def escaped(found):
        here = _ESCAPES.get(found.group(1), found.group())
        return _LINE_END if here == "\n" else here

    return re.sub(r"\\(.)", escaped, raw)


def _folded(text):
    """Line ends become spaces, and empty lines line ends."""
    lines = [line.strip(" \t") for line in text.split("\n")]
    out, empty = lines[0], 0
    for line in lines[1:]:
        if not line:
            empty += 1
            continue
        out += "\n" * empty + line if empty else " " + line
        empty = 0
    return (out + "\n" * empty).replace(_LINE_END, "\n")


def is_styled(text):
    return text[:1] in tuple("\"'[{")


def unclosed(line):
    """The number of brackets and braces that a line opens and does not close."""
    return sum(map(line.count, "[{")) - sum(map(line.count, "]}"))


def may_end(text, line, still_open):
    """Whether a value that begins with a text may end in a line. `still_open`: unclosed() of all
    its lines."""
    return text[0] in line if text[0] in "\"'" else still_open <= 0


def value(text):
    """The string, list or mapping that a text is. Raises Open if it needs further lines, and
    ValueError."""
    reader = _Reader(text)
    found = reader.value()
    if not reader.is_over():
        raise ValueError
    return found


def key_and_rest(line):
    """A key, without its quotes, and what follows the colon; ("", line) if there is no key."""
    found = re.match(
        r"""(?:"([^"]*)"|'([^']*)'|([A-Za-z_][^:'"{}\[\]]*))[ \t]*:(?:[ \t]+|$)""", line
    )
    if not found:
        return "", line
    return next(g for g in found.groups() if g is not None).rstrip(" \t"), line[found.end() :]
