"""Materials, samplers and images of a glTF document (glTF 2.0, sections 3.8 and 3.9).

Of the metallic-roughness model only the base colour is kept. Its factor is linear light, and the
tint of the emitted files is not, so the factor is converted to sRGB; the product of tint and
texel then differs from the linear product for partial tints, and the conversion is noted. The alpha
of texels counts in the modes MASK and BLEND only (section 3.9.6).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ptmtools.scene.colors import to_srgb
from ptmtools.scene.gltf.document import Document, data_uri
from ptmtools.scene.ktx2 import TranscodedBytes
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import FileRange, HeldBytes, SourceMaterial, SourceWrap, Texture

#: A material of a document → a texture of it, with its texture coordinates.
TextureOf = Callable[[dict[str, Any]], dict[str, Any] | None]

_KTX2 = "image/ktx2"
_WRAPS: dict[int | None, SourceWrap] = {33071: "clamp", 33648: "mirror"}


@dataclass(frozen=True)
class MaterialUse:
    """How a material applies to a primitive.

    Attributes
    ----------
    index: into `MaterialReader.materials`.
    coords: the attribute with its texture coordinates.
    matrix: (2, 3) KHR_texture_transform, origin at the upper left as glTF has it.
    see_through: whether it has an alpha mode other than opaque.
    light: (3,) its base colour, linear light, by which colours of vertices are multiplied.
    """

    index: int
    coords: str
    matrix: NDArray[np.float64]
    see_through: bool
    light: NDArray[np.float64]


class MaterialReader:
    """Reads each material once, when a primitive first asks for it.

    ``texture_of`` says which texture of a material counts, as the document has it, or None; without
    it, that of its base colour.
    """

    def __init__(
        self, document: Document, findings: Findings, texture_of: TextureOf | None = None
    ) -> None:
        self._document = document
        self._findings = findings
        self._texture_of = texture_of
        self._painted: dict[tuple[int | None, bool], MaterialUse] = {}
        self._materials: list[SourceMaterial] = []

    @property
    def materials(self) -> tuple[SourceMaterial, ...]:
        return tuple(self._materials)

    def read(self, index: int | None, colored: bool) -> MaterialUse:
        """The material of a primitive; None is the default material of the format. Vertices that
        are ``colored`` have its base colour in theirs, so that the two are multiplied as light."""
        if (index, colored) not in self._painted:
            entry = {} if index is None else self._document.tree["materials"][index]
            self._painted[index, colored] = self._read(entry, index, colored)
        return self._painted[index, colored]

    def _read(self, entry: dict[str, Any], index: int | None, colored: bool) -> MaterialUse:
        place = f"material {index}"
        name = str(entry.get("name") or ("default" if index is None else place))
        extensions = entry.get("extensions", {})
        base = entry.get("pbrMetallicRoughness", {})
        factor = base.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])
        use = base.get("baseColorTexture")
        glossy = extensions.get("KHR_materials_pbrSpecularGlossiness")
        if glossy is not None:
            factor = glossy.get("diffuseFactor", [1.0, 1.0, 1.0, 1.0])
            use = glossy.get("diffuseTexture")
        if self._texture_of is not None:
            use = self._texture_of(entry)
        r, g, b, a = (_share(value) for value in factor)
        if (r, g, b) != (1.0, 1.0, 1.0):
            self._findings.note("PTM-N215", f"{name}: colour factor converted to sRGB", place)
        light = np.array([r, g, b], dtype=np.float64)
        red, green, blue = (1.0, 1.0, 1.0) if colored else to_srgb(light).tolist()
        mode = entry.get("alphaMode", "OPAQUE")
        tested = mode == "MASK"
        cutoff = float(entry.get("alphaCutoff", 0.5)) if tested else 0.0
        opacity = {"BLEND": a, "MASK": float(a >= cutoff)}.get(mode, 1.0)
        see_through = mode in ("MASK", "BLEND")
        if extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 0) > 0:
            self._findings.note("PTM-N215", f"{name}: transmits light, never occludes", place)
            see_through = True

        texture, coords, matrix = None, "TEXCOORD_0", np.eye(2, 3)
        if use is not None:
            texture = self._texture(use["index"], place, _share(use.get("strength", 1.0)))
            moved = use.get("extensions", {}).get("KHR_texture_transform", {})
            matrix = _transform(moved)
            coords = f"TEXCOORD_{moved.get('texCoord', use.get('texCoord', 0))}"
            if moved:
                self._findings.note(
                    "PTM-N215", f"{name}: KHR_texture_transform is baked into its faces", place
                )
        self._materials.append(
            SourceMaterial(
                name=name,
                color=(red, green, blue),
                opacity=opacity,
                see_through=see_through,
                ignores_alpha=mode not in ("MASK", "BLEND"),
                # Of a texel, where all are multiplied with the factor's alpha.
                cutoff=max(cutoff / a, 0.0) if tested and opacity and a > 0 else None,
                two_sided=bool(entry.get("doubleSided", False)),
                texture=texture,
            )
        )
        return MaterialUse(len(self._materials) - 1, coords, matrix, see_through, light)

    def _texture(self, index: int, place: str, strength: float) -> Texture | None:
        tree = self._document.tree
        texture = tree["textures"][index]
        sampler = tree["samplers"][texture["sampler"]] if "sampler" in texture else {}
        sources = [texture, *texture.get("extensions", {}).values()]
        # The texture's own image is that for programs without extensions, with the least loss.
        source = next((each["source"] for each in sources if "source" in each), None)
        what = f"texture {index}"
        if source is None:
            self._findings.miss("PTM-N204", f"{what}: names no image", place)
            return None
        image = tree["images"][source]
        uri = image.get("uri")
        label = str(image.get("name") or f"image_{source}")
        if "bufferView" in image:
            buffer, start, length = self._document.view(image["bufferView"])
            read: Callable[[], bytes] = buffer.part(start, length)
        elif uri is not None and uri.startswith("data:"):
            read = HeldBytes(data_uri(self._document.path, uri, f"image {source}"))
        else:
            what = unquote(str(uri))
            file = self._findings.locate(what, what, place)
            if file is None:
                return None
            read, label = FileRange(file), file.name
        packed = image.get("mimeType") == _KTX2 or label.lower().endswith(".ktx2")
        return Texture(
            read=TranscodedBytes(read) if packed else read,
            label=label,
            what=what,
            place=place,
            wrap_s=_WRAPS.get(sampler.get("wrapS"), "repeat"),
            wrap_t=_WRAPS.get(sampler.get("wrapT"), "repeat"),
            strength=strength,
        )


def _share(value: Any) -> float:
    """A number, brought into [0, 1]; ValueError for what is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{value!r} is no number")
    return min(max(float(value), 0.0), 1.0)


def _transform(given: dict[str, Any]) -> NDArray[np.float64]:
    """(2, 3) matrix of KHR_texture_transform: scale, then rotation, then offset.

    Turned as its text, its test model and the viewers have it; its sample of GLSL, read by columns,
    turns the other way.
    """
    offset = np.array(given.get("offset", [0.0, 0.0]), dtype=np.float64)
    scale = np.array(given.get("scale", [1.0, 1.0]), dtype=np.float64)
    c, s = np.cos(given.get("rotation", 0.0)), np.sin(given.get("rotation", 0.0))
    return np.column_stack([np.array([[c, s], [-s, c]]) * scale, offset])
