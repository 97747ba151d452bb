# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups of models in the open file: made, exchanged, brought up to date."""
