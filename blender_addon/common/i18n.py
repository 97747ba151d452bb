# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of the interface and their translation by Blender. Without bpy, texts stay English.

translations/LOCALE.json holds the texts of a language: {English: translation}. Blender itself looks
up the labels and tooltips of classes and properties. Texts composed here are Sentences: English in
scripts and logs, translated where they are shown.
"""

import json
from collections import Counter
from pathlib import Path

from . import extension

#: Blender's translation contexts: that of operators and their buttons, and the default one.
CONTEXTS = ("Operator", "*")
FOLDER = extension.ROOT / "translations"


class Sentence(str):
    """English text made from a template with {names} and values, some of which may be Sentences.

    `more`: technical details, in English. Scripts get them as part of the text; the interface shows
    them apart from the sentence. Sentences among the values pass on their own details.
    """

    def __new__(cls, template, more="", **values):
        inner = [value for value in values.values() if isinstance(value, Sentence)]
        more = more or "; ".join(sentence.more for sentence in inner if sentence.more)
        made = super().__new__(cls, _filled(template, values) + (f": {more}" if more else ""))
        made.template, made.values, made.more = template, values, more
        return made

    def __getnewargs_ex__(self):
        return (self.template, self.more), self.values

    def shown(self, look_up):
        """The text without `more`; look_up(English) returns a text in the user's language."""
        return _filled(self.template, self.values, look_up)


def _filled(template, values, look_up=lambda english: english):
    shown = {
        name: value.shown(look_up) if isinstance(value, Sentence) else value
        for name, value in values.items()
    }
    return look_up(template).format(**shown)


def say(template, more="", **values):
    """Makes a Sentence. The template must be a literal: the test of the catalogues reads the
    sources."""
    return Sentence(template, more, **values)


def button(text):
    """Marks the text of a button, which Blender looks up when it draws the button."""
    return text


def _look_up(kind, text):
    try:
        from bpy.app import translations
    except ImportError:
        return text
    return getattr(translations, f"pgettext_{kind}")(text)


def _shown(kind, text):
    if isinstance(text, Sentence):
        return text.shown(lambda english: _look_up(kind, english))
    return text


def iface(text):
    """A Sentence translated for the interface; any other text unchanged."""
    return _shown("iface", text)


def tip(text):
    """The same for tooltips."""
    return _shown("tip", text)


def rpt(text):
    """The same for reports."""
    return _shown("rpt", text)


def counted(names):
    """Names for a list: one that several things have is said once, with their count."""
    return [
        name if count == 1 else say("{count} x {name}", count=count, name=name)
        for name, count in Counter(names).items()
    ]


#: Display names of forms, where they differ from the names in scripts.
_FORM_NAMES = {
    "auto": say("Automatic"),
    "nodes": say("Formula Nodes"),
    "twin": say("Blender Nodes"),
}


def in_percent(share):
    """A share as a number of percent with two digits, for sentences: "0.25", "12" or "100". What
    rounding alone makes is "0"."""
    if abs(share) < 1e-9:
        return "0"
    text = f"{100 * share:.2g}"
    return f"{100 * share:.0f}" if "e+" in text else text


def form_name(form):
    """The display name of a form; its template is the text of its button."""
    return _FORM_NAMES.get(form) or Sentence(form.capitalize())


def forms_in_scripts(forms):
    """A list of the names of forms in scripts, with those in the panel where they differ."""
    shown = {form: f" ({name})" for form, name in _FORM_NAMES.items()}
    return ", ".join(f"{form}{shown.get(form, '')}" for form in forms)


def of_error(error):
    """The text of an error, as a Sentence if it is one, and its technical details: ("...",
    "...")."""
    text = error.args[0] if error.args else ""
    return (text, text.more) if isinstance(text, Sentence) else (str(error), "")


def catalogues(folder=FOLDER):
    """{locale: {(context, English): translation}}, the format that Blender's translations take."""
    found = {}
    for path in sorted(Path(folder).glob("*.json")):
        texts = json.loads(path.read_text(encoding="utf-8"))
        found[path.stem] = {(c, english): texts[english] for c in CONTEXTS for english in texts}
    return found


def register():
    from bpy.app import translations

    translations.register(extension.PACKAGE, catalogues())


def unregister():
    from bpy.app import translations

    translations.unregister(extension.PACKAGE)
