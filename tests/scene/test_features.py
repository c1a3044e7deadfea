"""Each feature of a format: what becomes of it, and that the user's manual says so."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, ingest
from tests.scene.conftest import Put
from tests.scene.features.registry import Feature, all_features

FEATURES = all_features()
#: Codes of what is done by the way, and says nothing of the feature.
BY_THE_WAY = {"PTM-N201", "PTM-N227", "PTM-N232", "PTM-N234"}


#: What a format or a feature needs: module, and how to get it.
NEEDED = (
    ("meshopt compression", "meshopt", "meshopt"),
    ("Draco compression", "DracoPy", "DracoPy"),
    ("KTX2", "opengl_basisu", "'ptmtools[basisu]'"),
    ("USD", "pxr", "'ptmtools[usd]'"),
    ("IFC", "ifcopenshell", "'ptmtools[ifc]'"),
)
#: Formats that say their unit and axis.
SAYS = ("glTF", "USD", "IFC", "COLLADA", "VRML, X3D")


@pytest.mark.parametrize(
    "feature", FEATURES, ids=[f"{f.form}: {f.name} {f.make.__name__}" for f in FEATURES]
)
def test_what_becomes_of_it(
    put: Put, feature: Feature, require: Callable[[str, str], None]
) -> None:
    for word, module, remedy in NEEDED:
        if word in (feature.form, feature.name) and find_spec(module) is None:
            require(module, f"pip install {remedy}")
    path = put("folder", b"").parent / feature.make(put)
    if feature.outcome == "refused":
        with pytest.raises(InputError) as caught:
            ingest(path)
        assert caught.value.code == feature.codes[0]
        feature.check(str(caught.value))
        return
    given = {} if feature.form in SAYS else {"unit": "m", "up": "y"}
    scene = ingest(path, IngestOptions(**given))
    feature.check(scene)
    reported = {note.code for note in scene.notes} - BY_THE_WAY
    if feature.outcome in ("baked", "noted"):
        assert feature.codes[0] in reported
    assert reported <= {*feature.codes}


TABLE = Path(__file__).parents[2] / "docs/guide/prepare.md"


def rows_of_the_table() -> dict[tuple[str, str], str]:
    """(format, feature) → outcome, as the user's manual has them."""
    _, _, text = TABLE.read_text().partition("## Supported features of each format\n\n")
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
