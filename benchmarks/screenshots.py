"""Compares databases in real browsers with ray-cast pictures from the same viewpoints.

    python benchmarks/screenshots.py DB… [-o build/bench/browsers] [--viewpoints 0 3 5]

Prints, for each viewpoint of `root.wrl` in view3dscene and in X_ITE in headless Chromium, the
similarity of the picture to the reference (likeness.py) and the messages of the browser, then the
minimum and the median of each scene; writes a contact sheet for each database (reference, browser,
twice the difference around grey with masked edges in black). The browsers show the emitted VRML
files; the reference is cast from the ingested scene, so a difference indicates an error of
emission. view3dscene also reads every file separately.

X_ITE in a software renderer takes minutes for large textures; databases built with
``--fallback-size 512`` are faster, and the reference uses the same level of them.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests" / "e2e")]
from browsers import view3dscene, x_ite  # noqa: E402
from likeness import Likeness, Outline, likeness, outline  # noqa: E402
from render import LOOKS, View, load, render  # noqa: E402

from ptmtools.errors import PtmError  # noqa: E402
from ptmtools.scene.model import Scene  # noqa: E402

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Album:
    """What a browser made of a database.

    Attributes
    ----------
    pictures: (height, width, 3) each, of the viewpoints asked for.
    complaints: its warnings and errors.
    """

    pictures: tuple[Picture, ...]
    complaints: tuple[str, ...]

    @staticmethod
    def of(files: Sequence[bytes], complaints: Sequence[str]) -> Album:
        """From the bytes of PNG files."""
        pictures = []
        for png in files:
            with Image.open(io.BytesIO(png)) as image:
                pictures.append(np.asarray(image.convert("RGB")))
        return Album(tuple(pictures), tuple(complaints))


@dataclass(frozen=True)
class Database:
    """A database folder, and what of it pictures are compared by."""

    www: Path
    scene: Scene
    viewpoints: tuple[Mapping[str, Any], ...]

    @staticmethod
    def open(folder: Path) -> Database:
        hints = json.loads((folder / "www" / "hints.json").read_text())
        return Database(folder / "www", load(folder), tuple(hints["viewpoints"]))

    @property
    def root(self) -> Path:
        return self.www / "root.wrl"

    @property
    def side(self) -> int:
        """The longest side of a fallback image, texels; 0 if there is none."""
        longest = 0
        for file in (self.www / "textures").glob("*.png"):
            with Image.open(file) as image:
                longest = max(longest, *image.size)
        return longest

    def view(self, viewpoint: int, size: tuple[int, int]) -> View:
        return View.of_hint(self.viewpoints[viewpoint], *size)

    def own(self, viewpoint: int, size: tuple[int, int], browser: str) -> Picture:
        """Our picture of a viewpoint, as that browser should show it."""
        return render(self.scene, self.view(viewpoint, size), LOOKS[browser], side=self.side)


def by_view3dscene(database: Database, chosen: Sequence[int], size: tuple[int, int]) -> Album:
    """One run of the program for each viewpoint."""
    files, complaints = [], []
    with tempfile.TemporaryDirectory() as folder:
        for viewpoint in chosen:
            shot = Path(folder) / f"{viewpoint}.png"
            width, height = size
            complaints += view3dscene.screenshot(
                database.root, shot, viewpoint=viewpoint, width=width, height=height
            )
            files.append(shot.read_bytes())
    return Album.of(files, complaints)


def by_x_ite(
    database: Database,
    chosen: Sequence[int],
    size: tuple[int, int],
    *,
    smooth: bool = True,
    seconds: float = 1200,
) -> Album:
    """One page for all viewpoints."""
    names = [database.viewpoints[viewpoint]["name"] for viewpoint in chosen]
    width, height = size
    shots = x_ite.show(
        database.root, names, width=width, height=height, smooth=smooth, seconds=seconds
    )
    return Album.of(shots.pictures, shots.messages)


BROWSERS: Mapping[str, Callable[[Database, Sequence[int], tuple[int, int]], Album]] = {
    "view3dscene": by_view3dscene,
    "x_ite": by_x_ite,
}


def strip(shown: Picture, own: Picture, outline: Outline) -> Picture:
    """(height, 3 width, 3): ours, the browser's, twice the difference."""
    difference = 128 + 2 * (shown.astype(np.int64) - own)
    difference[outline.edge] = 0
    return np.concatenate([own, shown, np.clip(difference, 0, 255).astype(np.uint8)], axis=1)


