"""Octree textures: the kind of folder that `ptm apo` writes, and the representation of objects of a
database."""

from ptmtools.folder_kinds import FolderDrawing, FolderKind
from ptmtools.lazy import Lazy
from ptmtools.output.representation import Representation
from ptmtools_systems import PAGE
from ptmtools_systems.schemas import APO

APO_FOLDER = FolderKind(
    index="apo.json",
    about="octree texture",
    again="ptm apo MESH",
    check=Lazy("ptmtools_systems.apo.checking:check_folder"),
    describe=Lazy("ptmtools_systems.apo.checking:describe"),
    schema=APO,
    script=PAGE / "apo.js",
    files=Lazy("ptmtools_systems.apo.files:page_files"),
    drawing=FolderDrawing(
        Lazy("ptmtools_systems.apo.picture:RenderOptions"),
        Lazy("ptmtools_systems.apo.picture:draw_folder"),
    ),
)
OCTREES = Representation(
    name="octrees",
    noun="octree texture",
    member="octree",
    folder="apo",
    script=PAGE / "statues.js",
    check=Lazy("ptmtools_systems.apo.checking:check_octrees"),
    painter=Lazy("ptmtools_systems.apo.served_octrees:OctreePainter"),
    published=Lazy("ptmtools_systems.apo.served_octrees:published_rows"),
    warm_up=Lazy("ptmtools_systems.apo.making:warm_up"),
)
