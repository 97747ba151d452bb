# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the manifests of two builds of the extension: python same_manifest.py A B

Exit status 1, and a line for each difference, unless they are equal. The measured errors of albedos
(representations/FORM/error/albedo) may differ by half a unit in the last place of single precision:
they are errors of rounding to it, and come from single-precision functions of the C library, whose
results are not the same in each version of it. All else must be equal.
"""

import json
import sys
from pathlib import Path

#: Of a number between 0.5 and 1, as albedos at most are.
ROUNDING = 2.0**-25


def differences(a, b, path=()):
    """Places where two JSON values differ, as text."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted(a.keys() | b.keys()):
            if key in a and key in b:
                yield from differences(a[key], b[key], (*path, key))
            else:
                yield f"{'/'.join((*path, key))}: only in {'A' if key in a else 'B'}"
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, pair in enumerate(zip(a, b, strict=True)):
            yield from differences(*pair, (*path, str(i)))
    elif a != b and not (is_measured(path) and abs(a - b) <= ROUNDING):
        yield f"{'/'.join(path)}: {a} and {b}"


def is_measured(path):
    match path:
        case ("models", _, "representations", _, "error", "albedo"):
            return True
    return False


def main():
    found = list(differences(*(json.loads(Path(p).read_text()) for p in sys.argv[1:3])))
    print("\n".join(found), end="\n" * bool(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
