"""The bytes that a client has of its files, in any order of their arrival."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, strategies as st

from ptmtools.link import Conditions
from ptmtools_lab.client import ClientFiles, FileKind, Range
from ptmtools_lab.network import FluidLink
from ptmtools_lab.policies.whole_files import LruClient
from tests.lab.worlds import catalogue, raw, standing

ACTS = st.lists(
    st.tuples(st.just("ask"), st.integers(1, 40)) | st.tuples(st.just("arrive"), st.integers(0, 9)),
    max_size=30,
)


@given(ACTS)
def test_files_against_single_bytes(acts: list[tuple[str, int]]) -> None:
    """Whole ranges count."""
    files = ClientFiles(FileKind.TEXTURE, np.array([1000, 200]))
    held = np.zeros(200, dtype=bool)
    under_way: list[Range] = []
    for act, number in acts:
        asked = int(files.asked[1])
        if act == "ask" and asked < 200:
            part = files.ask(1, min(200, asked + number))
            assert (part.kind, part.number, part.begin) == (FileKind.TEXTURE, 1, asked)
            under_way.append(part)
        elif act == "arrive" and under_way:
            part = under_way.pop(number % len(under_way))
            files.receive(part)
            held[part.begin : part.end] = True
        assert files.loaded[1] == (200 if held.all() else held.argmin())
        assert files.whole.tolist() == [False, held.all()]
        assert files.loaded[1] <= files.asked[1]
        assert files.asked[0] == files.loaded[0] == 0


def test_the_last_byte_counts() -> None:
    """A file, or a level, that lacks one is not there."""
    textures = [raw(8), raw(4)]
    stock = catalogue(textures, [(0, 0), (0, 1)])
    client = LruClient(standing(stock, 1), FluidLink(Conditions()), 1 << 40)
    for kind, files in client.files.items():
        for number, size in enumerate(files.size.tolist()):
            files.receive(files.ask(number, size - 1))
            assert not files.whole[number]
            files.receive(files.ask(number, size))
            assert files.whole[number], kind
    for t, texture in enumerate(textures):
        client.textures.loaded[t] = 0
        for level, end in enumerate(itertools.accumulate(texture.groups)):
            client.textures.loaded[t] = end - 1
            assert client.have[t] == level
            client.textures.loaded[t] = end
            assert client.have[t] == level + 1
