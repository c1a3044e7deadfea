"""First-look bundles: prefixes of the textures, most valuable first."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import InputError
from ptmtools.output import EmitOptions, TextureRecord, emit
from ptmtools.output.content import Content
from ptmtools.output.first_look import FirstLooks, steps_of
from ptmtools.texture import decode_levels, open as open_ptm
from ptmtools.texture.detail import Detail
from ptmtools.texture.model import Level


def made_up(lengths: list[int], differences: list[float]) -> TextureRecord:
    """A texture whose levels have these lengths and differences, sides 1, 2, 4…"""
    ends = np.cumsum(lengths).tolist()
    levels = tuple(
        Level(1 << n, 1 << n, end - length, length, 0, (1, 1), 0)
        for n, (end, length) in enumerate(zip(ends, lengths, strict=True))
    )
    detail = Detail((0.0, *differences[1:]), (0, 0, 0))
    side = levels[-1].width
    return TextureRecord(
        0, "a.ptm", None, side, side, 3, levels, "", detail=detail, stored=Path("a.ptm")
    )


levels_of = st.lists(
    st.tuples(st.integers(1, 1000), st.sampled_from([0.0, 0.5, 2.0, 3.0, 40.0])),
    min_size=1,
    max_size=8,
)


@given(levels_of, st.sampled_from([1, 2, 8, 128]))
def test_steps_lead_to_the_finest_level_and_bring_less_and_less(
    levels: list[tuple[int, float]], side: int
) -> None:
    lengths, differences = (list(column) for column in zip(*levels, strict=True))
    record = made_up(lengths, differences)
    steps = steps_of(record, side)
    offered = [n for n, level in enumerate(record.levels) if level.width <= side]
    assert steps[-1].level == offered[-1]
    assert steps[0].start == 0
    assert all(one.end == other.start for one, other in itertools.pairwise(steps))
    assert all(step.end == record.levels[step.level].end for step in steps)
    worth = [step.gain / (step.end - step.start) for step in steps]
    assert all(one > other for one, other in itertools.pairwise(worth))
    # None of the levels that are passed over lies above the hull.
    for n in offered:
        (step,) = (s for s in steps if s.start < record.levels[n].end <= s.end)
        before = sum(s.gain for s in steps if s.end <= step.start)
        share = (record.levels[n].end - step.start) / (step.end - step.start)
        assert sum(differences[1 : n + 1]) <= before + share * step.gain + 1e-9


def content_of(artifacts, records: tuple[TextureRecord, ...], side: int, ach=None) -> Content:
    a = artifacts
    options = EmitOptions(first_look=side)
    return Content(a.scene, a.cells, a.pvs, ach or a.ach, records, options=options)


@pytest.mark.parametrize("side", [0, 2, 4, 9, 64])
def test_a_bundle_is_made_of_prefixes(artifacts, tmp_path: Path, put_textures, side: int) -> None:
    a, records = artifacts, put_textures(tmp_path)
    emit(a.scene, a.cells, a.pvs, a.ach, records, tmp_path, EmitOptions(first_look=side))
    index = json.loads((tmp_path / "hints.json").read_text())
    assert index.get("firstLook") == ("hints/{name}.bin" if side else None)
    bundles = sorted(file.name for file in tmp_path.glob("hints/*.bin"))
    assert bundles == [f"{cell['name']}.bin" for cell in index["cells"] if side]
    for name in bundles:
        record = json.loads((tmp_path / "hints" / name).with_suffix(".json").read_text())
        data = (tmp_path / "hints" / name).read_bytes()
        held, at = {}, 0
        for texture, level in record["firstLook"]:
            had = held.setdefault(texture, b"")
            length = index["textures"][texture]["ends"][level] - len(had)
            held[texture] = had + data[at : at + length]
            at += length
        assert at == len(data)
        assert set(held) == {texture for row in record["textures"] for texture in row}
        for texture, prefix in held.items():
            row = index["textures"][texture]
            whole = (tmp_path / row["file"]).read_bytes()
            assert whole.startswith(prefix)
            levels = list(decode_levels(prefix))
            with open_ptm(whole) as ptm:
                sides = [max(level.width, level.height) for level in ptm.header.levels]
            assert len(levels) == sum(s <= side for s in sides)


def value_at(content: Content, cell: int, share: dict[int, float], taken: int) -> float:
    """How much less the view is off with so many pieces of a bundle."""
    total = 0.0
    for piece in FirstLooks(content).pieces(cell)[:taken]:
        differences = content.textures[piece.texture].detail.differences
        ends = [0, *(level.end for level in content.textures[piece.texture].levels)]
        gain = sum(differences[ends.index(piece.start) : piece.level + 1])
        total += share[piece.texture] * gain
    return total


def test_what_is_worth_more_comes_first(artifacts, tmp_path: Path, put_textures) -> None:
    """By the shares of textures where they were measured; each byte brings less than the one
    before."""
    options = AchOptions(samples=32, face=8, backend="embree", per_texture=True)
    ach = compute_ach(artifacts.scene, artifacts.cells, artifacts.pvs, options)
    differences = ((0, 40, 1, 0.5, 0.2), (0, 5, 9))
    records = tuple(
        replace(record, detail=Detail(tuple(map(float, each)), (0, 0, 0)))
        for record, each in zip(put_textures(tmp_path), differences, strict=True)
    )
    content = content_of(artifacts, records, 64, ach)
    for cell in range(3):
        entries = range(*ach.texture_start[ach.start[cell : cell + 2]].tolist())
        share = dict.fromkeys(range(2), 0.0)
        for e in entries:
            if ach.texture[e] >= 0:
                share[int(ach.texture[e])] += float(ach.texture_value[e])
        pieces = FirstLooks(content).pieces(cell)
        assert len(pieces) > 2
        values = [value_at(content, cell, share, n) for n in range(len(pieces) + 1)]
        lengths = [p.end - p.start for p in pieces]
        slopes = np.diff(values) / lengths
        assert (np.diff(slopes) <= 1e-12).all()


def test_without_measured_shares_surfaces_share_by_area(artifacts, tmp_path, put_textures) -> None:
    records = put_textures(tmp_path)
    content = content_of(artifacts, records, 64)
    geometry = content.geometry
    scene_area = np.array(
        [
            sum(
                np.linalg.norm(
                    np.cross(*(geometry.point[s.point[t[1:]]] - geometry.point[s.point[t[0]]]))
                )
                / 2
                for t in s.triangle
            )
            for s in map(geometry.shape, range(len(geometry.object)))
        ]
    )
    assert geometry.areas() == pytest.approx(scene_area, rel=1e-5)
    looks = FirstLooks(content)
    for cell in range(3):
        wanted = {0: 0.0, 1: 0.0}
        for other, value in zip(
            content.pvs.row(cell).tolist(), content.ach.row(cell).tolist(), strict=True
        ):
            own = slice(*geometry.cell_start[other : other + 2].tolist())
            for texture in wanted:
                area = scene_area[own][content.paint[own] == texture].sum()
                wanted[texture] += value * area / scene_area[own].sum()
        assert looks._shares(cell) == pytest.approx(wanted, rel=1e-5)


def test_textures_that_are_not_at_hand_are_left_out(artifacts, tmp_path, put_textures) -> None:
    records = tuple(replace(r, stored=None) for r in put_textures(tmp_path))
    content = content_of(artifacts, records, 64)
    assert FirstLooks(content).pieces(0) == []


def test_a_negative_side_is_refused() -> None:
    with pytest.raises(InputError, match="--first-look -1 is below 0"):
        EmitOptions(first_look=-1)
