"""Parses models that are XML documents: COLLADA and X3D.

Entities are refused, so that a document can neither name other files nor grow in memory; what a
DOCTYPE refers to is not read.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.files import open_regular


def parse_xml(path: Path) -> ElementTree.Element:
    """The root of a document, whose tags are without their namespaces.

    Raises ValueError for a document that is not well-formed or declares entities, and OSError.
    """
    with open_regular(path) as stream:
        data = stream.read()
    if b"<!ENTITY" in (data.replace(b"\0", b"") if b"\0" in data else data):
        raise ValueError("it declares entities")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError) as error:
        raise ValueError(str(error)) from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    return root


def floats(text: str | None) -> Floats:
    """The numbers in a text. Raises ValueError."""
    return np.fromiter(map(float, (text or "").split()), np.float64)


def integers(text: str | None) -> Ints:
    """The integers in a text. Raises ValueError or OverflowError."""
    return np.fromiter(map(int, (text or "").split()), np.int64)
