# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by operators: how they report errors, and which material they act on."""

from ..common import editable
from ..common.i18n import Sentence, iface, of_error, rpt, say, tip
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
        return getattr(context.object, "active_material", None) is not None


class ChangesActiveMaterial(OfActiveMaterial):
    @classmethod
    def poll(cls, context):
        return super().poll(context) and keeps_changes(cls, context.object.active_material)


def keeps_changes(operator, *blocks):
    """Whether changes to these are saved with the file; if not, the disabled button explains
    why."""
    if why := editable.refusal(*blocks):
        operator.poll_message_set(tip(why))
    return why is None


class ModalJob:
    """An operator whose work is a jobs.Job. It runs while the interface, which shows its progress,
    stays usable; Esc cancels it, and then nothing is changed."""

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
        context.workspace.status_text_set(iface(said))

    def work(self):
        return Sentence(self.bl_label)

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancel(context)
            said = say("{work}: cancelled, nothing is changed", work=self.work())
            self.report({"INFO"}, rpt(said))
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            share = self.job.step()
        except ERRORS as error:
            self.cancel(context)
            return refused(self, error)
        if share is None:
            self.end(context)
            return self.finish(context, self.job.result)
        self.show_progress(context, share)
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender calls this, too, when a window closes or a file is opened."""
        self.job.cancel()
        self.end(context)

    def end(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
