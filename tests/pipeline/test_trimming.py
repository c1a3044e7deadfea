"""`--trim` in a build: what it leaves out, what it says, and when it is done again."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cells.options import SubdivideOptions
from ptmtools.errors import InputError
from ptmtools.pipeline.build import build_scene, run_stage
from ptmtools.pipeline.encoding import TextureOptions, encode_image
from ptmtools.pipeline.stages import CELLS, TEXTURES
from ptmtools.pipeline.status import plan_build
from ptmtools.pipeline.validation import validate
from ptmtools.texture import read_header, read_image
from ptmtools.visibility.options import PvsOptions

CEILING, PICTURE = 1024, 64
#: The ceiling is 0.8 m above the highest eye: a texel of every other level is enough there.
TRIM = TextureOptions(trim=True, trim_height=60)


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A room of 4 x 3 x 4 m with a fine texture on the ceiling, a metre of it wide, and a picture
    over a wall."""
    random = np.random.default_rng(4)
    for name, side in (("ceiling", CEILING), ("picture", PICTURE)):
        texels = random.integers(0, 256, (16, 16, 3), np.uint8)
        Image.fromarray(texels).resize((side, side)).save(tmp_path / f"{name}.png")
    (tmp_path / "room.mtl").write_text(
        "newmtl ceiling\nmap_Kd ceiling.png\nnewmtl picture\nmap_Kd picture.png\nnewmtl plain\n"
    )
    (tmp_path / "room.obj").write_text(
        "mtllib room.mtl\n"
        + "".join(f"v {x} {y} {z}\n" for y in (0, 3) for x, z in ((0, 0), (4, 0), (4, 4), (0, 4)))
        + "vt 0 0\nvt 4 0\nvt 4 4\nvt 0 4\nvt 1 0\nvt 1 1\nvt 0 1\n"
        + "usemtl plain\nf 1 4 3 2\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
        + "usemtl ceiling\nf 5/1 6/2 7/3 8/4\nusemtl picture\nf 1/1 2/5 6/6 5/7\n"
    )
    return tmp_path / "room.obj"


def widths(db: Path) -> dict[str, int]:
    """Of the finest level of each texture."""
    files = sorted((db / "www/textures").glob("[!l]*.ptm"))  # no lightmaps
    return {f.stem: read_header(f.read_bytes()).levels[-1].width for f in files}


def test_a_fine_ceiling_is_trimmed_and_a_picture_is_not(room: Path) -> None:
    db = room.parent / "db"
    report = build_scene(room, db, TRIM)
    assert widths(db) == {"ceiling": CEILING // 2, "picture": PICTURE}
    header = read_header((db / "www/textures/ceiling.ptm").read_bytes())
    assert (header.width, header.trimmed) == (CEILING, 1)
    (textures,) = (stage for stage in report.stages if stage.stage == "textures")
    less = (CEILING**2 - (CEILING // 2) ** 2) * 3
    assert (textures.counts["unresolved"], textures.counts["unresolved_bytes"]) == (1, less)
    assert "2.4 MB of 1 texture omitted" in TEXTURES.summarize(textures.counts)
    (note,) = (note for note in textures.notes if "--trim" in note)
    assert "1 level of textures/ceiling.ptm" in note
    assert "512 x 512 of 1024 x 1024, about" in note
    hints = json.loads((db / "www/hints.json").read_bytes())
    images = [row for row in hints["textures"] if "light" not in row]
    assert {row["width"] for row in images} == {CEILING // 2, PICTURE}
    assert read_image(db / "www/textures/ceiling.png").shape == (CEILING // 2, CEILING // 2, 3)
    assert validate(db).ok


def test_done_again_where_it_changes_something(room: Path) -> None:
    """A texture of which nothing else is left out keeps its file."""
    db = room.parent / "db"

    def tasks(*options: TextureOptions) -> tuple[int, int, int] | None:
        stages = build_scene(room, db, *options).stages
        (textures,) = (stage for stage in stages if stage.stage == "textures")
        return textures.tasks if textures.ran else None

    assert tasks() == (2, 0, 0)
    whole = {f: f.read_bytes() for f in db.rglob("*") if f.is_file()}
    assert "unresolved" not in json.loads((db / "manifest.json").read_bytes())["stages"]["textures"]
    (plan,) = (plan for plan in plan_build(room, db, TRIM) if plan.stage == "textures")
    assert (plan.plan, plan.textures) == ("run", ("ceiling",))
    assert tasks(TRIM) == (2, 1, 0)
    assert tasks(TRIM) is None
    assert widths(db)["ceiling"] == CEILING // 2
    assert tasks(TextureOptions(trim=True, trim_height=30)) == (2, 1, 0)
    assert widths(db)["ceiling"] == CEILING // 4
    assert tasks(TextureOptions(trim=True, trim_height=29)) == (2, 2, 0), "the same levels"
    assert tasks() == (2, 1, 0)
    assert {f: f.read_bytes() for f in db.rglob("*") if f.is_file()} == whole


def test_other_cells_other_levels(room: Path) -> None:
    """Where one may fly, one is near to the ceiling."""
    db = room.parent / "db"
    build_scene(room, db, TRIM)
    build_scene(room, db, SubdivideOptions(standing="anywhere"), TRIM)
    assert widths(db)["ceiling"] == CEILING
    build_scene(room, db, TRIM, until=CELLS)
    run_stage(db, PvsOptions())
    run_stage(db, TRIM)
    assert widths(db)["ceiling"] == CEILING // 2


def test_with_other_reasons_to_leave_levels_out(room: Path) -> None:
    source = (room.parent / "ceiling.png").read_bytes()
    for options, finest in (
        (TextureOptions(), 256),
        (TextureOptions(max_side=512), 256),
        (TextureOptions(max_side=64), 64),
        (TextureOptions(max_level=-2), 256),
        (TextureOptions(max_level=5), 32),
        (TextureOptions(min_level=-2), 512),
        (TextureOptions(min_level=9), 512),
        (TextureOptions(min_side=512), 512),
    ):
        header = read_header(encode_image(options, "ceiling.png", source, 2)[0][1])
        assert header.levels[-1].width == finest, options
    header = read_header(encode_image(TextureOptions(), "ceiling.png", source, 64)[0][1])
    assert [level.width for level in header.levels] == [1]


@pytest.mark.parametrize(
    "wrong",
    [
        {"trim_height": 0},
        {"trim_fov": 180.0},
        {"trim_fov": float("nan")},
        {"trim_distance": 0.0},
        {"trim_distance": float("inf")},
    ],
)
def test_impossible_screens(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        TextureOptions(trim=True, **wrong)
