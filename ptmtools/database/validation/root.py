"""What `root.wrl` must satisfy: by itself, beside the cells, and beside the hints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.vrml.pattern import PATTERN
from ptmtools.database.vrml.reader import Document
from ptmtools.findings import Place
from ptmtools.tolerance import PARALLEL_COSINE


@dataclass(frozen=True)
class ReadRoot:
    """The root as its file has it.

    Attributes
    ----------
    viewpoints: DEF name of each viewpoint → URL of its cell.
    poses: DEF name → the viewpoint's fields, which are named as in the hints.
    inlines: URL → (2, 3) centre and size of its bounding box, as written; None if it lacks that.
    """

    viewpoints: dict[str, str]
    poses: dict[str, dict[str, Any]]
    inlines: dict[str, NDArray[np.float64] | None]


def read_root(document: Document, at: Place) -> ReadRoot:
    """The root of a file; parts that are missing are left out, with PTM-D663."""
    for type in ("WorldInfo", "NavigationInfo"):
        if len(document.of_type(type)) != 1:
            at.add("PTM-D663", f"not one {type}")
    poses = {v.name: v.fields for v in document.of_type("Viewpoint")}
    viewpoints: dict[str, str] = {}
    for node in document.of_type("PTMViewpointCell"):
        name, urls = node.fields.get("viewpoint", ""), node.fields.get("cellUrl", ())
        if name not in poses or name in viewpoints or len(urls) != 1:
            at.add("PTM-D699", f"{name!r} names no one viewpoint", f"line {node.line}")
        else:
            viewpoints[name] = urls[0]
    if not poses or set(viewpoints) != set(poses):
        at.add("PTM-D699", "not every viewpoint has a cell, or there is none")
    wanted = {f"ptm:viewpoint {name} {url}" for name, url in viewpoints.items()}
    for node in document.of_type("WorldInfo"):
        here, info = at.at(f"line {node.line}"), node.fields.get("info", ())
        if info[:1] != (f"ptm:database {PATTERN}",):
            here.add("PTM-D663", "info does not begin with the pattern")
        if {line for line in info if line.startswith("ptm:viewpoint ")} != wanted:
            here.add("PTM-D699", "info does not say the same of the viewpoints as PTMViewpointCell")
    inlines: dict[str, NDArray[np.float64] | None] = {}
    for node in document.of_type("Inline"):
        if "url" not in node.fields:
            continue
        here, urls = at.at(f"line {node.line}"), node.fields["url"]
        if len(urls) != 1:
            here.add("PTM-D663", "an Inline without a URL")
        elif urls[0] in inlines:
            here.add("PTM-D699", f"{urls[0]} is listed twice")
        elif node.lacks:
            inlines[urls[0]] = None
        else:
            inlines[urls[0]] = np.stack([node.fields["bboxCenter"], node.fields["bboxSize"]])
    return ReadRoot(viewpoints, poses, inlines)


def check_root(root: ReadRoot, boxes: Mapping[str, NDArray[np.float64]], at: Place) -> None:
    """Compares with the cells, given as URL → (2, 3) bounds of all that they hold."""
    for url, box in boxes.items():
        if url not in root.inlines:
            at.add("PTM-D699", f"{url} is not inlined")
            continue
        if (written := root.inlines[url]) is None:
            continue
        centre, size = written.astype(np.float32).astype(np.float64)
        slack = np.spacing(np.abs(box).max(axis=0).astype(np.float32))
        if not (np.abs(box - centre) <= size / 2 + slack).all():
            at.add("PTM-D699", "the bounding box does not hold the cell", url)


def check_viewpoints(
    root: ReadRoot, viewpoints: Sequence[Mapping[str, Any]], urls: Sequence[str], at: Place
) -> None:
    """Compares with the viewpoints of the hints and the URLs of their cells."""
    wanted = {view["name"]: url for view, url in zip(viewpoints, urls, strict=True)}
    if wanted != root.viewpoints or len(wanted) < len(viewpoints):
        at.add("PTM-D706", "not those of the root file", "viewpoints")
    for i, view in enumerate(viewpoints):
        for name, written in root.poses.get(view["name"], {}).items():
            if name == "orientation":
                name, same = "direction", _turns(written, view["direction"])
            else:
                same = _same(written, view[name])
            if not same:
                at.add("PTM-D706", "is not that of the root file", f"viewpoints[{i}].{name}")


def _same(written: Any, full: Any) -> bool:
    if isinstance(written, str):
        return bool(written == " ".join(full.split()))
    single = np.asarray(full, np.float64).astype(np.float32)
    return bool((np.asarray(written).astype(np.float32) == single).all())


def _turns(orientation: Sequence[float], direction: Sequence[float]) -> bool:
    """Whether a rotation, axis and angle, brings -Z to a direction, both of them unit vectors."""
    axis, angle = np.array(orientation[:3], np.float64), orientation[3]
    ahead = np.array([0.0, 0.0, -1.0])
    turned = (
        ahead * np.cos(angle)
        + np.cross(axis, ahead) * np.sin(angle)
        + axis * (axis @ ahead) * (1 - np.cos(angle))
    )
    slack = 1 - PARALLEL_COSINE
    units = abs(axis @ axis - 1) <= slack and abs(np.dot(direction, direction) - 1) <= slack
    return bool(units and turned @ direction >= PARALLEL_COSINE)
