"""Lists of many files: a change of one file changes one or two lists, and nothing else is read."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import assume, given, strategies as st

from ptmtools import schemas
from ptmtools.errors import DatabaseError
from ptmtools.store import folder, lists
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import LISTS, MANIFEST, sha256
from ptmtools.store.lists import FileList, list_file, lists_of, read_list
from ptmtools.store.manifest import Manifest, StageRecord
from ptmtools.store.writer import DatabaseWriter
from tests.conftest import files_below

MANY = {f"www/{i:05}": sha256(str(i).encode()) for i in range(20_000)}


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lists of four files, for stages of more than four."""
    monkeypatch.setattr(lists, "INLINE", 4)
    monkeypatch.setattr(lists, "MEAN", 4)


def parts(files: dict[str, str]) -> list[bytes]:
    return list(lists_of(files))


def joined(texts: list[bytes]) -> dict[str, str]:
    held = {sha256(text): text for text in texts}
    return dict(FileList([*held], lambda digest: read_list(held[digest], file=digest)))


def test_the_manifest_has_a_thousand_files() -> None:
    few = dict(list(MANY.items())[: lists.INLINE])
    assert parts(few) == []
    assert len(parts({**few, "www/x": "ab" * 32})) >= 1


def test_they_read_back() -> None:
    texts = parts(MANY)
    assert 10 < len(texts) < 40
    assert joined(texts) == MANY
    assert parts(dict(reversed(MANY.items()))) == texts
    assert max(map(len, texts)) < 1 << 20


@given(st.dictionaries(st.text(max_size=4), st.sampled_from(["", "ab" * 32])), st.text(max_size=4))
def test_any_name(files: dict[str, str], name: str) -> None:
    files |= dict(list(MANY.items())[: lists.INLINE])
    assume(len(files) > lists.INLINE)
    assert joined(parts(files)) == files
    assert len(set(parts({**files, name: "cd" * 32})) - set(parts(files))) <= 2


@pytest.mark.parametrize("name", ["www/", "www/09999", "www/09999x", "zzz"])
def test_a_change_of_one_file_changes_few_lists(name: str) -> None:
    before = set(parts(MANY))
    assert len(set(parts({**MANY, name: "cd" * 32})) - before) in (1, 2)
    assert len(set(parts({n: d for n, d in MANY.items() if n != name})) - before) <= 1


@pytest.mark.parametrize(
    "data",
    [
        *(b"", b"[]", b"{}", b'{"format": "ptmtools file list", "schema": 2, "files": {}}'),
        b'{"format": "ptmtools file list", "schema": 1, "files": {"a": 5}}',
        b'{"format": "ptmtools file list", "schema": 1, "files": {"a": "", "a": ""}}',
    ],
)
def test_what_is_no_list(data: bytes) -> None:
    with pytest.raises(DatabaseError, match="PTM-D006"):
        read_list(data, file="x")


@pytest.mark.parametrize("name", ["mine.txt", "www/../mine.txt", "/etc/x", "www/a\\b"])
def test_outputs_that_no_stage_writes(name: str) -> None:
    data = json.dumps({"format": lists.FORMAT, "schema": lists.SCHEMA, "files": {name: "ab" * 32}})
    record = StageRecord(1, {}, {}, FileList(["ab" * 32], lambda _: {}))
    text = Manifest("m.obj", {"cells": record}).to_bytes()
    manifest = Manifest.from_bytes(
        text, file=MANIFEST, lists=lambda _: read_list(data.encode(), file="x")
    )
    with pytest.raises(DatabaseError, match="PTM-D002"):
        manifest.files()


def write(db: Path, files: dict[str, bytes], stage: str = "cells") -> None:
    with DatabaseWriter.open_for_model(db, "m.obj") as writer:
        staged = writer.begin(stage)
        for name, data in files.items():
            staged.put(name, data)
        staged.commit({stage: StageRecord(1, {}, {}, staged.pending())})


FILES = {f"www/{i:02}": b"1" for i in range(20)}


