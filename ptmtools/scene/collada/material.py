"""Reads materials of COLLADA: the common profile of their effects, and its images.

Colours are as displayed (sRGB). The opacity follows from `transparent` and `transparency` by the
opaque mode. Early SketchUp has no mode and writes 0 for opaque materials, though the default mode
means 1; such files are read as it meant them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.collada.document import ColladaDocument
from ptmtools.scene.colors import luminance, to_linear
from ptmtools.scene.markup import floats
from ptmtools.scene.mtl import roughness_of
from ptmtools.scene.source import FileRange, SourceMaterial, SourceTexture, SourceWrap

_SHADERS = ("constant", "lambert", "phong", "blinn")
_WRAPS: dict[str, SourceWrap] = {
    "CLAMP": "clamp",
    "BORDER": "clamp",
    "NONE": "clamp",
    "MIRROR": "mirror",
    "MIRROR_ONCE": "mirror",
}


@dataclass(frozen=True)
class ColladaUse:
    """The number of a material, and the semantic of its texture coordinates, "" without any."""

    index: int
    coords: str


class ColladaMaterialReader:
    """Reads each material of a document once, by its id."""

    def __init__(self, document: ColladaDocument) -> None:
        self._document, self._notes = document, document.notes
        self._uses: dict[str, ColladaUse] = {}
        self._materials: list[SourceMaterial] = []
        tool = document.root.findtext("asset/contributor/authoring_tool") or ""
        self._sketchup = "sketchup" in tool.lower()

    @property
    def materials(self) -> tuple[SourceMaterial, ...]:
        return tuple(self._materials)

    def read(self, name: str) -> ColladaUse:
        """The material of this id; the default one, and a miss, without it; "" is the default."""
        if name not in self._uses:
            material = self._document.find(name, "material")
            if material is None and name:
                self._notes.miss("PTM-N207", f"{name}: no such material")
            if material is None:
                self._materials.append(SourceMaterial(name or "default"))
                self._uses[name] = ColladaUse(len(self._materials) - 1, "")
            else:
                shader = _Shader(material, self._document, self._sketchup)
                self._materials.append(shader.material())
                self._uses[name] = ColladaUse(len(self._materials) - 1, shader.coords)
        return self._uses[name]


class _Shader:
    """The shader of a material."""

    def __init__(self, material: Element, document: ColladaDocument, sketchup: bool) -> None:
        self._document, self._notes, self._sketchup = document, document.notes, sketchup
        self._name = str(material.get("name") or material.get("id"))
        self._place = f"material {material.get('id')}"
        instance = material.find("instance_effect")
        url = None if instance is None else instance.get("url")
        effect = document.follow(url, "effect")
        self._effect = Element("effect") if effect is None else effect
        settings = [] if instance is None else instance.findall("setparam")
        self._parameters = {item.get("sid"): item for item in self._effect.iter("newparam")}
        self._parameters |= {item.get("ref"): item for item in settings}
        technique = self._effect.find("profile_COMMON/technique")
        parts = [] if technique is None else list(technique)
        self._shader = next((part for part in parts if part.tag in _SHADERS), Element("lambert"))
        self._shown = "emission" if self._shader.tag == "constant" else "diffuse"
        use = self._part(self._shown, "texture")
        self.coords = "" if use is None else use.get("texcoord", "")

    def material(self) -> SourceMaterial:
        """The material. Raises ValueError if it is damaged."""
        color, texture = self._color(self._shown), self._texture(self._shown)
        sides = [item.text or "" for item in self._effect.iter("double_sided")]
        specular, shininess = self._color("specular"), self._number("shininess", 0.0)
        shine = 0.0 if specular is None else float(max(specular[:3]))
        fields: dict[str, Any] = self._alpha()
        if self._shown == "emission":
            fields["unlit"] = True
        else:
            fields |= {"roughness": roughness_of(shine, shininess), **self._glow()}
        red, green, blue = (1.0, 1.0, 1.0) if color is None else np.clip(color[:3], 0, 1).tolist()
        return SourceMaterial(
            name=self._name,
            color=None if color is None else (red, green, blue),
            two_sided=not any(text.strip().lower() in ("0", "false") for text in sides),
            texture=texture,
            **fields,
        )

    def _part(self, name: str, kind: str) -> Element | None:
        """The value of a part of the shader, if it is of a kind: color, float or texture."""
        part = self._shader.find(name)
        if part is not None and (use := part.find("param")) is not None:
            part = self._parameters.get(use.get("ref"))
        if part is None:
            return None
        kinds = {"color": ("color", "float4", "float3"), "float": ("float",)}.get(kind, (kind,))
        return next((item for item in part if item.tag in kinds), None)

    def _color(self, name: str) -> Floats | None:
        """Red, green, blue and alpha of a part; None if it is no colour."""
        item = self._part(name, "color")
        if item is None:
            return None
        values = np.nan_to_num(floats(item.text))
        if len(values) not in (3, 4):
            raise ValueError(f"{self._place}: a colour of {len(values)} numbers")
        return np.append(values, 1.0)[:4]

    def _number(self, name: str, default: float) -> float:
        item = self._part(name, "float")
        return default if item is None else float(np.nan_to_num(floats(item.text))[0])

    def _texture(self, name: str) -> SourceTexture | None:
        """The texture of a part; None without one, and a miss if its image is missing."""
        use = self._part(name, "texture")
        if use is None:
            return None
        key = use.get("texture", "")
        sampler = self._inner(key, "sampler2D")
        image = self._document.find(key, "image")
        if sampler is not None:
            instance = sampler.find("instance_image")
            surface = self._inner((sampler.findtext("source") or "").strip(), "surface")
            if instance is not None:
                key = instance.get("url", "")[1:]
            elif surface is not None:
                key = (surface.findtext("init_from") or "").strip()
            image = self._document.find(key, "image")
        source = None if image is None else image.find("init_from")
        if source is None:
            self._notes.miss("PTM-N204", f"{name} {key}: has no image file", self._place)
            return None
        uri = (source.findtext("ref") or source.text or "").strip()
        what = f"{name} {uri}"
        file = self._notes.locate_first([uri], what, self._place)
        if file is None:
            return None
        wraps = ["" if sampler is None else sampler.findtext(f"wrap_{k}") or "" for k in "st"]
        across, up = (_WRAPS.get(wrap.strip(), "repeat") for wrap in wraps)
        return SourceTexture(FileRange(file), file.name, what, self._place, across, up)

    def _inner(self, name: str, tag: str) -> Element | None:
        """The content of a parameter."""
        parameter = self._parameters.get(name)
        return None if parameter is None else parameter.find(tag)

    def _glow(self) -> dict[str, Any]:
        """The emission, as the fields of a `SourceMaterial`."""
        color = self._color("emission")
        with self._notes.optional():
            image = self._texture("emission")
        if color is None and image is None:
            return {}
        light = np.ones(3) if color is None else to_linear(color[:3])
        return {"glow": tuple(light.tolist()), "glow_map": image}

    def _alpha(self) -> dict[str, Any]:
        """The opacity and its image, as the fields of a `SourceMaterial`."""
        part = self._shader.find("transparent")
        mode = None if part is None else part.get("opaque")
        factor, use = self._number("transparency", 1.0), self._part("transparent", "texture")
        if use is not None:
            colors = self._part(self._shown, "texture")
            if colors is not None and colors.get("texture") == use.get("texture"):
                return {"opacity": min(max(factor, 0.0), 1.0) if factor else 1.0}
            mask = self._texture("transparent")
            if mask is None or mode in ("A_ZERO", "RGB_ZERO"):
                text = f"{self._name}: image of opacities ignored, the material is transparent"
                self._notes.note("PTM-N215", text, self._place)
                return {"see_through": True}
            channel = "l" if mode == "RGB_ONE" else "m"
            return {"mask": SourceTexture(**{**vars(mask), "channel": channel})}
        color = self._color("transparent")
        if color is not None:
            rgb = mode in ("RGB_ZERO", "RGB_ONE")
            factor *= float(luminance(color[:3]) if rgb else color[3])
        opacity = min(max(factor, 0.0), 1.0)
        inverted = mode is None and self._part("transparency", "float") is not None
        inverted &= self._sketchup or opacity == 0
        if mode in ("RGB_ZERO", "A_ZERO") or inverted:
            opacity = 1 - opacity
        return {"opacity": opacity, "see_through": opacity < 1}
