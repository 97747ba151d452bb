# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader trees of any material: what reaches an output, which value a socket has."""
