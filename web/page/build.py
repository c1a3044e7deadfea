"""Builds the page that ptmtools ships, in ``ptmtools/site/page``: the modules of the page and of
the worker, bundled and minified by esbuild, the template with its style, and the decoder; and the
scripts of ``web/systems`` that attach to it, in ``ptmtools_systems/page``.

    python web/page/build.py            writes them
    python web/page/build.py FOLDER     writes them to the same places below a folder

The words of the page come from ``ptmtools/site/words``: the English ones as a module, of which each
bundle takes the sections that it uses (``web/page/words/english.js``, written here), every other
language as a script of its own. The constants of the client come from ``ptmtools/site/client.json``
in the same way (``web/page/policy/constants.js``).

The result is committed, so that `ptm publish` and `ptm serve` need no node. Bundles, since forty
modules would be forty requests, each found only in the one before it.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.npm import ESBUILD  # noqa: E402

PTM = ROOT / "web" / "ptm" / "src"
#: The template of the page of folders that are no databases.
FORMS = HERE / "forms"
#: Octree textures, interlaced images and campuses: scripts of their pages, and those that draw them
#: in a walk, which the page loads when it needs them.
SYSTEMS = ROOT / "web" / "systems"
FORM_SCRIPTS, ATTACHED = ("apo.js", "interlace.js", "campus.js"), ("statues.js", "sets.js")
#: Words by language, and the module of the English ones.
WORDS, ENGLISH = ROOT / "ptmtools" / "site" / "words", HERE / "words" / "english.js"
#: Constants of the client, and their module.
CLIENT = ROOT / "ptmtools" / "site" / "client.json"
CONSTANTS = HERE / "policy" / "constants.js"
#: Folders of the scripts in the repository.
PAGE, SYSTEMS_PAGE = "ptmtools/site/page", "ptmtools_systems/page"
#: Scripts that the page loads when it needs them.
LATER = (
    *("later.js", "compare.js", "light.js", "reliefs.js", "tour.js", "embedded.js"),
    *("register.js", "gamepad.js", "xr.js"),
)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_WORD = re.compile(r"\[\[(\w+)\]\]")
_LINE_END = re.compile(r"\s*\n\s*")
#: Template strings with shaders, and what esbuild leaves in them.
_SHADER = re.compile(r"`[^`]*\b(?:uniform|gl_Position|vec[23])\b[^`]*`")
_SHADER_REMARK = re.compile(r"\s*//[^\n]*")


def bundled(folder: Path, source: list[str], text: str = "") -> bytes:
    """What esbuild makes of a file of a folder, or of a text; CalledProcessError if it fails."""
    options = ["--bundle", "--minify", "--format=esm", "--target=es2022", "--charset=utf8"]
    options += [f"--external:./{name}" for name in (*LATER, *ATTACHED)]
    command = [ESBUILD.folder / "bin/esbuild", *source, *options, "--log-level=warning"]
    done = subprocess.run(
        command, cwd=folder, input=text.encode(), stdout=subprocess.PIPE, check=True
    )
    return done.stdout


def minified(source: Path) -> bytes:
    """A module with all that it imports, or a style sheet. CalledProcessError if esbuild fails."""
    return bundled(source.parent, [source.name])


def constants() -> str:
    """The module of the constants of the client."""
    lines = ["// Written by web/page/build.py from ptmtools/site/client.json.", ""]
    for name, (value, about) in json.loads(CLIENT.read_text(encoding="utf-8")).items():
        lines += [f"/** {about} */", f"export const {name} = {json.dumps(value)};"]
    return "\n".join(lines) + "\n"


def words_of(language: str) -> Any:
    """The words of a language, section → name → text."""
    return json.loads((WORDS / f"{language}.json").read_text(encoding="utf-8"))


def english() -> str:
    """The module of the English words; a script that is loaded after those of another language has
    these from the beginning."""
    lines = [
        "// Written by web/page/build.py from ptmtools/site/words/en.json.",
        "",
        "/** @template {Record<string, string>} T @param {string} name @param {T} words */",
        "const own = (name, words) =>",
        '  Object.assign(words, Reflect.get(globalThis, "ptmWords")?.[name]);',
    ]
    for name, texts in words_of("en").items():
        if isinstance(texts, dict) and name != "catalogue":
            text = json.dumps(texts, ensure_ascii=False, indent=2)
            lines += ["", f'export const {name} = /* @__PURE__ */ own("{name}", {text});']
    return "\n".join(lines) + "\n"


def language_script(language: str) -> bytes:
    """The script of a language, with all words but those of the catalogue."""
    words = {name: texts for name, texts in words_of(language).items() if name != "catalogue"}
    text = (
        'import { translate } from "./words/translate.js";\n'
        f"export const words = {json.dumps(words, ensure_ascii=False)};\n"
        f'translate("{language}", words);\n'
    )
    return bundled(HERE, ["--loader=js"], text)


def plain_shader(shader: re.Match[str]) -> str:
    """A template string without comments, indentation and spaces around operators."""
    text = _LINE_END.sub("\n", _SHADER_REMARK.sub("", shader[0]))
    text = re.sub(r" ?([-+*/=,?:{}()<>;]) ?", r"\1", text)
    text = re.sub(r"(?<=[;{}])\n", "", text)
    return re.sub(r"\b0(?=\.\d*[1-9])|(?<=\d\.)0\b", "", text)


def script(source: Path) -> bytes:
    """A bundle with plain shaders."""
    return _SHADER.sub(plain_shader, minified(source).decode()).encode()


def page(folder: Path) -> bytes:
    """The template of a page with its style."""
    template = _COMMENT.sub("", (folder / "index.html").read_text(encoding="utf-8"))
    style = minified(folder / "style.css").decode().strip()
    words = words_of("en")["markup"]
    template = _WORD.sub(lambda match: words[match[1]], _LINE_END.sub("\n", template))
    return template.replace("{{style}}", style).encode()


def page_files() -> dict[str, bytes]:
    """The files of the page."""
    return {
        "index.html": page(HERE),
        "form.html": page(FORMS),
        "viewer.js": script(HERE / "main.js"),
        **{name: script(HERE / name) for name in LATER},
        **{
            f"words-{file.stem}.js": language_script(file.stem)
            for file in sorted(WORDS.glob("*.json"))
            if file.stem != "en"
        },
        # Of `ptm serve --edit` alone.
        "editor.js": script(HERE / "editor.js"),
        "offline.js": script(HERE / "offline.js"),
        "ptm-walk.js": minified(ROOT / "web" / "embed" / "ptm-walk.js"),
        "worker.js": minified(PTM / "worker.js"),
        "decoder.wasm": (PTM / "decoder.wasm").read_bytes(),
    }


def systems_files() -> dict[str, bytes]:
    """The scripts of the other systems."""
    return {
        **{name: script(SYSTEMS / "forms" / name) for name in FORM_SCRIPTS},
        **{name: script(SYSTEMS / name) for name in ATTACHED},
    }


def build(root: Path) -> None:
    """Writes all files to their places below a folder. SystemExit without esbuild."""
    ESBUILD.require()
    if root == ROOT:
        ENGLISH.write_text(english(), encoding="utf-8")
        CONSTANTS.write_text(constants(), encoding="utf-8")
    for place, files in ((PAGE, page_files()), (SYSTEMS_PAGE, systems_files())):
        (root / place).mkdir(parents=True, exist_ok=True)
        for name, data in files.items():
            (root / place / name).write_bytes(data)


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
