"""Files of `emit`, read back by our own reader and by view3dscene."""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.errors import DatabaseError, InputError, OutputError
from ptmtools.output import (
    EmitExtras,
    EmitOptions,
    GivenViewpoint,
    TextureRecord,
    emit,
    validate_database,
)
from ptmtools.output.emission import compress
from ptmtools.output.names import DefNames
from ptmtools.scene.model import Material
from ptmtools.texture.model import Level
from ptmtools.visibility.model import Pvs
from tests.e2e.browsers import view3dscene
from tests.output.agreement import disagreements, kinds
from tests.output.vrml_reader import VrmlNode, parse

ONE_LEVEL = (Level(1, 1, 0, 100, 0, (1, 1), 3),)


def records() -> tuple[TextureRecord, ...]:
    return tuple(
        TextureRecord(i, f"textures/{n}.ptm", f"textures/{n}.png", 1, 1, 3, ONE_LEVEL, "0" * 64)
        for i, n in enumerate("ab")
    )


def write(
    artifacts,
    out: Path,
    options: EmitOptions = EmitOptions(),  # noqa: B008
    textures: tuple[TextureRecord, ...] = records(),
    *,
    force: bool = False,
    **changes,
):
    a = replace(artifacts, **changes)
    return emit(a.scene, a.cells, a.pvs, a.ach, textures, out, options, EmitExtras(force=force))


def shapes(db: Path) -> list[VrmlNode]:
    """Of all cells."""
    files = sorted((db / "www/cells").glob("*.wrl"))
    return [shape for file in files for shape in parse(file.read_bytes()).of_type("Shape")]


def triangles(shape: VrmlNode) -> np.ndarray:
    """(m, 3, 3) corners of a shape."""
    geometry = shape.fields["geometry"]
    corners = geometry.fields["coordIndex"].reshape(-1, 4)[:, :3]
    return geometry.fields["coord"].fields["point"][corners]


def test_cells_read_back(artifacts, finished: Path) -> None:
    scene, cells = artifacts.scene, artifacts.cells
    piece, owner = cells.emitted(scene.two_sided)
    for c in range(3):
        document = parse((finished / f"www/cells/c000{c}.wrl").read_bytes())
        (node,) = document.of_type("PTMCell")
        assert node.fields["cellName"] == f"c000{c}"
        assert node.fields["hullPoint"].tolist() == cells.leaf_points(c).tolist()
        assert node.fields["adjacentUrl"] == tuple(
            f"c000{n}.wrl" for n in artifacts.cells.adjacent()[c]
        )
        assert node.fields["visibleUrl"] == tuple(f"c000{n}.wrl" for n in artifacts.pvs.row(c))
        np.testing.assert_array_equal(
            node.fields["ach"].astype(np.float32), artifacts.ach.row(c).astype(np.float32)
        )
        written = np.concatenate([triangles(s) for s in document.of_type("Shape")])
        wanted = cells.vertex[cells.triangle[piece[owner == c]]]
        assert sorted(written.tolist()) == sorted(wanted.tolist())


def test_texture_coordinates_go_with_their_corners(artifacts, finished: Path) -> None:
    """The fixture maps every quad alike, so a corner's position tells its coordinates."""
    cells = artifacts.cells
    known = {
        (tuple(cells.vertex[i].tolist()), tuple(cells.vertex_uv[i].tolist()))
        for i in range(len(cells.vertex))
    }
    met = 0
    for shape in shapes(finished):
        fields = shape.at("geometry")
        if "texCoord" not in fields:
            continue
        index = fields["texCoordIndex"].reshape(-1, 4)[:, :3]
        uv = fields["texCoord"].fields["point"][index]
        for p, t in zip(triangles(shape).reshape(-1, 3), uv.reshape(-1, 2), strict=True):
            assert (tuple(p.tolist()), tuple(t.tolist())) in known
            met += 1
    assert met > 30


