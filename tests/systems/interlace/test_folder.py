"""Interlaced folders: exact for every kind of sample that a container holds, whole or not at all,
nobody else's files touched."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools import schemas
from ptmtools.errors import InputError, LimitError, OutputError
from ptmtools.texture import Description, Limits, Picture, load_image
from ptmtools_systems.interlace import (
    InterlaceOptions,
    deinterlace,
    interlace,
    read_manifest,
    validate_interlaced,
    write_folder,
)
from ptmtools_systems.interlace.containers import CONTAINERS
from ptmtools_systems.interlace.model import Interlaced
from ptmtools_systems.schemas import INTERLACE
from tests.conftest import files_below
from tests.systems.interlace.folders import SMALL, folder_of, image

#: Everything that the lossless containers hold.
EXACT = [
    (name, components, kind)
    for name, container in CONTAINERS.items()
    if container.lossless
    for components in container.components
    for kind in container.kinds
]


@pytest.mark.parametrize(("format", "components", "kind"), EXACT)
@pytest.mark.parametrize("size", [(16, 16), (8, 64), (32, 8), (2, 2), (1, 128)])
def test_exact(
    tmp_path: Path, format: str, components: int, kind: str, size: tuple[int, int]
) -> None:
    texels = image(*size, components, kind)
    folder = folder_of(tmp_path / "made", texels, format)
    interlaced = read_manifest(folder)
    assert interlaced.lossless
    assert interlaced.original == (interlaced.width, interlaced.height) == size[::-1]
    actual = deinterlace(folder)
    assert actual.dtype == texels.dtype
    np.testing.assert_array_equal(actual, texels)
    assert validate_interlaced(folder).issues == ()


@settings(max_examples=30)
@given(
    st.sampled_from(EXACT),
    st.integers(0, 5).map(lambda n: 1 << n),
    st.integers(0, 5).map(lambda n: 1 << n),
    st.integers(1, 20),
    st.integers(0, 99),
)
def test_any_image_any_minimum(
    tmp_path_factory: pytest.TempPathFactory,
    what: tuple[str, int, str],
    width: int,
    height: int,
    smallest: int,
    seed: int,
) -> None:
    format, components, kind = what
    top = np.iinfo(kind).max
    random = np.random.default_rng(seed)
    texels = random.integers(0, top, (height, width, components), kind, endpoint=True)
    folder = folder_of(tmp_path_factory.mktemp("made") / "f", texels, format, smallest)
    np.testing.assert_array_equal(deinterlace(folder), texels)
    assert sum(p.width * p.height for p in read_manifest(folder).parts) == width * height


@pytest.mark.parametrize("opaque", [True, False])
def test_alpha_of_webp(tmp_path: Path, opaque: bool) -> None:
    texels = image(8, 8, 4)
    texels[:, :, 3] = 255 if opaque else 0  # colours of what is transparent are kept
    np.testing.assert_array_equal(deinterlace(folder_of(tmp_path / "a", texels, "webp")), texels)


def test_every_step_from_the_first_files_alone(tmp_path: Path) -> None:
    texels = image(16, 64)
    folder = folder_of(tmp_path / "a", texels)
    parts = read_manifest(folder).parts
    assert [part.joined for part in parts] == [(16, 4), (32, 4), (32, 8), (64, 8), (64, 16)]
    for step in range(len(parts), 0, -1):
        width, height = parts[step - 1].joined
        actual = deinterlace(folder, step)
        np.testing.assert_array_equal(actual, texels[:: 16 // height, :: 64 // width])
        (folder / parts[step - 1].name).unlink()


def test_jpeg_is_near(tmp_path: Path) -> None:
    y, x, _ = np.mgrid[0:64, 0:64, 0:3]
    texels = (x + 2 * y).astype(np.uint8)
    folder = folder_of(tmp_path / "a", texels, "jpg")
    assert not read_manifest(folder).lossless
    assert abs(deinterlace(folder).astype(int) - texels).max() < 12
    grey = folder_of(tmp_path / "b", texels[:, :, :1], "jpg")
    assert deinterlace(grey).shape == (64, 64, 1)
    assert validate_interlaced(folder).issues == validate_interlaced(grey).issues == ()


@pytest.mark.parametrize(
    ("format", "components", "kind", "code"),
    [
        ("jpg", 4, "uint8", "PTM-I126"),
        ("jpg", 2, "uint8", "PTM-I126"),
        ("jpg", 3, "uint16", "PTM-I126"),
        ("webp", 3, "uint16", "PTM-I126"),
        ("png", 3, "float32", "PTM-I126"),
    ],
)
def test_what_a_container_does_not_hold(format: str, components: int, kind: str, code: str) -> None:
    texels = np.zeros((8, 8, components), kind)
    with pytest.raises(InputError, match=code):
        interlace(Picture(texels), InterlaceOptions(format=format))


def test_sides_that_a_container_does_not_hold() -> None:
    texels = np.zeros((1, 16384, 1), np.uint8)
    with pytest.raises(LimitError, match="PTM-L400"):
        interlace(Picture(texels), InterlaceOptions(format="webp"))
    assert len(interlace(Picture(texels)).files) == 1


def test_limits_count_after_scaling() -> None:
    texels = np.zeros((24, 24, 3), np.uint8)  # 32² when scaled
    with pytest.raises(LimitError, match="PTM-L104"):
        interlace(Picture(texels), limits=Limits(decoded_bytes=3 * 32 * 32 - 1))
    interlace(Picture(texels), limits=Limits(decoded_bytes=3 * 32 * 32))


def test_scaled_with_a_note(tmp_path: Path) -> None:
    written = interlace(Picture(image(24, 90)), InterlaceOptions(SMALL))
    assert (written.interlaced.width, written.interlaced.height) == (64, 32)
    assert written.interlaced.original == (90, 24)
    assert any("24" in note and "nearest powers of two" in note for note in written.notes)
    write_folder(tmp_path / "a", written)
    assert deinterlace(tmp_path / "a").shape == (32, 64, 3)


def test_upright_with_a_note() -> None:
    texels = image(8, 16)
    written = interlace(Picture(texels, Description(orientation=6)), InterlaceOptions(SMALL))
    assert any("EXIF" in note for note in written.notes)
    actual = [load_image(data).array() for data in written.files]
    np.testing.assert_array_equal(actual[0], texels.swapaxes(0, 1)[:, ::-1][::2, ::2])


@pytest.mark.parametrize(
    ("description", "noted"),
    [
        (Description(), False),
        (Description(srgb=0, gamma=45455), False),
        (Description(gamma=100_000), True),
        (Description(icc=b"profile", srgb=0), True),
    ],
)
def test_colours_that_are_not_kept_are_noted(description: Description, noted: bool) -> None:
    written = interlace(Picture(image(8, 8), description))
    assert any("colour profile" in note for note in written.notes) == noted
    assert all(load_image(data).description == Description() for data in written.files)


@pytest.mark.parametrize("format", CONTAINERS)
def test_the_same_bytes(tmp_path: Path, format: str) -> None:
    for name in ("a", "b"):
        folder_of(tmp_path / name, image(24, 48), format)
    assert files_below(tmp_path / "a") == files_below(tmp_path / "b")


def test_the_manifest_is_as_its_schema_says(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "a", image())
    document = json.loads((folder / "interlace.json").read_text())
    schema = json.loads(schemas.schema_text(INTERLACE))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(document, schema)
    schemas.check(document, INTERLACE)
    assert schema["$id"] == f"urn:ptmtools:interlace:{document['schema']}"
    assert Interlaced.from_document(document).document() == document
    assert set(schema["required"]) == set(document)
    assert set(schema["$defs"]["file"]["required"]) == set(document["files"][0])


def test_an_empty_folder_is_filled(tmp_path: Path) -> None:
    folder = tmp_path / "a"
    folder.mkdir()
    folder_of(folder, image())
    assert validate_interlaced(folder).ok


def test_a_folder_of_ours_is_replaced_with_force_only(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "a", image(64, 64))
    before = files_below(folder)
    other = interlace(Picture(image(8, 8)), InterlaceOptions(SMALL, "webp"))
    with pytest.raises(OutputError, match="PTM-O001"):
        write_folder(folder, other)
    assert files_below(folder) == before
    write_folder(folder, other, force=True)
    assert sorted(files_below(folder)) == ["1.webp", "2.webp", "3.webp", "interlace.json"]
    assert os.listdir(tmp_path) == ["a"]  # nothing beside it is left


def test_a_damaged_folder_of_ours_is_replaced(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "a", image())
    index = folder / "interlace.json"
    index.write_bytes(index.read_bytes()[:200])
    folder_of_other = interlace(Picture(image(8, 8)))
    write_folder(folder, folder_of_other, force=True)
    assert validate_interlaced(folder).ok


@pytest.mark.parametrize("what", ["notes.txt", "sub", "1.png.bak", "100.png", "7.png -> x"])
def test_nothing_of_others_is_replaced(tmp_path: Path, what: str) -> None:
    folder = folder_of(tmp_path / "a", image())
    name, _, link = what.partition(" -> ")
    if link:
        (folder / name).symlink_to(link)
    elif name == "sub":
        (folder / name).mkdir()
    else:
        (folder / name).write_bytes(b"mine")
    before = files_below(folder)
    with pytest.raises(OutputError, match="PTM-O010"):
        write_folder(folder, interlace(Picture(image())), force=True)
    assert files_below(folder) == before
    assert len(os.listdir(tmp_path)) == 1


@pytest.mark.parametrize("what", ["file", "photos", "other index"])
def test_no_folder_of_ours(tmp_path: Path, what: str) -> None:
    target = tmp_path / "a"
    if what == "file":
        target.write_bytes(b"mine")
    else:
        target.mkdir()
        name = "interlace.json" if what == "other index" else "1.png"
        (target / name).write_bytes(b'{"format": "of others"}')
    before = files_below(tmp_path)
    for force in (False, True):
        with pytest.raises(OutputError, match="PTM-O010"):
            write_folder(target, interlace(Picture(image())), force=force)
    assert files_below(tmp_path) == before


def test_what_a_link_leads_to_is_replaced(tmp_path: Path) -> None:
    folder_of(tmp_path / "a", image())
    (tmp_path / "link").symlink_to("a")
    write_folder(tmp_path / "link", interlace(Picture(image(8, 8))), force=True)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "a" / "1.png").exists()
    assert not (tmp_path / "a" / "2.png").exists()


@pytest.mark.parametrize("fails", ["mkdir", "put", "rename"])
def test_what_fails_leaves_what_was(
    tmp_path: Path, fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = folder_of(tmp_path / "a", image())
    before = files_below(tmp_path)

    def fail(*arguments: object, **settings: object) -> None:
        raise OSError(28, "no room")

    rename = os.rename
    if fails == "mkdir":
        monkeypatch.setattr(Path, "mkdir", fail)
    elif fails == "put":
        monkeypatch.setattr(os, "fsync", fail)
    else:
        monkeypatch.setattr("ptmtools.whole_folder.exchange", lambda *_: False)
        monkeypatch.setattr(
            os, "rename", lambda a, b: (fail if str(a).endswith(".part") else rename)(a, b)
        )
    with pytest.raises(OutputError, match="PTM-O003"):
        write_folder(folder, interlace(Picture(image(8, 8))), force=True)
    monkeypatch.undo()
    assert files_below(tmp_path) == before
    assert os.listdir(tmp_path) == ["a"]


def test_modes_of_files_are_the_users(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "a", image())
    mask = os.umask(0)
    os.umask(mask)
    for file in folder.iterdir():
        assert stat.S_IMODE(file.stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize(
    "options",
    [
        InterlaceOptions(min=0),
        InterlaceOptions(min=-5),
        InterlaceOptions(min=65537),
        InterlaceOptions(quality=0),
        InterlaceOptions(quality=101),
        InterlaceOptions(format="bmp"),
    ],
)
def test_options_that_cannot_be(options: InterlaceOptions) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        interlace(Picture(image()), options)
