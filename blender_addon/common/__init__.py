# SPDX-License-Identifier: GPL-3.0-or-later
"""What knows neither models nor materials: languages, long jobs, handlers, colour spaces."""
