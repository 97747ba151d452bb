# SPDX-License-Identifier: GPL-3.0-or-later
"""What the survey of a scene asks of a kind of lamp."""


class Kind:
    """A kind of lamp, which is read from objects, or from nodes of a world. It has no state of its
    own; `search` is the survey.Search that it takes part in."""

    #: Types of objects, or of Blender's lights, that may be lamps of this kind.
    objects = frozenset()
    #: Types (bl_idname) of the nodes whose colour makes a world show lamps of this kind.
    nodes = frozenset()

    # ---- objects ---------------------------------------------------------------------------------

    def of_object(self, item, search):
        """The slots.Candidate of an object, which drivers then follow; None if it is no lamp."""
        return None

    def of_copy(self, instance, search):
        """What of_copies() needs of an instance in the dependency graph: its slots.Candidate, for
        example; None if it is no lamp. The instance itself is gone after this call."""
        return None

    def of_copies(self, found):
        """A slots.Candidate for each instance that is worth one, of the results of of_copy()."""
        return found

    def may_shine(self, item, emitting):
        """Whether copies of an object are lamps; if unknown, true. `emitting`: the emissive
        materials."""
        return False

    def is_changed(self, update, survey, crowded):
        """Whether an update of one of its objects in the dependency graph may change the contents
        of the slots. `crowded`: whether there are more lamps than slots, so that their ranks
        matter."""
        return False

    # ---- nodes of a world ------------------------------------------------------------------------

    def of_node(self, shown, strength):
        """A slots.Candidate for each lamp that a node shows, a shader_trees.Shown. `strength`: of
        the Background node that it reaches."""
        return ()

    def forget(self):
        """Clears what it has cached, so that files are examined anew."""
