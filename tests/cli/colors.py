# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours as OpenColorIO converts them, without loss."""

import numpy as np
import PyOpenColorIO as ocio
from support import CONFIG


def converted(colors, first, second, config=CONFIG):
    """Colours (..., 3) of the first space of a configuration, as the second one has them."""
    pixels = np.array(colors, np.float32, order="C")
    cpu = ocio.Config.CreateFromFile(str(config)).getProcessor(first, second)
    lossless = ocio.OptimizationFlags.OPTIMIZATION_LOSSLESS
    cpu.getOptimizedCPUProcessor(lossless).applyRGB(pixels.reshape(-1, 3))
    return pixels
