"""The commands that the neighbouring systems add to `ptm`."""

from ptmtools.cli.entry import Entry

_OTHERS, _IMAGES = "Other representations", "Images"

APO = Entry(
    _OTHERS,
    "Convert a mesh to a simplified mesh and an octree texture.",
    "ptmtools_systems.cli.representations:apo",
)
CAMPUS = Entry(
    _OTHERS,
    "Convert a model to objects with levels of detail.",
    "ptmtools_systems.cli.representations:campus",
)
INTERLACE = Entry(
    _IMAGES,
    "Split an image into files that add detail step by step.",
    "ptmtools_systems.cli.interlaced:interlace",
)
DEINTERLACE = Entry(
    _IMAGES,
    "Join the files of an interlaced image.",
    "ptmtools_systems.cli.interlaced:deinterlace",
)