def test_each_kind_of_material(finished: Path) -> None:
    """Textured: no Material. Tinted: one Color. See-through: a Material."""
    kinds = set()
    for shape in shapes(finished):
        texture, material = shape.at("appearance", "texture"), shape.at("appearance", "material")
        color = shape.at("geometry", "color")
        kinds.add(
            (
                texture.get("url", ("",))[0],
                texture.get("repeatS", True),
                tuple(material["diffuseColor"].tolist()) if material else None,
                float(material["transparency"][0]) if "transparency" in material else 0.0,
                tuple(color["color"].ravel()) if color else (),
            )
        )
    assert kinds == {
        ("", True, (0.8, 0.8, 0.8), 0.0, ()),
        ("../textures/a.png", True, None, 0.0, ()),
        ("../textures/a.png", False, None, 0.0, (1.0, 0.3, 0.3)),
        ("../textures/b.png", True, (1.0, 1.0, 0.5), 0.75, ()),
        ("", True, (0.0, 1.0, 0.5), 0.5, ()),
    }


def test_solid_follows_the_sides(finished: Path) -> None:
    sides = {shape.at("geometry").get("solid", True) for shape in shapes(finished)}
    assert sides == {True, False}


def test_only_the_ptm_without_fallback(artifacts, tmp_path: Path) -> None:
    write(artifacts, tmp_path / "www", EmitOptions(fallback=False))
    text = "".join(p.read_text() for p in sorted((tmp_path / "www/cells").iterdir()))
    assert 'url [ "../textures/a.ptm" ]' in text
    assert ".png" not in text
    hints = json.loads((tmp_path / "www/hints.json").read_text())
    assert [t["fallback"] for t in hints["textures"]] == [None, None]


def test_same_bytes_again(artifacts, tmp_path: Path) -> None:
    first, second = (write(artifacts, tmp_path / n) for n in ("a", "b"))
    assert first == second
    for name in first.files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert first.bytes == sum((tmp_path / "a" / n).stat().st_size for n in first.files)


def test_gzip_copies(artifacts, tmp_path: Path) -> None:
    """Of each text a gzip file without name and time, listed after it; the texts are the same."""
    plain = write(artifacts, tmp_path / "plain")
    options = EmitOptions(gzip=True)
    twice = [write(artifacts, tmp_path / n, options) for n in ("a", "b")]
    assert twice[0] == twice[1]
    text = [n for n in plain.files if n.endswith((".wrl", ".json"))]
    assert len(text) == 2 * 3 + 3, "cells and their records, a root, an index and statistics"
    wanted = [name for n in plain.files for name in ([n, f"{n}.gz"] if n in text else [n])]
    assert list(twice[0].files) == wanted
    for name in plain.files:
        data = (tmp_path / "plain" / name).read_bytes()
        assert (tmp_path / "a" / name).read_bytes() == data
        if name in text:
            packed = (tmp_path / "a" / f"{name}.gz").read_bytes()
            assert gzip.decompress(packed) == data
            assert packed[:10] == bytes([0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 2, 255])
            assert (tmp_path / "b" / f"{name}.gz").read_bytes() == packed
            assert len(packed) < len(data)
    assert twice[0].bytes == sum((tmp_path / "a" / n).stat().st_size for n in wanted)
    write(artifacts, tmp_path / "a", force=True)
    assert not list((tmp_path / "a").glob("*.gz")), "none is left of another emission"


@pytest.mark.parametrize(
    ("name", "entry"),
    [
        ("cells/c0000.wrl", "root.wrl"),
        ("cells/c0002.wrl", "root.wrl"),
        ("hints/c0000.json", "hints.json"),
        ("hints/statistics.json", "hints.json"),
    ],
)
def test_a_file_that_cannot_be_written(artifacts, tmp_path: Path, name: str, entry: str) -> None:
    """The fault is reported, and there is no file that leads to it."""
    (tmp_path / name).mkdir(parents=True)
    with pytest.raises(OutputError, match="PTM-O002") as fault:
        write(artifacts, tmp_path, force=True)
    assert name in str(fault.value)
    assert not (tmp_path / entry).exists()


def test_compressing_nothing_and_much() -> None:
    for data in (b"", bytes(3_000_000), os.urandom(100_000)):
        assert gzip.decompress(compress(data)) == data


def test_the_level_of_the_fallback_image(artifacts, tmp_path: Path) -> None:
    first, second = records()
    given = (replace(first, levels=ONE_LEVEL * 3), replace(second, levels=ONE_LEVEL * 4))
    lower = (replace(given[0], fallback_level=1), replace(given[1], fallback=None))
    for some, fallback, levels in (
        (given, True, [2, 3]),
        (lower, True, [1, None]),
        (lower, False, [None, None]),
    ):
        out = tmp_path / f"{fallback}{levels}"
        write(artifacts, out, EmitOptions(fallback=fallback), some)
        hints = json.loads((out / "hints.json").read_text())
        assert [t["fallbackLevel"] for t in hints["textures"]] == levels


