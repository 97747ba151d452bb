# SPDX-License-Identifier: GPL-3.0-or-later
"""What people see in the node editor's sidebar and in the material's properties."""
