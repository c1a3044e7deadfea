"""Traces are read from both forms, and what is wrong with one is said with its place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ptmtools import link as trace
from ptmtools.errors import InputError, LimitError
from ptmtools.link import Step, Trace, read_trace

STEPS = [
    {"seconds": 2, "bandwidth": 500_000, "latency": 0.1, "loss": 0.01},
    {"seconds": 0.5, "bandwidth": None},
    {"seconds": 1, "bandwidth": 0},
]
TRACE = Trace((Step(2, 500_000, 0.1, 0.01), Step(0.5), Step(1, 0)))


def written(path: Path, content: object) -> Path:
    if isinstance(content, list):
        content = {"format": "ptmtools trace", "schema": 1, "steps": content}
    data = content if isinstance(content, bytes) else json.dumps(content).encode()
    path.write_bytes(data)
    return path


def test_json(tmp_path: Path) -> None:
    assert read_trace(written(tmp_path / "lift.json", STEPS)) == TRACE


@pytest.mark.parametrize(
    "text",
    [
        "seconds,bandwidth,latency,loss\n2,500000,0.1,0.01\n0.5,,,\n1,0,0,0\n",
        "\ufeff loss, seconds ,latency,bandwidth\r\n.01,2,.1,5e5\r\n\r\n0,0.5,,\r\n,1,,0",
    ],
)
def test_csv(tmp_path: Path, text: str) -> None:
    assert read_trace(written(tmp_path / "lift.CSV", text.encode())) == TRACE


def test_csv_of_one_column(tmp_path: Path) -> None:
    assert read_trace(written(tmp_path / "t.csv", b"seconds\n1\n")) == Trace((Step(1.0),))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("t.json", b"seconds\n1\n", "not JSON"),
        ("t.json", b"", "not JSON"),
        ("t.json", {"steps": STEPS}, "format is missing"),
        (
            "t.json",
            {"format": "ptmtools trace", "schema": 2, "steps": STEPS},
            "schema: .*2 is not 1",
        ),
        ("t.json", [], "steps: .*0 entries, fewer than 1"),
        ("t.json", [{}], r"steps\[0\]: .*seconds is missing"),
        ("t.json", [{"seconds": 0}], r"steps\[0\].seconds: .*0 is less than 0.001"),
        ("t.json", [*STEPS, {"seconds": 1, "loss": 1}], r"steps\[3\].loss: .*1 is not less than 1"),
        ("t.json", [{"seconds": 1, "bandwidth": -1}], r"bandwidth: .*-1 is less than 0"),
        ("t.json", [{"seconds": 1, "latency": "1s"}], r'latency: .*"1s" is not of type number'),
        ("t.json", [{"seconds": 1, "bandwidth": 0}], "steps: .*the bandwidth of every step is 0"),
        ("t.csv", b"", "line 1: .*does not name the columns"),
        ("t.csv", b"bandwidth\n1\n", "line 1: .*does not name the columns"),
        ("t.csv", b"seconds,jitter\n1,1\n", "line 1: .*does not name the columns"),
        ("t.csv", b"seconds,loss,loss\n1,0,0\n", "line 1: .*does not name the columns"),
        ("t.csv", b"seconds\n", "steps: .*0 entries"),
        ("t.csv", b"seconds,loss\n1,0\n1\n", "line 3: .*1 fields for 2 columns"),
        ("t.csv", b"seconds,loss\n1,0\n\n1,x\n", "line 4: .*a field is no number"),
        ("t.csv", b"seconds\nnan\n", r"steps\[0\].seconds: .*not finite"),
        ("t.csv", b"seconds,loss\n,0.5\n", r"steps\[0\]: .*seconds is missing"),
        ("t.csv", b"seconds\n\xff\n", "not CSV"),
    ],
)
def test_what_is_no_trace(tmp_path: Path, name: str, content: object, message: str) -> None:
    file = written(tmp_path / name, content)
    with pytest.raises(InputError, match=message) as caught:
        read_trace(file)
    assert (caught.value.code, caught.value.file) == ("PTM-I710", str(file))


def test_a_trace_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace, "LARGEST", 0)
    with pytest.raises(LimitError, match=r"more than 0 MiB.*\[PTM-L204\]"):
        read_trace(written(tmp_path / "t.json", STEPS))
