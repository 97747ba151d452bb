# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of measured BRDFs as an asset catalogue: a material of each file, with a preview.

The program brdfc fits models to one file after the other. Then a second Blender without a window
makes the materials, renders their previews, and writes a .blend, which is put into place at the
end, with the catalogues beside it.
"""

import contextlib
import json
import os
import shutil
from collections import Counter
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import bpy

from ..common.files import beside
from ..common.i18n import say
from ..common.jobs import Job, ProgramJob
from ..common.program import find
from ..content import kept_groups
from ..measured import ENDINGS, SUM, Fittings, MeasuredError, check_model, fitting_of
from . import (
    BLEND,
    CATALOGS,
    CATALOGS_HEAD,
    NAME,
    REFUSALS,
    build_command,
    catalog_id,
    catalog_line,
    count_made,
    with_parents,
)

#: Catalogue of files that are not in a subfolder.
MEASURED = "Measured"
#: The part of the time that fits take; making materials takes the rest.
_FITS = 0.9
#: Most characters of an asset's description: some lines of a tooltip.
_DESCRIPTION = 400


@dataclass(frozen=True)
class MeasuredLibrary:
    """A .blend with a material for each measured file that could be read."""

    blend: Path
    #: The file that defines the catalogues.
    catalogs: Path
    #: Names of the materials, by file.
    materials: dict
    #: A sentence for each file of which no material was made, by file.
    refusals: dict
    #: What was assumed or repaired of a file, and what its data lack, by file: those of
    #: Measured.notes. Files of which there is nothing to say are left out.
    notes: dict
    #: What keeps the model of a material from coming closer, by file: what Fit.remarks() says.
    #: Files of which there is nothing to say are left out.
    remarks: dict


class Making(Job):
    """Makes a MeasuredLibrary. Nothing is changed before the last step."""

    def __init__(self, folder, blend, model=None, representation="auto"):
        """Raises MeasuredError, and ValueError for arguments that no file could do with."""
        self._root = Path(bpy.path.abspath(str(folder))).absolute()
        self._blend = Path(bpy.path.abspath(str(blend))).absolute()
        self._model, self._representation = model, representation
        _check(self._root, self._blend, model, representation)
        self._files = sorted(
            path
            for path in self._root.rglob("*")
            if path.suffix.lower() in ENDINGS and path.is_file() and not self._hidden(path)
        )
        if not self._files:
            endings = ", ".join(ENDINGS)
            raise MeasuredError(
                say("No file in {folder} ends with {endings}", folder=folder, endings=endings)
            )
        find(MeasuredError)
        self._fits, self._building = Fittings(self._files, self._fitting), None

    def _hidden(self, path):
        return any(part.startswith(".") for part in path.relative_to(self._root).parts)

    def step(self):
        if self.result is not None:
            return None
        if self._building is not None:
            return self._build()
        share = self._fits.step()
        if share is not None:
            return _FITS * share
        self._found, errors = self._fits.result
        self._refusals = {path: error.args[0] for path, error in errors.items()}
        if not self._found:
            raise self._nothing()
        self._building = _Building(self._entries())
        return _FITS

    def _fitting(self, path):
        return fitting_of(path, self._model)

    def _build(self):
        share = self._building.step()
        if share is not None:
            return _FITS + (1 - _FITS) * share
        try:
            refused = self._building.refusals()
            self._refusals |= {
                path: refused[str(path)] for path in self._found if str(path) in refused
            }
            if self._refusals.keys() == set(self._files):
                raise self._nothing()
            _put_into_place(self._building.result, self._blend, self._catalogs, self._lines)
        except OSError as failed:
            more = failed.strerror or str(failed)
            raise MeasuredError(
                say("{file} can't be written", more=more, file=self._blend)
            ) from failed
        finally:
            self._building.clean_up()
        names = self._names()
        made = {path: names[path] for path in self._found if path not in self._refusals}
        notes = {path: self._found[path].notes for path in made if self._found[path].notes}
        remarks = {path: said for path in made if (said := self._remarks(self._found[path]))}
        self.result = MeasuredLibrary(
            self._blend, self._catalogs, made, self._refusals, notes, remarks
        )
        return None

    def _remarks(self, found):
        """Of the fit that becomes the material."""
        return () if self._model == SUM else tuple(found.fit(self._model).remarks())

    def _nothing(self):
        more = "; ".join(f"{path.name}: {why}" for path, why in self._refusals.items())
        return MeasuredError(
            say("No file in {folder} became a material", more=more, folder=self._root)
        )

    def _names(self):
        """The name of each file's material: the file's, with its folder and ending where two files
        have the same."""
        count = Counter(path.stem for path in self._files)
        return {
            path: path.stem if count[path.stem] == 1 else path.relative_to(self._root).as_posix()
            for path in self._files
        }

    def _entries(self):
        """What the second Blender needs, by file."""
        names = self._names()
        catalogs = {path: self._catalog(path) for path in self._found}
        self._catalogs = _catalogs_file(self._blend)
        known = {path: identifier for identifier, path in _catalogs(_text(self._catalogs))}
        paths = with_parents(catalogs.values())
        ids = {
            path: known.get(str(path), catalog_id(path.relative_to(NAME).as_posix()))
            for path in paths
        }
        self._lines = {ids[path]: catalog_line(ids[path], path) for path in paths}
        return [
            {
                "path": str(path),
                "name": names[path],
                "told": found.told,
                "model": self._model,
                "representation": self._representation,
                "catalog_id": ids[catalogs[path]],
                "description": _description(found, self._remarks(found)),
                "tags": [MEASURED.lower(), found.format],
            }
            for path, found in self._found.items()
        ]

    def _catalog(self, path):
        inside = path.relative_to(self._root).parent.as_posix().replace(":", "-")
        return PurePosixPath(NAME, MEASURED, inside)

    def cancel(self):
        self._fits.cancel()
        if self._building is not None:
            self._building.cancel()


def _description(found, remarks=()):
    """Of an asset. What the data lack stands before what was assumed of them and remarks on the
    fit, as far as there is room."""
    said = f"{found.path.name}: {found.format}, {found.grid}"
    for note in (*found.told["lacks"], *found.told["notes"], *remarks):
        longer = f"{said}; {note}"
        if len(longer) <= _DESCRIPTION:
            said = longer
    return said


class _Building(ProgramJob):
    """Runs build.py; the result is the .blend that it wrote."""

    failure = MeasuredError

    def __init__(self, entries):
        self._count = len(entries)
        listed = json.dumps(entries)
        self._made = self._open_folder("brdfc-measured-", {"fits.json": listed})
        command = build_command(str(self._made), str(self._made / "fits.json"))
        try:
            self._start(command, environment=kept_groups.environment())
        except OSError as failed:
            raise self._failed(f"{command[0]}: {failed}") from failed

    def _failed(self, more):
        return MeasuredError(say("The library of materials could not be made", more))

    def _share(self, log):
        return min(count_made(log) / self._count, 0.99)

    def _ended(self, status):
        if status != 0 or not (self._made / REFUSALS).is_file():
            more = self._last_words(status)
            self.clean_up()
            raise self._failed(more)
        return self._made / BLEND

    def refusals(self):
        """Why no material was made, by path."""
        return json.loads((self._made / REFUSALS).read_text(encoding="utf-8"))

    def clean_up(self):
        self._folder.cleanup()

    def cancel(self):
        super().cancel()
        self.clean_up()


def _check(folder, blend, model, representation):
    if not folder.is_dir():
        raise ValueError(say("There is no folder {folder}", folder=folder))
    if blend.suffix.lower() != ".blend" or not blend.parent.is_dir() or blend.is_dir():
        raise ValueError(
            say("Expected the name of a .blend in a folder that exists, got {file}", file=blend)
        )
    if bpy.data.filepath and Path(bpy.data.filepath).absolute() == blend:
        raise ValueError(say("{file} is the file that is open: choose another name", file=blend))
    _check_replaced(blend)
    check_model(model, representation)


def _check_replaced(blend):
    """Raises ValueError if a file would be lost that is no library of materials."""
    if not blend.exists():
        return
    try:
        # Names alone are read.
        with bpy.data.libraries.load(str(blend)) as (there, _):
            scene = bool(there.scenes or there.objects)
    except OSError as failed:
        raise ValueError(say("{file} can't be read", more=str(failed), file=blend)) from failed
    if scene:
        raise ValueError(
            say(
                "{file} has a scene or objects, so it is no library of materials: choose another "
                "name",
                file=blend,
            )
        )


def _catalogs_file(blend):
    """The file in which Blender looks for the catalogues of a .blend: that of the asset library
    that contains it, or else the one beside it."""
    for library in bpy.context.preferences.filepaths.asset_libraries:
        root = Path(bpy.path.abspath(library.path)).absolute()
        if library.path and root in blend.parents:
            return root / CATALOGS
    return blend.parent / CATALOGS


def _text(catalogs):
    try:
        return catalogs.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as failed:
        raise MeasuredError(
            say("{file} can't be read", more=str(failed), file=catalogs)
        ) from failed


def _catalogs(text):
    """(identifier, path) of each catalogue of a file."""
    for line in text.splitlines():
        fields = line.split(":")
        if len(fields) >= 2 and not line.lstrip().startswith("#"):
            yield fields[0].strip().lower(), fields[1].strip()


def _put_into_place(made, blend, catalogs, lines):
    """Moves the .blend to its place, and adds lines to the file of catalogues, by identifier, that
    it lacks. Raises OSError; then both files are as they were."""
    before = _text(catalogs)
    known = {identifier for identifier, _ in _catalogs(before)}
    text = before or CATALOGS_HEAD
    text += "" if text.endswith("\n") else "\n"
    text += "".join(line for identifier, line in lines.items() if identifier not in known)
    new = [beside(blend), beside(catalogs)]
    try:
        shutil.copyfile(made, new[0])
        new[1].write_text(text, encoding="utf-8", newline="")
        os.replace(new[1], catalogs)
        try:
            os.replace(new[0], blend)
        except OSError:
            with contextlib.suppress(OSError):
                if before:
                    catalogs.write_text(before, encoding="utf-8", newline="")
                else:
                    catalogs.unlink()
            raise
    finally:
        for path in new:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
