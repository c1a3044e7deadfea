"""What `root.wrl` must satisfy: by itself, beside the cells, and beside the hints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.validation.findings import Place
from ptmtools.database.vrml.reader import Document, Node
from ptmtools.database.vrml.root import PATTERN
from ptmtools.tolerance import PARALLEL_COSINE

_PROTO = {"viewpoint": "SFString", "cellUrl": "MFString"}
#: What a Viewpoint and a viewpoint of the hints both have, under the same names.
_POSE = ("position", "orientation", "fieldOfView", "description")


@dataclass(frozen=True)
class ReadRoot:
    """The root as its file has it.

    Attributes
    ----------
    viewpoints: DEF name of each viewpoint → URL of its cell.
    poses: DEF name → the viewpoint.
    inlines: URL → (2, 3) centre and size of its bounding box, as written, if it has one.
    """

    viewpoints: dict[str, str]
    poses: dict[str, Node]
    inlines: dict[str, NDArray[np.float64] | None]


def read_root(document: Document, at: Place) -> ReadRoot:
    """The root of a file; parts that are missing are left out, with PTM-D663."""
    for type in ("WorldInfo", "NavigationInfo"):
        if len(document.of_type(type)) != 1:
            at.add("PTM-D663", f"not one {type}")
    poses = {v.name: v for v in document.of_type("Viewpoint")}
    for name, pose in poses.items():
        if missing := [field for field in _POSE if field not in pose.fields]:
            at.add("PTM-D663", f"{name} lacks {missing[0]}", f"line {pose.line}")
    viewpoints: dict[str, str] = {}
    if document.protos.get("PTMViewpointCell") == _PROTO:
        for node in document.of_type("PTMViewpointCell"):
            name, urls = node.fields.get("viewpoint", ""), node.fields.get("cellUrl", ())
            if name not in poses or name in viewpoints or len(urls) != 1:
                at.add("PTM-D699", f"{name!r} names no one viewpoint", f"line {node.line}")
            else:
                viewpoints[name] = urls[0]
    else:
        at.add("PTM-D663", "PROTO PTMViewpointCell is not the pattern's")
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
        fields, here = node.fields, at.at(f"line {node.line}")
        url = fields.get("url", ())
        boxed = {"bboxCenter", "bboxSize"} <= set(fields)
        if len(url) != 1 or not boxed:
            here.add("PTM-D663", "an Inline without a URL or a bounding box")
        if len(url) == 1 and url[0] in inlines:
            here.add("PTM-D699", f"{url[0]} is listed twice")
        elif len(url) == 1:
            box = np.stack([fields["bboxCenter"], fields["bboxSize"]]) if boxed else None
            inlines[url[0]] = box
    return ReadRoot(viewpoints, poses, inlines)


def check_root(root: ReadRoot, boxes: Mapping[str, NDArray[np.float64]], at: Place) -> None:
    """Compares with the cells, given as URL → (2, 3) bounds of all that they hold."""
    for url, box in boxes.items():
        if url not in root.inlines:
            at.add("PTM-D699", f"{url} is not inlined")
        written = root.inlines.get(url)
        if written is None:
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
        pose = root.poses.get(view["name"])
        written = {} if pose is None else pose.fields
        for name in _POSE:
            if name in written and not _same(written[name], view[name]):
                at.add("PTM-D706", "is not that of the root file", f"viewpoints[{i}].{name}")
        if not _turns(view["orientation"], view["direction"]):
            message = "does not turn -Z to the direction"
            at.add("PTM-D706", message, f"viewpoints[{i}].orientation")


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
