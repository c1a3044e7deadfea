"""COLLADA: nodes, meshes and materials, each with the numbers that follow from the format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import areas
from ptmtools.errors import InputError, LimitError
from ptmtools.scene import ingest
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import SourceMaterial

from .conftest import Put, noise, png, read_source

SQUARE = "0 0 0 10 0 0 10 4 0 0 4 0"
COORDS = "0 0 1 0 1 1 0 1"
TRIANGLES = '<triangles count="2" material="s">{inputs}<p>0 0 1 1 2 2 0 0 2 2 3 3</p></triangles>'
INPUTS = '<input semantic="VERTEX" source="#v" offset="0"/>'
TEXCOORD = '<input semantic="TEXCOORD" source="#{}" offset="1" set="{}"/>'
PLACED = '<node id="n" name="wall">{}<instance_geometry url="#g"/></node>'
BOUND = (
    '<node id="n" name="wall"><instance_geometry url="#g"><bind_material><technique_common>'
    '<instance_material symbol="s" target="#m"><bind_vertex_input semantic="UV" '
    'input_semantic="TEXCOORD" input_set="{}"/></instance_material></technique_common>'
    "</bind_material></instance_geometry></node>"
)
IMAGE = (
    '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
    '<newparam sid="t"><sampler2D><source>f</source>{}</sampler2D></newparam>'
)
TEXTURE = '<diffuse><texture texture="t" texcoord="UV"/></diffuse>'


def source_of(name: str, values: str, letters: str) -> str:
    count, stride = len(values.split()) // len(letters), len(letters)
    parameters = "".join(f'<param name="{letter}" type="float"/>' for letter in letters)
    return (
        f'<source id="{name}"><float_array id="{name}a">{values}</float_array><technique_common>'
        f'<accessor source="#{name}a" count="{count}" stride="{stride}">{parameters}</accessor>'
        "</technique_common></source>"
    )


def dae(
    primitives: str = TRIANGLES.format(inputs=INPUTS + TEXCOORD.format("t0", 0)),
    nodes: str = PLACED.format(""),
    *,
    points: str = SQUARE,
    shader: str = "",
    model: str = "lambert",
    before: str = "",
    asset: str = '<unit meter="1"/><up_axis>Y_UP</up_axis>',
    more: str = "",
    image: str = "a.png",
    namespace: str = "2005/11",
) -> str:
    return (
        f'<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/{namespace}/COLLADASchema">'
        f"<asset>{asset}</asset><library_images><image id='i'><init_from>{image}</init_from>"
        "</image></library_images><library_effects><effect id='e'><profile_COMMON>"
        f"{before}<technique><{model}>{shader}</{model}></technique></profile_COMMON></effect>"
        "</library_effects><library_materials><material id='m' name='paint'>"
        "<instance_effect url='#e'/></material></library_materials>"
        f"<library_geometries><geometry id='g'><mesh>{source_of('p', points, 'XYZ')}"
        f"{source_of('t0', COORDS, 'ST')}{source_of('t1', '5 5 6 5 6 6 5 6', 'ST')}"
        f"{source_of('c', '1 0 0 0 1 0 0 0 1 1 1 1', 'RGB')}"
        "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
        f"{primitives}</mesh></geometry></library_geometries>{more}<library_visual_scenes>"
        f"<visual_scene id='x'>{nodes}</visual_scene></library_visual_scenes>"
        "<scene><instance_visual_scene url='#x'/></scene></COLLADA>"
    )


def material_of(put: Put, shader: str, **parts: str) -> SourceMaterial:
    put("a.png", png(noise(1)))
    nodes = BOUND.format(0)
    source = read_source(put("a.dae", dae(nodes=nodes, shader=shader, **parts)))
    return source.materials[source.triangle_material[0]]


@pytest.mark.parametrize(
    ("name", "metres", "size"),
    [
        ("dae-materials-units/yup", 0.3048, (8, 3, 6)),
        ("dae-materials-units/odd", 0.3, (8, 3, 6)),
        ("dae-materials-units/inch", 0.0254, (8, 3, 6)),
        ("dae-one/collada_materials", 0.0254, (5.08, 2.54, 4.064)),
    ],
)
def test_cases(shared: Path, name: str, metres: float, size: tuple[float, ...]) -> None:
    scene = ingest(shared / "cases" / f"{name}.dae")
    assert scene.space.metres == metres
    assert np.ptp(scene.points, axis=0) == pytest.approx(size, abs=1e-3)
    assert not {note.code for note in scene.notes} & {"PTM-N204", "PTM-N233", "PTM-N207"}
    colors = {m.name: m.color for m in scene.materials if m.image < 0}
    if "one" in name:
        assert scene.objects == ("Walls", "Floor", "Ceiling")
        assert colors == {"Red": (0.9, 0.1, 0.1)}
        assert [i.name for i in scene.images] == ["green.png"]
    else:
        assert scene.objects == ("floor", "ceil", "n", "s", "w", "e", "picture0", "picture1")
        assert colors == dict.fromkeys(("floor", "ceil", "wall"), (0.6, 0.6, 0.6))
        assert scene.images[0].name == "a.png"


def test_nodes_and_instances(put: Put) -> None:
    """A node is placed by all of its transformations in order, at each use."""
    turned = (
        "<translate>100 0 0</translate><rotate>0 0 2 90</rotate><scale>2 1 1</scale>"
        "<matrix>1 0 0 0 0 1 0 0 0 0 1 7 0 0 0 1</matrix>"
    )
    door = PLACED.format("").replace('id="n"', 'id="door"')
    library = f"<library_nodes>{door}</library_nodes>"
    use = '<node name="{}"><translate>0 0 {}</translate><instance_node url="#door"/></node>'
    nodes = PLACED.format(turned) + use.format("a", 50) + use.format("b", 60)
    source = read_source(put("a.dae", dae(nodes=nodes, more=library)))
    assert source.objects == ("wall", "wall", "wall")
    corners = source.points[source.triangles[::2]]
    assert corners[0].tolist() == pytest.approx(
        np.array([[100, 0, 7], [100, 20, 7], [96, 20, 7]]), abs=1e-12
    )
    assert corners[1:, 0].tolist() == [[0, 0, 50], [0, 0, 60]]
    look = "<lookat>1 2 3  1 2 -5  0 1 0</lookat>"
    source = read_source(put("a.dae", dae(nodes=PLACED.format(look))))
    assert source.points[0].tolist() == [1, 2, 3]
    assert source.points[2].tolist() == pytest.approx([11, 6, 3])


def test_axes_and_units(put: Put) -> None:
    asset = '<unit meter="0.0254"/><up_axis>{}</up_axis>'
    for axis, up, corner in [
        ("Y", "y", [10, 4, 0]),
        ("Z", "z", [10, 4, 0]),
        ("X", "y", [-4, 10, 0]),
    ]:
        source = read_source(put("a.dae", dae(asset=asset.format(f"{axis}_UP"))))
        assert (source.metres, source.up) == (0.0254, up)
        assert source.points[2].tolist() == corner
    for meter in ("0", "-1", "inf", "nan"):
        text = dae(asset=f'<unit meter="{meter}"/>')
        assert read_source(put("a.dae", text)).metres is None


@pytest.mark.parametrize(
    ("primitives", "faces", "area"),
    [
        ("<polylist count='1'>{}<vcount>4</vcount><p>0 1 2 3</p></polylist>", 2, 40),
        ("<polylist count='2'>{}<vcount>3 3</vcount><p>0 1 2 0 2 3</p></polylist>", 2, 40),
        ("<polygons count='2'>{}<p>0 1 2</p><p>0 2 3</p></polygons>", 2, 40),
        ("<tristrips count='1'>{}<p>0 1 3 2</p></tristrips>", 2, 40),
        ("<trifans count='1'>{}<p>0 1 2 3</p></trifans>", 2, 40),
        ("<polygons>{}<ph><p>0 1 2 3</p><h>4 5 6 7</h><h>8 9 10 11</h></ph></polygons>", 20, 35),
        ("<polygons>{}<ph><p>3 2 1 0</p><h>4 5 6 7</h></ph></polygons>", 12, 36),
        ("<lines>{}<p>0 1</p></lines><triangles>{}<p>0 1 2</p></triangles>", 1, 20),
        ("<polylist>{}<vcount>2 3</vcount><p>0 1 0 1 2</p></polylist>", 1, 20),
    ],
)  # fmt: skip
def test_primitives(put: Put, primitives: str, faces: int, area: float) -> None:
    holes = " 1 1 0 3 1 0 3 3 0 1 3 0 5 1 0 6 1 0 6 2 0 5 2 0"
    text = dae(primitives.replace("{}", INPUTS), points=SQUARE + holes)
    source = read_source(put("a.dae", text))
    corners = source.points[source.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert len(source.triangles) <= faces
    assert areas(corners).sum() == pytest.approx(area)
    assert len(set(np.sign(normal[normal != 0]))) == 1


def test_sets_of_coordinates(put: Put) -> None:
    """The material of an instance names the set that its texture has."""
    put("a.png", png(noise(1)))
    inputs = INPUTS + TEXCOORD.format("t0", 0) + TEXCOORD.format("t1", 1)
    inputs += '<input semantic="COLOR" source="#c" offset="0"/>'
    for number, first in ((0, [0, 0]), (1, [5, 5]), (9, [0, 0])):
        text = dae(
            TRIANGLES.format(inputs=inputs), BOUND.format(number), shader=TEXTURE, before=IMAGE
        )
        source = read_source(put("a.dae", text))
        assert source.uv[0, 0].tolist() == first
    assert source.colors is not None
    assert source.colors[0].tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]


FLAT = "<transparent{}><color>{}</color></transparent>"
SHARE = "<transparency><float>{}</float></transparency>"


@pytest.mark.parametrize(
    ("shader", "opacity"),
    [
        ("", 1),
        (SHARE.format(0.3), 0.3),
        (FLAT.format(' opaque="A_ONE"', "1 1 1 0.5") + SHARE.format(0.5), 0.25),
        (FLAT.format(' opaque="A_ZERO"', "1 1 1 0.5") + SHARE.format(0.5), 0.75),
        (FLAT.format(' opaque="RGB_ZERO"', "0.2 0.2 0.2 1") + SHARE.format(1), 0.8),
        (FLAT.format(' opaque="RGB_ONE"', "0.2 0.2 0.2 1"), 0.2),
        (FLAT.format(' opaque="RGB_ZERO"', "0 0 0 1") + SHARE.format(1), 1),
        (FLAT.format("", "1 1 1 1") + SHARE.format("0.0"), 1),
        (FLAT.format(' opaque="A_ONE"', "1 1 1 1") + SHARE.format("0.0"), 0),
    ],
)
def test_opacity(put: Put, shader: str, opacity: float) -> None:
    material = material_of(put, shader)
    assert material.opacity == pytest.approx(opacity)
    assert material.see_through == (opacity < 1)


def test_early_sketchup_has_shares_of_transparency(put: Put) -> None:
    tool = "<contributor><authoring_tool>Google SketchUp 6.4.112</authoring_tool></contributor>"
    shader = FLAT.format("", "1 1 1 1") + SHARE.format(0.3)
    assert material_of(put, shader, asset=tool).opacity == pytest.approx(0.7)


def test_materials(put: Put) -> None:
    shader = (
        "<emission><color>0.5 0 0 1</color></emission><diffuse><color>.1 .2 .3 1</color></diffuse>"
        "<specular><color>.5 .5 .5 1</color></specular><shininess><float>40</float></shininess>"
    )
    extra = "<extra><technique><double_sided>{}</double_sided></technique></extra>"
    material = material_of(put, shader, model="phong", before=extra.format(0))
    assert material.name == "paint"
    assert material.color == (0.1, 0.2, 0.3)
    assert material.roughness == pytest.approx(0.8)
    assert material.glow == pytest.approx((0.21404, 0, 0), abs=1e-5)
    assert not material.two_sided
    assert material_of(put, "", before=extra.format(1)).two_sided
    constant = material_of(put, shader, model="constant")
    assert (constant.color, constant.unlit) == ((0.5, 0, 0), True)
    given = '<newparam sid="c"><float4>.4 .5 .6 1</float4></newparam>'
    material = material_of(put, '<diffuse><param ref="c"/></diffuse>', before=given)
    assert material.color == (0.4, 0.5, 0.6)


@pytest.mark.parametrize(
    ("image", "before", "namespace"),
    [
        ("maps/the%20wall.png", IMAGE.format("<wrap_s>CLAMP</wrap_s><wrap_t>MIRROR</wrap_t>"), ""),
        ("maps/the wall.png", IMAGE, "2005/11"),
        ("file:///C:/models/maps/the%20wall.png", IMAGE, "2005/11"),
        ("..\\maps\\the wall.png", IMAGE, "2005/11"),
        (
            "<ref>maps/the%20wall.png</ref>",
            '<newparam sid="t"><sampler2D><instance_image url="#i"/></sampler2D></newparam>',
            "2008/03",
        ),
    ],
)
def test_images(put: Put, image: str, before: str, namespace: str) -> None:
    put("maps/the wall.png", png(noise(2)))
    material = material_of(put, TEXTURE, before=before, image=image, namespace=namespace)
    assert material.texture is not None
    assert material.texture.read() == png(noise(2))
    expected = ("clamp", "mirror") if "CLAMP" in before else ("repeat", "repeat")
    assert (material.texture.wrap_s, material.texture.wrap_t) == expected


def test_images_of_opacity_and_emission(put: Put) -> None:
    alpha = '<transparent opaque="{}"><texture texture="{}" texcoord="UV"/></transparent>'
    same = material_of(put, TEXTURE + alpha.format("A_ONE", "t"), before=IMAGE.format(""))
    assert (same.mask, same.opacity, same.see_through) == (None, 1, False)
    other = material_of(put, TEXTURE + alpha.format("RGB_ONE", "i"), before=IMAGE.format(""))
    assert other.mask is not None
    assert other.mask.channel == "l"
    inverse = material_of(put, TEXTURE + alpha.format("RGB_ZERO", "i"), before=IMAGE.format(""))
    assert (inverse.mask, inverse.see_through) == (None, True)
    glow = material_of(put, TEXTURE.replace("diffuse", "emission"), before=IMAGE.format(""))
    assert glow.glow == (1, 1, 1)
    assert glow.glow_map is not None


def test_what_is_missing_is_told(put: Put) -> None:
    nodes = PLACED.format("") + '<node><instance_geometry url="other.dae#g"/></node>'
    path = put("a.dae", dae(nodes=nodes.replace("#g", "#g"), image="none.png"))
    notes = IngestNotes(path)
    read_source(path, notes)
    assert {note.code for note in notes.entries} == {"PTM-N207", "PTM-N214"}
    bare = TRIANGLES.format(inputs=INPUTS).replace("0 0 1 1 2 2 0 0 2 2 3 3", "0 1 2")
    text = dae(bare, BOUND.format(0), shader=TEXTURE, before=IMAGE, image="none.png")
    notes = IngestNotes(path)
    read_source(put("a.dae", text), notes)
    assert {note.code for note in notes.entries} == {"PTM-N204"}


def test_skins_and_cameras(put: Put) -> None:
    more = (
        '<library_controllers><controller id="k"><skin source="#g"><bind_shape_matrix>'
        "1 0 0 3 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller>"
        '</library_controllers><library_cameras><camera id="lens"><optics><technique_common>'
        "<perspective><xfov>90</xfov><aspect_ratio>2</aspect_ratio></perspective>"
        "</technique_common></optics></camera></library_cameras>"
    )
    nodes = '<node id="a"><instance_controller url="#k"/></node><node name="eye"><translate>1 2 3'
    nodes += '</translate><instance_camera url="#lens"/></node>'
    source = read_source(put("a.dae", dae(nodes=nodes, more=more)))
    assert source.points[0].tolist() == [3, 0, 0]
    (camera,) = source.cameras
    assert (camera.name, camera.position, camera.direction) == ("eye", (1, 2, 3), (0, 0, -1))
    assert camera.field_of_view == pytest.approx(2 * np.arctan(0.5))


def doubled(count: int) -> str:
    """Nodes that each have the next one twice."""
    node = '<node id="n{}">' + '<instance_node url="#n{}"/>' * 2 + "</node>"
    nodes = "".join(node.format(i, i + 1, i + 1) for i in range(count))
    return f"{nodes}<node id='n{count}'><instance_geometry url='#g'/></node>"


def test_instances_are_counted_before_they_are_made(put: Put) -> None:
    path = put("a.dae", dae(nodes=doubled(5).replace('"n0"', '"n0" name="all"')))
    assert len(read_source(path).triangles) == 2 * (2**6 - 1)
    for count in (40, 3000):
        with pytest.raises(LimitError, match="PTM-L203"):
            read_source(put("a.dae", dae(nodes=doubled(count))))
    chain = "<node>" * 2_000 + "<instance_geometry url='#g'/>" + "</node>" * 2_000
    assert len(read_source(put("a.dae", dae(nodes=chain))).triangles) == 2


GOOD = dae()
DAMAGE = {
    "itself": dae(nodes='<node id="n"><instance_node url="#n"/></node>'),
    "round": dae(nodes='<node id="a"><node id="b"><instance_node url="#a"/></node></node>'),
    "entities": GOOD.replace("?><", '?><!DOCTYPE a [<!ENTITY a SYSTEM "/etc/passwd">]><', 1),
    "utf-16": GOOD.replace("?><", "?><!DOCTYPE a [<!ENTITY a 'b'>]><", 1),
    "an index": GOOD.replace("0 0 1 1 2 2 0", "0 0 1 1 2 4 0").replace("#t0", "#p"),
    "a far index": GOOD.replace("0 0 1 1 2 2 0", "0 0 1 1 9999999999 2 0"),
    "a negative index": GOOD.replace("0 0 1 1 2 2 0", "0 0 1 1 -1 2 0"),
    "an endless index": GOOD.replace("0 0 1 1 2 2 0", f"0 0 1 1 {'9' * 30} 2 0"),
    "an uneven list": GOOD.replace("0 0 1 1 2 2 0", "0 1 1 2 2 0"),
    "no number": GOOD.replace("10 4 0", "10 x 0"),
    "a stride of 0": GOOD.replace('stride="3"', 'stride="0"'),
    "a stride below 0": GOOD.replace('stride="3"', 'stride="-3"'),
    "a stride without end": GOOD.replace('stride="3"', 'stride="999999999999"'),
    "an offset": GOOD.replace('offset="1"', 'offset="-1"'),
    "a far offset": GOOD.replace('offset="1"', 'offset="99999999999"'),
    "no source": GOOD.replace('id="p"', 'id="q"'),
    "no positions": GOOD.replace("semantic='POSITION'", "semantic='NORMAL'"),
    "counts": dae(f"<polylist>{INPUTS}<vcount>5</vcount><p>0 1 2 3</p></polylist>"),
    "counts below 0": dae(f"<polylist>{INPUTS}<vcount>5 -1</vcount><p>0 1 2 3</p></polylist>"),
    "a matrix": dae(nodes=PLACED.format("<matrix>1 2 3</matrix>")),
    "a color": dae(nodes=BOUND.format(0), shader="<diffuse><color>1</color></diffuse>"),
    "a float": dae(nodes=BOUND.format(0), shader="<shininess><float/></shininess>"),
    "a unit": dae(asset='<unit meter="foot"/>'),
    "html": "<html></html>",
    "truncated": GOOD[:-20],
    "an encoding": GOOD.replace('"1.0"', '"1.0" encoding="klingon"'),
    "bytes": "\0\1\2",
    "empty": "<COLLADA/>",
}  # fmt: skip


@pytest.mark.parametrize("what", DAMAGE)
def test_damage(put: Put, what: str) -> None:
    text = DAMAGE[what].encode("utf-16") if what == "utf-16" else DAMAGE[what]
    with pytest.raises(InputError, match=r"a\.dae.*PTM-I2(54|47)") as caught:
        read_source(put("a.dae", text))
    assert "\n" not in str(caught.value)