def test_an_empty_cell_has_a_file(artifacts, tmp_path: Path) -> None:
    nobody = np.where(artifacts.cells.triangle_cell == 1, -1, artifacts.cells.triangle_cell)
    write(artifacts, tmp_path / "www", cells=replace(artifacts.cells, triangle_cell=nobody))
    document = parse((tmp_path / "www/cells/c0001.wrl").read_bytes())
    assert len(document.of_type("PTMCell")) == 1
    assert document.of_type("Shape") == []


def test_a_cell_of_two_leaves(artifacts, tmp_path: Path, made_up_hints) -> None:
    cells = replace(
        artifacts.cells,
        leaf_cell=np.array([0, 0, 1], np.int32),
        triangle_cell=np.maximum(artifacts.cells.triangle_cell - 1, -1)
        * (artifacts.cells.triangle_cell > 0)
        + np.minimum(artifacts.cells.triangle_cell, 0),
    )
    pvs = replace(artifacts.pvs, start=np.array([0, 2, 4]), cell=np.array([0, 1, 1, 0], np.int32))
    ach = made_up_hints(pvs, np.array([0.75, 0.25, 0.5, 0.5]))
    write(artifacts, tmp_path / "db/www", cells=cells, pvs=pvs, ach=ach)
    node = parse((tmp_path / "db/www/cells/c0000.wrl").read_bytes()).of_type("PTMCell")[0]
    assert node.fields["leafStart"].tolist() == [0, 8]
    assert node.fields["leafPoint"].tolist() == cells.leaf_point[:16].tolist()
    assert np.ptp(node.fields["hullPoint"], axis=0).tolist() == [8, 4, 4]
    assert len(node.fields["hullPoint"]) == 8
    issues = {i.code for i in validate_database(tmp_path / "db").issues}
    assert issues == {"PTM-D650", "PTM-D671"}, "no manifest and no textures here, nothing else"
    assert disagreements(tmp_path / "db/www") == []
    files = [tmp_path / f"db/www/hints/c000{cell}.json" for cell in range(2)]
    records = [json.loads(file.read_text()) for file in files]
    assert [len(record["leaves"]) for record in records] == [2, 1]
    records[0]["leaves"].reverse()
    files[0].write_text(json.dumps(records[0]))
    assert kinds(tmp_path / "db/www") == {"cell"}


def test_geometry_beyond_the_root_box_of_a_cell_of_two_leaves(
    tmp_path: Path, room_row, made_up_hints
) -> None:
    """An open model: what lies beyond the box is in order before a leaf, though the hull of a cell
    whose leaves differ in height leans; what lies elsewhere beyond the hull is not."""
    scene, cells = room_row(2)
    point = cells.leaf_point.copy()
    point[(point[:, 0] > 4) & (point[:, 1] > 2), 1] = 2.0  # the second is 2 m high, not 4
    loose = cells.vertex.copy()
    whole = replace(cells, leaf_cell=np.zeros(2, np.int32), leaf_point=point, closed=False)
    whole = replace(whole, triangle_cell=np.minimum(whole.triangle_cell, 0))
    pvs = Pvs.from_matrix(np.ones((1, 1), np.bool_))
    ach = made_up_hints(pvs, np.ones(1))

    def faults(moved: tuple[float, float, float], name: str) -> set[str]:
        vertex = loose.copy()
        vertex[np.isclose(vertex, [0, 0, -2]).all(axis=1)] = moved
        vertex[(vertex[:, 0] > 4.5) & (vertex[:, 1] > 2), 1] = 2.0
        out = tmp_path / name / "www"
        emit(scene, replace(whole, vertex=vertex), pvs, ach, (), out, EmitOptions())
        return kinds(out)

    assert "outside_hull" not in faults((0, 0, -2), "as it was")
    assert "outside_hull" not in faults((2, 6, -2), "above the higher leaf")
    assert "outside_hull" in faults((10, 3, -2), "above and beyond the lower leaf")


