# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by operators: how they report errors, and which material they act on."""

import bpy

from ..common import editable
from ..common.i18n import Sentence, iface, of_error, rpt, say, tip
from ..common.interface import material_of
from ..warnings import checks

ERRORS = (ValueError, RuntimeError)  # CompileError and PackError are RuntimeErrors


def refused(operator, error):
    """Reports an error as a sentence; its details go to the Info editor first."""
    said, more = of_error(error)
    if more:
        operator.report({"INFO"}, more)
    operator.report({"ERROR"}, rpt(said))
    return {"CANCELLED"}


def report_osl(operator, ours, scene):
    """Reports what keeps the shaders of these nodes from running in a scene."""
    for finding in checks.of_scene(ours, scene):
        operator.report({"WARNING"}, rpt(finding.message))


class OfActiveMaterial:
    @classmethod
    def poll(cls, context):
        return material_of(context) is not None


class ChangesActiveMaterial(OfActiveMaterial):
    @classmethod
    def poll(cls, context):
        return super().poll(context) and keeps_changes(cls, material_of(context))


def keeps_changes(operator, *blocks):
    """Whether changes to these are saved with the file; if not, the disabled button explains
    why."""
    if why := editable.refusal(*blocks):
        operator.poll_message_set(tip(why))
    return why is None


#: Events with which users look around.
_NAVIGATION = frozenset(
    "MOUSEMOVE INBETWEEN_MOUSEMOVE MIDDLEMOUSE WHEELUPMOUSE WHEELDOWNMOUSE TRACKPADPAN "
    "TRACKPADZOOM MOUSEROTATE NDOF_MOTION".split()
)


def _show_status(context, text):
    """Shows a text in the status bars of all windows: that of the Preferences has none."""
    for window in context.window_manager.windows:
        with context.temp_override(window=window):
            context.workspace.status_text_set(text)


class ModalJob:
    """An operator whose work is a jobs.Job. The interface shows its progress. Users can navigate,
    but not change anything under the job; Esc cancels it, and then nothing is changed."""

    job = None

    def begin(self, context, job):
        self.job = job
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self.show_progress(context, 0)  # before the first step, so that users can cancel at once
        return {"RUNNING_MODAL"}

    def show_progress(self, context, share):
        context.window_manager.progress_update(100 * share)
        said = say("{work}: {share}   Esc: cancel", work=self.work(), share=f"{share:.0%}")
        _show_status(context, iface(said))

    def work(self):
        return Sentence(self.bl_label)

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancel(context)
            said = say("{work}: cancelled, nothing is changed", work=self.work())
            self.report({"INFO"}, rpt(said))
            return {"CANCELLED"}
        if event.type in _NAVIGATION:
            return {"PASS_THROUGH"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            share = self.job.step()
        except ERRORS as error:
            self.cancel(context)
            return refused(self, error)
        except BaseException:
            self.cancel(context)
            raise
        if share is None:
            self.end(context)
            return self.finish(context, self.job.result)
        self.show_progress(context, share)
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender calls this, too, when a window closes, a file is opened, or a file browser that
        the operator has opened is cancelled."""
        if self.job is not None:
            self.job.cancel()
            self.end(context)

    def end(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        _show_status(context, None)


class ModalJobOnPath(ModalJob):
    """A ModalJob that asks for files or a folder, if none of the properties for them is set, whose
    names are in `given`. start() returns the job for them."""

    #: A job for the next run: an operator that its file browser executes can't become modal.
    _started = None

    def invoke(self, context, event):
        if not any(getattr(self, name) for name in self.given):
            context.window_manager.fileselect_add(self)
            self.browsed = True
            return {"RUNNING_MODAL"}
        job, type(self)._started = type(self)._started, None
        try:
            return self.begin(context, job or self.start())
        except ERRORS as error:
            return refused(self, error)

    def arguments(self):
        """What the file browser has set, for another call of the operator."""
        return {name: getattr(self, name) for name in self.given}

    def begin_browsed(self):
        """For execute(): the result if the file browser has called it, otherwise None."""
        if not getattr(self, "browsed", False):
            return None
        cls = type(self)
        try:
            cls._started = self.start()
        except ERRORS as error:
            return refused(self, error)
        try:
            category, name = cls.bl_idname.split(".")
            operator = getattr(getattr(bpy.ops, category), name)
            return operator("INVOKE_DEFAULT", **self.arguments())
        finally:
            if cls._started is not None:  # refused
                cls._started.cancel()
                cls._started = None
