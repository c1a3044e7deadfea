"""Cut-outs keep their coverage from near and far: a grille whose bars hide a quarter of what is
behind them, with a cutoff at the left and blended at the right."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from ptmtools.output.served import Served, read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.layers import Layers
from ptmtools.rendering.pyramids import read_levels
from ptmtools.site.content import SiteOptions, site_of
from ptmtools.site.pictures import PictureKind, pictures_of

from .conftest import build

#: Metres before the grille: there a bar takes 12, 3 and half a pixel.
DISTANCES = 0.4, 2, 10
#: The grille's place and height, and metres to the wall behind it; beginning and end of its halves;
#: the grey of its bars.
PLACE, HIGH, WALL, HALVES, GREY = -17.0, 1.2, 3.0, ((-4.0, -0.1), (0.1, 4.0)), 20
SIZE, FIELD = (320, 180), 1.1


@pytest.fixture(scope="module")
def served(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> Served:
    folder = tmp_path_factory.mktemp("cutouts")
    model = shared / "cases/cutout-levels/m.glb"
    return read_served(build(model, folder / "m.db", "--samples", "16"))


@pytest.fixture(scope="module")
def behind(served: Served) -> dict[float, NDArray[np.uint8]]:
    """By distance, what is seen without the grille."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Layers, "split", lambda self, sight, alpha: (sight, []))
        return {far: render(served, far) for far in DISTANCES}


def render(served: Served, far: float) -> NDArray[np.uint8]:
    width, height = SIZE
    field = np.degrees(FIELD)
    view = ViewOptions(eye=(0, HIGH, PLACE + far), width=width, height=height, field_of_view=field)
    return draw_view(served, view)


def hidden_shares(shown: NDArray[np.uint8], before: NDArray[np.uint8], far: float) -> list[float]:
    """Of the wall behind each half, beside its edges."""
    width, height = SIZE
    pixel = 2 * np.tan(FIELD / 2) / height
    bottom = min(height / 2 + HIGH / (far + WALL) / pixel, height) - 3
    shares = []
    for ends in HALVES:
        tangents = np.clip(np.array(ends) / far, *(side / (far + WALL) for side in (-4, 4)))
        left, right = np.clip(width / 2 + tangents / pixel, 0, width) + [3, -3]
        part = slice(height // 2 + 3, int(bottom)), slice(int(left), int(right))
        lost = before[part].astype(np.float64) - shown[part]
        shares.append(lost.sum() / (before[part] - float(GREY)).sum())
    return shares


def test_what_alpha_hides_has_the_colour_of_what_it_shows(served: Served) -> None:
    for level in read_levels(served, 0):
        assert (level[..., :3] == GREY).all()


def test_pictures(served: Served, behind: dict[float, NDArray[np.uint8]]) -> None:
    kind = PictureKind(SIZE, 1 << 20)
    places = [
        {"position": [0, HIGH, PLACE + far], "direction": [0, 0, -1], "fieldOfView": FIELD}
        for far in DISTANCES
    ]
    jpegs = pictures_of(served, [(kind, place) for place in places])
    for far, jpeg in zip(DISTANCES, jpegs, strict=True):
        shares = hidden_shares(render(served, far), behind[far], far)
        assert shares == pytest.approx([0.25] * 2, abs=0.02)
        with Image.open(io.BytesIO(jpeg)) as image:
            shares = hidden_shares(np.asarray(image), behind[far], far)
        assert shares == pytest.approx([0.25] * 2, abs=0.02)


@pytest.mark.parametrize("query", ["", "?quality=low"])
def test_the_page(
    visit: Callable[..., Any],
    served: Served,
    behind: dict[float, NDArray[np.uint8]],
    query: str,
) -> None:
    """With all levels, and with those that fit into little memory; with several samples a
    pixel, and with one."""
    site = site_of(served.folder.parent, SiteOptions(pictures=False))
    width, height = SIZE
    with visit(site, width=width, height=height, query=query) as visitor:
        visitor.complete()
        for budget, distances in ((1 << 20, DISTANCES), (8000, DISTANCES[:1])):
            for far in distances:
                place = {"eye": [0, HIGH, PLACE + far], "yaw": 0, "pitch": 0}
                visitor.page.evaluate(
                    "([place, budget]) => { ptm.setBudget(budget); ptm.goTo(place); }",
                    [place, budget],
                )
                visitor.complete()
                shares = hidden_shares(visitor.picture(), behind[far], far)
                assert shares == pytest.approx([0.25] * 2, abs=0.02)
    assert visitor.messages == []
