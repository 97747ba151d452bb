# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour conversion by OpenColorIO, in floating point."""

import numpy as np
import PyOpenColorIO as ocio
from support import CONFIG


def converted(colors, first, second, config=CONFIG):
    """Converts colours (..., 3) from the first space of a configuration to the second."""
    pixels = np.array(colors, np.float32, order="C")
    cpu = ocio.Config.CreateFromFile(str(config)).getProcessor(first, second)
    lossless = ocio.OptimizationFlags.OPTIMIZATION_LOSSLESS
    cpu.getOptimizedCPUProcessor(lossless).applyRGB(pixels.reshape(-1, 3))
    return pixels
