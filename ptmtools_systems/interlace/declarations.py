"""Interlaced images: the kind of folder that `ptm interlace` writes, and the form of the textures
of a database."""

from ptmtools.folder_kinds import FolderKind
from ptmtools.lazy import Lazy
from ptmtools.output.emitter import Emitter, SiteTextures
from ptmtools_systems import PAGE
from ptmtools_systems.schemas import INTERLACE

INTERLACE_FOLDER = FolderKind(
    index="interlace.json",
    about="interlaced image",
    again="ptm interlace IMAGE",
    check=Lazy("ptmtools_systems.interlace.reading:validate_interlaced"),
    describe=Lazy("ptmtools_systems.interlace.reading:describe"),
    schema=INTERLACE,
    script=PAGE / "interlace.js",
    files=Lazy("ptmtools_systems.interlace.reading:page_files"),
)
INTERLACED = Emitter(
    name="interlace",
    about="an interlaced image of each texture, in interlace/",
    owns=("interlace/",),
    writer=Lazy("ptmtools_systems.interlace.database:interlaced_files"),
    reader=Lazy("ptmtools_systems.interlace.database:read_file"),
    check=Lazy("ptmtools_systems.interlace.database:check_files"),
    texture_files="interlace/{name}/",
    site=SiteTextures(
        "sets",
        "data/sets",
        PAGE / "sets.js",
        Lazy("ptmtools_systems.interlace.database:set_entries"),
    ),
)
