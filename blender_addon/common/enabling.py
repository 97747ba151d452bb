# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells whether the extension is enabled, and enables it for scripts."""

import addon_utils

from . import extension
from .i18n import say

_registered = False
#: Whether this process has said that it enabled the extension.
_said = False


def set_registered(value):
    """Notes that the extension was registered or unregistered."""
    global _registered
    _registered = value


def enable():
    """Enables the extension for this session if it is disabled. Raises RuntimeError.

    Blender lets scripts import the package of an extension that is disabled. Without its handlers,
    materials would keep the lamps that they were made with, and look wrong after any change. The
    preferences stay as they are. wm.read_factory_settings, with which many scripts begin a file,
    reads preferences without any extension, and so disables this one each time. That is said once.
    """
    global _said
    if _registered:
        return
    name, errors = extension.PACKAGE, []
    addon_utils.enable(name, handle_error=errors.append)
    if not _registered:
        reason = errors[0] if errors else say("see Blender's console")
        raise RuntimeError(
            say("Extension {name} can't be enabled: {reason}", name=name, reason=reason)
        )
    if not _said:
        print(f"brdfc: {name} was disabled; enabled for this session", flush=True)
    _said = True