def test_viewpoints_stand_on_the_floor(artifacts, finished: Path) -> None:
    document = parse((finished / "www/root.wrl").read_bytes())
    views = {v.name: v.fields["position"] for v in document.of_type("Viewpoint")}
    assert list(views) == ["VP_0", "VP_1", "VP_2"]
    (info,) = document.of_type("NavigationInfo")
    assert info.fields["avatarSize"].tolist() == [0.25, 1.6, 0.5]
    for node in document.of_type("PTMViewpointCell"):
        position = views.pop(node.fields["viewpoint"])
        assert position[1] == 1.6
        cell = int(artifacts.cells.locate(position)[0])
        assert node.fields["cellUrl"] == (f"cells/c{cell:04d}.wrl",)
    assert not views


def test_def_names() -> None:
    names = DefNames("C7")
    given = ["Wände.001", "Wände 001", "wall", "wall", "wall_2", "…", "", "1"]
    taken = [names.take(n) for n in given]
    assert taken == [
        "C7_Wande_001",
        "C7_Wande_001_2",
        "C7_wall",
        "C7_wall_2",
        "C7_wall_2_2",
        "C7_shape",
        "C7_shape_2",
        "C7_1",
    ]
    assert all(re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", t) for t in taken)


def test_faults_before_anything_is_written(artifacts, tmp_path: Path) -> None:
    out = tmp_path / "www"
    cells, pvs, ach = artifacts.cells, artifacts.pvs, artifacts.ach
    nothing = replace(cells, leaf_cell=np.zeros(0, np.int32), triangle_source=np.zeros(0, np.int32))
    vertex = cells.vertex.copy()
    vertex[3, 1] = np.nan
    for fault, changes in (
        ("PTM-D600", {"cells": nothing}),
        ("PTM-D008", {"pvs": replace(pvs, start=pvs.start[:-1])}),
        ("PTM-D008", {"ach": replace(ach, start=ach.start * 2)}),
        (r"'b\.png'.*PTM-D004", {"textures": records()[:1]}),
        ("PTM-D601", {"cells": replace(cells, vertex=vertex)}),
        ("PTM-D601", {"cells": replace(cells, vertex=cells.vertex * 1e40)}),
    ):
        with pytest.raises(DatabaseError, match=fault):
            write(artifacts, out, **changes)
    with pytest.raises(InputError, match="PTM-I111"):
        write(artifacts, out, EmitOptions(viewpoints=(GivenViewpoint((50, 1, 0)),)))
    assert not out.exists()


def test_what_is_there_stays(artifacts, tmp_path: Path) -> None:
    (tmp_path / "root.wrl").write_text("mine")
    with pytest.raises(OutputError, match=r"specify another folder.*PTM-O001"):
        write(artifacts, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["root.wrl"]
    write(artifacts, tmp_path, force=True)
    assert (tmp_path / "root.wrl").read_text().startswith("#VRML V2.0 utf8\n")


def test_collapsed_pieces_are_counted(artifacts, tmp_path: Path) -> None:
    """A sliver whose corners are one in float32 is left out, in both cells that it faces."""
    cells = artifacts.cells
    vertex, triangle = cells.vertex.copy(), cells.triangle
    vertex[triangle[0, 1]] = vertex[triangle[0, 0]] + [0, 0, 1e-12]
    before = write(artifacts, tmp_path / "a")
    after = write(artifacts, tmp_path / "b", cells=replace(cells, vertex=vertex))
    assert before.collapsed == 0
    assert after.collapsed == 1
    assert after.triangles == before.triangles - 1


def test_colours_beyond_the_range_are_held(artifacts, tmp_path: Path) -> None:
    bright = (Material("bright", (2.0, -1.0, 0.5), opacity=1.5),)
    scene = replace(
        artifacts.scene,
        materials=bright,
        triangle_material=np.zeros_like(artifacts.scene.triangle_material),
    )
    write(artifacts, tmp_path, scene=scene)
    text = (tmp_path / "cells/c0000.wrl").read_text()
    assert "material Material { diffuseColor 1 0 0.5 emissiveColor 0.25 0 0.125 }" in text


def test_view3dscene_has_nothing_to_say(
    finished: Path, tmp_path: Path, require: Callable[[str, str], None]
) -> None:
    if shutil.which("view3dscene") is None:
        require("view3dscene", "apt install view3dscene")
    assert view3dscene.check_all(finished / "www") == {}
    bad = tmp_path / "bad.wrl"
    text = (finished / "www/cells/c0000.wrl").read_text()
    bad.write_text(text.replace("coordIndex", "coordIdx", 1))
    assert view3dscene.check(bad), "the check must be able to fail"
