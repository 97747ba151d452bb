# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's own nodes reflect, and which model or Principled node comes nearest."""
