# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's lobe as a picture: of its model, and of what its form makes of it."""
