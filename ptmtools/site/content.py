"""Collects the files of a site, with which a browser walks through a database.

Every file but the page has a hash of its contents in its name, so that caches may keep it for ever
and a site that changes is never half old. The index is that of the hints, with names and sizes of
each file instead of templates: a client plans with the sizes of records and geometry.
The page itself is filled in by `ptmtools.site.program`.

The geometry stays GLB, without what the page does not read (`ptmtools.site.conversion`).
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from ptmtools.errors import DatabaseError, InputError, Rebuild
from ptmtools.files import open_regular
from ptmtools.output.emission import compress
from ptmtools.output.emitter import SiteTextures
from ptmtools.output.emitters import is_other_form, texture_forms
from ptmtools.output.model import FileError
from ptmtools.output.representation import Representation, representations_in
from ptmtools.output.served import FORM, Served, read_served
from ptmtools.pipeline.command import naming_command, open_database
from ptmtools.pipeline.stages.emit import EMIT
from ptmtools.progress import Progress, silent
from ptmtools.site.conversion import lean_glb, web_texture, without_exact
from ptmtools.site.entry import SiteEntry
from ptmtools.site.files import DATA, SiteFiles
from ptmtools.site.front import Front, SiteOptions as SiteOptions
from ptmtools.store.folder import DatabaseFolder, damage_error
from ptmtools.store.layout import SERVED, sha256
from ptmtools.texture.previews import FORMATS

FORMAT = "ptmtools site"
JSON, JPEG = "application/json", "image/jpeg"
GLB, PTM = "model/gltf-binary", "application/octet-stream"
OPENING = "application/octet-stream"
#: Fields of a database's index that a site's index lacks.
_LEFT_OUT = ("record", "geometry", "textureSets", "statistics")
_IMAGE_MEDIA = {format.suffix: format.media for format in FORMATS.values()}
_VRML_MEDIA = {".wrl": "model/vrml", ".png": "image/png"} | _IMAGE_MEDIA
#: Largest poster, as a share of the site: a building of few bytes is there as soon as its picture.
POSTER_SHARE = 0.1
#: First bytes of pictures: pattern, media type, suffix.
_MAGIC = (
    (rb"\xff\xd8\xff", JPEG, ".jpg"),
    (rb"\x89PNG\r\n\x1a\n", "image/png", ".png"),
    (rb"RIFF....WEBP", "image/webp", ".webp"),
)
#: Fields of a texture that the hints of earlier releases lack.
_NEEDED = {"gpuTexelBytes", "differences", "color"}


@dataclass(frozen=True)
class Site:
    """A site.

    Attributes
    ----------
    entries: its files, by name.
    index: the document that the page reads first.
    notes: remarks for the user, one line each.
    title: of the page.
    again: makes the site with the tour as it is then; raises as `site_tour`.
    """

    entries: Mapping[str, SiteEntry]
    index: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    title: str = ""
    again: Callable[[], Site] | None = field(default=None, repr=False, compare=False)


def site_of(
    database: str | os.PathLike[str],
    options: SiteOptions | None = None,
    progress: Progress = silent,
) -> Site:
    """The site of a finished database.

    Raises
    ------
    DatabaseError: PTM-D001 to D003 no database, or one of another version or earlier release;
        PTM-D004 it is not finished; PTM-D005, D006 a file is missing or damaged; PTM-D606 it has
        no geometry in glTF.
    InputError: PTM-I122 the installed page is incomplete; and as `web_texture`.
    LimitError: as `web_texture`.
    """
    options = options or SiteOptions()
    with naming_command(database):
        folder = open_database(database)
        folder.record(EMIT.name)
        return _Builder(folder, read_served(folder.path), options, progress).site()


class _Builder:
    """Collects the files of a site."""

    def __init__(
        self, folder: DatabaseFolder, served: Served, options: SiteOptions, progress: Progress
    ) -> None:
        self._folder, self._served, self._options = folder, served, options
        self._progress = progress
        self._title = options.title or title_of(folder.path)
        self._digests = folder.manifest.outputs()
        self._files = SiteFiles()

    def site(self) -> Site:
        """The whole site."""
        index = dict(self._served.index)
        for name in _LEFT_OUT:
            index.pop(name, None)
        index["format"] = FORMAT
        index["cells"] = list(self._cells())
        if "meshes" in index:
            index["meshes"] = list(self._meshes())
        for kind in representations_in(index):
            index[kind.name] = list(self._representation_rows(kind))
        index["textures"] = list(self._textures())
        for form in texture_forms(self._served.index):
            index[form.member] = self._texture_form(form)
        index["viewpoints"], poster, picture = self._pictures()
        openings = self._openings(index) if self._options.opening else {}
        if self._options.clients == "vrml":
            self._vrml()
        text = json.dumps(index, ensure_ascii=False, separators=(",", ":")).encode()
        name = self._files.add("index", ".json", JSON, text, compressed=True)
        front = Front(
            self._folder,
            self._served,
            self._options,
            self._title,
            index,
            f"{DATA}/{name}",
            poster,
            picture,
            openings,
        )

        def build_with_tour() -> Site:
            files = SiteFiles(dict(self._files.entries), list(self._files.notes))
            title = front.add(files)
            return Site(files.entries, index, tuple(files.notes), title, build_with_tour)

        return build_with_tour()

    def _openings(self, index: Mapping[str, Any]) -> dict[str, Sequence[float]]:
        """The URLs of the openings, and the addresses of their views, see `openings_of`; none where
        Embree is missing."""
        from ptmtools.site.opening import openings_of

        previews = [p["file"] for row in index["textures"] for p in row.get("previews", ())]

        def read(kind: str, number: int, end: int) -> bytes:
            if kind == "preview":
                url = previews[number]
            elif kind == "texture":
                url = index["textures"][number]["file"]
            else:
                url = index["cells"][number][kind]
            return self._files.entries[f"{DATA}/{url}"].read(end if kind == "texture" else None)

        try:
            openings = list(openings_of(self._served, index, read, self._size()))
        except ImportError:
            return {}
        mark = sha256("".join(sha256(data) for data, _ in openings).encode())
        return {
            f"{DATA}/{self._files.add('opening', f'-{number}.bin', OPENING, data, mark=mark)}": view
            for number, (data, view) in enumerate(openings)
        }

    def _size(self) -> int:
        """Bytes of the files so far."""
        entries = (entry for entry in self._files.entries.values() if not is_other_form(entry.name))
        return sum(entry.state[2] if entry.state else len(entry.read()) for entry in entries)

    def _cells(self) -> Iterator[dict[str, Any]]:
        index = self._served.index
        templates = {"record": index["record"], "geometry": index["geometry"][FORM]}
        media = {"record": (".json", JSON), "geometry": (".glb", GLB)}
        for number, cell in enumerate(index["cells"]):
            self._progress(number, len(index["cells"]), "cells")
            row = dict(cell)
            for kind, template in templates.items():
                url = template.replace("{name}", cell["name"])
                row[kind], row[f"{kind}Bytes"] = self._data(url, cell["name"], *media[kind])
            yield row

    def _meshes(self) -> Iterator[dict[str, Any]]:
        for row in self._served.index["meshes"]:
            stem = self._served.index["cells"][row["cell"]]["name"]
            files = [self._data(url, f"{stem}-mesh", ".glb", GLB) for url in row["files"]]
            names, sizes = zip(*files, strict=True)
            yield row | {"files": names, "bytes": sizes}

    def _representation_rows(self, kind: Representation) -> Iterator[Mapping[str, Any]]:
        """The rows of a kind of representation."""
        for row, file, digest in kind.published.load()(self._served, self._place):
            yield {**row, "file": self._files.add(file.stem, ".bin", PTM, file, digest=digest)}

    def _texture_form(self, form: SiteTextures) -> str:
        """The URL of the document of the textures in another form."""
        entries: list[SiteEntry] = [*form.entries.load()(self._served.index, self._place)]
        self._files.entries |= {entry.name: entry for entry in entries}
        return entries[-1].name.removeprefix(f"{DATA}/")

    def _data(self, url: str, stem: str, suffix: str, media: str) -> tuple[str, int]:
        """The name in the site, and the bytes on the link, of a document or a GLB."""
        file, digest = self._place(url)
        data = self._folder.read(file.relative_to(self._folder.path).as_posix(), digest)
        source: Path | bytes = file
        if media == GLB:
            try:
                source = data = lean_glb(data)
            except FileError as fault:
                raise damage_error(file, str(fault)) from None
        name = self._files.add(stem, suffix, media, source, digest=digest, compressed=True)
        return name, min(len(data), len(compress(data)))

    def _textures(self) -> Iterator[Mapping[str, Any]]:
        rows = self._served.index["textures"]
        for number, row in enumerate(rows):
            self._progress(number, len(rows), "textures")
            if _NEEDED - row.keys():
                raise DatabaseError(
                    "PTM-D003",
                    "was built by an earlier release: its hints lack fields that the page needs",
                    file=self._folder.path,
                    remedy=Rebuild("run {}"),
                )
            file, digest = self._place(row["file"])
            texture = web_texture(file, row)
            if texture.note:
                self._files.note(texture.note)
            if self._options.exact == "never":
                texture = without_exact(file, texture)
            source = file if texture.data is None else texture.data
            changed = dict(texture.row)
            changed |= {
                "file": self._files.add(file.stem, ".ptm", PTM, source, digest=digest),
                "fallback": None,
                "fallbackLevel": None,
            }
            kept = [
                preview
                for preview in changed.pop("previews", ())
                if self._options.preview or preview["level"] >= len(changed["ends"])
            ]
            if kept:
                changed["previews"] = list(self._previews(kept))
            yield changed

    def _previews(self, rows: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
        """The rows of a texture's previews, with the names of their files in the site. All have the
        digest of all, which gzip stores once: a fifth less of the index of the sample museum."""
        places = [self._place(row["file"]) for row in rows]
        mark = sha256("".join(digest for _, digest in places).encode())
        for row, (file, digest) in zip(rows, places, strict=True):
            if not file.is_file() or file.stat().st_size != row["bytes"]:
                raise damage_error(file, "is not the preview that the index has")
            media = _IMAGE_MEDIA[file.suffix]
            name = self._files.add(file.stem, file.suffix, media, file, digest=digest, mark=mark)
            yield {key: value for key, value in row.items() if key != "error"} | {"file": name}

    def _pictures(self) -> tuple[list[dict[str, Any]], str, str]:
        """The viewpoints, and the URLs of the poster and of a picture for link previews, ""
        without."""
        rows = [dict(row) for row in self._served.index["viewpoints"]]
        poster = picture = ""
        if self._options.poster:
            media, suffix, data = _picture_file(self._options.poster)
            poster = self._files.add("poster", suffix, media, data)
        if self._options.pictures:
            self._progress(0, 1, "pictures")
            both = self._files.render(lambda: _viewpoints(self._served), self._folder.path)
            drawn, small = both or (b"", [])
            if drawn and not poster:
                shown = len(drawn) <= POSTER_SHARE * self._size()
                picture = self._files.add("poster" if shown else "picture", ".jpg", JPEG, drawn)
                poster = picture if shown else ""
            for number, (row, data) in enumerate(zip(rows, small, strict=False)):
                row["thumbnail"] = self._files.add(f"vp-{number:03}", ".jpg", JPEG, data)
        poster, picture = (name and f"{DATA}/{name}" for name in (poster, picture or poster))
        return rows, poster, picture

    def _vrml(self) -> None:
        """The files of VRML, under the names that they have in the database."""
        if "vrml" not in self._served.index["geometry"]:
            raise DatabaseError(
                "PTM-D606",
                "has no VRML files",
                file=self._folder.path,
                remedy="write them with `ptm emit DB --format vrml,gltf`",
            )
        for name in sorted(self._digests):
            media = _VRML_MEDIA.get(Path(name).suffix)
            if media and name.startswith(f"{SERVED}/"):
                url = quote(name.removeprefix(f"{SERVED}/"))
                self._files.entries[url] = SiteEntry(
                    url, self._folder.path / name, media, compressed=url.endswith(".wrl")
                )

    def _place(self, url: str) -> tuple[Path, str]:
        """The file that a URL of the index names, and its recorded hash."""
        name = f"{SERVED}/{os.path.normpath(unquote(url))}"
        file = self._folder.path / name
        if name not in self._digests:
            raise damage_error(file, "the manifest does not list it")
        return file, self._digests[name]


def _viewpoints(served: Served) -> tuple[bytes, list[bytes]]:
    from ptmtools.site.pictures import pictures

    return pictures(served)


def _picture_file(file: str) -> tuple[str, str, bytes]:
    """Media type, suffix and bytes of a picture; raises InputError PTM-I125 if it is none."""
    try:
        with open_regular(file) as stream:
            data = stream.read()
    except OSError as fault:
        reason = f"cannot be read ({fault.strerror or fault})"
        raise InputError("PTM-I125", reason, file=file) from None
    for begin, media, suffix in _MAGIC:
        if re.match(begin, data, re.DOTALL):
            return media, suffix, data
    remedy = "use a JPEG, PNG or WebP"
    raise InputError("PTM-I125", "is no picture that browsers show", file=file, remedy=remedy)


def title_of(database: Path) -> str:
    """The name of a database as a title: `old_town-hall.db` is "Old town hall"."""
    words = re.sub(r"[\s_-]+", " ", database.resolve().stem).strip()
    return words[:1].upper() + words[1:]
