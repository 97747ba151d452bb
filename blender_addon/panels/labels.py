# SPDX-License-Identifier: GPL-3.0-or-later
"""Text of panels and dialogs in lines that fit: Blender does not wrap labels, it cuts them."""

import re
import unicodedata

import blf
import bpy

from ..common.i18n import iface

#: Pixels at a resolution scale of 1: what a region has beside the text of a box in a panel, the
#: strip of tabs of a sidebar, an icon, and the room that is taken where there is no region.
_MARGIN, _TABS, _ICON, _ROOM = 54, 22, 20, 250
#: What no line of Japanese begins with.
_CLOSING = "、。，．・：；！？）」』】…%ー々ァィゥェォッャュョぁぃぅぇぉっゃゅょ"


def _scale():
    return bpy.context.preferences.system.ui_scale or 1.0  # 0 without a window


def width(text):
    """Pixels that a text takes in a panel."""
    points = bpy.context.preferences.ui_styles[0].widget.points
    blf.size(0, points * _scale())
    return blf.dimensions(0, text)[0]


def room(icon=False):
    """Pixels that the region which is drawn has for a line."""
    region, scale = bpy.context.region, _scale()
    if region is None:
        pixels = _ROOM * scale
    else:
        pixels = region.width - scale * (_MARGIN + (_TABS if region.type == "UI" else 0))
    return pixels - (scale * _ICON if icon else 0)


def _pieces(text):
    """The parts between which a line may be broken: words, and characters of East Asian width."""
    # Not at spaces that hold words together, as before a per cent sign.
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
    """A text in lines that are no wider than that, if its words allow, indented as it is."""
    margin = text[: len(text) - len(text.lstrip(" "))]
    lines, line = [], ""
    for piece in _pieces(text):
        if line and width(line + piece) > pixels:
            lines.append(line)
            line = ""
        line += piece if line else margin + piece.strip()
    return [made.replace("\u00a0", " ") for made in (*lines, line)]


def wrapped(layout, text, icon="NONE", pixels=None):
    """A label over several lines, of a Sentence or of a text that is not translated; as wide as
    the region or as is said, at a resolution scale of 1."""
    known = room(icon != "NONE") if pixels is None else pixels * _scale()
    for line in lines_of(iface(text), known):
        layout.label(text=line, icon=icon, translate=False)
        icon = "BLANK1" if icon != "NONE" else "NONE"
