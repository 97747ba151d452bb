# SPDX-License-Identifier: GPL-3.0-or-later
"""What a warning is: a row of the table, and what it finds in a material or a scene."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from ..common.i18n import Sentence

#: Severities: the picture is wrong; it is right, but something can be better.
ERROR, WARNING = "ERROR", "WARNING"


@dataclass(frozen=True)
class Finding:
    """A problem that was found: a stable code, "ERROR" (the picture is wrong) or "WARNING", and a
    sentence. The sentence may be an i18n.Sentence: English in scripts, translated where shown."""

    code: str
    severity: str
    message: str


class Button(NamedTuple):
    """A button that fixes a problem: its operator, text, and the operator's settings."""

    operator: str
    text: str
    settings: dict = {}


@dataclass(frozen=True)
class Row:
    """A warning. `predicate` takes a context (context.py) and returns a dict for each problem that
    it finds there: the values for the {names} in `sentence` and `more`. Its docstring says in the
    documentation when the warning appears. `more` is technical details in English; `stops`: whether
    no shader runs, so that Blender's own nodes stand in where they can."""

    code: str
    severity: str
    sentence: str
    predicate: Any
    button: Button | None = None
    more: str = ""
    stops: bool = False

    def findings(self, at):
        """Yields a Finding for each problem in a context."""
        for values in self.predicate(at):
            said = Sentence(self.sentence, more=self.more.format(**values), **values)
            yield Finding(self.code, self.severity, said)


def when(wrong, **values):
    """The result of a predicate that finds one problem or none."""
    return [values] if wrong else []
