"""VRML97 and X3D: nodes, geometries and appearances of both encodings."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import areas, normals
from ptmtools.errors import InputError, LimitError
from ptmtools.scene import ingest
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import ModelSource
from ptmtools.scene.x3d import classic

from .conftest import Put, noise, png, read_source

HEAD = "#VRML V2.0 utf8\n"
QUAD = "coord Coordinate { point [ 0 0 0, 10 0 0, 10 4 0, 0 4 0 ] }"
FACE = f"geometry IndexedFaceSet {{ {QUAD} coordIndex [ 0 1 2 3 -1 ] }}"


def vrml(put: Put, text: str, notes: IngestNotes | None = None) -> ModelSource:
    return read_source(put("a.wrl", HEAD + text), notes)


def shape(geometry: str, appearance: str = "") -> str:
    return f"Shape {{ {appearance} {geometry} }}"


def x3d(put: Put, text: str) -> ModelSource:
    doctype = '<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 3.0//EN" "http://localhost/x3d.dtd">'
    return read_source(put("a.x3d", f"{doctype}<X3D><head/><Scene>{text}</Scene></X3D>"))


def faces_of(source: ModelSource) -> tuple[float, np.ndarray]:
    """The area of all faces, and their unit normals."""
    corners = source.points[source.triangles]
    normal = normals(corners)
    return float(areas(corners).sum()), normal / np.linalg.norm(normal, axis=1)[:, None]


def test_cases(shared: Path) -> None:
    folder = shared / "cases/vrml-colours"
    scene = ingest(folder / "m.wrl")
    assert scene.objects == ("floor", "ceil", "n", "s", "w", "e")
    by_object = dict(zip(scene.objects, scene.materials, strict=True))
    assert by_object["w"].color == (0.9, 0.1, 0.1)
    assert by_object["e"].color == (0.1, 0.1, 0.9)
    assert scene.images[by_object["floor"].image].name == "a.png"
    assert (scene.space.metres, scene.space.up) == (1, "y")
    two = ingest(folder / "two_colours.wrl")
    assert [m.color for m in two.materials] == [(0.9, 0.1, 0.1), (0.1, 0.7, 0.1)]
    boxes = ingest(folder / "boxes_only.wrl")
    assert (len(boxes.objects), len(boxes.triangles)) == (5, 60)
    assert np.ptp(boxes.points, axis=0) == pytest.approx([8.2, 3.2, 6.2])


SIDES = 24
POLYGON = SIDES / 2 * np.sin(2 * np.pi / SIDES)  # area of the unit circle's polygon
#: The sides of a cone of radius 1 and height 2: triangles over the edges of that polygon.
SLANT = SIDES * np.sin(np.pi / SIDES) * np.hypot(2, np.cos(np.pi / SIDES))
#: Of a tube of radius 1 and height 2.
WALL = SIDES * 2 * np.sin(np.pi / SIDES) * 2


@pytest.mark.parametrize(
    ("geometry", "area"),
    [
        ("Box { size 2 3 4 }", 52),
        ("Box { }", 24),
        ("Cylinder { }", WALL + 2 * POLYGON),
        ("Cylinder { side FALSE top FALSE radius 2 }", 4 * POLYGON),
        ("Cone { }", SLANT + POLYGON),
        ("Cone { bottom FALSE }", SLANT),
        ("Sphere { }", None),
    ],
)
def test_solids(put: Put, geometry: str, area: float | None) -> None:
    """Closed surfaces that face outwards, with whole textures."""
    source = vrml(put, shape(f"geometry {geometry}"))
    actual, normal = faces_of(source)
    if area is None:
        area = 0.97 * 4 * np.pi
    assert actual == pytest.approx(area, rel=0.02 if "Sphere" in geometry else 1e-9)
    centre = source.points[source.triangles].mean(axis=1)
    if "FALSE" not in geometry:
        assert ((centre * normal).sum(axis=1) > 0).all()
        cut = np.einsum("tk,tk->t", centre, normals(source.points[source.triangles]))
        assert cut.sum() > 0
    elif "side" in geometry:
        assert (normal[:, 1] < -0.99).all()
    assert source.uv.min() == pytest.approx(0, abs=1e-9)
    assert source.uv.max() == pytest.approx(1, abs=1e-9)
    assert not source.materials[0].two_sided


SETS = {
    "TriangleSet": "0 0 0 10 0 0 10 4 0 0 0 0 10 4 0 0 4 0",
    "TriangleFanSet fanCount='4'": "0 0 0 10 0 0 10 4 0 0 4 0",
    "TriangleStripSet stripCount='4'": "0 0 0 10 0 0 0 4 0 10 4 0",
    "QuadSet": "0 0 0 10 0 0 10 4 0 0 4 0",
    "IndexedTriangleSet index='0 1 2 0 2 3'": "0 0 0 10 0 0 10 4 0 0 4 0",
    "IndexedTriangleFanSet index='0 1 2 3 -1'": "0 0 0 10 0 0 10 4 0 0 4 0",
    "IndexedTriangleStripSet index='0 1 3 2 -1'": "0 0 0 10 0 0 10 4 0 0 4 0",
    "IndexedQuadSet index='0 1 2 3'": "0 0 0 10 0 0 10 4 0 0 4 0",
    "IndexedFaceSet coordIndex='0 1 2 3'": "0,0,0, 10,0,0, 10,4,0, 0,4,0",
}


@pytest.mark.parametrize("name", SETS)
def test_sets(put: Put, name: str) -> None:
    for ccw in ("true", "false"):
        color = f"<Color color='1 0 0 0 1 0 0 0 1 {'1 1 1 ' * 3}'/>"
        text = f"<{name} ccw='{ccw}'><Coordinate point='{SETS[name]}'/>{color}"
        source = x3d(put, f"<Shape>{text}</{name.split()[0]}></Shape>")
        area, normal = faces_of(source)
        assert (area, len(source.triangles)) == (40, 2)
        assert (normal[:, 2] == (1 if ccw == "true" else -1)).all()
        assert source.colors is not None
        at_origin = source.colors[(source.points[source.triangles] == 0).all(axis=2)]
        assert [255, 0, 0] in at_origin.tolist()


def test_elevation(put: Put) -> None:
    grid = "ElevationGrid { xDimension 3 zDimension 2 xSpacing 2 zSpacing 5 height [ 0 0 0 0 0 0 ]"
    source = vrml(put, shape(f"geometry {grid} }}"))
    area, normal = faces_of(source)
    assert area == 20
    assert (normal[:, 1] == 1).all()
    corners = {tuple(uv) for uv in source.uv.reshape(-1, 2).tolist()}
    assert corners == {(s, t) for s in (0, 0.5, 1) for t in (0, 1)}
    colored = "colorPerVertex FALSE color Color { color [ 1 0 0, 0 0 1 ] }"
    colors = vrml(put, shape(f"geometry {grid} {colored} }}")).colors
    assert colors is not None
    assert colors[:, 0, 0].tolist() == [255, 255, 0, 0]


SQUARE = "crossSection [ 1 1, 1 -1, -1 -1, -1 1, 1 1 ]"


@pytest.mark.parametrize(
    ("fields", "area", "size"),
    [
        ("", 4 * 2 + 8, (2, 1, 2)),
        (f"{SQUARE} spine [ 0 0 0, 0 3 0 ] scale [ 1 1 ]", 4 * 2 * 3 + 8, (2, 3, 2)),
        (f"{SQUARE} spine [ 0 0 0, 5 0 0 ] beginCap FALSE", 4 * 2 * 5 + 4, (5, 2, 2)),
        (f"{SQUARE} spine [ 0 5 0, 0 0 0 ]", 4 * 2 * 5 + 8, (2, 5, 2)),
        # A mitre joins the parts of an L: on its diagonal, both ends are as far off.
        (f"{SQUARE} spine [ 0 0 0, 0 9 0, 9 9 0 ] scale [ 1 1, 1.41421356 1, 1 1 ]",
         4 * 2 * 18 + 8, (10, 10, 2)),
        (f"{SQUARE} spine [ 0 0 0, 0 3 0 ] orientation 0 1 0 0.785398163397",
         4 * 2 * 3 + 8, (2 * np.sqrt(2), 3, 2 * np.sqrt(2))),
    ],
)  # fmt: skip
def test_extrusions(put: Put, fields: str, area: float, size: tuple[float, ...]) -> None:
    source = vrml(put, shape(f"geometry Extrusion {{ {fields} }}"))
    assert faces_of(source)[0] == pytest.approx(area)
    assert np.ptp(source.points, axis=0) == pytest.approx(size)
    corners = source.points[source.triangles]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    volume = np.einsum("tk,tk->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume > 0.5 * area / 8


def test_face_sets(put: Put) -> None:
    """Concave faces, indices of their own for each value, and values by default."""
    more = "texCoord TextureCoordinate { point [ 0 0, 2 2 ] } texCoordIndex [ 0 1 0 1 -1 1 1 1 -1 ]"
    more += " color Color { color [ 1 0 0, 0 0 1 ] } colorIndex [ 1 0 ] colorPerVertex FALSE"
    indices = "coordIndex [ 0 1 2 3 -1 0 2 3 -1 ]"
    source = vrml(put, shape(f"geometry IndexedFaceSet {{ {QUAD} {indices} {more} solid FALSE }}"))
    assert source.colors is not None
    assert source.colors[:, 0].tolist() == [[0, 0, 255], [0, 0, 255], [255, 0, 0]]
    assert source.uv[0].tolist() == [[0, 0], [2, 2], [0, 0]]
    assert source.uv[2].tolist() == [[2, 2]] * 3
    assert source.materials[0].two_sided
    assert source.materials[0].color == (1, 1, 1)
    plain = vrml(put, shape(FACE))
    assert plain.uv[0].tolist() == [[0, 0], [1, 0], [1, 0.4]]
    arrow = QUAD.replace("10 4 0", "1 1 0")
    concave = f"geometry IndexedFaceSet {{ {arrow} coordIndex [ 0 1 2 3 ] convex FALSE }}"
    assert faces_of(vrml(put, shape(concave)))[0] == pytest.approx(7)


def test_transformations(put: Put) -> None:
    """Scale in its own axes, then rotation, about the centre, then translation."""
    inner = shape(FACE)
    turned = (
        "Transform { translation 100 0 0 center 10 0 0 rotation 0 0 1 1.5707963267948966 "
        f"scale 2 1 1 children [ DEF wall {inner} ] }}"
    )
    source = vrml(put, f"{turned} Transform {{ translation 0 0 7 children USE wall }}")
    first, second = source.points[:4], source.points[4:]
    assert first == pytest.approx(
        np.array([[110, -20, 0], [110, 0, 0], [106, 0, 0], [106, -20, 0]]), abs=1e-9
    )
    assert second[0].tolist() == [0, 0, 7]
    assert source.objects == ("wall", "wall")
    slanted = (
        f"Transform {{ scaleOrientation 0 0 1 1.5707963267948966 scale 3 1 1 children {inner} }}"
    )
    assert np.ptp(vrml(put, slanted).points, axis=0) == pytest.approx([10, 12, 0])
    mirrored = vrml(put, f"Transform {{ scale -1 1 1 children [ {inner} ] }}")
    assert (faces_of(mirrored)[1][:, 2] == 1).all()


def test_groups(put: Put) -> None:
    one, two = (f"DEF {name} {shape(FACE)}" for name in ("one", "two"))
    for text, expected in [
        (f"LOD {{ level [ {one} {two} ] range [ 5 ] }}", ["one"]),
        (f"Switch {{ choice [ {one} {two} ] whichChoice 1 }}", ["two"]),
        (f"Group {{ children [ {one} Switch {{ choice [ {two} ] }} ] }}", ["one"]),
        (f'Anchor {{ url "#x" children [ {one}, NULL, {two} ] }}', ["one", "two"]),
        (f"Billboard {{ children Collision {{ children {one} proxy {two} }} }}", ["one"]),
        (f"DEF both Group {{ children [ {shape(FACE)} ] }}", ["both"]),
        (f"{one} ROUTE one.a TO two.b\n{two}", ["one", "two"]),
    ]:
        assert vrml(put, text).objects == tuple(expected)


def test_inlines(put: Put) -> None:
    put("parts/wall.wrl", HEAD + shape(FACE, 'appearance Appearance { texture ImageTexture { url '
        '[ "none.png" "maps/a%20b.png" ] repeatS FALSE } }'))  # fmt: skip
    put("parts/maps/a b.png", png(noise(1)))
    put("parts/old.x3d", "<Scene><Shape><Box/></Shape></Scene>")
    put("outside.wrl", HEAD + shape(FACE))
    text = 'Inline { url [ "none.wrl", "parts/wall.wrl" ] } Inline { url "parts/old.x3d" }'
    source = vrml(put, text + ' Inline { url "parts/wall.wrl" } Inline { url "gone.wrl" }')
    assert len(source.triangles) == 2 + 12 + 2
    box, wall = source.materials
    assert box.texture is None
    assert wall.texture is not None
    assert wall.texture.read() == png(noise(1))
    assert (wall.texture.wrap_s, wall.texture.wrap_t) == ("clamp", "repeat")
    assert wall.unlit
    put("house/c.stl", "solid c")
    links = 'Inline { url "../outside.wrl" } Inline { url "c.stl" }'
    notes = IngestNotes(put("house/b.wrl", HEAD + links + shape(FACE)))
    assert len(read_source(notes.model, notes).triangles) == 2
    assert {note.code for note in notes.entries} == {"PTM-N205", "PTM-N214"}


def test_prototypes(put: Put) -> None:
    proto = (
        "PROTO Wall [ field SFVec3f at 0 0 1 exposedField MFNode parts [ ] eventIn SFTime t\n"
        "field SFNode look NULL ] { Transform { translation IS at children [ DEF face Shape { "
        f'appearance IS look {FACE} }} Group {{ children IS parts }} ] }} Script {{ url "x" '
        "eventIn SFTime t IS t field SFNode n USE face directOutput TRUE } ROUTE a.b TO c.d }\n"
    )
    red = "Appearance { material Material { diffuseColor 1 0 0 } }"
    nested = (
        "PROTO Two [ field SFVec3f up 0 5 0 ] { Group { children [ Wall { at IS up } Wall { } ] } }"
    )
    source = vrml(
        put, f"{proto}{nested} DEF a Wall {{ look {red} parts Wall {{ at 0 0 9 }} }} Two {{ }}"
    )
    assert [p.tolist() for p in source.points[::4]] == [
        [0, 0, 1], [0, 0, 10], [0, 5, 0], [0, 0, 1]
    ]  # fmt: skip
    assert source.objects[0] == "face"
    assert source.materials[0].color == (1, 0, 0)
    notes = IngestNotes(put("a.wrl", ""))
    far = 'EXTERNPROTO Far [ field SFVec3f at ] [ "far.wrl#Far" ] Far { at 1 2 3 }'
    assert len(vrml(put, far + shape(FACE), notes).triangles) == 2
    assert "EXTERNPROTO Far" in notes.entries[0].message


def test_appearances(put: Put) -> None:
    put("a.png", png(noise(1)))
    image = 'texture ImageTexture { url "a.png" }'
    looks = [
        "material Material { }",
        "material Material { diffuseColor .2 .4 .6 transparency .75 specularColor 1 1 1 }",
        "material Material { diffuseColor 0 0 0 emissiveColor 1 .5 0 }",
        f"material Material {{ }} {image}",
        f"material Material {{ diffuseColor .5 .5 .5 }} {image}",
        image,
        "texture PixelTexture { image 2 1 3 0xFF0000 0x00FF00 }",
    ]
    notes = IngestNotes(put("a.wrl", ""))
    text = "".join(shape(FACE, f"appearance Appearance {{ {look} }}") for look in looks)
    plain, glass, lamp, picture, tinted, bare, pixels = vrml(put, text, notes).materials
    assert (plain.color, plain.name, plain.roughness) == ((0.8, 0.8, 0.8), "#cccccc", 1)
    assert (glass.color, glass.opacity, glass.see_through) == ((0.2, 0.4, 0.6), 0.25, True)
    assert glass.roughness == pytest.approx(1 - np.sqrt(0.0256))
    assert (lamp.color, lamp.unlit) == ((1, 0.5, 0), True)
    assert lamp.glow == pytest.approx((1, 0.214041, 0), abs=1e-6)
    assert picture.texture is not None
    assert (picture.color, picture.unlit) == (None, False)
    assert tinted.color == (0.5, 0.5, 0.5)
    assert bare.unlit
    assert pixels.texture is None
    assert [note.message for note in notes.entries] == ["PixelTexture: not drawn"]


def test_texture_transformations(put: Put) -> None:
    """By clause 6.49: the coordinates are moved, turned and scaled, and the image the other way."""
    for transform, expected in [
        ("translation 1 2", [[1, 2], [2, 2], [2, 2.4]]),
        ("scale 10 5", [[0, 0], [10, 0], [10, 2]]),
        ("scale 3 3 center .5 .5", [[1, 1], [4, 1], [4, 2.2]]),
        ("rotation 1.5707963267948966", [[0, 0], [0, 1], [-0.4, 1]]),
    ]:
        look = f"appearance Appearance {{ textureTransform TextureTransform {{ {transform} }} }}"
        source = vrml(put, shape(FACE, look))
        assert source.uv[0] == pytest.approx(np.array(expected), abs=1e-9)


def test_encodings_agree(put: Put) -> None:
    """The same scene in XML, in the classic encoding, and compressed."""
    red = "appearance DEF a Appearance { material Material { diffuseColor 1 0 0 } }"
    text = (
        '#X3D V3.0 utf8\nPROFILE Immersive\nCOMPONENT NURBS:2\nMETA "a" "b"\nDEF g Transform { '
        f"translation 1 2 3 children [ DEF wall {shape(FACE, red)} ] }} Viewpoint {{ position 1 2 "
        '3 orientation 0 1 0 1.5707963267948966 description "eye" }'
    )
    xml = (
        "<Transform DEF='g' translation='1 2 3'><Shape DEF='wall'><Appearance DEF='a'><Material "
        "diffuseColor='1 0 0'/></Appearance><IndexedFaceSet coordIndex='0 1 2 3 -1'><Coordinate "
        "point='0 0 0, 10 0 0, 10 4 0, 0 4 0'/></IndexedFaceSet></Shape></Transform><Viewpoint "
        "position='1 2 3' orientation='0 1 0 1.5707963267948966' description='eye'/>"
    )
    sources = [
        read_source(put("a.x3dv", text)),
        read_source(put("a.wrz", gzip.compress(text.encode()))),
        x3d(put, xml),
    ]
    for source in sources:
        assert source.objects == ("wall",)
        assert np.array_equal(
            source.points[source.triangles], sources[0].points[sources[0].triangles]
        )
        assert source.materials == sources[0].materials
        (camera,) = source.cameras
        assert (camera.name, camera.position) == ("eye", (1, 2, 3))
        assert camera.direction == pytest.approx((-1, 0, 0), abs=1e-12)


def test_what_is_not_drawn_is_told(put: Put) -> None:
    notes = IngestNotes(put("a.wrl", ""))
    text = shape('geometry Text { string "a" }') * 3 + shape(FACE)
    vrml(put, f"{text} PointLight {{ }} TouchSensor {{ }} USE nothing", notes)
    assert {(note.message, note.count) for note in notes.entries} == {
        ("Text: not drawn", 3), ("lights left out", 1), ("USE nothing: no such node", 1)
    }  # fmt: skip


def doubled(count: int) -> str:
    group = "DEF g{} Group {{ children [ USE g{} USE g{} ] }} "
    groups = "".join(group.format(k, k - 1, k - 1) for k in range(1, count + 1))
    return f"Switch {{ choice [ DEF g0 {shape(FACE)} {groups} ] }} USE g{count}"


def test_instances_are_counted_before_they_are_made(put: Put) -> None:
    assert len(vrml(put, doubled(5)).triangles) == 64
    for count in (40, 90):
        with pytest.raises(LimitError, match="PTM-L203"):
            vrml(put, doubled(count))
    spheres = "DEF s Shape { geometry Sphere { } }" + " USE s" * 100
    with pytest.raises(LimitError, match="PTM-L203"):
        read_source(put("a.wrl", HEAD + spheres), max_triangles=50_000)


PROTO = "PROTO P{} [ field SFVec3f a 0 0 0 ] {{ {} }} "
PROTOS = PROTO.format(0, "Transform { translation IS a }") + "".join(
    PROTO.format(k, "Group { children [ " + f"P{k - 1} {{ a IS a }} " * 2 + "] }")
    for k in range(1, 40)
)
DAMAGE = {
    "an index": shape(FACE.replace("3 -1", "4 -1")),
    "half an index": shape(FACE.replace("3 -1", "3.5 -1")),
    "an endless index": shape(FACE.replace("3 -1", f"{'9' * 400} -1")),
    "no number": shape(FACE.replace("10 4 0", "10 4.x 0")),
    "signs": shape(FACE.replace("10 4 0", "+-+ 4 0")),
    "coordinates": shape(FACE.replace("coordIndex", "texCoord TextureCoordinate { } coordIndex")),
    "colours": shape(FACE.replace("coordIndex", "color Color { color [ 1 1 1 ] } coordIndex")),
    "a list": shape(FACE.replace("-1 ]", "-1 ")),
    "a text": 'WorldInfo { title "a',
    "a brace": "Group { ",
    "a name": "DEF 3 Group { }",
    "deep": "Group { children [ " * 5000,
    "brackets": "Group { children " + "[" * 5000,
    "a matrix": "Transform { translation 1 2 children [ " + shape(FACE) + " ] }",
    "text for numbers": 'Transform { translation "1 2 3" children [ ' + shape(FACE) + " ] }",
    "a grid": shape("geometry ElevationGrid { xDimension 9999999 zDimension 9999999 height 1 }"),
    "a grid below 0": shape("geometry ElevationGrid { xDimension -1 zDimension -1 height [ 1 ] }"),
    "an extrusion": shape("geometry Extrusion { scale [ 1 1, 1 1, 1 1 ] }"),
    "a long extrusion": shape(
        f"geometry Extrusion {{ spine [ {'0 0 0 ' * 2000} ] crossSection [ {'0 1 ' * 2000} ] }}"
    ),
    "prototypes": PROTOS + "P39 { }",
    "nothing": "",
    "binary": "\0\1\2\3",
    "itself": 'Inline { url "a.wrl" }',
    "a colour": shape(FACE, "appearance Appearance { material Material { diffuseColor 1 } }"),
}  # fmt: skip


@pytest.mark.parametrize("what", DAMAGE)
def test_damage(put: Put, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    monkeypatch.setattr(classic, "_MOST_NODES", 1000)
    with pytest.raises(InputError, match=r"a\.wrl.*PTM-I2(54|47)") as caught:
        vrml(put, DAMAGE[what])
    assert "\n" not in str(caught.value)


def test_other_damage(put: Put) -> None:
    with pytest.raises(InputError, match=r"VRML 1\.0.*PTM-I254"):
        read_source(put("a.wrl", "#VRML V1.0 ascii\nCube { }"))
    with pytest.raises(InputError, match="PTM-I254"):
        read_source(put("a.wrl", b"\x1f\x8b\x08 not gzip"))
    put("b.wrl", HEAD + "Group {")
    with pytest.raises(InputError, match=r"b\.wrl: damaged \(line 2.*PTM-I254"):
        vrml(put, shape(FACE) + 'Inline { url "b.wrl" }')
    cycle = "<X3D><Scene><Group DEF='a'><Group USE='a'/></Group></Scene></X3D>"
    entities = "<!DOCTYPE X3D [<!ENTITY a 'b'>]><X3D><Scene/></X3D>"
    for text in ("<Scene/>", "<X3D/>", cycle, entities):
        with pytest.raises(InputError, match=r"PTM-I2(54|47)"):
            read_source(put("a.x3d", text))
