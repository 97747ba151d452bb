# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of items in Blender's searches, so that what begins with a typed word comes before what
only contains it: Blender puts the shortest text that has a word beginning with it first."""

import os
import re
from functools import lru_cache

#: What Blender takes for no part of a word, and a space that it takes for one.
_BETWEEN, _SPACE = r"[ \-_/\u25b8]+", "\u00a0"
#: Words are taken for alike if this many letters at their beginnings are: so many are typed.
_TYPED = 3


def _words(text):
    return [word for word in re.split(_BETWEEN, text.lower()) if word]


def length(text):
    """The length that Blender compares, in bytes."""
    return sum(len(word.encode()) for word in _words(text))


def _alike(word, other):
    """The number of letters at the beginnings of two words that are alike; 0 if they are few."""
    count = len(os.path.commonprefix([word, other]))
    return count if count >= _TYPED else 0


def _comes_after(text, label):
    """The number of letters that a label begins with and that are found inside a text alone, which
    hence comes after it; 0 if there are none."""
    first, *further = _words(text)
    begins = _words(label)[0]
    return 0 if _alike(first, begins) else max((_alike(w, begins) for w in further), default=0)


def _continues(label, other):
    """Whether a label is another one and further words."""
    words, known = _words(label), _words(other)
    return words[: len(known)] == known and len(words) > len(known)


def ordered(texts):
    """{label: text of its item, which begins with the label}, with spaces at the ends of those
    that a search is to find later."""
    return dict(_ordered(tuple(texts.items())))


@lru_cache(maxsize=8)  # menus ask each time that they are drawn
def _ordered(texts):
    made = dict(texts)
    earlier = _earlier(made)
    for _ in made:  # a label may come after one that comes after another
        for label, others in earlier.items():
            least = 1 + max((length(made[other]) for other in others), default=-1)
            missing = max(least - length(made[label]), 0)
            made[label] += _SPACE * -(-missing // len(_SPACE.encode()))
    return made


def _earlier(texts):
    """{label: labels that come before it}. The texts of two labels may each have what the other
    label begins with: what names say counts more than what else is in a text, then what has more
    letters alike."""
    pairs = [(label, other) for label in texts for other in texts if label != other]
    wanted = [
        *(pair for pair in pairs if _continues(*pair)),
        *(pair for pair in pairs if _comes_after(*pair)),
    ]
    inside = {(label, other): _comes_after(texts[label], other) for label, other in pairs}
    wanted += sorted(filter(inside.get, pairs), key=inside.get, reverse=True)
    earlier = {label: set() for label in texts}

    def reaches(label, other):
        return label == other or any(reaches(one, other) for one in earlier[label])

    for label, other in wanted:
        if not reaches(other, label):
            earlier[label].add(other)
    return earlier
