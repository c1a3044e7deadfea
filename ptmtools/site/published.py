"""What a publication of a site consists of, whether in a folder or at a URL."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from urllib.parse import unquote

from ptmtools.files import open_regular
from ptmtools.options import option
from ptmtools.output.emission import compress
from ptmtools.site.about import MANIFEST
from ptmtools.site.content import GLB, Site
from ptmtools.site.entry import SiteEntry, is_marked
from ptmtools.site.program import ELEMENT, INDEX
from ptmtools.store.folder import damage_error, reading_error
from ptmtools.store.layout import sha256

#: The list of our files, and the caching rules for hosts that read them from a file.
LIST, HEADERS = ".ptm-site.json", "_headers"
#: End of the name of a gzip copy.
COPY = ".gz"


@dataclass(frozen=True)
class PublishOptions:
    """Options of `publish`."""

    heading: ClassVar[str] = "Site"

    gzip: bool = option(
        False,
        "Also write gzip copies, for servers that send precompressed files (nginx: gzip_static). "
        "Not for s3:// and gs://, where files are stored compressed.",
    )
    keep: bool = option(
        False, "Keep the files of earlier versions of the site, for visitors who are using them."
    )


@dataclass(frozen=True)
class Published:
    """Names of the files of a folder or URL that were written, left unchanged, and removed."""

    written: tuple[str, ...]
    unchanged: tuple[str, ...]
    removed: tuple[str, ...]


def steps_of(names: Iterable[str]) -> list[list[str]]:
    """Names of files in steps, in the order of writing: those that change with their contents,
    those that replace others, and the page with its copy. So an interrupted run leaves all that
    each version of a replaced file names. Removal has the reverse order."""
    rows = sorted((_step(name), name) for name in names)
    return [[name for step, name in rows if step == wanted] for wanted in range(3)]


def _step(name: str) -> int:
    return 2 if name.removesuffix(COPY) == INDEX else int(not is_marked(name))


def steps_of_removal(
    before: Iterable[str], now: Collection[str], options: PublishOptions
) -> list[list[str]]:
    """The files of earlier versions to remove, in steps. A copy of a file that is still there has
    former contents, or those that the file has: servers would send it instead of the file."""
    steps = reversed(steps_of(name for name in before if name not in now))
    if not options.keep:
        return list(steps)
    return [[name for name in step if name.removesuffix(COPY) in now] for step in steps]


def plain_files(site: Site, options: PublishOptions) -> Iterator[tuple[str, SiteEntry]]:
    """The files of a site, for a host whose files have no headers, by their names."""
    for name, entry in site.entries.items():
        yield unquote(name), entry
        if options.gzip and entry.compressed:
            data = entry.read()
            packed = compress(data)
            if len(packed) < len(data):
                yield (
                    f"{unquote(name)}{COPY}",
                    SiteEntry(f"{name}{COPY}", packed, "application/gzip", entry.forever),
                )
    yield HEADERS, SiteEntry(HEADERS, _headers(site.entries.values()), "text/plain")


def _headers(entries: Iterable[SiteEntry]) -> bytes:
    """Types and caching for Netlify and Cloudflare Pages, and who may load the element. Where
    several rules match, Cloudflare joins their values: each address has one rule of each header."""
    rules: dict[str, list[str]] = {}
    for entry in sorted(entries, key=lambda entry: entry.name):
        caching = f"Cache-Control: {entry.caching}"
        folder, within, _ = entry.name.partition("/")
        for path in [f"/{folder}/*"] if within else _addresses(entry.name):
            rules[path] = [caching]
        if entry.name == ELEMENT:
            rules[f"/{ELEMENT}"].append("Access-Control-Allow-Origin: *")
        if entry.name == MANIFEST:
            rules[f"/{MANIFEST}"].append(f"Content-Type: {entry.media}")
        if entry.media == GLB:
            rules[f"/{folder}/*.glb"] = [f"Content-Type: {GLB}"]
    lines = (f"{path}\n" + "".join(f"  {rule}\n" for rule in rules[path]) for path in rules)
    return "".join(lines).encode()


def _addresses(name: str) -> list[str]:
    """The addresses of a file beside the page: these hosts remove `.html`."""
    stem = name.removesuffix(".html")
    return [f"/{name}"] if stem == name else [f"/{name}", "/" if name == INDEX else f"/{stem}"]


def digest_of(entry: SiteEntry) -> str:
    """The SHA-256 of an entry.

    Raises DatabaseError: PTM-D006 it is not the recorded one, PTM-D005 the file cannot be read.
    """
    if isinstance(entry.source, bytes):
        return sha256(entry.source)
    with reading(entry.source):
        digest = file_digest(entry.source)
    if entry.digest and digest != entry.digest:
        raise damage_error(entry.source, "its SHA-256 is not the recorded one")
    return digest


@contextmanager
def reading(file: Path) -> Iterator[None]:
    """Turns an OSError while a file of the database is read into a DatabaseError."""
    try:
        yield
    except OSError as fault:
        raise reading_error(file, fault) from fault


def file_digest(file: Path, algorithm: str = "sha256") -> str:
    """A digest of a file, hexadecimal; raises OSError."""
    with open_regular(file) as stream:
        return hashlib.file_digest(stream, algorithm).hexdigest()
