"""The names of the files in a database folder.

::

    manifest.json       the state of the database, see `manifest`
    stages/NAME.npz     the arrays of a stage
    stages/images.json  the list of the model's images
    stages/images/      a copy of each, under its SHA-256
    stages/lights.npz   the lights of the model
    stages/textures/    the details of the levels of each texture
    stages/lists/       names and digests of the files of large stages, see `lists`
    www/                the served files, and nothing else
    .ptm-new/           outputs before their commit, see `transaction`
    .ptm-lock           the writing process, see `writer`
"""

from __future__ import annotations

import hashlib

MANIFEST = "manifest.json"
SERVED = "www"
STAGES_FOLDER = "stages"
#: The folders that stages write in.
WRITTEN = (STAGES_FOLDER, SERVED)
IMAGES, IMAGE_LIST = f"{STAGES_FOLDER}/images", f"{STAGES_FOLDER}/images.json"
LIGHTS = "lights"
LISTS = f"{STAGES_FOLDER}/lists"
STAGING = ".ptm-new"
LOCK = ".ptm-lock"


def arrays_of(stage: str) -> str:
    """The file of a stage's arrays."""
    return f"{STAGES_FOLDER}/{stage}.npz"


def sha256(data: bytes) -> str:
    """The hex digest under which a file is recorded."""
    return hashlib.sha256(data).hexdigest()
