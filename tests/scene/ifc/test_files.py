"""IFC: archives, damaged files, and a missing library."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from ptmtools.errors import InputError, LimitError, MissingComponentError
from ptmtools.scene import Scene, ingest
from ptmtools.scene.ifc import reader as ifc
from tests.scene.conftest import Put
from tests.scene.ifc.ifc_house import Ifc, house
from tests.scene.ifc.reading import read


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = house(Ifc()).write(tmp_path / "house.ifc")
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ptmtools\[ifc\]'.*PTM-M100"):
        ingest(file)


class TestArchives:
    def test_one_file(self, tmp_path: Path) -> None:
        plain = house(Ifc()).write(tmp_path / "house.ifc")
        with zipfile.ZipFile(tmp_path / "a.ifczip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(plain, "sub/house.IFC")
            archive.writestr("readme.txt", "a house")
        packed, _ = read(tmp_path / "a.ifczip")
        assert np.array_equal(packed.points, read(plain)[0].points)

    @pytest.mark.parametrize(("names", "what"), [((), "no"), (("a.ifc", "b.ifc"), "2")])
    def test_not_one_file(self, tmp_path: Path, names: tuple[str, ...], what: str) -> None:
        with zipfile.ZipFile(tmp_path / "a.ifczip", "w") as archive:
            archive.writestr("a.txt", "")
            for name in names:
                archive.writestr(name, "")
        with pytest.raises(InputError, match=f"contains {what} IFC files instead of one.*PTM-I266"):
            read(tmp_path / "a.ifczip")

    def test_none(self, put: Put) -> None:
        with pytest.raises(InputError, match="PTM-I266"):
            read(put("a.ifczip", b"PK\x03\x04" + bytes(100)))

    def test_too_large(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        with zipfile.ZipFile(tmp_path / "a.ifczip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("a.ifc", bytes(5 << 20))
        monkeypatch.setattr(ifc, "_LARGEST", 0)
        with pytest.raises(LimitError, match="PTM-L204"):
            read(tmp_path / "a.ifczip")


@pytest.fixture
def whole(tmp_path: Path) -> bytes:
    return house(Ifc(), ["EG"]).write(tmp_path / "whole.ifc").read_bytes()


class TestDamage:
    @pytest.mark.parametrize(
        ("content", "code"),
        [
            (b"", "PTM-I243"),
            (b"hello", "PTM-I266"),
            (bytes(5000), "PTM-I266"),
            (b"ISO-10303-21;", "PTM-I266"),
            (b"ISO-10303-21;\nEND-ISO-10303-21;", "PTM-I254"),
        ],
    )
    def test_no_ifc(self, put: Put, content: bytes, code: str) -> None:
        with pytest.raises(InputError, match=code):
            ingest(put("a.ifc", content))

    @pytest.mark.parametrize("schema", [b"IFC5", b"AUTOMOTIVE_DESIGN"])
    def test_other_schemas(self, put: Put, whole: bytes, schema: bytes) -> None:
        file = put("a.ifc", whole.replace(b"'IFC4'", b"'" + schema + b"'"))
        with pytest.raises(InputError, match=rf"{schema.decode()}.*IFC4X3_ADD2.*PTM-I243"):
            ingest(file)

    def test_no_products(self, tmp_path: Path) -> None:
        made = Ifc()
        made.storey("EG", 0)
        with pytest.raises(InputError, match=r"no drawable product.*PTM-I247"):
            ingest(made.write(tmp_path / "empty.ifc"))

    def test_only_spaces(self, tmp_path: Path) -> None:
        made = Ifc()
        made.box("IfcSpace", "Room", (0, 0, 0), (1, 1, 1))
        with pytest.raises(InputError, match=r"no drawable product.*PTM-I247"):
            ingest(made.write(tmp_path / "space.ifc"))

    def test_cut_off(self, put: Put, whole: bytes) -> None:
        for length in np.linspace(1, len(whole) - 3, 40).astype(int).tolist():
            with pytest.raises(InputError, match="PTM-I266"):
                ingest(put("cut.ifc", whole[:length]))

    @pytest.mark.parametrize("share", [0.05, 0.2, 0.4, 0.6, 0.8, 0.95])
    def test_a_part_is_missing(self, put: Put, whole: bytes, share: float) -> None:
        """Begun and ended as it should be."""
        cut = whole[: int(share * len(whole))] + b"\nENDSEC;\nEND-ISO-10303-21;\n"
        self.harmless(put("cut.ifc", cut))

    @pytest.mark.parametrize("seed", range(16))
    def test_flipped_bytes(self, put: Put, whole: bytes, seed: int) -> None:
        random = np.random.default_rng(seed)
        damaged = np.frombuffer(whole, np.uint8).copy()
        places = random.integers(300, len(whole) - 100, random.integers(1, 40))
        damaged[places] = random.integers(0, 256, len(places))
        self.harmless(put("flipped.ifc", damaged.tobytes()))

    def harmless(self, file: Path) -> None:
        """Read as far as it goes, or one line that says why not."""
        try:
            scene = ingest(file)
        except InputError as error:
            printed = str(error)
        else:
            printed = str(file)
            Scene.from_arrays(scene.to_arrays())
        assert str(file) in printed
        assert "\n" not in printed

    def test_a_product_that_is_damaged(self, tmp_path: Path) -> None:
        """All others are drawn, and storeys with no sound placement have their elevations."""
        made = house(Ifc(), ["EG", "OG"])
        made.file.by_type("IfcBuildingStorey")[1].ObjectPlacement = None
        text = made.file.to_string()
        door = made.file.by_type("IfcDoor")[0]
        text = text.replace(f"#{door.Representation.id()},$", "1.5,$")
        assert "1.5," in text
        file = tmp_path / "damaged.ifc"
        file.write_text(text)
        scene = ingest(file)
        assert "IfcDoor D0" not in scene.objects
        assert "IfcWall Inner" in scene.objects
        assert [storey.name for storey in scene.storeys] == ["EG", "OG"]
        assert [note.code for note in scene.notes if "geometry" in note.message] == ["PTM-N253"]

    def test_wrong_statements_are_missed(self, put: Put, whole: bytes) -> None:
        spoilt = whole.replace(b"IFCFURNITURE(", b"IFCFURNICHER(")
        scene = ingest(put("a.ifc", spoilt))
        (note,) = [note for note in scene.notes if note.code == "PTM-N244"]
        assert "IFCFURNICHER" in note.message
        assert not [name for name in scene.objects if "Table" in name]
