"""`ptm render`: views of a database, drawn from its finest textures."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.output.served import read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view, eye_of
from ptmtools.site.pictures import PictureKind, jpeg, pictures_of

SMALL = ["--width", "96", "--height", "54"]


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


def test_a_viewpoint_and_an_eye_give_the_same_picture(
    two_rooms: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = tmp_path / "a.png", tmp_path / "b.png"
    assert run("render", two_rooms, "-o", first, *SMALL) == 0
    assert capsys.readouterr().out == f"{first}: {two_rooms}, 96 x 54\n"
    picture = np.asarray(Image.open(first))
    assert picture.shape == (54, 96, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    row = read_served(two_rooms).index["viewpoints"][0]
    eye = ",".join(map(str, row["position"]))
    look = ",".join(str(p + d) for p, d in zip(row["position"], row["direction"], strict=True))
    angle = np.degrees(2 * np.arctan(np.tan(row["fieldOfView"] / 2)))
    command = ["render", two_rooms / "www", "-o", second, "--eye", eye, "--look", look, *SMALL]
    assert run(*command, "--field-of-view", angle, "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"file": str(second), "width": 96, "height": 54}
    np.testing.assert_array_equal(np.asarray(Image.open(second)), picture)


def test_levels_and_light_change_the_picture(two_rooms: Path) -> None:
    served = read_served(two_rooms)
    views = [
        draw_view(served, ViewOptions(width=64, height=48, **more)).astype(int)
        for more in ({}, {"max_side": 1}, {"lit": True})
    ]
    assert np.abs(views[0] - views[1]).mean() > 1
    assert (views[2] <= views[0] + 1).all()
    assert (views[2] < views[0]).any()


def test_pictures_of_sites_are_those_of_render(
    two_rooms: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    served, kind = read_served(two_rooms), PictureKind((160, 90), 9999, 512)
    drawn: list[np.ndarray] = []

    def keep(colors: np.ndarray, size: tuple[int, int], limit: int) -> bytes:
        drawn.append(colors.reshape(size[1], 2, size[0], 2, 3).mean(axis=(1, 3)))
        return b""

    monkeypatch.setattr("ptmtools.site.pictures.jpeg", keep)
    list(pictures_of(served, [(kind, served.index["viewpoints"][0])]))
    expected = draw_view(served, ViewOptions(width=160, height=90)).astype(float)
    assert 10 * np.log10(255**2 / ((drawn[0] - expected) ** 2).mean()) > 45


@pytest.mark.parametrize("limit", [100, 3000, 6000, 10**9])
def test_pictures_are_as_good_as_their_bytes_allow(limit: int) -> None:
    colors = np.random.default_rng(1).normal(128, 40, (80 * 160, 3))
    means = colors.reshape(40, 2, 80, 2, 3).mean(axis=(1, 3))
    image = Image.fromarray(np.rint(np.clip(means, 0, 255)).astype(np.uint8))
    sized = []
    for quality in range(8, 81):
        out = io.BytesIO()
        image.save(out, "JPEG", quality=quality, optimize=True, progressive=True)
        sized.append(out.getvalue())
    best = max((data for data in sized if len(data) <= limit), key=len, default=sized[0])
    assert jpeg(colors, (80, 40), limit) == best


def test_where_the_eye_is(two_rooms: Path) -> None:
    served = read_served(two_rooms)
    eye = eye_of(served, ViewOptions(eye=(1, 2, 3, 90)))
    np.testing.assert_allclose(eye.position, (1, 2, 3))
    np.testing.assert_allclose(eye.direction, (-1, 0, 0), atol=1e-12)
    assert np.degrees(eye.field_of_view) == pytest.approx(60)
    up = eye_of(served, ViewOptions(eye=(1, 2, 3), look=(1, 7, 3), field_of_view=90))
    np.testing.assert_allclose(up.direction, (0, 1, 0))
    assert np.degrees(up.field_of_view) == pytest.approx(90)
    # The field of view of a viewpoint is the smaller one, as in VRML.
    wide, tall = (eye_of(served, ViewOptions(width=w, height=h)) for w, h in ((80, 40), (40, 80)))
    across = 2 * np.arctan(np.tan(tall.field_of_view / 2) / 2)
    assert across == pytest.approx(wide.field_of_view)


@pytest.mark.parametrize(
    "options",
    [
        {"width": 0},
        {"height": 4097},
        {"field_of_view": 0.5},
        {"max_side": -1},
        {"viewpoint": 0, "eye": (0, 0, 0)},
        {"eye": (0, 0, float("nan"))},
        {"eye": (0, 0, 0, 0), "look": (1, 0, 0)},
        {"eye": (1, 2, 3), "look": (1, 2, 3)},
        {"viewpoint": 99},
        {"viewpoint": -1},
    ],
)
def test_impossible_views(options: dict[str, object], two_rooms: Path) -> None:
    with pytest.raises(InputError) as caught:
        eye_of(read_served(two_rooms), ViewOptions(**options))  # type: ignore[arg-type]
    assert caught.value.code == "PTM-I111"


def test_failures_have_one_line_each(
    two_rooms: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    view = tmp_path / "view.png"
    for arguments, code in (
        ([two_rooms, "-o", tmp_path / "view.jpg"], "PTM-O101"),
        ([two_rooms, "-o", tmp_path / "no" / "view.png"], "PTM-O002"),
        ([two_rooms, "-o", view, "--viewpoint", "99"], "PTM-I111"),
        ([two_rooms, "-o", view, "--azimuth", "9"], "PTM-U001"),
        ([tmp_path, "-o", view], "PTM-D001"),
        ([tmp_path / "absent", "-o", view], "PTM-D001"),
    ):
        assert run("render", *arguments) > 0
        err = capsys.readouterr().err
        assert err.count("\n") == 1
        assert f"[{code}]" in err
    assert not view.exists()
