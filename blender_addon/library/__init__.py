# SPDX-License-Identifier: GPL-3.0-or-later
"""Ready-made materials for the Asset Browser.

materials.json lists them by catalogue: each with its model, the values that differ from the model's
defaults, tags and a sentence. Models that no listed material uses are added with their defaults.
The .blend is made on the user's machine on request, by a second Blender without a window that runs
build.py; so it matches the versions of Blender and of the extension that use it.
"""

import contextlib
import json
import re
import shutil
import sys
import uuid
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import bpy

from ..common.extension import PACKAGE
from ..common.i18n import say
from ..common.jobs import ProgramJob
from ..content import kept_groups
from ..packs import pack

_HERE = Path(__file__).parent
#: Name of the library in the Asset Browser, and root of its catalogues.
NAME = "brdfc"
#: File in the library's folder that records what made it.
STAMP = "brdfc.json"
BLEND = "materials.blend"
CATALOGS = "blender_assets.cats.txt"
#: File with the reason, by path, why no material was made of a measured file.
REFUSALS = "refusals.json"
CATALOGS_HEAD = "VERSION 1\n\n"
#: Catalogue for models that materials.json does not use.
_REST = "More Models"
#: Namespace of the UUIDs of catalogues: with the path it gives an identifier that never changes.
_NAMESPACE = uuid.UUID("5a4df0f5-8f0c-4c53-9c0d-3f6f6a1e7b62")


class LibraryError(RuntimeError):
    """The library can't be made."""


@dataclass(frozen=True)
class Entry:
    """A material: its name, its catalogue's path below NAME, and what it is made from."""

    name: str
    catalog: str
    model: str
    values: dict
    tags: tuple
    description: str
    #: The metal, glass or liquid with measured refractive index that it represents, or None.
    substance: str | None = None

    @property
    def preview(self):
        """Its preview image, which script/assets renders."""
        slug = re.sub(r"[^a-z0-9]+", "_", self.name.lower())
        return _HERE / "previews" / f"{slug}.jpg"


def available():
    """Whether this extension has a library; one cut to a scene has none."""
    return (_HERE / "materials.json").is_file()


def entries():
    """[Entry] of all materials, ordered by catalogue and name. Raises LibraryError."""
    path = _HERE / "materials.json"
    try:
        listed = json.loads(path.read_text(encoding="utf-8"))
        found = [
            Entry(
                row["name"],
                catalog,
                row["model"],
                row["values"],
                tuple(row["tags"]),
                row["description"],
                row.get("substance"),
            )
            for catalog, rows in listed.items()
            for row in rows
        ]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        more = (
            f"{path}: expected, by catalogue, objects with name, model, values, tags and "
            f"description: {error!r}"
        )
        raise LibraryError(
            say("A file of this extension is damaged: install it again", more)
        ) from error
    used = {entry.model for entry in found}
    for name in pack.model_names():
        if name not in used:
            model = pack.model(name)
            found.append(Entry(model.label, _REST, name, {}, (), model.doc.rstrip(".")))
    return found


def make(api, entry):
    """Makes the material of an entry in the open file."""
    material = api.new_material(entry.model, **entry.values)
    if entry.substance:
        api.set_substance(material, entry.substance)
    return material


def description(entry):
    """The material's description in the Asset Browser: its sentence, the model's paper, and whether
    Open Shading Language matters."""
    model = pack.model(entry.model)
    text = f"{entry.description}. {model.label}: {model.paper}"
    if model.native_form is None:
        text += ". Needs Open Shading Language: without it, Blender's own nodes are shown"
    elif model.native_form.refusal(entry.values):
        text += ". Needs Open Shading Language: without it, the model's default choices are shown"
    return text


def tags(entry):
    """Search words of a material in the Asset Browser, besides its name."""
    model = pack.model(entry.model)
    return tuple(dict.fromkeys([*entry.tags, model.look, model.label, model.citation]))


def catalog_id(catalog):
    return str(uuid.uuid5(_NAMESPACE, catalog))


def with_parents(paths):
    """Paths of catalogues and of those that contain them, sorted: Blender would add the latter and
    then report unsaved changes."""
    paths = {PurePosixPath(path) for path in paths}
    return sorted(paths | {parent for path in paths for parent in list(path.parents)[:-1]})


