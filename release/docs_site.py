"""The hooks of mkdocs.yml: what makes the Markdown of the repository a site.

The pages are written for a reader of the repository: links lead to files, also outside ``docs/``,
and name headings as GitHub does. The hooks keep the text and change the targets: each file outside
``docs/`` that a page names becomes a page or a file under ``repository/``.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from ptmtools.version import __version__

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
#: Code, and outside of code `](target)` or `](target#anchor)`, and `][`, which mkdocstrings takes
#: for a link.
CODE_OR_LINK = re.compile(
    r"^ *```.*?^ *```$|`[^`\n]+`|\]\["
    r"|\]\((?!\w+:)(?P<target>[^()\s#]+)(?P<anchor>#[^()\s]*)?\)",
    re.MULTILINE | re.DOTALL,
)
#: A row of a table, and code.
ROW = re.compile(r"^\|.*\|$", re.MULTILINE)
CODE = re.compile(r"`[^`\n]+`")
#: Something that a page fetches from another host.
FOREIGN = re.compile(
    r"<(?:script|link|img|iframe|source)\b[^>]*(?:src|href)=\"?(?:https?:)?//[^>]*"
)


def heading_id(heading: str, separator: str) -> str:
    """The anchor of a heading, as GitHub forms it."""
    return re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", separator)


def uri_of(file: Path) -> str:
    """The place of a file of the repository in the source of the site."""
    if file.is_relative_to(DOCS):
        return file.relative_to(DOCS).as_posix()
    return f"repository/{file.relative_to(ROOT).as_posix()}"


def linked_files(page: Path) -> set[Path]:
    """The files that the links of a page name."""
    matches = CODE_OR_LINK.finditer(page.read_text("utf-8"))
    return {(page.parent / match["target"]).resolve() for match in matches if match["target"]}


def on_config(config: Any) -> Any:
    config.site_name = f"ptmtools {__version__}"
    config.mdx_configs["toc"]["slugify"] = heading_id
    return config


def on_files(files: Files, config: Any) -> Files:
    """Adds the files outside ``docs/`` that a page names, directly or through such a file."""
    waiting = [Path(str(file.abs_src_path)) for file in files.documentation_pages()]
    seen = set(waiting)
    while waiting:
        for target in sorted(linked_files(waiting.pop()) - seen):
            seen.add(target)
            if not target.is_file() or target.is_relative_to(DOCS):
                continue
            file = File.generated(config, uri_of(target), abs_src_path=str(target))
            if not target.suffix:  # a server would not know its type
                file.dest_uri += ".txt"
            files.append(file)
            if target.suffix == ".md":
                waiting.append(target)
    return files


def on_page_markdown(markdown: str, page: Page, config: Any, files: Files) -> str:
    """Rewrites the links of a page to the places in the site."""
    source = Path(str(page.file.abs_src_path))
    start = posixpath.dirname(page.file.src_uri)

    def moved(match: re.Match[str]) -> str:
        if not match["target"]:
            return r"]\[" if match[0] == "][" else match[0]
        target = uri_of((source.parent / match["target"]).resolve())
        return f"]({posixpath.relpath(target, start)}{match['anchor'] or ''})"

    return bars(CODE_OR_LINK.sub(moved, markdown))


def bars(markdown: str) -> str:
    """Replaces ``\\|`` in code in tables, whose backslash Python-Markdown prints, by ``|``."""

    def plain(match: re.Match[str]) -> str:
        return match[0].replace(r"\|", "|")

    return ROW.sub(lambda row: CODE.sub(plain, row[0]), markdown)


def on_post_page(output: str, page: Page, config: Any) -> str:
    """Raises PluginError if the page fetches something from another host."""
    if foreign := FOREIGN.search(output):
        raise PluginError(f"{page.file.src_uri} loads from another host: {foreign[0]}")
    return output
