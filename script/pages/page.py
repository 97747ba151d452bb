# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates of the pages, how they write numbers, and the command line that fills them."""

import argparse
import sys
from pathlib import Path

import jinja2
from markdown_table import percent
from markupsafe import Markup

MINUS, DASH = "−", "–"


def with_minus(text):
    return text.replace("-", MINUS)


def scientific(value):
    """0.00123 as 1.2·10^−3."""
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.1e}".split("e")
    return Markup("{}·10<sup>{}</sup>").format(with_minus(mantissa), with_minus(str(int(exponent))))


def signed(value, digits=3):
    return with_minus(f"{value:+.{digits}f}")


def number(value, digits=3):
    """A number to so many significant digits."""
    return with_minus(f"{value:.{digits}g}")


def fixed(value, digits=2):
    return with_minus(f"{value:.{digits}f}")


def counted(count, one, many=None):
    return f"{count} {one if count == 1 else many or one + 's'}"


def environment():
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {
        "scientific": scientific,
        "signed": signed,
        "number": number,
        "fixed": fixed,
        "counted": counted,
        "percent": percent,
    }
    made.globals |= {"dash": DASH, "minus": MINUS}
    return made


def write_page(folder, template, **context):
    """Fills a template as index.html of a folder; the old one stays until the new is whole."""
    text = environment().get_template(template).render(context)
    begun = folder / ".index.html.part"
    begun.write_text(text, encoding="utf-8")
    begun.replace(folder / "index.html")


def main(doc, write):
    """The command line of a page: write(folder) makes it. Exit status 2 for wrong input."""
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="DIR")
    folder = parser.parse_args().folder
    try:
        write(folder)
    except (OSError, ValueError) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        sys.exit(2)
    print(f"wrote {folder / 'index.html'}", file=sys.stderr)
