"""Each feature of a format: what becomes of it, and that the user's manual says so."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import pytest

from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, ingest

from .conftest import Put
from .features import FEATURES, Feature

#: Codes of what is done by the way, and says nothing of the feature.
BY_THE_WAY = {"PTM-N226", "PTM-N227", "PTM-N232", "PTM-N234"}


@pytest.mark.parametrize(
    "feature", FEATURES, ids=[f"{f.form}: {f.name} {f.make.__name__}" for f in FEATURES]
)
def test_what_becomes_of_it(
    put: Put, feature: Feature, require: Callable[[str, str], None]
) -> None:
    if "meshopt" in feature.name and find_spec("meshopt") is None:
        require("meshopt", "pip install meshopt")
    if "Draco" in feature.name and find_spec("DracoPy") is None:
        require("DracoPy", "pip install DracoPy")
    path = put("folder", b"").parent / feature.make(put)
    if feature.outcome == "refused":
        with pytest.raises(InputError) as caught:
            ingest(path)
        assert caught.value.code == feature.codes[0]
        feature.check(str(caught.value))
        return
    given = {} if feature.form == "glTF" else {"unit": "m", "up": "y"}
    scene = ingest(path, IngestOptions(**given))
    feature.check(scene)
    told = {note.code for note in scene.notes} - BY_THE_WAY
    if feature.outcome in ("baked", "noted"):
        assert feature.codes[0] in told
    assert told <= {*feature.codes}
