"""The published schemas: what we write satisfies them; our reader and jsonschema agree."""

from __future__ import annotations

import copy
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.diagnostics import CODES, FOLDER_CODES
from ptmtools.output.model import FileError
from ptmtools.output.validation.hints import read_file
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.manifest import FORMAT, SCHEMA, Manifest, StageRecord
from ptmtools_lab.schemas import CAMPUS_WALK

Step = str | int

DOCS = Path(__file__).parents[2] / "docs"
#: Those of the hints, and a file of each.
SERVED = {
    schemas.HINTS: "hints.json",
    schemas.CELL: "hints/c0001.json",
    schemas.STATISTICS: "hints/statistics.json",
}
NAMES = (*SERVED, schemas.MANIFEST, schemas.VALIDATION, schemas.TRACE, CAMPUS_WALK)


def validator(name: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(json.loads(schemas.schema_text(name)))


@pytest.fixture(scope="module")
def served(finished: Path) -> dict[str, dict[str, Any]]:
    """By schema; the index and the record with optional fields that no other database here has."""
    actual = {n: json.loads((finished / "www" / file).read_text()) for n, file in SERVED.items()}
    cube = {"low": [0.5, 0, -1], "side": 2}
    octree = {"object": "a", "file": "apo/a.bin", "cube": cube, "levels": [2, 8]}
    actual[schemas.HINTS]["octrees"] = [octree | {"ends": [16, 90], "crc32": [0, 1]}]
    record = actual[schemas.CELL]
    record["need"] = [[0, 1, 0.25, 0.125]]
    record["textureShares"] = [[[0, record["ach"][0]]], [[None, record["ach"][1]]], []]
    return actual


@pytest.fixture(scope="module")
def manifest() -> dict[str, Any]:
    record = StageRecord(
        2,
        {"wall_area": 2.0},
        {"rooms.obj": "0" * 64, "gone.png": ""},
        {"stages/scene.npz": "f" * 64, "www/textures/a ä.png": "1" * 64},
        {"cells": 3},
        ("open above",),
    )
    return json.loads(Manifest("rooms.obj", {"scene": record, "emit": record}).to_bytes())


@pytest.fixture(scope="module")
def report() -> dict[str, Any]:
    return {
        "format": "ptmtools validation",
        "schema": 1,
        "target": "rooms.db",
        "ok": False,
        "counts": {"files": 1, "bytes": 2, "errors": 3, "warnings": 4},
        "issues": [
            {
                "code": "PTM-D650",
                "severity": "error",
                "file": "manifest.json",
                "place": "",
                "message": "missing",
                "count": 1,
            }
        ],
        "segments": {
            "tried": 9,
            "unoccluded": 8,
            "hairlines": 1,
            "missed": [
                {"cells": [0, 1], "start": [0, 0, 0], "end": [1.5, 0, 0], "segments": 1},
            ],
        },
    }


CAMPUS_WALK = {
    "format": "ptmtools campus walk",
    "schema": 1,
    "campus": "campus",
    "seconds": 40.0,
    "runs": [
        {
            "preset": "Low",
            "bandwidth": None,
            "begun": 1.5,
            "memory": {"start": 10, "most": 20},
            "bytes": 30,
            "overheadBytes": 4,
            "requests": 5,
            "idle": 0.5,
            "pauses": 1,
            "late": 0.25,
            "delay": None,
            "shown": 0,
            "never": 2,
            "reused": 1.0,
            "e": None,
        }
    ],
}
TRACE = {
    "format": "ptmtools trace",
    "schema": 1,
    "steps": [{"seconds": 2, "bandwidth": 5e5, "latency": 0.1, "loss": 0.01}, {"seconds": 0.5}],
}


@pytest.mark.parametrize("name", NAMES)
def test_schemas_are_schemas(name: str) -> None:
    schema = json.loads(schemas.schema_text(name))
    jsonschema.Draft202012Validator.check_schema(schema)
    stem = name.split(":")[-1]
    assert f"{stem}.schema.json" in (DOCS / "formats/schemas.md").read_text()
    assert schema["$id"] == f"urn:ptmtools:{stem}:{schema['properties']['schema']['const']}"


@pytest.mark.parametrize("name", SERVED)
def test_every_field_of_the_hints_is_described(name: str) -> None:
    schema = json.loads(schemas.schema_text(name))
    page = (DOCS / "formats/hints.md").read_text()
    objects = [schema, *(d for d in schema["$defs"].values() if d.get("type") == "object")]
    for parent in objects:
        for field, form in parent["properties"].items():
            assert re.search(rf"`[^`\n]*\b{field}\b[^`\n]*`", page), field
            if form.get("type") in ("number", "integer"):
                assert "description" in form, field


def shape_fault(document: object, name: str) -> str:
    try:
        schemas.check(document, name)
    except schemas.ShapeError as fault:
        return str(fault) or "something"
    return ""


def test_what_we_write_satisfies_them(served, manifest, report) -> None:
    for name, document in zip(
        NAMES, (*served.values(), manifest, report, TRACE, CAMPUS_WALK), strict=True
    ):
        validator(name).validate(document)
        assert shape_fault(document, name) == ""


def test_the_schema_of_the_manifest_is_that_of_its_reader(manifest) -> None:
    schema = json.loads(schemas.schema_text(schemas.MANIFEST))
    assert schema["properties"]["format"]["const"] == FORMAT
    assert schema["properties"]["schema"]["const"] == SCHEMA
    names = re.compile(schema["properties"]["stages"]["propertyNames"]["pattern"])
    assert all(map(names.fullmatch, STAGES))
    for document, _ in mutations(manifest):
        if shape_fault(document, schemas.MANIFEST) == "":
            Manifest.from_bytes(json.dumps(document).encode(), file="manifest.json")


def places(value: object, path: tuple[Step, ...] = ()) -> Iterator[tuple[Step, ...]]:
    """Every kind of place in a document: of a list the first entry stands for all."""
    yield path
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from places(inner, (*path, name))
    if isinstance(value, list) and value:
        yield from places(value[0], (*path, 0))


def at(document: Any, path: tuple[Step, ...]) -> Any:
    for step in path:
        document = document[step]
    return document


GONE = object()
#: What may come to stand in the place of a value.
OTHERS: tuple[object, ...] = (
    *(GONE, None, True, False, 0, 1, -1, 3, 2**70, 0.5, -0.5, 1.5, 3.2, "", "a", "0" * 64),
    *([], [0], [None], [0.5] * 3, ["a"], [[]], [{}], {}, {"a": 1}),
)


def mutations(document: Any) -> Iterator[tuple[Any, str]]:
    """The document with one value removed or replaced, and what was done."""
    for path in places(document):
        if not path:
            continue
        for other in OTHERS:
            changed = copy.copy(document)
            parent = changed
            for step in path[:-1]:
                parent[step] = copy.copy(parent[step])
                parent = parent[step]
            if other is GONE:
                del parent[path[-1]]
            else:
                parent[path[-1]] = other
            yield changed, f"{path}: {'gone' if other is GONE else repr(other)}"
        if isinstance(at(document, path), (dict, list)):
            changed = copy.deepcopy(document)
            inner = at(changed, path)
            if isinstance(inner, dict):
                inner["more"] = 1
            else:
                inner.append(inner[0] if inner else 0)
            yield changed, f"{path}: one more"


def shortened(value: Any) -> Any:
    """A document with one object in each list: jsonschema takes its time."""
    if isinstance(value, dict):
        return {name: shortened(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [
            shortened(v) for v in (value[:1] if value and isinstance(value[0], dict) else value)
        ]
    return value


@pytest.mark.parametrize("name", NAMES)
def test_our_reader_and_jsonschema_agree(name: str, served, manifest, report) -> None:
    hints = map(shortened, served.values())
    document = dict(zip(NAMES, (*hints, manifest, report, TRACE, CAMPUS_WALK), strict=True))[name]
    theirs = validator(name)
    refused = tried = 0
    for changed, what in mutations(document):
        fault = shape_fault(changed, name)
        assert theirs.is_valid(changed) == (fault == ""), f"{what}: {fault or 'is let through'}"
        refused, tried = refused + (fault != ""), tried + 1
    assert tried > 200
    assert refused > tried // 2


@pytest.mark.parametrize("name", SERVED)
def test_validate_refuses_what_the_schema_refuses(name: str, served) -> None:
    for changed, what in mutations(served[name]):
        code = ""
        try:
            read_file(SERVED[name], json.dumps(changed).encode())
        except FileError as fault:
            code = fault.code
        number = changed.get("schema") if isinstance(changed, dict) else 3
        assert code in ("", "PTM-D700" if type(number) is not int or number == 3 else "PTM-D656")
        assert code or not shape_fault(changed, name), what


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not JSON"),
        (b"\xff", "byte 0 is not UTF-8"),
        (b"\xef\xbb\xbf{}", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b'{"a": 1, "b": {"c": 1, "c": 2}}', "two fields 'c'"),
        (
            b"{" + b",".join(b'"%d":0' % (i // 2 + i % 2) for i in range(100_000)) + b"}",
            "fields '1'",
        ),
        (b"{" + b",".join(b'"%d":0' % (i % 99_999) for i in range(100_000)) + b"}", "fields '0'"),
        (b"[NaN]", "NaN is not finite"),
        (b"[-Infinity]", "not finite"),
        (b"[" + b"9" * 10_000 + b"]", "not JSON"),
        (b"[]", "a list is not of type object"),
    ],
)
def test_what_is_no_document(data: bytes, message: str) -> None:
    with pytest.raises(schemas.ShapeError, match=re.escape(message)):
        schemas.read(data, schemas.HINTS)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("unit"), "unit is missing"),
        (lambda d: d.update(unit="m"), 'unit: "m" is not of type number'),
        (lambda d: d.update(unit=0), "unit: 0 is not more than 0"),
        (lambda d: d.update(unit=math.inf), "unit: Infinity is not finite"),
        (lambda d: d.update(unit=10**400), "is not finite"),
        (lambda d: d["cells"][1]["box"].__setitem__(2, None), "cells[1].box[2]: null is not of"),
        (lambda d: d["viewpoints"][0].update(cell=1.0), "viewpoints[0].cell: 1.0 is not of type"),
        (lambda d: d["cells"][0].update(name="c0000\n"), "does not match"),
        (lambda d: d["textures"][0].update(ends={}), "ends: an object is not of type array"),
        (lambda d: d["cells"][0]["box"].pop(), "5 entries, fewer than 6"),
        (lambda d: d.update(schema=True), "schema: true is not 3"),
    ],
)
def test_faults_are_told_with_their_place(
    served, change: Callable[[dict], object], message: str
) -> None:
    changed = copy.deepcopy(served[schemas.HINTS])
    change(changed)
    assert message in shape_fault(changed, schemas.HINTS)


