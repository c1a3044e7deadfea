"""MTL: options of texture statements, file names with blanks, tints, opacity, and misses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from ptmtools.scene.mtl import MapStatement, parse_map, read_mtl
from ptmtools.scene.notes import IngestNotes

finite = st.floats(-1e3, 1e3, allow_nan=False).map(lambda x: round(x, 4))
word = st.text(st.sampled_from("abcXYZ0123456789_ü()."), min_size=1, max_size=8)


@given(
    scale=st.none() | st.lists(finite, min_size=1, max_size=3),
    offset=st.none() | st.lists(finite, min_size=1, max_size=3),
    clamp=st.none() | st.sampled_from(["on", "off", "ON"]),
    channel=st.none() | st.sampled_from("rgbmlz"),
    harmless=st.lists(
        st.sampled_from(
            [
                "-blendu on",
                "-blendv off",
                "-bm 0.5",
                "-boost 2",
                "-texres 512",
                "-mm 0 1",
                "-cc off",
            ]
        ),
        unique=True,
    ),
    words=st.lists(word, min_size=1, max_size=3),
    order=st.randoms(use_true_random=False),
)
def test_options_come_in_any_order_before_a_name_with_blanks(
    scale, offset, clamp, channel, harmless, words, order
) -> None:
    """The name begins with a letter: a number there would belong to the option before it."""
    name = "n" + "  ".join(words)
    options = list(harmless)
    if scale is not None:
        options.append("-s " + " ".join(map(repr, scale)))
    if offset is not None:
        options.append("-o " + " ".join(map(repr, offset)))
    if clamp is not None:
        options.append(f"-clamp {clamp}")
    if channel is not None:
        options.append(f"-imfchan {channel}")
    order.shuffle(options)
    parsed = parse_map(" ".join([*options, name]) + " ", 7)

    full_scale = (*(scale or []), 1.0, 1.0)[:2]
    full_offset = (*(offset or []), 0.0, 0.0)[:2]
    if scale and len(scale) == 1:
        full_scale = (scale[0], 1.0)
    if offset and len(offset) == 1:
        full_offset = (offset[0], 0.0)
    assert parsed == MapStatement(
        file=name,
        scale=full_scale,
        offset=full_offset,
        clamp=(clamp or "off").lower() == "on",
        channel=channel or "",
        strength=0.5 if "-bm 0.5" in harmless else 1.0,
        line=7,
    )


@pytest.mark.parametrize(
    ("text", "file"),
    [
        ("-s 2 2 2 1.png", "1.png"),
        ("-s 2 2 7", "7"),
        ("-type sphere -s 1 sky map.png", "sky map.png"),
        ("-foo.png", "-foo.png"),
        (r"textures\wall 1.png", r"textures\wall 1.png"),
    ],
)
def test_where_the_name_begins(text: str, file: str) -> None:
    assert parse_map(text).file == file


@pytest.mark.parametrize("text", ["", "-s", "-s a b.png", "-clamp on", "-mm 0 b.png", "-s nan a"])
def test_what_is_not_understood(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_map(text)


def test_options_that_change_the_picture_are_named() -> None:
    assert parse_map("-cc on -t 1 1 -mm 0.1 1 a.png").ignored == ("-cc", "-mm", "-t")
    assert parse_map("-cc off -t 0 -mm 0 1 a.png").ignored == ()


@pytest.mark.parametrize(
    ("lines", "color", "dissolve"),
    [
        ("Kd 0.1 0.2 0.3", (0.1, 0.2, 0.3), 1.0),
        ("Kd 0.5", (0.5, 0.5, 0.5), 1.0),
        ("KD 2 -1 0", (1.0, 0.0, 0.0), 1.0),
        ("d 0.25", None, 0.25),
        ("d -halo 0.25", None, 0.25),
        ("Tr 0.25", None, 0.75),
        ("Tr 0.25\nd 0.5", None, 0.5),
        ("d 0.5\nTr 0.25", None, 0.5),
        ("Pr 0.5\nnorm n.png\nillum 2\nKs 1 1 1", None, 1.0),
    ],
)
def test_tint_and_opacity(
    put: Callable[..., Path], lines: str, color: tuple[float, ...] | None, dissolve: float
) -> None:
    path = put("a.mtl", "# made by hand\n\nnewmtl m\n" + lines + "\n")
    findings = IngestNotes(path)
    material = read_mtl(path, findings)["m"]
    assert (material.color, material.dissolve) == (color, dissolve)
    assert findings.entries == ()


def test_lines_not_understood_and_names_defined_twice(put: Callable[..., Path]) -> None:
    path = put("a.mtl", "newmtl m\r\nKd red\r\nd\r\nmap_Kd -s\r\nnewmtl m\r\nKd 1 1 1\r\n")
    findings = IngestNotes(path)
    assert read_mtl(path, findings)["m"].color is None
    printed = [(n.code, n.place) for n in findings.entries]
    assert printed == [
        ("PTM-N214", "a.mtl:2"),
        ("PTM-N214", "a.mtl:3"),
        ("PTM-N214", "a.mtl:4"),
        ("PTM-N208", "a.mtl:5"),
    ]
