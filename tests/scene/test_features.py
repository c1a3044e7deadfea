"""Each feature of a format: what becomes of it, and that the user's manual says so."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, ingest

from .conftest import Put
from .features import FEATURES, Feature

#: Codes of what is done by the way, and says nothing of the feature.
BY_THE_WAY = {"PTM-N226", "PTM-N227", "PTM-N232", "PTM-N234", "PTM-N237"}


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
    if feature.name == "KTX2" and find_spec("opengl_basisu") is None:
        require("opengl_basisu", "pip install 'ptmtools[basisu]'")
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


TABLE = Path(__file__).parents[2] / "docs" / "prepare.md"


def rows_of_the_table() -> dict[tuple[str, str], str]:
    """(format, feature) → outcome, as the user's manual has them."""
    _, _, text = TABLE.read_text().partition("## What is read of each format\n\n")
    head, _, *rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.split("\n\n")[0].splitlines()
    ]
    return {
        (form, name): outcome
        for name, *outcomes in rows
        for form, outcome in zip(head[1:], outcomes, strict=True)
        if outcome
    }


def test_the_manual_says_what_becomes_of_each() -> None:
    tried: dict[tuple[str, str], set[str]] = {}
    for each in FEATURES:
        tried.setdefault((each.form, each.name), set()).add(each.outcome)
    assert {key: {outcome} for key, outcome in rows_of_the_table().items()} == tried
