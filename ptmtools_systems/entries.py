"""What the neighbouring systems add to ptmtools: commands, kinds of folders, representations."""

from ptmtools import schemas
from ptmtools.cli.entry import Entry
from ptmtools.folder_kinds import FolderDrawing, FolderKind
from ptmtools.lazy import Lazy
from ptmtools.output.representation import Representation

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

OCTREES = Representation(
    name="octrees",
    noun="octree texture",
    member="octree",
    folder="apo",
    script="statues.js",
    check=Lazy("ptmtools_systems.apo.checking:check_octrees"),
    painter=Lazy("ptmtools_systems.apo.served_octrees:OctreePainter"),
    published=Lazy("ptmtools_systems.apo.served_octrees:published_rows"),
    warm_up=Lazy("ptmtools_systems.apo.making:warm_up"),
)

APO_FOLDER = FolderKind(
    index="apo.json",
    about="octree texture",
    again="ptm apo MESH",
    check=Lazy("ptmtools_systems.apo.checking:check_folder"),
    describe=Lazy("ptmtools_systems.apo.checking:describe"),
    schema=schemas.APO,
    script="apo.js",
    files=Lazy("ptmtools_systems.apo.files:page_files"),
    drawing=FolderDrawing(
        Lazy("ptmtools_systems.apo.picture:RenderOptions"),
        Lazy("ptmtools_systems.apo.picture:draw_folder"),
    ),
)
INTERLACE_FOLDER = FolderKind(
    index="interlace.json",
    about="interlaced image",
    again="ptm interlace IMAGE",
    check=Lazy("ptmtools_systems.interlace.reading:validate_interlaced"),
    describe=Lazy("ptmtools_systems.interlace.reading:describe"),
    schema=schemas.INTERLACE,
    script="interlace.js",
    files=Lazy("ptmtools_systems.interlace.reading:page_files"),
)
CAMPUS_FOLDER = FolderKind(
    index="campus.json",
    about="campus",
    again="ptm campus MODEL",
    check=Lazy("ptmtools_systems.campus.validation:check_campus"),
    describe=Lazy("ptmtools_systems.campus.reading:describe_campus"),
    schema=schemas.CAMPUS,
    script="campus.js",
    files=Lazy("ptmtools_systems.campus.reading:page_files"),
    records=True,
)
