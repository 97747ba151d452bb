# SPDX-License-Identifier: GPL-3.0-or-later
"""Words that people see, and their translations by Blender. Works without bpy, then in English.

translations/LOCALE.json holds what each text is in a language: {English: translation}.
Labels and tooltips of classes and properties Blender looks up by itself. What is put together here
is a Sentence, which is English to scripts and logs and is translated where it is shown.
"""

import json
from pathlib import Path

from . import extension

#: Contexts under which Blender looks texts up: those of operators and their buttons, and all else.
CONTEXTS = ("Operator", "*")
FOLDER = extension.ROOT / "translations"


class Sentence(str):
    """English text, made of a template with {names} and of values, some of which may be Sentences.

    `more`: what whoever looks for the cause wants to know, in English; part of the text for
    scripts, and behind the sentence where people see it. Sentences among the values pass theirs on.
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
        """Without `more`; look_up(English) gives a text in the user's language."""
        return _filled(self.template, self.values, look_up)


def _filled(template, values, look_up=lambda english: english):
    shown = {
        name: value.shown(look_up) if isinstance(value, Sentence) else value
        for name, value in values.items()
    }
    return look_up(template).format(**shown)


def say(template, more="", **values):
    """A Sentence; the template is a literal, for the test of the catalogues reads the sources."""
    return Sentence(template, more, **values)


def button(text):
    """The text of a button, for Blender to look up when it draws it."""
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
    """A Sentence as the interface shows it; any other text as it is."""
    return _shown("iface", text)


def tip(text):
    """The same for a tooltip."""
    return _shown("tip", text)


def rpt(text):
    """The same for a report."""
    return _shown("rpt", text)


#: Names of forms that people see, where they are not those of scripts.
_FORM_NAMES = {
    "auto": say("Automatic"),
    "nodes": say("Formula Nodes"),
    "twin": say("Blender Nodes"),
}


def form_name(form):
    """The name of a form in sentences; its template is the text of its button."""
    return _FORM_NAMES.get(form) or Sentence(form.capitalize())


def of_error(error):
    """What an error says, as a Sentence or a text, and what is behind it: ("...", "...")."""
    text = error.args[0] if error.args else ""
    return (text, text.more) if isinstance(text, Sentence) else (str(error), "")


def catalogues(folder=FOLDER):
    """{locale: {(context, English): translation}}, as Blender takes them."""
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
