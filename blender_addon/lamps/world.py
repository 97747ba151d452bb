# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps of a world: what the nodes show that its Background nodes read."""

from ..trees import shader_trees, shader_values
from . import emission, kinds


def candidates(world):
    """A candidate for each lamp that a world shows; `world` may be None."""
    tree = shader_trees.shading(world) if world is not None else None
    if tree is None or world.cycles.sampling_method == "NONE":
        return
    seen = []
    for background in shader_trees.shown(world):
        if background.node.bl_idname not in {"ShaderNodeBackground", "ShaderNodeEmission"}:
            continue
        inputs, within = background.node.inputs, background.within
        strength = shader_values.current(inputs["Strength"], within)
        strength = 1.0 if strength is None else strength
        if strength <= 0 and not emission.animated(tree):
            continue
        for shown in shader_trees.upstream(inputs["Color"], within=within):
            node = shown.node
            if node in seen:
                continue
            seen.append(node)
            kind = kinds.of_node(node)
            if kind is not None:
                yield from kind.of_node(shown, strength)
