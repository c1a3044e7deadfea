"""Hostile databases: archives of arrays, manifests, what an interrupted run left, served files.

A small database is built once. What is changed in it comes with the right checksums, as in a
database that an enemy has made; and with wrong ones.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import zipfile
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzz.mutation import NAMES, NUMBERS, Case, damaged, dumped, garbled, twisted
from ptmtools.cli.main import main
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.stages import ACH, CELLS, PVS, SCENE, STAGES
from ptmtools.store import lists
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import IMAGE_LIST, LISTS, arrays_of, sha256
from ptmtools.store.manifest import Manifest, StageRecord
from ptmtools.store.writer import DatabaseWriter

MODEL = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
#: Names that outputs of a stage may try.
OUTPUTS = (
    *(*NAMES, "stages/../../outside/x", "www/../manifest.json", "www/away/x", "away/secret.png"),
    *("manifest.json", "stages", "www", "www/", "stages//a", "stages/a\\b", "stages/c:a"),
)

#: Commands that write, and one that counts by what the manifest says.
WRITING = ("textures -j 1", "emit", "pvs -j 1", "validate --segments 50")


def built(folder: Path) -> Path:
    """The database of a small model."""
    model = Path(shutil.copytree(MODEL, folder / "model"))
    options = ["--samples", "16", "--backend", "embree", "-j", "1", "-q"]
    db = folder / "db"
    status = main(["build-scene", str(model / "two_rooms.obj"), "-o", str(db), *options])
    assert status == 0
    return db


def commanded(*arguments: str) -> tuple[int, str]:
    """Exit status and what a command printed."""
    stream = io.TextIOWrapper(io.BytesIO(), "utf-8")
    with redirect_stdout(stream), redirect_stderr(stream):
        status = main(list(arguments))
    stream.flush()
    printed = stream.buffer.getvalue().decode()  # type: ignore[attr-defined]
    assert status != 1, f"ptm {arguments[0]}: {printed[printed.find('internal error') :][:200]}"
    assert status != 7 or "[PTM-L099]" not in printed, f"ptm {arguments[0]}: {printed[-300:]}"
    assert "\x1b" not in printed, f"ptm {arguments[0]} says what terminals obey"
    return status, printed


class Npz:
    """The reader of archives, and of the artifacts that are in them."""

    limit = 1 << 24

    def __init__(self, folder: Path, outside: Path) -> None:
        db = built(folder)
        self._stages = ("scene", "cells", "pvs", "ach")
        self._files = {s: (db / arrays_of(s)).read_bytes() for s in self._stages}
        self._arrays = {s: unpack_arrays(d, file=s) for s, d in self._files.items()}
        self._images = (db / IMAGE_LIST).read_bytes()

    def make(self, rng: Random) -> Case:
        """Bytes of an archive, other arrays in a sound one, or an archive of another kind."""
        stage = rng.choice(self._stages)
        match rng.randrange(8):
            case 0 | 1:
                data = damaged(rng, self._files[stage], fields=_zip_fields(self._files[stage]))
            case 2:
                data = _rezipped(rng, self._arrays[stage])
            case _:
                data = pack_arrays(_rearranged(rng, self._arrays[stage]))
        return Case(data, stage)

    def read(self, case: Case) -> str:
        """Reads it back as the stage that it is of, beside the others, and counts by it."""
        artifacts = Artifacts(_Held({**self._arrays, case.facts: case.data}, self._images))
        scene, cells, pvs, ach = (artifacts[stage] for stage in (SCENE, CELLS, PVS, ACH))
        assert len(scene.corners) == len(scene.opaque)
        with np.errstate(all="ignore"):
            cells.locate(scene.points[:9])
            cells.adjacent()
            cells.leaf_volumes()
            cells.emitted(scene.two_sided)
            assert sum(len(cells.portal(k)) for k in range(cells.portal_count)) >= 0
            assert sum(len(pvs.row(i)) + len(ach.row(i)) for i in range(pvs.cell_count)) >= 0
        return "sound"


class _Held(DatabaseFolder):
    """A database in memory, one of whose archives is still to be read."""

    def __init__(self, stages: Mapping[str, Any], images: bytes) -> None:
        self.path, self.manifest = Path("db"), Manifest("model.obj")
        self._stages = stages
        self._images = images

    def record(self, stage: str) -> StageRecord:
        return StageRecord(STAGES[stage].recipe, {}, {}, {})

    def read_output(self, stage: str, name: str) -> bytes:
        return self._images

    def read_arrays(self, stage: str) -> Any:
        held = self._stages[stage]
        return unpack_arrays(held, file=arrays_of(stage)) if isinstance(held, bytes) else held


def _zip_fields(data: bytes) -> list[tuple[int, int]]:
    """Where the numbers of an archive are: of local heads, of the directory and of its end."""
    actual = []
    for mark, offsets in (
        (b"PK\3\4", ((6, 2), (8, 2), (14, 4), (18, 4), (22, 4), (26, 2), (28, 2))),
        (b"PK\1\2", ((8, 2), (10, 2), (16, 4), (20, 4), (24, 4), (28, 2), (30, 2), (42, 4))),
        (b"PK\5\6", ((8, 2), (10, 2), (12, 4), (16, 4), (20, 2))),
    ):
        at = data.find(mark)
        while at >= 0:
            actual += [(at + offset, size) for offset, size in offsets]
            at = data.find(mark, at + 1)
    heads = [at for at in range(len(data) - 6) if data[at : at + 6] == b"\x93NUMPY"][:50]
    return actual + [(at + offset, 1) for at in heads for offset in range(6, 80, 3)]


def _rezipped(rng: Random, arrays: Mapping[str, Any]) -> bytes:
    """An archive of another writer, or of none."""
    out = io.BytesIO()
    kind = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA))
    with zipfile.ZipFile(out, "w", kind) as archive:
        for name, array in arrays.items():
            body = io.BytesIO()
            np.lib.format.write_array(body, np.asarray(array), version=rng.choice(((1, 0), (2, 0))))
            data = body.getvalue()
            if rng.random() < 0.2:
                data = damaged(rng, data)
            if rng.random() < 0.05:
                data = bytes(1 << 22)
            member = rng.choice(NAMES) if rng.random() < 0.1 else f"{name}.npy"
            info = zipfile.ZipInfo(member.replace("\0", "") or "x")
            info.compress_type = kind
            archive.writestr(info, data)
            if rng.random() < 0.1:
                archive.writestr(zipfile.ZipInfo(f"{name}.npy"), data)
    return out.getvalue()


def _rearranged(rng: Random, arrays: Mapping[str, Any]) -> dict[str, Any]:
    """One to three of the arrays with other elements, shapes or types, or the texts beside them."""
    changed = dict(arrays)
    for _ in range(rng.randint(1, 3)):
        name = rng.choice(sorted(changed))
        array = np.array(changed[name])
        if name == "about" and rng.random() < 0.9:
            text = dumped(rng, twisted(rng, json.loads(arrays["about"].tobytes())))
            changed[name] = np.frombuffer(text, np.uint8)
            continue
        match rng.randrange(10):
            case 0 | 1 | 2 | 3 if array.size:
                flat = array.reshape(-1)
                for _ in range(rng.choice((1, 3, 50))):
                    flat[rng.randrange(array.size)] = _number(rng, array.dtype)
            case 4 if array.size:
                changed[name] = array.reshape(-1)[: rng.randrange(array.size)]
                continue
            case 5:
                array = array[: rng.randrange(1 + len(array))] if array.ndim else array
            case 6:
                kinds = ("<f8", "<f4", "<i8", "<i4", "|u1", "|b1", "<u8")
                with np.errstate(all="ignore"):
                    array = array.astype(rng.choice(kinds))
            case 7:
                array = np.repeat(array, rng.choice((0, 2, 3)), axis=0) if array.ndim else array
            case 8:
                array = np.array(arrays[rng.choice(sorted(arrays))])
            case _:
                del changed[name]
                if not changed:
                    return dict(arrays)
                continue
        changed[name] = array
    return changed


def _number(rng: Random, dtype: np.dtype[Any]) -> Any:
    if dtype.kind == "f":
        return rng.choice((0.0, -1.0, 1e308, -1e308, 1e-320, np.nan, np.inf, 1e9, -0.0))
    if dtype.kind == "b":
        return rng.random() < 0.5
    info = np.iinfo(dtype)
    return max(info.min, min(info.max, rng.choice((-1, -2, -99, *NUMBERS, rng.randrange(300)))))


class ManifestText:
    """The reader of the manifest, and the commands that go by it."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        self._db = built(folder)
        self._text = (self._db / "manifest.json").read_bytes()
        self._tree = json.loads(self._text)
        (outside / "secret.png").write_bytes(b"secret")
        os.symlink(outside, self._db / "away")
        os.mkfifo(self._db / "stages/fifo")

    def make(self, rng: Random) -> Case:
        """Other values, names, or bytes."""
        if rng.random() < 0.2:
            return Case(damaged(rng, self._text), rng.randrange(10))
        tree = twisted(rng, self._tree, OUTPUTS)
        if rng.random() < 0.4:
            outputs = rng.choice(list(self._tree["stages"].values()))["outputs"]
            stage = rng.choice(list(self._tree["stages"]))
            digest = rng.choice(("ab" * 32, *outputs.values()))
            held = tree.get("stages") if isinstance(tree, dict) else None
            entry = held.get(stage) if isinstance(held, dict) else None
            if isinstance(entry, dict) and isinstance(entry.get("outputs"), dict):
                entry["outputs"][rng.choice((*OUTPUTS, "stages/fifo"))] = digest
        return Case(dumped(rng, tree), rng.randrange(10))

    def read(self, case: Case) -> str:
        """Reads it; writes it again; asks the commands."""
        (self._db / "manifest.json").write_bytes(case.data)
        db = str(self._db)
        commands = ("info", "status", "info --json", "status --json", *WRITING)
        try:
            if case.facts < len(commands):
                command, *options = commands[case.facts].split()
                commanded(command, db, *options)
        finally:
            if case.facts >= 4 and (self._db / "manifest.json").read_bytes() != case.data:
                self._restore()
        manifest = Manifest.from_bytes(case.data, file="manifest.json")
        assert Manifest.from_bytes(manifest.to_bytes(), file="manifest.json") == manifest
        return "sound"

    def _restore(self) -> None:
        """After a command that has written."""
        folder, outside = self._db.parent, self._db.parent.parent / "outside"
        shutil.rmtree(self._db)
        shutil.rmtree(folder / "model")
        built(folder)
        os.symlink(outside, self._db / "away")
        os.mkfifo(self._db / "stages/fifo")


