# SPDX-License-Identifier: GPL-3.0-or-later
"""What a model's node group holds: its formulas, twin or shader, made of a pack's lists."""
