# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a material or a scene, in sentences with what can be done about it."""