class ListText:
    """A list of the files of a stage, in a database that has lists of few files."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        before = lists.INLINE, lists.MEAN
        lists.INLINE = lists.MEAN = 6
        try:
            self._whole = built(folder).rename(folder / "whole")
        finally:
            lists.INLINE, lists.MEAN = before
        self._db = folder / "db"
        self._files = {f.stem: f.read_bytes() for f in sorted((self._whole / LISTS).iterdir())}
        (outside / "secret.png").write_bytes(b"secret")

    def make(self, rng: Random) -> Case:
        """Other values, names or bytes; most of the time under their own digest."""
        digest = rng.choice(list(self._files))
        if rng.random() < 0.3:
            data = damaged(rng, self._files[digest])
        else:
            tree = twisted(rng, json.loads(self._files[digest]), OUTPUTS)
            if isinstance(tree, dict) and isinstance(files := tree.get("files"), dict):
                files[rng.choice((*OUTPUTS, *files))] = rng.choice(("ab" * 32, "", digest))
            data = dumped(rng, tree)
        return Case(data, (digest, rng.random() < 0.8, rng.randrange(8)))

    def read(self, case: Case) -> str:
        """Asks the commands; one that repairs leaves a sound database."""
        digest, agreed, number = case.facts
        shutil.rmtree(self._db, ignore_errors=True)
        shutil.copytree(self._whole, self._db)
        name = sha256(case.data) if agreed else digest
        (self._db / LISTS / f"{digest}.json").unlink()
        (self._db / LISTS / f"{name}.json").write_bytes(case.data)
        manifest = self._db / "manifest.json"
        manifest.write_text(manifest.read_text().replace(digest, name))
        commands = ("info", "status", "validate -q", *WRITING)
        if number < len(commands):
            command, *options = commands[number].split()
            return f"{command} ended with {commanded(command, str(self._db), *options)[0]}"
        model = self._whole.parent / "model/two_rooms.obj"
        build = ("build-scene", str(model), "-o", str(self._db), "-j", "1", "-q")
        words = ("--samples", "16", "--backend", "embree", "--force")
        status, printed = commanded(*build, *words)
        if status and "--force --rebuild" in printed:
            status, printed = commanded(*build, *words, "--rebuild")
        assert status == 0, printed
        return "repaired"


class Interrupted:
    """Leftovers of a killed run, or files put in their place."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        self._whole = built(folder).rename(folder / "whole")
        self._db = folder / "db"
        self._outside = outside
        self._tree = json.loads((self._whole / "manifest.json").read_bytes())
        (outside / "secret.png").write_bytes(b"secret")
        (outside / "manifest.json").write_bytes(b"{}")

    def make(self, rng: Random) -> Case:
        """A manifest to be committed, and links, pipes and files where folders should be."""
        tree = twisted(rng, self._tree, OUTPUTS) if rng.random() < 0.6 else self._tree
        return Case(dumped(rng, tree), rng.randrange(1 << 30))

    def read(self, case: Case) -> str:
        """Opens the database to write in it, which finishes or drops what was begun."""
        rng = Random(case.facts)
        self._prepare(rng, case.data)
        with DatabaseWriter.open_for_stage(self._db) as writer:
            transaction = writer.begin(rng.choice(("textures", "emit")))
            name = rng.choice(("www/a.txt", "stages/a.npz", "www/textures/a.ptm", *OUTPUTS))
            transaction.put(name, b"text")
        return "opened"

    def _prepare(self, rng: Random, manifest: bytes) -> None:
        shutil.rmtree(self._db, ignore_errors=True)
        shutil.copytree(self._whole, self._db)
        begun = self._db / ".ptm-new" / rng.choice(("textures", "x", "emit"))
        begun.mkdir(parents=True)
        if rng.random() < 0.7:
            (begun / "manifest.json").write_bytes(manifest)
        names = rng.sample(sorted(self._tree["stages"]["emit"]["outputs"]), 3)
        for name in names:
            (begun / name).parent.mkdir(parents=True, exist_ok=True)
            (begun / name).write_bytes(b"new")
        if rng.random() < 0.5:
            outputs = {rng.choice(OUTPUTS): "ab" * 32, names[0]: sha256(b"new")}
            line = {"task": rng.choice(("ab" * 32, 5)), "outputs": outputs}
            (begun / "journal").write_bytes(dumped(rng, line) + b"\n[\n")
        for _ in range(rng.choice((0, 1, 2))):
            inner = rng.choice((".", "www", "journal", "manifest.json", names[0]))
            outer = rng.choice(("www", "stages", ".ptm-new", ".ptm-lock", "www/textures", names[1]))
            place = rng.choice((begun / inner, self._db / outer))
            if place.parent.resolve() != place.parent or not place.parent.is_dir():
                continue  # it is there no more, or lies beyond a link
            if place.is_dir() and not place.is_symlink():
                place.rename(self._db / f"moved{rng.randrange(1 << 30)}")
            elif os.path.lexists(place):
                place.unlink()
            match rng.randrange(4):
                case 0:
                    os.symlink(self._outside, place)
                case 1:
                    os.symlink(self._outside / "secret.png", place)
                case 2:
                    os.mkfifo(place)
                case _:
                    place.write_bytes(b"a file")


