"""The emission pattern: the nodes and fields that the VRML files are made of."""

from __future__ import annotations

from collections.abc import Mapping

HEADER = "#VRML V2.0 utf8\n"
#: The version of the pattern, in WorldInfo's first info string.
PATTERN = 1

#: Node → field → type; for SFNode the node that must stand there. A "?" follows the type of what
#: may be left out.
NODES: dict[str, dict[str, str]] = {
    "WorldInfo": {"title": "SFString?", "info": "MFString?"},
    "NavigationInfo": {"type": "MFString?", "avatarSize": "MFFloat?", "headlight": "SFBool?"},
    "Viewpoint": {
        "position": "SFVec3f",
        "orientation": "SFRotation",
        "fieldOfView": "SFFloat",
        "description": "SFString",
    },
    "Inline": {"url": "MFString", "bboxCenter": "SFVec3f", "bboxSize": "SFVec3f"},
    "Shape": {"appearance": "Appearance", "geometry": "IndexedFaceSet"},
    "Appearance": {"material": "Material?", "texture": "ImageTexture?"},
    "Material": {
        "diffuseColor": "SFColor?",
        "emissiveColor": "SFColor?",
        "transparency": "SFFloat?",
    },
    "ImageTexture": {"url": "MFString", "repeatS": "SFBool?", "repeatT": "SFBool?"},
    "IndexedFaceSet": {
        "solid": "SFBool?",
        "coord": "Coordinate",
        "coordIndex": "MFInt32",
        "texCoord": "TextureCoordinate?",
        "texCoordIndex": "MFInt32?",
        "color": "Color?",
        "colorIndex": "MFInt32?",
        "colorPerVertex": "SFBool?",
    },
    "Coordinate": {"point": "MFVec3f"},
    "TextureCoordinate": {"point": "MFVec2f"},
    "Color": {"color": "MFColor"},
}
_CELL = {
    "cellName": "SFString",
    "hullPoint": "MFVec3f",
    "hullIndex": "MFInt32",
    "adjacentUrl": "MFString",
    "visibleUrl": "MFString",
    "ach": "MFFloat",
}
#: What PROTOs declare, whose bodies draw nothing: a cell of one leaf, a cell of several, and the
#: cell of a viewpoint.
CELL = ("PTMCell", _CELL)
CELL_OF_LEAVES = ("PTMCell", _CELL | {"leafPoint": "MFVec3f", "leafStart": "MFInt32"})
VIEWPOINT_CELL = ("PTMViewpointCell", {"viewpoint": "SFString", "cellUrl": "MFString"})
PROTOS = (CELL, CELL_OF_LEAVES, VIEWPOINT_CELL)


def declaration(name: str, fields: Mapping[str, str]) -> str:
    """The text of a PROTO."""
    width = max(map(len, fields))
    rows = []
    for field, type in fields.items():
        default = "[ ]" if type.startswith("MF") else '""'
        rows.append(f"  field {type:<8} {field:<{width}} {default}\n")
    return f"PROTO {name} [\n{''.join(rows)}] {{\n  WorldInfo {{ }}\n}}\n"
