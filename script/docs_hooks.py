# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds pages from the repository's root and the explorer to the site, and adapts links for it.

A file in the root links to docs/NAME.md, which is NAME.md in the site. Pages in docs/ link only to
one another: files outside would be missing in the site, and pages added here would be missing when
docs/ is read in the repository. Such files are named by a path in `code` instead.
"""

import logging
import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parent.parent
#: Names of pages in the site, by names in the repository.
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
#: Folder in which script/gallery writes one page per model.
MODELS = "gallery/models"
#: The output of `brdfc explorer`, its folder in the site, and the page that the site links to it.
EXPLORER = ROOT / "build" / "explorer"
EXPLORER_IN_SITE = "explorer"
EXPLORER_PAGE = "explorer.md"
#: Matches [text](target) and ![text](target), with an optional # part.
LINK = re.compile(r"(\]\()([^)#\s]+)((?:#[^)\s]*)?\))")

log = logging.getLogger("mkdocs.hooks.brdfc")  # a warning fails a strict build


def _in_the_site(target):
    return PAGES.get(target, target.removeprefix("docs/"))


def on_config(config):
    """Adds the pages of models, which no list names, after the other pages of the gallery."""
    pages = sorted((ROOT / "docs" / MODELS).glob("*.md"))
    names = [f"{MODELS}/{p.name}" for p in pages if p.name != "overview.md"]
    for section in config["nav"]:
        for title, entries in section.items():
            if title == "Gallery":
                entries.append({"Models": [f"{MODELS}/overview.md", *names]})
    return config


def on_files(files, config):
    for source, name in PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        text = LINK.sub(lambda m: m[1] + _in_the_site(m[2]) + m[3], text)
        files.append(File.generated(config, name, content=text))
    for path in sorted(EXPLORER.iterdir()):
        name = f"{EXPLORER_IN_SITE}/{path.name}"
        files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown, page, config, files):
    if page.file.src_uri == EXPLORER_PAGE:
        markdown += f"\n**[Open the explorer]({EXPLORER_IN_SITE}/index.html)**\n"
    if page.file.generated_by is None:
        for link in LINK.finditer(markdown):
            if posixpath.basename(link[2]) in PAGES.values():
                log.warning("%s: %s is a page of the site alone", page.file.src_uri, link[2])
    return markdown
