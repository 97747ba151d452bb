# SPDX-License-Identifier: GPL-3.0-or-later
"""What a search for lamps works with, and what it leaves."""

from dataclasses import dataclass, field


@dataclass
class Survey:
    """The lamps of a scene, and what handlers must know to recognize a change."""

    candidates: list = field(default_factory=list)  # slots.Candidate
    emission: dict = field(default_factory=dict)  # radiance of materials, by name
    uneven: set = field(default_factory=set)  # names of materials that emit unevenly
    glowing: set = field(default_factory=set)  # names of emissive objects
    instancers: set = field(default_factory=set)  # names of objects that instance lamps
    #: slots.transform_kind() of lamps that drivers follow, by name.
    transforms: dict = field(default_factory=dict)
    #: Names of flat lamps, if there are several: where they are decides whether they may overlap.
    sheets: set = field(default_factory=set)
    #: Points at which lamps are ranked, (n, 3).
    subject: object = None


@dataclass
class Search:
    """A search for the lamps of a scene, which fills a survey."""

    survey: Survey
    #: Without it, what modifiers do and what is instanced is unknown.
    depsgraph: object | None
    #: Radiance of the emissive materials.
    emitting: dict
    #: For kinds: what instances of the same data have in common.
    shared: dict = field(default_factory=dict)

    def matrix(self, item):
        """World matrix of an object."""
        return (
            item.evaluated_get(self.depsgraph).matrix_world if self.depsgraph else item.matrix_world
        )

    def name_of(self, instance):
        """Name of an instance's lamp."""
        return f"{instance.parent.name}/{instance.object.name}"
