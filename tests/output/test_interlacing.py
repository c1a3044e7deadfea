"""The emitter `interlace`: an interlaced image of each texture, checked with the database."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.output import EmitOptions, validate_database
from ptmtools.texture import decode
from ptmtools.texture.images import Picture
from ptmtools_systems.interlace import deinterlace, interlace, read_manifest
from ptmtools_systems.interlace.steps import scale
from tests.output.agreement import disagreements

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
FORMATS = "vrml,gltf,interlace"


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The two rooms, with one texture of 256 × 256 and one of 300 × 200 texels."""
    folder = tmp_path_factory.mktemp("interlaced") / "model"
    shutil.copytree(SAMPLES / "two_rooms", folder)
    random = np.random.default_rng(5)
    for name, shape in {"room_a": (256, 256, 3), "room_b": (200, 300, 4)}.items():
        texels = random.integers(0, 256, shape, np.uint8)
        Image.fromarray(texels).save(folder / f"{name}.png")
    return folder / "two_rooms.obj"


@pytest.fixture(scope="module")
def whole(model: Path) -> Path:
    """Its database; not to be changed."""
    db = model.parent.parent / "db"
    words = ["-q", "build-scene", str(model), "-o", str(db), "-j", "1", "--format", FORMATS]
    assert main([*words, "--light", "none"]) == 0
    return db


@pytest.fixture
def db(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "db"))


def codes(db: Path) -> set[str]:
    return {issue.code for issue in validate_database(db, workers=1).issues}


def files(db: Path) -> dict[str, bytes]:
    """Of the sets."""
    folder = db / "www/interlace"
    return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


def test_each_texture_has_a_set_of_its_finest_level(whole: Path) -> None:
    index = json.loads((whole / "www/hints.json").read_text())
    assert index["textureSets"] == {"interlace": "interlace/{name}/"}
    assert "interlace" not in index["geometry"]
    counts = {}
    for row in index["textures"]:
        file = whole / "www" / row["file"]
        folder = whole / "www/interlace" / file.stem
        manifest, texels = read_manifest(folder), decode(file.read_bytes())
        assert manifest.original == (row["width"], row["height"])
        assert manifest.components == row["components"]
        if (manifest.width, manifest.height) != manifest.original:
            texels = scale(texels, manifest.width, manifest.height)
        assert np.array_equal(deinterlace(folder), texels)
        counts[row["width"], row["height"]] = len(manifest.parts)
    assert counts == {(256, 256): 3, (300, 200): 3, (64, 64): 1}
    assert main(["-q", "validate", str(whole)]) == 0


def test_the_same_again(model: Path, whole: Path, tmp_path: Path) -> None:
    words = ["-q", "build-scene", str(model), "-o", str(tmp_path / "db"), "--format", FORMATS]
    assert main([*words, "--light", "none"]) == 0
    assert files(tmp_path / "db") == files(whole)
    assert len(files(whole)) == 2 * 4 + 2 * 2


def test_what_is_not_asked_for_any_more_goes(db: Path, whole: Path) -> None:
    mine = db / "www/interlace/mine.txt"
    mine.write_text("kept")
    assert main(["-q", "emit", str(db), "--format", "vrml,gltf"]) == 0
    assert files(db) == {"mine.txt": b"kept"}
    assert "textureSets" not in json.loads((db / "www/hints.json").read_text())
    mine.unlink()
    assert codes(db) == set()
    assert main(["-q", "emit", str(db), "--format", FORMATS, "--gzip"]) == 0
    plain = {name: data for name, data in files(db).items() if not name.endswith(".gz")}
    assert plain == files(whole)
    assert len(files(db)) == len(plain) + 4, "a copy of each manifest"
    assert codes(db) == set()


def flipped(folder: Path) -> None:
    data = bytearray((folder / "2.png").read_bytes())
    data[-20] ^= 1
    (folder / "2.png").write_bytes(data)


def edited(change: Callable[[dict], object]) -> Callable[[Path], None]:
    def damage(folder: Path) -> None:
        document = json.loads((folder / "interlace.json").read_text())
        change(document)
        (folder / "interlace.json").write_text(json.dumps(document))

    return damage


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (flipped, {"D652", "D804"}),
        (lambda folder: (folder / "3.png").unlink(), {"D651", "D803"}),
        (lambda folder: (folder / "interlace.json").unlink(), {"D651", "D671"}),
        (lambda folder: (folder / "interlace.json").write_text("{"), {"D652", "D800"}),
        (edited(lambda d: d["original"].update(width=257)), {"D652"}),
        (edited(lambda d: d.update(min=64)), {"D652", "D808"}),
        (lambda folder: shutil.copytree(folder, folder.with_name("zz")), {"D653", "D710"}),
        (lambda folder: (folder / "4.png").write_bytes(b""), {"D653"}),
    ],
    ids=["byte", "file", "manifest", "json", "size", "split", "stranger", "stray"],
)
def test_damage_is_found(db: Path, damage: Callable[[Path], None], expected: set[str]) -> None:
    index = json.loads((db / "www/hints.json").read_text())
    name = next(Path(row["file"]).stem for row in index["textures"] if row["width"] == 256)
    damage(db / "www/interlace" / name)
    assert codes(db) == {f"PTM-{code}" for code in expected}


def test_the_set_of_another_texture(db: Path) -> None:
    """As its own manifest has it, and yet not the texture's."""
    folder = db / "www/interlace"
    one, other = (f for f in sorted(folder.iterdir()) if (f / "2.png").exists())
    shutil.rmtree(one)
    shutil.copytree(other, one)
    (line,) = disagreements(db / "www")
    assert line.startswith(f"set: textures/{one.name}.ptm: ")


def test_a_set_of_another_size(db: Path) -> None:
    folder = min((db / "www/interlace").iterdir())
    edited(lambda d: d["original"].update(width=d["original"]["width"] + 1))(folder)
    assert disagreements(db / "www") == [f"set: textures/{folder.name}.ptm: another size"]


def test_a_set_of_other_texels(db: Path) -> None:
    """Of the right size and kind, with all checksums as its manifest has them; of two textures,
    one of which is scaled."""
    for folder in sorted((db / "www/interlace").iterdir()):
        manifest = read_manifest(folder)
        texels = deinterlace(folder).copy()
        texels[3, 5] ^= 1
        written = interlace(Picture(texels))
        old = json.loads((folder / "interlace.json").read_text())["original"]
        for name, data in written.named_files():
            (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        edited(lambda d, old=old: d.update(original=old))(folder)
        assert read_manifest(folder).original == manifest.original
    lines = disagreements(db / "www")
    assert [line.rpartition(": ")[2] for line in lines] == ["1 texels differ"] * 4


def test_sets_that_the_index_does_not_name(db: Path) -> None:
    file = db / "www/hints.json"
    index = json.loads(file.read_text())
    del index["textureSets"]
    file.write_text(json.dumps(index))
    assert codes(db) == {"PTM-D652", "PTM-D700"}


def test_images_alone_are_no_database() -> None:
    with pytest.raises(InputError, match=r"none of them is of cells.*PTM-I111"):
        EmitOptions(format="interlace")
