# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads which objects the user has copied from the file that Blender's Ctrl+C writes.

That file holds what these depend on as well, and Ctrl+V pastes all of its objects. Blender marks
those that were copied, but does not tell scripts.
"""

import re
import struct
from pathlib import Path

#: The file's name, in the folder for temporary files.
NAME = "copybuffer.blend"
#: ID_FLAG_CLIPBOARD_MARK of Blender's DNA_ID.h.
_MARK = 1 << 14


def copied_objects(path):
    """The names of the objects that were copied. Raises ValueError for a file of another layout,
    and OSError."""
    data = Path(path).read_bytes()
    try:
        blocks = list(_blocks(data))
        (dna,) = (at for code, at in blocks if code == b"DNA1")
        places = _places_in_id(data[dna:])
        found = [at for code, at in blocks if code == b"OB\0\0"]
        return [_name(data, at, places) for at in found if _flag(data, at, places) & _MARK]
    except (struct.error, IndexError, KeyError) as error:
        raise ValueError(f"{path}: {error!r}") from error


def _blocks(data):
    """(code, place of the content) of each block."""
    if data[:7] != b"BLENDER":
        raise ValueError("not a .blend, or a compressed one")
    # Since Blender 5.0 the header begins with its own size.
    since_5 = data[7:9].isdigit()
    at, layout = (int(data[7:9]), "<4siQqq") if since_5 else (12, "<4siQii")
    code = b""
    while code != b"ENDB":
        code, second, _, fourth, _ = struct.unpack_from(layout, data, at)
        start = at + struct.calcsize(layout)
        yield code, start
        at = start + (fourth if since_5 else second)


def _places_in_id(data):
    """The offset of each field of the structure ID, by its name in C. `data`: from the block with
    all structures on, whose parts are aligned to its beginning."""
    names, at = _texts(data, data.index(b"NAME"))
    types, at = _texts(data, at)
    lengths = struct.unpack_from(f"<{len(types)}H", data, at + 4)
    at = _aligned(at + 4 + 2 * len(types))
    (count,) = struct.unpack_from("<i", data, at + 4)
    at += 8
    for _ in range(count):
        kind, fields = struct.unpack_from("<HH", data, at)
        pairs = struct.unpack_from(f"<{2 * fields}H", data, at + 4)
        at += 4 + 4 * fields
        if types[kind] == "ID":
            return _offsets(names, lengths, pairs)
    raise KeyError("ID")


def _offsets(names, lengths, pairs):
    found, offset = {}, 0
    for kind, name in zip(pairs[::2], pairs[1::2], strict=True):
        size = 8 if names[name].startswith(("*", "(")) else lengths[kind]
        for times in re.findall(r"\[(\d+)\]", names[name]):
            size *= int(times)
        found[names[name].split("[")[0]] = offset
        offset += size
    return found


def _texts(data, at):
    """A list of texts that follows a code and their number, and the place behind it."""
    (count,) = struct.unpack_from("<i", data, at + 4)
    at += 8
    texts = []
    for _ in range(count):
        end = data.index(b"\0", at)
        texts.append(data[at:end].decode())
        at = end + 1
    return texts, _aligned(at)


def _aligned(at):
    return at + 3 & ~3


def _flag(data, at, places):
    return struct.unpack_from("<H", data, at + places["flag"])[0]


def _name(data, at, places):
    start = at + places["name"] + 2  # after the two letters of its kind
    return data[start : data.index(b"\0", start)].decode()
