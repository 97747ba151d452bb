# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to glTF, which gets the nearest Principled material.

Files of glTF can't hold reflection models. Blender's exporter asks enabled extensions about each
material."""

from .plotting import nearest_node


class glTF2ExportUserExtension:  # the exporter looks for this name
    """The exporter makes one for each file, and logs what its methods raise."""

    def gather_material_hook(self, gltf2_material, blender_material, export_settings):
        """Fills in a material of models alone."""
        near = nearest_node.of_material(blender_material)
        if near is not None:
            _fill(gltf2_material, near)


def _fill(gltf2_material, near):
    # The exporter's classes, which exist while it runs.
    from io_scene_gltf2.io.com.gltf2_io import MaterialPBRMetallicRoughness
    from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

    gltf2_material.pbr_metallic_roughness = MaterialPBRMetallicRoughness(
        base_color_factor=[*near.color, 1.0],
        base_color_texture=None,
        extensions=None,
        extras=None,
        metallic_factor=near.metallic,
        metallic_roughness_texture=None,
        roughness_factor=near.roughness,
    )
    added = {}
    if near.metallic < 1:
        added["KHR_materials_ior"] = {"ior": near.ior}
        # The exporter drops an IOR that is alone.
        added["KHR_materials_specular"] = {"specularFactor": 1.0}
    if near.transmission:
        added["KHR_materials_transmission"] = {"transmissionFactor": 1.0}
    gltf2_material.extensions = (gltf2_material.extensions or {}) | {
        name: Extension(name, values, required=False) for name, values in added.items()
    }
