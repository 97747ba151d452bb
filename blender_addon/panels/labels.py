# SPDX-License-Identifier: GPL-3.0-or-later
"""Wraps the text of panels and dialogs: Blender cuts long labels off instead of wrapping them."""

import re
import unicodedata

import blf
import bpy

from ..common.i18n import iface

#: Pixels at a resolution scale of 1: the margins beside a label in a panel's box, a sidebar's tabs,
#: an icon, and the width assumed where there is no region.
_MARGIN, _TABS, _ICON, _ROOM = 54, 22, 20, 250
#: Characters that may not begin a line in Japanese.
_CLOSING = "、。，．・：；！？）」』】…%ー々ァィゥェォッャュョぁぃぅぇぉっゃゅょ"


def _scale():
    return bpy.context.preferences.system.ui_scale or 1.0  # 0 without a window


def width(text):
    """Width of a text in a panel, in pixels."""
    points = bpy.context.preferences.ui_styles[0].widget.points
    blf.size(0, points * _scale())
    return blf.dimensions(0, text)[0]


def room(icon=False):
    """Width available to a line in the region being drawn, in pixels."""
    region, scale = bpy.context.region, _scale()
    if region is None:
        pixels = _ROOM * scale
    else:
        pixels = region.width - scale * (_MARGIN + (_TABS if region.type == "UI" else 0))
    return pixels - (scale * _ICON if icon else 0)


def _pieces(text):
    """The parts between which a line may break: words, and single East Asian characters."""
    # Does not break at spaces that belong between two words, such as before a per cent sign.
    text = re.sub(rf" (?=[{re.escape(_CLOSING)}])", "\u00a0", text)
    for word in re.split(r"[ \t\n]+", text):
        piece = " "
        for c in word:
            wide = unicodedata.east_asian_width(c) in "WF"
            if piece.strip() and wide and c not in _CLOSING:
                yield piece
                piece = ""
            piece += c
        if piece.strip():
            yield piece


def lines_of(text, pixels):
    """Breaks a text into lines that fit a width where its words allow it; keeps the indentation."""
    margin = text[: len(text) - len(text.lstrip(" "))]
    lines, line = [], ""
    for piece in _pieces(text):
        if line and width(line + piece) > pixels:
            lines.append(line)
            line = ""
        line += piece if line else margin + piece.strip()
    return [made.replace("\u00a0", " ") for made in (*lines, line)]


def wrapped(layout, text, icon="NONE", pixels=None):
    """A label over several lines, from a Sentence or untranslated text. `pixels`: the width at a
    resolution scale of 1; by default that of the region."""
    known = room(icon != "NONE") if pixels is None else pixels * _scale()
    for line in lines_of(iface(text), known):
        layout.label(text=line, icon=icon, translate=False)
        icon = "BLANK1" if icon != "NONE" else "NONE"
