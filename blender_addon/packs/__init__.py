# SPDX-License-Identifier: GPL-3.0-or-later
"""What the generator wrote: models, parameters, forms, tables; and whether OSL runs here."""
