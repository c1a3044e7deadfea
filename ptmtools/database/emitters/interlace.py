"""Interlaced images: the files of each texture for clients that join them on the GPU.

Writing and checking them needs the room of interlaced images, which is beside this one; so that is
done in a module above both, which is named here and imported when it is used.
"""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import INTERLACE_FILES, INTERLACE_FOLDER
from ptmtools.lazy import Lazy

INTERLACE = Emitter(
    name="interlace",
    about="an interlaced image of each texture, in interlace/",
    owns=(f"{INTERLACE_FOLDER}/",),
    writer=Lazy("ptmtools.pipeline.interlacing:interlaced_files"),
    reader=Lazy("ptmtools.pipeline.interlacing:read_file"),
    check=Lazy("ptmtools.pipeline.interlacing:check_sets"),
    texture_files=INTERLACE_FILES,
)
