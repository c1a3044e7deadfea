"""What becomes of the extensions of glTF that a model names."""

from __future__ import annotations

from typing import Literal

from ptmtools.errors import InputError
from ptmtools.scene.source import Findings

#: Drawn as the extension says; used where it serves, and passed over where it does not matter to
#: what is drawn here; not carried over, which is noted.
Outcome = Literal["read", "silent", "noted"]

#: All that are known, with what becomes of them.
KNOWN: dict[str, Outcome] = {
    "EXT_mesh_gpu_instancing": "read",
    "EXT_meshopt_compression": "read",
    "EXT_texture_webp": "read",
    "KHR_animation_pointer": "silent",
    "KHR_draco_mesh_compression": "read",
    "KHR_lights_punctual": "silent",
    "KHR_materials_anisotropy": "silent",
    "KHR_materials_clearcoat": "silent",
    "KHR_materials_diffuse_transmission": "noted",
    "KHR_materials_dispersion": "silent",
    "KHR_materials_emissive_strength": "silent",
    "KHR_materials_ior": "silent",
    "KHR_materials_iridescence": "silent",
    "KHR_materials_pbrSpecularGlossiness": "read",
    "KHR_materials_sheen": "silent",
    "KHR_materials_specular": "silent",
    "KHR_materials_transmission": "read",
    "KHR_materials_unlit": "read",
    "KHR_materials_variants": "noted",
    "KHR_materials_volume": "silent",
    "KHR_mesh_quantization": "read",
    "KHR_meshopt_compression": "read",
    "KHR_node_visibility": "read",
    "KHR_texture_basisu": "read",
    "KHR_texture_transform": "read",
    "KHR_xmp_json_ld": "silent",
}
#: A free program that turns a model into one without an extension, by extension.
_REMEDIES = {
    "EXT_texture_avif": "npx @gltf-transform/cli png --formats '*' IN.glb OUT.glb",
}
_WORDS: dict[Outcome, str] = {
    "read": "read",
    "silent": "does not change what is drawn",
    "noted": "not carried over",
}
_ANY = "open it in Blender and export it as glTF again"


def outcome_of(name: str) -> str:
    """What becomes of an extension, in words."""
    return _WORDS[KNOWN.get(name, "noted")]


def check_extensions(tree: dict[str, object], findings: Findings) -> None:
    """Notes what is not carried over.

    Raises InputError PTM-I255 for an extension that the model cannot do without and that is not
    read.
    """
    required, used = tree.get("extensionsRequired", []), tree.get("extensionsUsed", [])
    if not isinstance(required, list) or not isinstance(used, list):
        raise ValueError("its extensions are not a list")
    for name in sorted({str(name) for name in required} - KNOWN.keys()):
        remedy = _REMEDIES.get(name, _ANY)
        raise InputError(
            "PTM-I255",
            f"needs the glTF extension {name}, which is not read",
            file=findings.model,
            remedy=remedy if remedy == _ANY else f"run `{remedy}`",
        )
    for name in sorted({str(name) for name in used}):
        if KNOWN.get(name, "noted") == "noted":
            findings.say("PTM-N224", f"{name} is not carried over")
