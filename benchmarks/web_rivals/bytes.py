"""Bytes of a site against those of its model, and for each triangle.

    python -m benchmarks.web_rivals.bytes [--scene museum,atrium]

All bytes are those on the link, compressed where servers compress. The *model* is the file itself
if it is a GLB; geometry of other models, which are long texts, counts as one plain GLB. Its images
count as they are. The *site* is all that `ptm publish` writes, for all cells and with all levels;
a visitor downloads a part of it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.web_rivals.__main__ import SCENES, database_in, subject_of
from benchmarks.web_rivals.entrants import Subject, walk_page
from benchmarks.web_rivals.images import in_form
from benchmarks.web_rivals.models import whole_glb
from ptmtools.output.emission import compress
from ptmtools.site.entry import SiteEntry, link_bytes

#: What of a site's data is neither geometry nor texture: first letters of names.
_PICTURES = ("poster-", "picture-", "vp-", "icon-")


@dataclass(frozen=True)
class Weight:
    """Bytes: ``geometry``, ``images``, and the ``rest`` (page, index, records, pictures)."""

    geometry: int
    images: int
    rest: int = 0

    @property
    def total(self) -> int:
        """All of it."""
        return self.geometry + self.images + self.rest


@dataclass(frozen=True)
class Row:
    """Of a scene: its name, triangles, the bytes of its images as PNG, and the two weights."""

    scene: str
    triangles: int
    png: int
    model: Weight
    site: Weight


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.web_rivals.bytes")
    parser.add_argument("--scene", default=",".join(SCENES), help="names, or paths of databases")
    given = parser.parse_args()
    databases = [database_in(scene) for scene in given.scene.split(",")]
    print(bytes_table([row_of(database) for database in databases]))


def row_of(database: Path) -> Row:
    """The weights of a database and of its model."""
    subject = subject_of(database)
    scene = subject.scene
    png = sum(map(len, in_form(scene.images, "png")))
    site = site_weight(walk_page(database).files)
    return Row(database.stem, len(scene.triangle_material), png, model_weight(subject), site)


def model_weight(subject: Subject) -> Weight:
    """Of the model that the scene was read from."""
    images = sum(len(image.load()) for image in subject.scene.images)
    if subject.source:
        return Weight(subject.source.stat().st_size - images, images)
    return Weight(len(compress(whole_glb(subject.scene))), images)


def site_weight(files: Mapping[str, SiteEntry]) -> Weight:
    """Of a site."""
    total = {"geometry": 0, "images": 0, "rest": 0}
    for name, entry in files.items():
        total[_kind(name, entry)] += link_bytes(entry)
    return Weight(**total)


def _kind(name: str, entry: SiteEntry) -> str:
    if name.endswith(".glb"):
        return "geometry"
    picture = name.rsplit("/", 1)[-1].startswith(_PICTURES)
    texture = name.endswith(".ptm") or (entry.media.startswith("image/") and not picture)
    return "images" if texture else "rest"


def bytes_table(rows: Sequence[Row]) -> str:
    """A line for each scene."""
    lines = [
        "| | triangles | model, MB: geometry, images | site, MB: geometry, textures, rest "
        "| site : model | textures : PNG | geometry, bytes a triangle: model, site |",
        "|---" + "|--:" * 6 + "|",
    ]
    for row in rows:
        model, site = row.model, row.site
        cells = [
            f"{row.triangles:,}",
            f"{model.geometry / 1e6:.2f} + {model.images / 1e6:.2f}",
            f"{site.geometry / 1e6:.2f} + {site.images / 1e6:.2f} + {site.rest / 1e6:.2f}",
            f"{site.total / model.total:.2f}",
            f"{site.images / row.png:.2f}" if row.png else "–",
            f"{model.geometry / row.triangles:.1f}, {site.geometry / row.triangles:.1f}",
        ]
        lines.append(f"| {row.scene} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