@pytest.mark.usefixtures("short")
def test_a_commit_replaces_the_lists_that_changed(tmp_path: Path) -> None:
    write(tmp_path, FILES)
    before = files_below(tmp_path)
    listed = {name for name in before if name.startswith(LISTS)}
    assert len(listed) > 2
    assert all(name == list_file(sha256(before[name])) for name in listed)
    for name in listed:
        schemas.check(json.loads(before[name]), schemas.FILES)
    write(tmp_path, {"stages/x": b"x"}, "pvs")
    changed = {name: data for name, data in FILES.items() if name != "www/03"} | {"www/07": b"2"}
    write(tmp_path, changed)
    after = files_below(tmp_path)
    now = {name for name in after if name.startswith(LISTS)}
    assert 1 <= len(now - listed) <= 2
    assert 1 <= len(listed - now) <= 2
    assert set(after) - now == {MANIFEST, "stages/x", *changed}
    manifest = DatabaseFolder.open(tmp_path).manifest
    assert manifest.files() == {
        name: sha256(data) for name, data in after.items() if name != MANIFEST
    }
    write(tmp_path, {"www/00": b"1"})
    assert set(files_below(tmp_path)) == {MANIFEST, "stages/x", "www/00"}


@pytest.mark.usefixtures("short")
def test_other_stages_read_no_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, FILES)
    write(tmp_path, {"stages/x": b"x"}, "pvs")
    monkeypatch.setattr(folder, "read_list", lambda *_, **__: pytest.fail("a list was read"))
    with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
        staged = writer.begin("pvs")
        staged.put("stages/x", b"another")
        staged.commit({"pvs": StageRecord(1, {}, {}, staged.pending())})


def test_a_staged_file_of_another_run_stays_out(tmp_path: Path) -> None:
    """A task that has finished before the input changed back."""
    write(tmp_path, {"www/a": b"old", "www/b": b"b"})

    def stopped() -> None:
        with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
            staged = writer.begin("cells")
            staged.put("www/a", b"new")
            staged.finish("a", ["www/a"])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    write(tmp_path, {"www/a": b"old", "www/b": b"c"})
    db = DatabaseFolder.open(tmp_path)
    assert (tmp_path / "www/a").read_bytes() == b"old"
    assert db.first_damage(db.record("cells").outputs) is None


@pytest.mark.usefixtures("short")
def test_a_commit_without_its_lists_is_dropped(tmp_path: Path) -> None:
    write(tmp_path, FILES)
    write(tmp_path, {**FILES, "www/00": b"2"})
    after = files_below(tmp_path)
    staged = tmp_path / ".ptm-new/cells"
    staged.mkdir(parents=True)
    (staged / MANIFEST).write_bytes(after[MANIFEST].replace(b'"cells"', b'"pvs"'))
    for name in after:
        if name.startswith(LISTS):
            (tmp_path / name).unlink()
    with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
        assert list(writer.manifest.lost) == ["cells"]
    assert not (tmp_path / ".ptm-new").exists()
    write(tmp_path, FILES)


@pytest.mark.usefixtures("short")
def test_a_list_that_is_none_of_outputs(tmp_path: Path) -> None:
    """With the right digest: --force drops its stage."""
    write(tmp_path, FILES)
    text = (tmp_path / MANIFEST).read_text()
    bad = b'{"format": "ptmtools file list", "schema": 1, "files": {"../x": "' + b"ab" * 32 + b'"}}'
    (tmp_path / list_file(sha256(bad))).write_bytes(bad)
    first = json.loads(text)["stages"]["cells"]["outputs"][0]
    (tmp_path / MANIFEST).write_text(text.replace(first, sha256(bad)))
    with pytest.raises(DatabaseError, match="PTM-D002"):
        write(tmp_path, FILES)
    with DatabaseWriter.open_for_model(tmp_path, "m.obj", force=True) as writer:
        assert list(writer.manifest.lost) == ["cells"]
        staged = writer.begin("cells")
        staged.put("www/00", b"1")
        staged.commit({"cells": StageRecord(1, {}, {}, staged.pending())})
    assert set(DatabaseFolder.open(tmp_path).manifest.files()) == {"www/00"}


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("damage", [Path.unlink, lambda file: file.write_bytes(b"{}")])
def test_a_stage_without_its_list_has_not_run(tmp_path: Path, damage: object) -> None:
    write(tmp_path, FILES)
    write(tmp_path, {"stages/x": b"x"}, "pvs")
    lost = min((tmp_path / LISTS).iterdir())
    assert callable(damage)
    damage(lost)
    with pytest.raises(DatabaseError, match=r"PTM-D00[56]"):
        DatabaseFolder.open(tmp_path).manifest.files()
    with DatabaseWriter.open_for_model(tmp_path, "m.obj") as writer:
        assert writer.manifest.lost == {"cells": f"{LISTS}/{lost.name}"}
        assert list(writer.manifest.stages) == ["pvs"]
    write(tmp_path, FILES)
    assert set(DatabaseFolder.open(tmp_path).manifest.outputs()) == {*FILES, "stages/x"}