def test_a_keyword_that_is_not_understood_does_not_compile() -> None:
    with pytest.raises(ValueError, match="uniqueItems"):
        schemas._compile({"type": "array", "uniqueItems": True}, {})


Run = Callable[..., tuple[int, str]]


@pytest.fixture
def run(capsys) -> Run:
    """``run(*arguments)``: status and standard output of the command."""

    def run(*arguments: str) -> tuple[int, str]:
        status = main(arguments)
        return status, capsys.readouterr().out

    return run


@pytest.mark.parametrize("damaged", [False, True])
def test_the_report_of_the_command(database: Path, run: Run, damaged: bool) -> None:
    if damaged:
        (database / "www/root.wrl").write_text("#VRML V2.0 utf8\nShape { \x1b }\n")
        (database / "www/cells/notes.txt").write_text("mine")
    status, stdout = run("validate", str(database), "--json")
    document = json.loads(stdout)
    validator(schemas.VALIDATION).validate(document)
    schemas.check(document, schemas.VALIDATION)
    assert document["ok"] is (status == 0) is not damaged
    errors = sum(i["count"] for i in document["issues"] if i["severity"] == "error")
    warnings = sum(i["count"] for i in document["issues"] if i["severity"] == "warning")
    assert (document["counts"]["errors"], document["counts"]["warnings"]) == (errors, warnings)
    assert bool(errors) == bool(warnings) == damaged
    assert {i["code"] for i in document["issues"]} <= set(CODES)


def test_ok_is_what_the_exit_status_says(database: Path, run: Run) -> None:
    (database / "www/cells/notes.txt").write_text("mine")
    for options, expected in (((), 0), (("--strict",), 8)):
        status, stdout = run("validate", str(database), "--json", *options)
        assert (status, json.loads(stdout)["ok"]) == (expected, expected == 0)


def test_the_codes_of_the_command(run: Run) -> None:
    status, stdout = run("validate", "--codes")
    assert status == 0
    assert [line.split()[0] for line in stdout.splitlines()] == sorted({*CODES, *FOLDER_CODES})
