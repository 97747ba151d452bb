# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages of what brdfc has measured: the report of rendered scenes, and maps of rounding errors; and
the templates of all pages, also of that of measured materials, which demo_measured.py fills.

The modules state what report.json and maps.json hold, and compute nothing about it. A page is one
file, index.html, which loads nothing but the pictures beside it: style sheet, script and charts
stand in it.
"""
