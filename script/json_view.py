# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a JSON file that know where they stand in it, for error messages."""

import json
import math


class View:
    """A JSON value that knows its file and key."""

    def __init__(self, value, file, path=""):
        self.value, self.file, self.path = value, file, path

    def error(self, expected):
        where = self.path or "the top level"
        return ValueError(f"{self.file}: {where}: expected {expected}, got {self.value!r:.80}")

    def _child(self, key):
        path = f"{self.path}.{key}" if self.path else str(key)
        return type(self)(self.value[key], self.file, path)

    def has(self, key):
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def get(self, key):
        if not isinstance(self.value, dict):
            raise self.error("an object")
        if key not in self.value:
            raise self.error(f"an object with {key!r}")
        return self._child(key)

    def items(self):
        if isinstance(self.value, dict):
            return [(key, self._child(key)) for key in self.value]
        if isinstance(self.value, list):
            return [(index, self._child(index)) for index in range(len(self.value))]
        raise self.error("an object or a list")

    def elements(self):
        if not isinstance(self.value, list):
            raise self.error("a list")
        return [view for _, view in self.items()]

    def number(self):
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.error("a number")
        if not math.isfinite(self.value):
            raise self.error("a finite number")
        return float(self.value)

    def text(self):
        if not isinstance(self.value, str):
            raise self.error("a text")
        return self.value

    def choice(self, *choices):
        if self.value not in choices:
            raise self.error(f"one of {', '.join(map(str, choices))}")
        return self.value


def read(file):
    """The top level of a JSON file. Raises OSError, or ValueError that names the file."""
    with open(file, encoding="utf-8") as text:
        try:
            return View(json.load(text), file)
        except ValueError as error:
            raise ValueError(f"{file}: expected JSON: {error}") from error