def catalog_line(identifier, path):
    """The line that defines a catalogue."""
    return f"{identifier}:{path}:{str(path).replace('/', '-')}\n"


def catalogs_text(found):
    """Content of the file that defines the catalogues of these entries."""
    return CATALOGS_HEAD + "".join(
        catalog_line(catalog_id(path.relative_to(NAME).as_posix()), path)
        for path in with_parents(PurePosixPath(NAME, entry.catalog) for entry in found)
    )


def stamp():
    """What a library made by this extension records about itself."""
    return {"generator": pack.manifest()["generator"], "hash": pack.manifest()["hash"]}


def folder():
    """Folder of this extension's library, which may not exist yet; uninstalling removes it."""
    return Path(bpy.utils.extension_path_user(PACKAGE)) / "library"


def registered():
    """The library as registered in the preferences, or None."""
    for library in bpy.context.preferences.filepaths.asset_libraries:
        path = Path(bpy.path.abspath(library.path))
        if path == folder() or (path / STAMP).is_file():
            return library
    return None


def is_current():
    """Whether the registered library was made by this extension's version."""
    library = registered()
    if library is None:
        return False
    try:
        text = (Path(bpy.path.abspath(library.path)) / STAMP).read_text(encoding="utf-8")
        return json.loads(text) == stamp()
    except (OSError, ValueError):
        return False


def _program():
    """Path of Blender, or "" if Blender is a Python module."""
    return bpy.app.binary_path


def build_command(*arguments):
    """The command that runs build.py in a second Blender."""
    build = str(_HERE / "build.py")
    if not _program():
        return [sys.executable, build, "--", *arguments]
    options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python", build]
    return [_program(), *options, "--", *arguments]


def count_made(log):
    """The number of materials that build.py has made, by its log."""
    return len(re.findall(r"^brdfc: made ", log, re.M))


class Making(ProgramJob):
    """Makes the library and registers it in the preferences; the result is the number of materials.

    Nothing is changed before the last step. Steps raise LibraryError.
    """

    failure = LibraryError

    def __init__(self):
        self._count = len(entries())
        self._made = self._open_folder("brdfc-library-") / "library"
        self._made.mkdir()
        command = build_command(str(self._made))
        try:
            self._start(command, environment=kept_groups.environment())
        except OSError as failed:
            raise LibraryError(
                say("The library of materials could not be made", f"{command[0]}: {failed}")
            ) from failed

    def _share(self, log):
        return min(count_made(log) / self._count, 0.99)

    def _ended(self, status):
        if status != 0 or not (self._made / STAMP).is_file():
            more = self._last_words(status)
            self.cancel()
            raise LibraryError(say("The library of materials could not be made", more))
        try:
            _replace(self._made)
        except OSError as failed:
            raise LibraryError(
                say("The library of materials could not be put into place", str(failed))
            ) from failed
        finally:
            self._folder.cleanup()
        _name_it()
        return self._count


def _replace(made):
    target = folder()
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.exists():
        shutil.rmtree(target)
    shutil.move(made, target)


def _name_it():
    library = registered()
    if library is None:
        libraries = bpy.context.preferences.filepaths.asset_libraries
        library = libraries.new(name=NAME, directory=str(folder()))
        _append_from(library)
    library.path = str(folder())
    _changed()


def _append_from(library):
    """Makes Blender append materials that are dragged in, as the lamp list of a linked material
    can't be updated; and, if possible (before 5.0), reuse what it has already appended."""
    for method in ("APPEND", "APPEND_REUSE"):
        with contextlib.suppress(TypeError):  # which import methods exist varies
            library.import_method = method


def remove():
    """Removes the library from the preferences and deletes its folder; materials that were dragged
    into files stay. Returns whether there was one."""
    library = registered()
    if library is not None:
        bpy.context.preferences.filepaths.asset_libraries.remove(library)
        _changed()
    shutil.rmtree(folder(), ignore_errors=True)
    return library is not None


def _changed():
    bpy.context.preferences.is_dirty = True
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == "ASSETS":
                with bpy.context.temp_override(window=window, area=area):
                    if bpy.ops.asset.library_refresh.poll():
                        bpy.ops.asset.library_refresh()