def sheet(strips: Sequence[tuple[str, Picture]], output: Path) -> None:
    """One strip below the other, each with its title."""
    height, width = strips[0][1].shape[:2]
    image = Image.new("RGB", (width, (height + 20) * len(strips)), (255, 255, 255))
    draw = ImageDraw.Draw(image)
    for k, (title, picture) in enumerate(strips):
        draw.text((6, k * (height + 20) + 3), title, (0, 0, 0), ImageFont.load_default(13))
        image.paste(Image.fromarray(picture), (0, k * (height + 20) + 20))
    image.save(output)


def row(name: str, viewpoint: int, browser: str, found: Likeness) -> str:
    return (
        f"| {name} | {viewpoint} | {browser} | {found.psnr:.1f} | {found.whole:.1f} "
        f"| {found.masked:.1%} | {found.sky:.1%} | {found.stray:.2%} | {found.off:.3%} |"
    )


def summary(found: Mapping[tuple[str, str], Sequence[Likeness]]) -> str:
    """One row for each scene and browser."""
    lines = [
        "| scene | browser | views | dB outside edges, least | median | dB whole, least "
        "| edges, most | stray, most | off, most |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for (name, browser), all_found in found.items():
        outside = [each.psnr for each in all_found]
        lines.append(
            f"| {name} | {browser} | {len(all_found)} | {min(outside):.1f} "
            f"| {np.median(outside):.1f} | {min(each.whole for each in all_found):.1f} "
            f"| {max(each.masked for each in all_found):.1%} "
            f"| {max(each.stray for each in all_found):.2%} "
            f"| {max(each.off for each in all_found):.3%} |"
        )
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Databases in browsers, held against our rays.")
    add = parser.add_argument
    add("databases", type=Path, nargs="+", metavar="DB")
    add("-o", "--output", type=Path, default=Path("build/bench/browsers"), metavar="DIR")
    add("--viewpoints", type=int, nargs="+", metavar="K", help="their numbers, from 0; else all")
    add("--size", default="480x360", help="WIDTHxHEIGHT (default 480x360)")
    add("--only", choices=tuple(BROWSERS), help="one of the browsers")
    add("--no-smoothing", action="store_true", help="X_ITE without its antialiasing")
    given = parser.parse_args(arguments)
    width, height = (int(n) for n in given.size.split("x"))
    given.output.mkdir(parents=True, exist_ok=True)
    lacking = {"view3dscene": view3dscene.missing(), "x_ite": x_ite.missing()}
    browsers = dict(BROWSERS)
    if given.no_smoothing:
        browsers["x_ite"] = partial(by_x_ite, smooth=False)
    names = [name for name in browsers if given.only in (None, name)]
    for name in names:
        if lacking[name]:
            print(f"{name}: left out; to be installed: {lacking[name]}")
    names = [name for name in names if not lacking[name]]

    print(
        "| scene | viewpoint | browser | dB outside edges | dB whole | edges | sky | stray | off |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    warnings = 0
    every: dict[tuple[str, str], list[Likeness]] = {}
    for folder in given.databases:
        try:
            database = Database.open(folder)
        except PtmError as error:
            parser.exit(error.exit_status, f"screenshots: {error}\n")
        title, size = folder.resolve().stem, (width, height)
        count = len(database.viewpoints)
        chosen = [k for k in given.viewpoints or range(count) if k < count]
        albums = {name: browsers[name](database, chosen, size) for name in names}
        strips: list[tuple[str, Picture]] = []
        for k, viewpoint in enumerate(chosen):
            what = outline(database.scene, database.view(viewpoint, size))
            for name, album in albums.items():
                own = database.own(viewpoint, size, name)
                actual = likeness(album.pictures[k], own, what, LOOKS[name])
                print(row(title, viewpoint, name, actual), flush=True)
                every.setdefault((title, name), []).append(actual)
                label = f"{title}, viewpoint {viewpoint}: ours, {name}, difference; "
                label += f"{actual.psnr:.1f} dB outside edges"
                strips.append((label, strip(album.pictures[k], own, what)))
        if strips:
            sheet(strips, given.output / f"{title}.png")
        printed = [f"{name}: {line}" for name, album in albums.items() for line in album.complaints]
        if "view3dscene" in names:
            for file, lines in view3dscene.check_all(database.www).items():
                printed += [f"view3dscene: {file}: {line}" for line in lines]
        files = len(list(database.www.rglob("*.wrl")))
        print(f"{title}: {files} files, textures to {database.side}², {len(printed)} warnings")
        print("".join(f"  {line}\n" for line in printed), end="", flush=True)
        warnings += len(printed)
    print(f"\n{summary(every)}\n\n{warnings} warnings; pictures in {given.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