class Served:
    """The check of a database one of whose files is another."""

    limit = 1 << 28

    def __init__(self, folder: Path, outside: Path) -> None:
        self._db = built(folder)
        self._manifest = (self._db / "manifest.json").read_bytes()
        outputs = Manifest.from_bytes(self._manifest, file="m").outputs()
        self._files = {name: (self._db / name).read_bytes() for name in outputs}

    def make(self, rng: Random) -> Case:
        """Words of VRML, values of JSON, bytes of the others."""
        texts = [name for name in self._files if name.endswith((".wrl", ".json"))]
        name = rng.choice(rng.choice((texts, list(self._files))))
        data = self._files[name]
        if name.endswith(".wrl") and rng.random() < 0.8:
            words = (
                "Shape",
                "Inline",
                "PTMCell",
                "url",
                "[",
                "]",
                "{",
                "}",
                '"../x"',
                "TRUE",
                "ach",
            )
            changed = garbled(rng, data.decode(), words).encode("utf-8", "surrogatepass")
        elif name.endswith(".json") and rng.random() < 0.8:
            changed = dumped(rng, twisted(rng, json.loads(data)))
        elif name.endswith(".npz") and rng.random() < 0.7:
            changed = pack_arrays(_rearranged(rng, unpack_arrays(data, file=name)))
        else:
            changed = damaged(rng, data)
        return Case(changed, (name, rng.random() < 0.8))

    def read(self, case: Case) -> str:
        """Validates the database; most of the time the manifest agrees with it."""
        name, agreed = case.facts
        manifest = self._manifest
        if agreed:
            before = sha256(self._files[name]).encode()
            manifest = manifest.replace(before, sha256(case.data).encode())
        (self._db / "manifest.json").write_bytes(manifest)
        (self._db / name).write_bytes(case.data)
        try:
            status, _ = commanded("validate", str(self._db), "-q", "--limit", "64")
        finally:
            (self._db / name).write_bytes(self._files[name])
        return f"validate ended with {status}"


class Vrml:
    """The reader of VRML alone."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        db = built(folder)
        self._files = [file.read_bytes() for file in sorted((db / "www").rglob("*.wrl"))]

    def make(self, rng: Random) -> Case:
        """Words, or bytes."""
        data = rng.choice(self._files)
        if rng.random() < 0.3:
            return Case(damaged(rng, data, rng.choice(self._files)))
        words = ("Inline", "{", "}", "[", "]", "url", '"', "\\", "#", "-1", "TRUE")
        return Case(garbled(rng, data.decode(), words).encode("utf-8", "surrogatepass"))

    def read(self, case: Case) -> str:
        """Reads its URLs."""
        from ptmtools.output.model import FileError
        from ptmtools.output.validation.vrml import read_file

        try:
            return f"{len(read_file('a.wrl', case.data) or ())} URLs"
        except FileError as error:
            return error.code
