"""What `root.wrl` must satisfy beside the cells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.findings import Findings
from ptmtools.database.wrl import Document

_PROTO = {"viewpoint": "SFString", "cellUrl": "MFString"}


@dataclass(frozen=True)
class ReadRoot:
    """The root as its file has it.

    Attributes
    ----------
    viewpoints: DEF name of each viewpoint → URL of its cell.
    inlines: URL → (2, 3) centre and size of its bounding box, as written.
    """

    viewpoints: dict[str, str]
    inlines: dict[str, NDArray[np.float64]]


def read_root(document: Document, file: str, found: Findings) -> ReadRoot:
    """The root of a file; parts that are missing are told as PTM-D663 and left out."""
    for type in ("WorldInfo", "NavigationInfo"):
        if len(document.of_type(type)) != 1:
            found.add("PTM-D663", file, "", f"not one {type}")
    names = {v.name for v in document.of_type("Viewpoint")}
    viewpoints: dict[str, str] = {}
    if document.protos.get("PTMViewpointCell") == _PROTO:
        for node in document.of_type("PTMViewpointCell"):
            name, urls = node.fields.get("viewpoint", ""), node.fields.get("cellUrl", ())
            if name not in names or name in viewpoints or len(urls) != 1:
                found.add("PTM-D699", file, f"line {node.line}", f"{name!r} names no one viewpoint")
            else:
                viewpoints[name] = urls[0]
    else:
        found.add("PTM-D663", file, "", "PROTO PTMViewpointCell is not the pattern's")
    if not names or set(viewpoints) != names:
        found.add("PTM-D699", file, "", "not every viewpoint has a cell, or there is none")
    inlines: dict[str, NDArray[np.float64]] = {}
    for node in document.of_type("Inline"):
        fields, place = node.fields, f"line {node.line}"
        url = fields.get("url", ())
        if len(url) != 1 or not {"bboxCenter", "bboxSize"} <= set(fields):
            found.add("PTM-D663", file, place, "an Inline without a URL or a bounding box")
        elif url[0] in inlines:
            found.add("PTM-D699", file, place, f"{url[0]} stands here twice")
        else:
            inlines[url[0]] = np.stack([fields["bboxCenter"], fields["bboxSize"]])
    return ReadRoot(viewpoints, inlines)


def check_root(
    root: ReadRoot, hulls: Mapping[str, NDArray[np.float64]], file: str, found: Findings
) -> None:
    """Compares with the cells, given as URL → hull points."""
    for url, hull in hulls.items():
        box = root.inlines.get(url)
        if box is None:
            found.add("PTM-D699", file, "", f"{url} is not inlined")
            continue
        centre, size = box.astype(np.float32).astype(np.float64)
        slack = np.spacing(np.abs(hull).max(axis=0, initial=0).astype(np.float32))
        if len(hull) and (np.abs(hull - centre) > size / 2 + slack).any():
            found.add("PTM-D699", file, url, "the bounding box does not hold the cell's hull")
