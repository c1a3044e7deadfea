"""The committed page is what `web/page/build.py` makes of its sources."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.npm import ESBUILD
from benchmarks.page_weight import sent
from ptmtools.errors import InputError
from ptmtools.site import client, program
from ptmtools.site.program import PAGE, PROGRAM, program_files
from ptmtools_systems import PAGE as SYSTEMS_PAGE

ROOT = Path(__file__).parents[2]
BUILD = ROOT / "web" / "page" / "build.py"
#: Sizes in kB that pages of the documentation quote, and the script.
QUOTED = {
    "devices.md": {
        "gamepad.js": r"([\d.]+) kB\s\(`gamepad\.js`\)",
        "xr.js": r"([\d.]+) kB\s\(`xr\.js`\)",
    },
    "offline.md": {
        "offline.js": r"service worker, ([\d.]+) kB compressed",
        "register.js": r"/register\.js` \| ([\d.]+) kB",
    },
    "embedding.md": {"ptm-walk.js": r"The element has less than (\d+) kB"},
}
#: What docs/formats/client.md says of constants of the client.
SPECIFIED = (
    "1 / max(d, {NEAREST} m)²",
    "max(`differences`[n], {LEAST_DIFFERENCE})",
    "d = max(`difference`, {LEAST_DIFFERENCE})",
    "the worth (*present* + {SURROUNDINGS} *around*)",
    "the worth {NOTHING} × (*hidden*[c] + a)",
    "a is the greatest of {BEHIND} `ach`[c]",
    "and {BEYOND} `ach`[c] of the record of each adjacent cell",
    "w(x) = x / (x + {GROSS})",
    "{NOTHING} × {RECORD_SHARE} each",
    "Choose by (share + {HELD_ON} *kept* +",
    "which halves every {HELD_SECONDS} s",
    "adds to the bytes {OVERHEAD} bytes",
    "the link delivers in {RANGE_SECONDS} s, but at least {RANGE_BYTES:,}",
    "fewer than six requests ({STREAMS} with HTTP/2 or 3)",
    "the first download 1 Mbit/s and {PRIOR_LATENCY} s",
)


def test_the_sources_give_the_page(require: Callable[[str, str], None], tmp_path: Path) -> None:
    """Byte for byte, with the pinned esbuild."""
    if remedy := ESBUILD.remedy():
        require("esbuild", remedy)
    subprocess.run([sys.executable, BUILD, tmp_path], check=True)
    built, committed = (
        {
            f"{place}/{file.name}": file.read_bytes()
            for place in ("ptmtools/site/page", "ptmtools_systems/page")
            for file in (root / place).iterdir()
        }
        for root in (tmp_path, ROOT)
    )
    assert built.keys() == committed.keys()
    changed = [name for name in built if built[name] != committed[name]]
    assert changed == [], "run: python web/page/build.py"


@pytest.mark.parametrize("page", QUOTED)
def test_sizes_in_the_docs(page: str) -> None:
    """Within 0.1 kB; benchmarks/docs_tables.py checks the table of all exact sizes."""
    text = (ROOT / "docs/formats" / page).read_text("utf-8")
    for script, pattern in QUOTED[page].items():
        (quote,) = re.findall(pattern, text)
        size = sent(PAGE / script) / 1000
        if "less than" in pattern:
            assert size < float(quote), script
        else:
            assert abs(size - float(quote)) < 0.1, script


def test_the_constants_of_the_client() -> None:
    """The page has those of the simulator, and the format specifies them."""
    module = (ROOT / "web/page/policy/constants.js").read_text("utf-8")
    table = {name: value for name, (value, _) in client.CONSTANTS.items()}
    assert re.findall(r"export const (\w+) = (.*);", module) == [
        (name, json.dumps(value)) for name, value in table.items()
    ]
    assert {name: getattr(client, name) for name in table} == table
    text = " ".join((ROOT / "docs/formats/client.md").read_text("utf-8").split())
    for phrase in SPECIFIED:
        assert phrase.format(**table) in text


def test_scripts_import_nothing_at_once() -> None:
    """Each is one request: no other script is found only after it."""
    files = (PAGE / name for name in PROGRAM if name.endswith(".js"))
    for file in (*files, *SYSTEMS_PAGE.iterdir()):
        script = file.read_text()
        assert not re.search(r"""\bimport\s*["{*\w]""", script)
        assert not re.search(r"/\*\*|\n\s*//", script)


def test_an_incomplete_installation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(program, "PAGE", tmp_path)
    with pytest.raises(InputError, match="install ptmtools again") as raised:
        program_files()
    assert raised.value.code == "PTM-I122"
