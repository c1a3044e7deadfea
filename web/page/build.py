"""Builds the page that ptmtools ships, in ``ptmtools/site/page``: the modules of the page and of
the worker, bundled and minified by esbuild, the template with its style, and the decoder.

    python web/page/build.py            writes it
    python web/page/build.py FOLDER     writes it elsewhere

The result is committed, so that `ptm publish` and `ptm serve` need no node. Bundles, since forty
modules would be forty requests, each found only in the one before it.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.web_rivals.packages import ESBUILD  # noqa: E402

PTM = ROOT / "web" / "ptm" / "src"
#: The page of octree textures, interlaced images and campuses.
FORMS = HERE / "forms"
OUTPUT = ROOT / "ptmtools" / "site" / "page"
#: Scripts that the page loads when it needs them.
LATER = ("later.js", "compare.js", "statues.js", "reliefs.js", "sets.js", "tour.js", "embedded.js")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_LINE_END = re.compile(r"\s*\n\s*")
#: Template strings with shaders, and what esbuild leaves in them.
_SHADER = re.compile(r"`[^`]*\b(?:uniform|gl_Position)\b[^`]*`")
_SHADER_REMARK = re.compile(r"\s*//[^\n]*")


def minified(source: Path) -> bytes:
    """A module with all that it imports, or a style sheet. CalledProcessError if esbuild fails."""
    options = ["--bundle", "--minify", "--format=esm", "--target=es2022", "--charset=utf8"]
    options += [f"--external:./{name}" for name in LATER]
    command = [ESBUILD.folder / "bin/esbuild", source.name, *options, "--log-level=warning"]
    return subprocess.run(command, cwd=source.parent, stdout=subprocess.PIPE, check=True).stdout


def plain_shader(shader: re.Match[str]) -> str:
    """A template string without comments, indentation and spaces around operators."""
    text = _LINE_END.sub("\n", _SHADER_REMARK.sub("", shader[0]))
    return re.sub(r" ?([-+*/=,?:{}()]) ?", r"\1", text)


def script(source: Path) -> bytes:
    """A bundle with plain shaders."""
    return _SHADER.sub(plain_shader, minified(source).decode()).encode()


def page(folder: Path) -> bytes:
    """The template of a page with its style."""
    template = _COMMENT.sub("", (folder / "index.html").read_text(encoding="utf-8"))
    style = minified(folder / "style.css").decode().strip()
    return _LINE_END.sub("\n", template).replace("{{style}}", style).encode()


def build(folder: Path) -> None:
    """Writes the page to a folder. SystemExit without esbuild."""
    ESBUILD.require()
    files = {
        "index.html": page(HERE),
        "form.html": page(FORMS),
        **{f"{name}.js": script(FORMS / f"{name}.js") for name in ("apo", "interlace", "campus")},
        "viewer.js": script(HERE / "main.js"),
        **{name: script(HERE / name) for name in LATER},
        # Of `ptm serve --edit` alone.
        "editor.js": script(HERE / "editor.js"),
        "ptm-walk.js": minified(ROOT / "web" / "embed" / "ptm-walk.js"),
        "worker.js": minified(PTM / "worker.js"),
        "decoder.wasm": (PTM / "decoder.wasm").read_bytes(),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else OUTPUT)
