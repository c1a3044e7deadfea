"""Campuses: the kind of folder that `ptm campus` writes."""

from ptmtools.folder_kinds import FolderKind
from ptmtools.lazy import Lazy
from ptmtools_systems import PAGE
from ptmtools_systems.schemas import CAMPUS

CAMPUS_FOLDER = FolderKind(
    index="campus.json",
    about="campus",
    again="ptm campus MODEL",
    check=Lazy("ptmtools_systems.campus.validation:check_campus"),
    describe=Lazy("ptmtools_systems.campus.reading:describe_campus"),
    schema=CAMPUS,
    script=PAGE / "campus.js",
    files=Lazy("ptmtools_systems.campus.reading:page_files"),
    records=True,
)
