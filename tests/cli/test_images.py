"""`ptm encode`, `decode`, `info` and `compare`: which files are meant, and where results go."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.texture import (
    Description,
    EncodeOptions,
    build_pyramid,
    decode,
    encode,
    load_image,
    open as open_ptm,
    read_header,
    write_image,
)
from ptmtools.texture.images.png import png_bytes

RGB = np.random.default_rng(8).integers(0, 256, (21, 34, 3), np.uint8)
RAW = EncodeOptions("raw")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("a.png", "b.PNG", "sub/c.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(png_bytes(RGB))
    (tmp_path / "notes.txt").write_text("no image")
    return tmp_path


@pytest.fixture
def through(
    monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]
) -> Callable[..., tuple[int, bytes, str]]:
    """``through(data, "encode", "-")``: status, stdout and stderr, given stdin."""

    def run(data: bytes, *arguments: str) -> tuple[int, bytes, str]:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
        status = main(arguments)
        out, err = capfdbinary.readouterr()
        return status, out, err.decode()

    return run


@pytest.mark.parametrize(
    ("named", "made"),
    [
        (["a.png"], ["a.ptm"]),
        (["*.png"], ["a.ptm"]),
        (["?.[pP]*"], ["a.ptm", "b.ptm"]),
        (["**/*.png"], ["a.ptm", "sub/c.ptm"]),
        (["."], ["a.ptm", "b.ptm"]),
        (["sub", "a.png"], ["a.ptm", "sub/c.ptm"]),
    ],
)
def test_which_images_are_meant(named: list[str], made: list[str], folder: Path) -> None:
    assert main(["-q", "encode", *named, "--profile", "raw", "-j", "2"]) == 0
    actual = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.ptm"))
    assert actual == made
    for name in made:
        np.testing.assert_array_equal(decode(folder / name), RGB)


def test_a_name_with_brackets_is_a_name(folder: Path) -> None:
    (folder / "a.png").rename("a[b].png")
    assert main(["-q", "encode", "a[b].png", "--profile", "raw"]) == 0
    assert Path("a[b].ptm").exists()


def test_good_images_are_encoded_in_spite_of_bad_ones(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "aa.png").write_bytes(b"nonsense")
    (folder / "b.ptm").write_bytes(b"mine")
    assert main(["encode", "absent.png", ".", "--profile", "raw"]) == 3
    out, err = capsys.readouterr()
    assert [line[-10:] for line in err.splitlines()] == ["[PTM-I120]", "[PTM-I125]", "[PTM-O001]"]
    assert [line.partition(":")[0] for line in out.splitlines()] == ["a.ptm"]
    assert (folder / "b.ptm").read_bytes() == b"mine"
    assert main(["-q", "encode", "b.PNG", "aa.png", "--profile", "raw"]) == 4
    assert sorted(path.name for path in folder.iterdir() if path.name.startswith(".")) == []


def test_each_file_once_and_none_over_another(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("a.tga").write_bytes(Path("a.png").read_bytes())
    assert main(["encode", ".", "sub/c.png", "./sub/../sub/c.png", "--profile", "raw"]) == 4
    out, err = capsys.readouterr()
    assert [line.partition(":")[0] for line in out.splitlines()] == ["b.ptm", "sub/c.ptm"]
    (line,) = err.splitlines()
    assert line.startswith("ptm: a.ptm: ./a.png and ./a.tga would both")
    assert line.endswith("[PTM-O101]")
    assert not Path("a.ptm").exists()
    assert main(["-q", "encode", "a.png", "./a.png", "-o", "x.ptm", "--profile", "raw"]) == 0
    Path("linked").symlink_to("sub")
    Path("d.png").symlink_to("a.png")
    named = ["sub/c.png", "linked/c.png", "d.png"]
    assert main(["encode", *named, "--profile", "raw", "--force"]) == 0
    out = capsys.readouterr().out
    assert [line.partition(":")[0] for line in out.splitlines()] == ["sub/c.ptm", "d.ptm"]


@pytest.mark.parametrize(
    ("named", "output", "made"),
    [
        (["*.png"], "new", ["new/a.ptm"]),
        (["sub/*.png", "a.png"], "new", ["new/a.ptm", "new/c.ptm"]),
        (["."], "new/deep", ["new/deep/a.ptm", "new/deep/b.ptm"]),
        (["a.png"], "new/", ["new/a.ptm"]),
        (["a.png"], "sub", ["sub/a.ptm"]),
        (["a.png"], "new", ["new"]),
        (["?.png"], "x.ptm", ["x.ptm"]),
        (["a.png", "b.PNG"], "x.ptm/", ["x.ptm/a.ptm", "x.ptm/b.ptm"]),
    ],
)
def test_where_results_go(named: list[str], output: str, made: list[str], folder: Path) -> None:
    before = set(folder.rglob("*"))
    assert main(["-q", "encode", *named, "-o", output, "--profile", "raw"]) == 0
    actual = {path for path in folder.rglob("*") if path.is_file()} - before
    assert sorted(path.relative_to(folder).as_posix() for path in actual) == made
    # And back, the same way.
    if made != ["new"]:
        assert main(["-q", "decode", *made, "-o", "back/"]) == 0
        names = sorted(path.stem for path in Path("back").iterdir())
        assert names == [Path(name).stem for name in made]


def test_a_folder_is_made_only_where_one_is_meant(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["encode", "a.png", "b.PNG", "-o", "x.ptm"]) == 2
    assert "x.ptm is one file, but there are 2 to write" in capsys.readouterr().err
    assert main(["encode", "a.png", "b.PNG", "-o", "notes.txt"]) == 2
    assert main(["encode", "a.png", "-o", "notes.txt/"]) == 2
    assert "is a file, not a folder" in capsys.readouterr().err
    assert main(["encode", "a.png", "-o", "absent/x.ptm"]) == 4
    assert main(["encode", "no*.png", "-o", "absent"]) == 3
    assert not Path("absent").exists()


def test_what_exists_is_skipped_if_asked_for(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    encoding = ["encode", ".", "-o", "new", "--profile", "raw"]
    Path("new").mkdir()
    Path("new/a.ptm").write_bytes(encode(RGB, RAW))
    assert main(encoding) == 4
    Path("new/b.ptm").unlink()
    capsys.readouterr()
    assert main([*encoding, "--skip-existing"]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first == "new/a.ptm: exists and was skipped"
    assert second.startswith("new/b.ptm: 5 levels")
    for skipped in (False, True):
        assert main(["decode", "new", "--skip-existing", "--json"]) == 0
        reports = json.loads(capsys.readouterr().out)
        assert [report["skipped"] for report in reports] == [skipped, skipped]
    assert main([*encoding, "--skip-existing", "--force"]) == 2


def test_sizes_are_printed_beside_those_of_the_input(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image = Image.fromarray(np.tile(RGB, (4, 4, 1)))
    for name, options in {
        "l.jpg": {"quality": 30},
        "m.webp": {"quality": 30},
        "n.webp": {"lossless": True},
        "o.webp": {"quality": 30, "exif": b"Exif\0\0"},
        "p.tif": {"compression": "jpeg"},
    }.items():
        image.save(name, **options)
    assert main(["encode", "l.jpg", "a.png", "-o", "new"]) == 0
    first, second, hint = capsys.readouterr().out.splitlines()
    stored, given = os.path.getsize("new/l.ptm"), os.path.getsize("l.jpg")
    assert first.endswith(f", {stored / given:.1f} times the size of l.jpg ({given / 1000:.1f} kB)")
    assert f"% of the size of a.png ({os.path.getsize('a.png') / 1000:.1f} kB)" in second
    assert hint.startswith("hint: JPEG files discard detail")
    assert "--max-error 4" in hint
    assert main(["encode", "a.png", "n.webp", "-o", "new", "--force"]) == 0
    assert main(["encode", "l.jpg", "-o", "new", "--force", "--max-error", "1"]) == 0
    assert "hint" not in capsys.readouterr().out
    assert main(["encode", ".", "-o", "new", "--json", "--profile", "raw", "--force"]) == 0
    reports = json.loads(capsys.readouterr().out)
    assert {os.path.basename(one["image"]): one["lossy"] for one in reports} == {
        "a.png": None,
        "b.PNG": None,
        "l.jpg": "JPEG",
        "m.webp": "WebP",
        "n.webp": None,
        "o.webp": "WebP",
        "p.tif": "JPEG in TIFF",
    }
    assert [one["image_bytes"] for one in reports] == [
        os.path.getsize(one["image"]) for one in reports
    ]


@pytest.mark.parametrize(
    ("side", "note"),
    [
        (10, "finest within --max-side 10 is 8 x 5; the next, 17 x 10, would add about 4"),
        (17, None),
        (34, None),
        (99, None),
        (1, "all levels exceed --max-side 1; the coarsest, 2 x 1, is kept"),
    ],
)
def test_the_side_that_was_chosen(
    side: int, note: str | None, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["encode", "a.png", "--profile", "raw", "--max-side", str(side)]) == 0
    _, *notes = capsys.readouterr().out.splitlines()
    assert (note in notes[0]) if note else not notes


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs terminals")
@pytest.mark.parametrize("both", [True, False])
def test_results_stand_above_the_progress_bar(both: bool, folder: Path) -> None:
    """On a terminal each has a line of its own; a file gets the results and nothing else."""
    outer, inner = os.openpty()
    with open("out.txt", "wb") as file:
        run = subprocess.Popen(
            [sys.executable, "-m", "ptmtools", "encode", ".", "--profile", "raw", "-j1"],
            stdout=inner if both else file,
            stderr=inner,
            env=os.environ | {"COLUMNS": "300", "TERM": "xterm"},
        )
        os.close(inner)
        shown = b""
        with contextlib.suppress(OSError):  # the end of a terminal, on Linux
            while part := os.read(outer, 1 << 16):
                shown += part
        assert run.wait() == 0
    os.close(outer)
    # What remains of each line once the terminal has obeyed.
    lines = [
        re.split(rb"\r|\x1b\[[0-9?]*[KAhl]", line.strip(b"\r"))[-1] for line in shown.split(b"\n")
    ]
    results = [line.split(b":")[0] for line in lines if b" levels" in line]
    assert b"files" in shown
    assert results == ([b"a.ptm", b"b.ptm"] if both else [])
    names = [line.split(b":")[0] for line in Path("out.txt").read_bytes().splitlines()]
    assert names == ([] if both else [b"a.ptm", b"b.ptm"])


def test_a_name_that_is_empty_does_not_stop_the_others(folder: Path) -> None:
    assert main(["-q", "encode", "", "a.png", "--profile", "raw"]) == 3
    np.testing.assert_array_equal(decode("a.ptm"), RGB)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes that have a name")
def test_pipes_are_as_standard_input(folder: Path, through: Callable[..., Any]) -> None:
    os.mkfifo("pipe")

    def piped(data: bytes, *arguments: str) -> tuple[int, bytes, str]:
        writer = threading.Thread(target=Path("pipe").write_bytes, args=[data], daemon=True)
        writer.start()
        actual = through(b"", *arguments)
        writer.join()
        return actual

    status, data, err = piped(png_bytes(RGB), "encode", "pipe", "--profile", "raw")
    assert (status, data) == (0, encode(RGB, RAW))
    assert err.startswith("-: 5 levels")
    assert piped(data, "decode", "pipe", "-q") == (0, png_bytes(RGB), "")
    assert piped(data, "decode", "pipe", "-q", "-o", "x.png") == (0, b"", "")
    np.testing.assert_array_equal(load_image("x.png").array(), RGB)
    status, report, _ = piped(data, "info", "pipe", "--json")
    assert (status, json.loads(report)["whole_levels"]) == (0, 5)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
@pytest.mark.parametrize("arguments", [["encode", "a.png"], ["decode", "a.ptm"]])
def test_standard_output_is_full(arguments: list[str], folder: Path) -> None:
    (folder / "a.ptm").write_bytes(encode(RGB, RAW))
    script = Path(sys.executable).with_name("ptm")
    with open("/dev/full", "wb") as full:
        run = subprocess.run(
            [script, *arguments, "-o", "-"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    (line,) = run.stderr.splitlines()
    assert line.startswith("ptm: standard output: ")
    assert line.endswith("[PTM-O003]")
    assert run.returncode == 4


def test_stdin_and_stdout(folder: Path, through: Callable[..., Any]) -> None:
    status, data, err = through(png_bytes(RGB), "encode", "-", "--profile", "raw")
    assert (status, data) == (0, encode(RGB, RAW))
    assert err.startswith("-: 5 levels")
    assert through(data, "decode", "-", "-q") == (0, png_bytes(RGB), "")
    status, actual, _ = through(data, "decode", "-", "--level", "2", "-o", "-")
    np.testing.assert_array_equal(load_image(actual).array(), build_pyramid(RGB)[2])
    assert through(data, "decode", "-", "-o", "x.png", "-q") == (0, b"", "")
    np.testing.assert_array_equal(load_image("x.png").array(), RGB)
    (folder / "a.ptm").write_bytes(data)
    assert through(b"", "decode", "a.ptm", "-o", "-", "-q") == (0, png_bytes(RGB), "")
    status, report, _ = through(data, "info", "-", "--json")
    assert json.loads(report)["whole_levels"] == 5
    status, _, err = through(b"", "encode", "-")
    assert (status, err[:7], err.strip()[-10:]) == (3, "ptm: -:", "[PTM-I125]")


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float16", "float32"])
def test_the_suffix_follows_the_samples(kind: str, folder: Path) -> None:
    texels = RGB.astype(kind)
    (folder / "x.ptm").write_bytes(encode(texels, RAW))
    assert main(["-q", "decode", "x.ptm"]) == 0
    made = "x.npy" if kind.startswith("f") else "x.png"
    actual = load_image(made).array()
    assert actual.dtype == texels.dtype
    np.testing.assert_array_equal(actual, texels)
    assert main(["-q", "encode", made, "--profile", "raw", "-o", "y.ptm"]) == 0
    assert (folder / "y.ptm").read_bytes() == (folder / "x.ptm").read_bytes()


def test_decoding_several_into_a_folder(folder: Path) -> None:
    for name in ("a", "sub/c"):
        (folder / f"{name}.ptm").write_bytes(encode(RGB, RAW))
    (folder / "out").mkdir()
    assert main(["-q", "decode", "**/*.ptm", "-o", "out", "--level", "3", "-j", "2"]) == 0
    assert sorted(path.name for path in (folder / "out").iterdir()) == ["a.png", "c.png"]
    np.testing.assert_array_equal(load_image("out/c.png").array(), build_pyramid(RGB)[3])
    assert main(["-q", "decode", "a.ptm", "sub/c.ptm", "-o", "x.png"]) == 2


def test_a_window(folder: Path) -> None:
    (folder / "a.ptm").write_bytes(encode(np.tile(RGB, (9, 9, 1)), EncodeOptions("raw", tile=32)))
    assert main(["-q", "decode", "a.ptm", "--window", "30,7,50,41", "-o", "w.png"]) == 0
    wanted = np.tile(RGB, (9, 9, 1))[7:48, 30:80]
    np.testing.assert_array_equal(load_image("w.png").array(), wanted)
    assert (
        main(["-q", "decode", "a.ptm", "--level", "2", "--window", "1,2,3,1", "-o", "v.npy"]) == 0
    )
    np.testing.assert_array_equal(np.load("v.npy"), decode("a.ptm", 2)[2:3, 1:4])


def test_colour_and_orientation_come_back(folder: Path) -> None:
    printed = Description(b"a profile", None, 45455, None, 6)
    (folder / "x.png").write_bytes(png_bytes(RGB, printed))
    assert main(["-q", "encode", "x.png", "--profile", "raw"]) == 0
    assert main(["-q", "decode", "x.ptm", "-o", "y.png"]) == 0
    picture = load_image("y.png")
    assert picture.description == printed
    np.testing.assert_array_equal(picture.array(), RGB)
    assert main(["-q", "encode", "x.png", "--profile", "raw", "--orient", "--force"]) == 0
    with open_ptm("x.ptm") as ptm:
        assert ptm.description().orientation == 1
        assert ptm.description().icc == b"a profile"
        np.testing.assert_array_equal(ptm.level(), np.rot90(RGB, -1))


def test_a_damaged_description_is_reported_and_left_out(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = bytearray(encode(RGB, RAW, description=Description(b"a profile", orientation=6)))
    data[data.index(b"a profile")] ^= 1
    (folder / "x.ptm").write_bytes(data)
    assert main(["decode", "x.ptm"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("ptm: x.ptm: written without colour and orientation")
    assert line.endswith("[PTM-I108]")
    picture = load_image("x.png")
    assert picture.description == Description()
    np.testing.assert_array_equal(picture.array(), RGB)
    assert main(["-q", "validate", "x.ptm"]) == 8


def test_decode_reports_as_json(folder: Path, through: Callable[..., Any]) -> None:
    (folder / "x.ptm").write_bytes(encode(RGB.astype(np.float32), RAW))
    status, out, err = through(b"", "decode", "x.ptm", "no.ptm", "--json", "--level", "3")
    assert (status, err.strip()[-10:]) == (3, "[PTM-I120]")
    assert json.loads(out) == [
        {
            "file": "x.ptm",
            "image": "x.npy",
            "skipped": False,
            "level": 3,
            "width": 17,
            "height": 10,
            "components": 3,
            "kind": "float32",
            "warning": None,
        }
    ]
    data = encode(RGB, RAW)
    status, out, err = through(data[:-1], "decode", "-", "--json")
    np.testing.assert_array_equal(load_image(out).array(), build_pyramid(RGB)[3])
    assert (json.loads(err)[0]["image"], json.loads(err)[0]["level"]) == ("-", 3)


def test_info_counts(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = Description(b"a profile", 1, 45455, None, 6)
    texels = np.tile(RGB, (3, 3, 1)).astype(np.uint16)
    data = encode(texels, EncodeOptions("raw", tile=16, max_level=-2), description=printed)
    header = read_header(data)
    (folder / "x.ptm").write_bytes(data[: header.levels[-1].end - 1])
    assert main(["info", "x.ptm", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["width"], report["kind"], report["profile"], report["trimmed"]) == (
        102,
        "uint16",
        "raw",
        1,
    )
    assert report["description"] == {
        "icc_bytes": 9,
        "srgb_intent": 1,
        "gamma": 0.45455,
        "orientation": 6,
    }
    assert report["whole_levels"] == len(header.levels) - 1
    assert report["file_bytes"] == len(data) - 1
    finest, one = report["levels"][-1], report["levels"][0]
    assert finest["tiles"] == [3, 1]
    assert finest["length"] == header.levels[-1].length
    assert finest["bits_per_texel"] == 8 * finest["length"] / (51 * 31)
    assert finest["end"] == header.levels[-1].end
    assert sum(level["length"] for level in report["levels"]) <= header.file_size
    assert (one["gpu_bytes"], one["gpu_bytes_padded"]) == (3 * 1 * 6, 3 * 1 * 8)
    assert finest["gpu_bytes_padded"] * 3 == finest["gpu_bytes"] * 4
    assert main(["info", "x.ptm"]) == 0
    out = capsys.readouterr().out
    assert "1 finer level omitted" in out
    assert out.splitlines()[-1].endswith("cut off")
    assert "orientation 6" in out


def test_info_reads_the_head_only(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = encode(RGB, RAW)
    damaged = data[: read_header(data).levels[0].offset] + b"\xff" * 999
    (folder / "x.ptm").write_bytes(damaged)
    assert main(["info", "x.ptm"]) == 0
    assert "34 x 21" in capsys.readouterr().out


def test_compare(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "a.png", "b.PNG", "--profiles", "raw", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [image["image"] for image in report["images"]] == ["a.png", "b.PNG"]
    by_name = {one["codec"]: one for one in report["images"][0]["codecs"]}
    assert by_name["ptm raw"]["all_bytes"] == len(encode(RGB, RAW))
    assert by_name["ptm raw"]["finest_bytes"] is None
    png = by_name["PNG"]
    assert png["finest_bytes"] == len(png_bytes(RGB))
    assert png["all_bytes"] == sum(len(png_bytes(level)) for level in build_pyramid(RGB))
    assert png["raw_bytes"] == RGB.size
    for one in by_name.values():
        assert one["problem"] is None or one["problem"].startswith("not installed: pip install")
    totals = {one["codec"]: one for one in report["total"]}
    assert totals["PNG"]["all_bytes"] == 2 * png["all_bytes"]
    assert main(["compare", "a.png", "b.PNG", "--profiles", "raw"]) == 0
    out = capsys.readouterr().out
    assert out.count("ptm raw") == 3
    assert "total of 2 images" in out
    assert main(["compare", "a.png", "--profiles", "raw,tiny"]) == 2


def test_compare_says_what_cannot_be(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imagecodecs", None)
    write_image("f.npy", RGB.astype(np.float32))
    assert main(["compare", "f.npy", "--profiles", "raw"]) == 0
    lines = {line[:26].strip(): line[26:] for line in capsys.readouterr().out.splitlines()}
    assert lines["JPEG XL effort 7"] == "not installed: pip install 'ptmtools[codecs]'"
    assert "does not hold 34 x 21, 3 components of float32" in lines["PNG"]
    assert "MB/s" in lines["ptm raw"]
