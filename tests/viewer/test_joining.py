"""Joined modules do what they do apart, and what cannot be joined is refused with its line."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ptmtools.errors import InputError
from ptmtools.viewer.joining import joined
from ptmtools.viewer.scripts import compact, tokens
from tests.web.node import PACKAGE, missing, run

HERE = Path(__file__).resolve().parent
VECTORS = HERE.parents[1] / "tests" / "texture" / "vectors" / "v2"
SOURCE = PACKAGE / "src"
ASSETS = {PACKAGE / "decoder.wasm": "decoder.wasm", SOURCE / "worker.js": "worker.js"}


@pytest.fixture(scope="module", autouse=True)
def _node(require: Callable[[str, str], None]) -> None:
    if remedy := missing():
        require("node", remedy)


@pytest.fixture
def modules(tmp_path: Path) -> Callable[..., Path]:
    """Writes modules by their paths; returns the first."""

    def write(**texts: str) -> Path:
        for name, text in texts.items():
            (tmp_path / f"{name}.js").write_text(text)
        return tmp_path / f"{next(iter(texts))}.js"

    return write


def evaluated(folder: Path, script: str, rest: str = "") -> Any:
    """What a script has put into `globalThis.out` after its promises are kept, as an object."""
    (folder / "script.mjs").write_text(script)
    (folder / "rest.mjs").write_text(rest)
    main = (
        'await import("./script.mjs"); await 0; await new Promise((then) => setTimeout(then, 20));'
    )
    (folder / "main.mjs").write_text(
        f"globalThis.out = []; {main} console.log(JSON.stringify(out));"
    )
    return json.loads(run(folder / "main.mjs"))


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("wasm", [PACKAGE / "decoder.wasm", "-"])
def test_the_decoder(tmp_path: Path, wasm: str | Path, apart: bool) -> None:
    """Both forms of the decoder make the same of the frozen files, with both engines."""
    script, rest = joined(SOURCE / "index.js", ASSETS, "./rest.mjs" if apart else None)
    (tmp_path / "index.mjs").write_text(script)
    (tmp_path / "rest.mjs").write_text(rest)
    assert bool(rest) is apart
    files = sorted(VECTORS.glob("*.ptm"))
    first = json.loads(run(HERE / "decode.mjs", SOURCE / "index.js", wasm, *files))
    found = json.loads(run(HERE / "decode.mjs", tmp_path / "index.mjs", wasm, *files))
    assert found.pop("url") == (tmp_path / "decoder.wasm").as_uri()
    assert first.pop("url") == (PACKAGE / "decoder.wasm").as_uri()
    assert found == first
    assert found["engine"] == ("js" if wasm == "-" else "wasm")
    assert sum(isinstance(one, list) for one in found["found"]) == 23


def test_nothing_is_left_of_comments() -> None:
    script = joined(SOURCE / "worker.js", ASSETS)[0]
    assert not re.search(r"/\*|^\s|\n\n|@param|//", script)
    assert "plainEngine" in script
    # What most browsers never run is not in the worker, if it may lie apart.
    worker, rest = joined(SOURCE / "worker.js", ASSETS, "./rest.js")
    assert "decodeHaar" not in worker
    assert "decodeHaar" in rest
    assert 'import("./rest.js")' in worker


def test_order_names_and_cycles(modules: Callable[..., Path], tmp_path: Path) -> None:
    """Modules run once, in the order that modules have; equal names do not meet."""
    first = modules(
        a='import { x as y } from "./b.js";\nimport { x, c } from "./c.js";\n'
        'const later = import("./d.js");\nout.push("a", x, y, c());\n'
        "later.then(({ d }) => out.push(d, x));\n",
        b='import { c } from "./c.js";\nexport const x = `b${c()}`;\nout.push("b");\n',
        c='const x = 1, $ = 7;\nlet n = 0;\nexport function c() {\n  return $ + n++;\n}\n'
        'out.push("c");\nexport { x };\n',
        # It imports, later, what imports it.
        d='import { x } from "./e.js";\nexport const d = ["d", x];\nout.push("d");\n',
        e='import { c } from "./c.js";\nexport const x = c();\nexport const more = () => '
        'import("./d.js");\n',
    )  # fmt: skip
    wanted = ["c", "b", "a", 1, "b7", 8, "d", ["d", 9], 1]
    assert evaluated(tmp_path, joined(first)[0]) == wanted
    script, rest = joined(first, rest="./rest.mjs")
    assert '"d"' not in script
    assert '"d"' in rest
    assert evaluated(tmp_path, script, rest) == wanted


def test_exports_again_bring_nothing_else(modules: Callable[..., Path], tmp_path: Path) -> None:
    first = modules(
        a='import { two, three as one } from "./all.js";\nout.push(two, one);\n',
        all='export { one } from "./one.js";\nexport { two, two as three } from "./two.js";\n',
        one='out.push("never");\nexport const one = 1;\n',
        two="export const two = 2;\n",
    )
    script, _ = joined(first)
    assert "never" not in script
    assert evaluated(tmp_path, script) == [2, 2]


#: Expressions that are hard to cut; □ is where spaces or comments may be.
TRICKY = [
    '"a // b"□+□"\\" /* c */"',
    "'\\'//'□+□'/*'",
    "`// ${□1□+□2□} /* \\` ${□`a${□{ b:□`}`□}.b□}//`□} */\n  kept`",
    '/[/*"]\\/"`/□.source',
    "/[\\]/]+/g□.test(□'a]/'□)",
    "[□6□/□2□/□3□,□/x/□.source□]",
    "(□8□)□/□2□/□[□4□][□0□]□/□1",
    "typeof□/re/□in□{□}",
    "/a/g□instanceof□RegExp",
    "n□++□+□n",
    "n□-□-□-□n",
    "n□+□+□+□n",
    "1□.toString□(□)",
    "1.5□.toFixed□(□1□)",
    "n□?□.5□:□1",
    "n□?.□toString□(□)",
    "(□(□a□,□b□=□/[)]/□)□=>□b.source□+□a□)□(□2□)",
    "[□...□'ab'□]□.length□/□2",
    "(□{□return□:□6□,□case□:□2□}□)□.return□/□3",
    "(□x□=>□{□if□(□x□)□/}/□.test□(□x□)□;□return□/\\//□.source□}□)□(□1□)",
    "(□(□)□=>□{□return□\n□7□}□)□(□)□??□'nothing'",
    "(□(□)□=>□{□let□a□=□n□\n□++□n□;□return□a□+□n□}□)□(□)",
    "new□(□class□{□#p□=□/#p\\/*/□;□get□q□(□)□{□return□this.#p.source□}□}□)□(□)□.q",
    "void□0□||□'ä/*☃*/'",
]
GAPS = ["", "", " ", "\t", "/**/", "/* '\"` */", "/* / */", " /* ${ */ ", "/***/"]
LINES = ["// don't\n", "\n\n  ", "/*\n`*/", "// ` /*\n"]


def test_tricky_texts(tmp_path: Path) -> None:
    """Scripts mean the same, whatever comments and spaces are in them."""
    draw = random.Random(5)

    def gaps(expression: str) -> str:
        # Behind `return`, before ++ and before => a line end means something, or is wrong.
        fragile = any(word in expression for word in ("++", "return", "=>"))
        choices = GAPS if fragile else GAPS + LINES

        def gap(match: re.Match[str]) -> str:
            before, after = expression[match.start() - 1], expression[match.end() :][:1]
            found = draw.choice(choices)
            glued = (before.isalnum() or before == "/") and (after.isalnum() or after == ".")
            same = before == after and before in "+-"
            if not found and (glued or same):
                return " "
            # A slash and a comment would be another comment.
            beside = "//" in (before + found[:1], found[-1:] + after)
            return f" {found} " if beside else found

        return re.sub("□", gap, expression)

    texts = []
    for _ in range(30):
        texts += [f"n = 2; out.push({gaps(one)});\n" for one in draw.sample(TRICKY, len(TRICKY))]
    whole = "let n = 2;\n" + "".join(texts)
    (tmp_path / "whole.js").write_text(whole)
    shorter = compact(tokens(whole))
    assert evaluated(tmp_path, shorter) == evaluated(tmp_path, whole)
    assert len(shorter) < len(whole)
    # What is compact stays so, and its tokens are the same.
    assert compact(tokens(shorter)) == shorter
    assert [t.text for t in tokens(shorter)] == [t.text for t in tokens(whole)]


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("\nexport default 1;", 2, "default"),
        ("export let a = 1;", 1, "let"),
        ("export var a = 1;", 1, "var"),
        ('export * from "./b.js";', 1, "\\*"),
        ('import * as b from "./b.js";', 1, "\\*"),
        ('import b from "./b.js";', 1, "has b"),
        ('import "./b.js";', 1, "has"),
        ('import { b } from "three";', 1, "no relative path"),
        ('\n\nimport { absent } from "./b.js";', 3, "exports no absent"),
        ("export const a = 1, b = 2;", 1, "several constants"),
        ("export const { a } = { a: 1 };", 1, "no name of its own"),
        ("const a = 1;\nconst b = await a;", 2, "top level"),
        ("console.log(import.meta.url);", 1, "import.meta"),
        ('const a = new URL("./b.txt", import.meta.url);', 1, "not beside"),
        ("const load = (x) => import(x);", 1, "no relative path"),
        ('{ import { b } from "./b.js"; }', 1, "inside"),
        ("const a = `${1", 1, "other half"),
        ("const a = `x", 1, "template"),
        ('const a = "x\n";', 1, "string"),
        ("a = 1; /* x", 1, "does not end"),
        ("if (a) {}\n/x/.test(a);", 2, "behind a brace"),
        ("a = (1];", 1, "other half"),
    ],
)
def test_what_is_refused(modules: Callable[..., Path], text: str, line: int, what: str) -> None:
    first = modules(a=text, b="export const b = 1;\n")
    with pytest.raises(InputError, match=what) as raised:
        joined(first)
    assert raised.value.code == "PTM-I900"
    assert raised.value.place == f"line {line}"
    assert raised.value.file == str(first)


def test_a_cycle(modules: Callable[..., Path], tmp_path: Path) -> None:
    first = modules(
        a='\nimport { b } from "./b.js";\nexport const a = b;\n',
        b='import { c } from "./c.js";\nexport const b = c;\n',
        c='\n\nimport { a } from "./a.js";\nexport const c = a;\n',
    )
    with pytest.raises(InputError, match=r"a\.js imports this module in turn") as raised:
        joined(first)
    assert (raised.value.file, raised.value.place) == (str(tmp_path / "c.js"), "line 3")


def test_a_missing_module(modules: Callable[..., Path], tmp_path: Path) -> None:
    first = modules(a='import { b } from "./gone.js";\n')
    with pytest.raises(InputError, match="cannot be read") as raised:
        joined(first)
    assert raised.value.file == str(tmp_path / "gone.js")
