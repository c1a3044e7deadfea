"""A site with reflections whose pixels follow from a formula: strips before an eye that reflect a
probe, in the files of `strips.lit_site`."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.scene.colors import luminance, to_linear, to_srgb
from ptmtools.site.content import Site
from ptmtools.site.entry import SiteEntry
from ptmtools.texture import EncodeOptions, encode
from tests.site.strips import (
    BASE,
    EXPOSURE,
    LEFT,
    RIGHT,
    Z,
    changed,
    developed,
    evened,
    glb,
    lit_site,
    row_of,
)

Floats = NDArray[np.float64]

#: The heights of each strip, m; glass is before the other two, which are unlit.
STRIPS = {
    "metal": (2.2, 3.2),
    "floor": (1.2, 2.0),
    "bright": (0.4, 1.0),
    "dark": (-0.4, 0.2),
    "curved": (-1.4, -0.6),
    "glass": (-0.4, 1.0),
}
#: Linear colours; metallic and roughness; opacity of the glass.
FACTORS = {"bright": (0.8, 0.9, 0.7), "dark": (0.01, 0.02, 0.01), "glass": (0.2, 0.6, 0.3)}
POLISH = {"metal": (1.0, 0.2), "floor": (0.0, 0.1), "curved": (0.6, 0.55), "glass": (0.0, 0.0)}
OPACITY, IN_FRONT = 0.25, 0.001
#: The x of the normals of the curved strip at its ends, of 127.
BENT = 60
WHITE, CODE = 3.0, np.array([210.0, 190.0, 170.0])
PROBE = {
    "cell": 0,
    "white": 2.5,
    "mean": 0.7,
    "centre": [-1.0, 1.2, -2.0],
    "low": [-7.0, -2.0, -7.0],
    "high": [6.0, 5.0, 4.0],
}
MAPS = ((0, 0, 128), (128, 0, 64), (128, 64, 32), (160, 64, 16))


def panorama() -> NDArray[np.uint8]:
    """(128, 192, 3) codes: waves over the directions, other ones in each map."""
    image = np.full((128, 192, 3), 255.0)
    for number, (x0, y0, side) in enumerate(MAPS):
        way = directions(side)
        waves = [np.sin(4 * way @ np.roll([1.0, 2.0, -1.5], k) + k + number) for k in range(3)]
        image[y0 : y0 + side, x0 : x0 + side] = 160 + 60 * np.stack(waves, axis=-1)
    return np.rint(image).astype(np.uint8)


def directions(side: int) -> Floats:
    """(side, side, 3) unit vectors of the texels of an octahedral map; beyond its edge, it goes on
    at the opposite end of that edge."""
    v, u = (2 * (np.mgrid[0:side, 0:side] - 0.5) / (side - 2) - 1).astype(np.float64)
    for _ in range(2):
        out = np.abs(u) > 1
        u, v = np.where(out, 2 * np.sign(u) - u, u), np.where(out, -v, v)
        u, v = v, u
    y = 1 - np.abs(u) - np.abs(v)
    x = np.where(y < 0, (1 - np.abs(v)) * np.sign(u), u)
    z = np.where(y < 0, (1 - np.abs(u)) * np.sign(v), v)
    way = np.stack([x, y, z], axis=-1)
    return np.asarray(way / np.linalg.norm(way, axis=-1, keepdims=True))


def mirror_site(plain: Site, probe: bool = True) -> Site:
    """The site of strips with a probe in its first cell, which no material names without
    ``probe``."""
    image = panorama()
    data = encode(image, EncodeOptions())
    row = row_of("probe.ptm", image, data) | {"probe": PROBE}
    light = np.broadcast_to(CODE.astype(np.uint8), (8, 8, 3))
    codes = encode(np.ascontiguousarray(light), EncodeOptions())
    row_of_light = row_of("even.ptm", light, codes) | {"light": 0}
    site = lit_site(plain, lambda index: index["textures"].extend([row, row_of_light]))
    first = len(site.index["textures"]) - 2
    entries = dict(site.entries)
    for name, texels in (("probe", data), ("even", codes)):
        place = f"data/{name}.ptm"
        entries[place] = SiteEntry(place, texels, "application/octet-stream")
    document = json.loads(json.dumps(site.index))
    for cell in document["cells"]:
        place = f"data/{cell['record']}"
        record = json.loads(entries[place].read())
        for textures in record["textures"]:
            textures += [first, first + 1]
        entries[place] = changed(entries[place], record)
    place = f"data/{document['cells'][0]['geometry']}"
    materials = materials_of(first - 3, first + 1, first)
    for material in materials.values() if not probe else ():
        material.get("extras", {}).pop("probe", None)
    geometry = glb(0, materials, STRIPS, {"curved": BENT})
    entries[place] = replace(entries[place], source=geometry, state=None, digest="")
    return Site(entries, document)


def materials_of(base: int, light: int, probe: int) -> dict[str, dict[str, Any]]:
    """Of each strip, with these textures."""
    lit = {"texture": base, "light": light, "white": WHITE, "probe": probe}
    materials: dict[str, dict[str, Any]] = {}
    for name in STRIPS:
        metallic, roughness = POLISH.get(name, (0.0, 1.0))
        surface: dict[str, Any] = {"metallicFactor": metallic, "roughnessFactor": roughness}
        if name in FACTORS:
            surface["baseColorFactor"] = [*FACTORS[name], OPACITY if name == "glass" else 1]
        materials[name] = {"pbrMetallicRoughness": surface, "doubleSided": True}
        if name not in FACTORS:
            materials[name]["extras"] = dict(lit)
    materials["glass"] |= {"alphaMode": "BLEND", "extras": {"probe": probe}}
    return materials


def radiance(way: Floats, rough: float, image: NDArray[np.uint8] | None) -> Floats:
    """(h, w, 3) of directions of any length; without an image that of the mean code."""
    if image is None:
        codes = np.broadcast_to(np.rint(panorama().mean(axis=(0, 1))), way.shape)
    else:
        level = min(int(3 * rough), 2)
        share = 3 * rough - level
        codes = (1 - share) * looked_up(way, MAPS[level], image)
        codes = codes + share * looked_up(way, MAPS[level + 1], image)
    white = float(str(PROBE["white"]))
    return np.asarray(white * np.exp2(10 * (codes / 255 - 1)))


def looked_up(way: Floats, place: tuple[int, int, int], image: NDArray[np.uint8]) -> Floats:
    """(h, w, 3) codes of an octahedral map, filtered between its texels."""
    x, y, z = np.moveaxis(way / np.abs(way).sum(axis=-1, keepdims=True), -1, 0)
    below = y < 0
    sign_x, sign_z = np.where(x >= 0, 1, -1), np.where(z >= 0, 1, -1)
    u = np.where(below, (1 - np.abs(z)) * sign_x, x)
    v = np.where(below, (1 - np.abs(x)) * sign_z, z)
    x0, y0, side = place
    across, down = (o + 0.5 + (p * 0.5 + 0.5) * (side - 2) for o, p in ((x0, u), (y0, v)))
    left, top = np.floor(across).astype(int), np.floor(down).astype(int)
    s, t = (across - left)[..., None], (down - top)[..., None]
    texel = image.astype(float)
    upper = texel[top, left] * (1 - s) + texel[top, left + 1] * s
    lower = texel[top + 1, left] * (1 - s) + texel[top + 1, left + 1] * s
    return np.asarray(upper * (1 - t) + lower * t)


def split_sum(rough: float, facing: Floats) -> tuple[Floats, Floats]:
    """Factor of the colour of a reflection, and a share of white (Karis)."""
    k = rough * np.array([-1, -0.0275, -0.572, 0.022]) + np.array([1, 0.0425, 1.04, -0.04])
    a = np.minimum(k[0] ** 2, np.exp2(-9.28 * facing)) * k[0] + k[1]
    return -1.04 * a + k[2], 1.04 * a + k[3]


def mirrors_of(
    angle: float,
    eye: tuple[float, float, float],
    size: tuple[int, int],
    arrives: bool = True,
    shaded: bool = True,
) -> tuple[Floats, dict[str, NDArray[np.bool_]]]:
    """As `strips.view_of`: of the strips, at the exposure of the first cell. Glass is in "bright"
    and "dark". Until the probe ``arrives`` its mean is reflected. ``shaded``: whether what is unlit
    is shaded by its angle."""
    width, height = size
    image = panorama() if arrives else None
    y, x = np.mgrid[0:height, 0:width]
    half = np.tan(angle / 2)
    across = (2 * (x + 0.5) / width - 1) * half * width / height
    up = (1 - 2 * (y + 0.5) / height) * half
    far = eye[2] - Z
    at = np.stack([eye[0] + far * across, eye[1] + far * up, np.full(x.shape, Z)], axis=-1)
    view = np.array(eye) - at
    view /= np.linalg.norm(view, axis=-1, keepdims=True)
    flat = np.broadcast_to([0.0, 0.0, 1.0], view.shape)
    tilt = BENT * (2 * (at[..., 0] - LEFT) / (RIGHT - LEFT) - 1)
    bent = np.stack([tilt, 0 * tilt, np.full(tilt.shape, 100.0)], axis=-1)
    bent /= np.linalg.norm(bent, axis=-1, keepdims=True)
    base, light = to_linear(np.array(BASE) / 255), WHITE * np.exp2(10 * (evened(CODE) / 255 - 1))

    def seen(normal: Floats, rough: float) -> tuple[Floats, Floats, Floats]:
        """What is reflected, and the split sum."""
        along = (normal * view).sum(axis=-1, keepdims=True)
        way = 2 * along * normal - view
        ends = np.maximum(*((np.array(PROBE[k]) - at) / way for k in ("low", "high")))
        hit = at + way * np.maximum(ends.min(axis=-1, keepdims=True), 0) - np.array(PROBE["centre"])
        return radiance(hit, rough, image), *split_sum(rough, np.maximum(np.abs(along), 0.001))

    def lit(normal: Floats, metallic: float, rough: float) -> Floats:
        reflection, scale, bias = seen(normal, rough)
        share = (0.04 * (1 - metallic) + base * metallic) * scale + bias
        dimmed = min(1.0, float(luminance(light[None])[0]) / float(str(PROBE["mean"])))
        reflection = reflection * (1 - rough + rough * dimmed)
        t = np.clip((rough - 0.2) / 0.6, 0, 1)
        reflection += (light - reflection) * t * t * (3 - 2 * t)
        matt = base * light * (1 - metallic) * (1 - share.max(axis=-1, keepdims=True))
        return developed(np.array(EXPOSURE[0]) * (matt + reflection * share), "neutral")

    facing = (0.7 + 0.3 * view[..., 2])[..., None] if shaded else 1.0
    reflection, scale, bias = seen(flat, POLISH["glass"][1])
    share = 0.04 * scale + bias
    share = share * (1 + 0.9 * (1 - share))
    around = EXPOSURE[0] * radiance(-view, 1.0, image)
    more = developed(around * (1 - share) + EXPOSURE[0] * reflection * share, "neutral")
    more = np.maximum(more - (1 - share) * developed(around, "neutral"), 0)
    glass = to_srgb(np.array(FACTORS["glass"])) * facing * OPACITY * (1 - share) + more
    opaque = OPACITY + share * (1 - OPACITY)
    behind = {name: to_srgb(np.array(FACTORS[name])) * facing for name in ("bright", "dark")}
    colors = {
        "metal": lit(flat, *POLISH["metal"]),
        "floor": lit(flat, *POLISH["floor"]),
        "curved": lit(bent, *POLISH["curved"]),
        **{name: glass + (1 - opaque) * color for name, color in behind.items()},
    }
    picture, edge = np.zeros(view.shape), 0.06
    masks = {}
    for name, color in colors.items():
        low, top = STRIPS[name]
        inside = (at[..., 1] > low + edge) & (at[..., 1] < top - edge)
        masks[name] = inside & (at[..., 0] > LEFT + edge) & (at[..., 0] < RIGHT - edge)
        picture[masks[name]] = color[masks[name]]
    return 255 * picture, masks
