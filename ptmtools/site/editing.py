"""The tour of a database while a person edits it on the page: reads, checks, places and saves it.

The only file that is written is `tour.json` beside the database, and only with a document that
`ptm tour check` accepts.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from ptmtools.errors import InputError, OutputError, naming
from ptmtools.files import write_bytes
from ptmtools.pipeline.command import naming_command, open_database
from ptmtools.site.entry import SiteEntry, stamp_of, state_of
from ptmtools.site.tours import TourPlacer
from ptmtools.store.layout import MANIFEST, sha256
from ptmtools.tour.model import FORMAT, NAME, SCHEMA, Tour
from ptmtools.tour.pictures import pick_objects
from ptmtools.tour.reading import CAPTIONS, LARGEST, SOUNDS, content_of, document_of, tour_of
from ptmtools.tour.writing import format_json, rewrite

#: Folder of sounds and captions in the addresses of the server.
MEDIA = "edit/media"
#: Tag of a tour that does not exist yet.
ABSENT = '"none"'
#: The most files that are offered, the most folders that are searched, and their depth.
_MOST_FILES, _MOST_FOLDERS, _DEEPEST = 1000, 500, 3


class StaleError(Exception):
    """The tour was changed since it was read."""


class TourEditor:
    """The tour beside a database.

    Raises
    ------
    DatabaseError: as `open_database`, and PTM-D004 to D008 for the artifacts.
    InputError: as `read_tour`; PTM-I870 it is the tour of another model.
    OutputError: PTM-O002 the folder or the file cannot be written.
    """

    def __init__(self, database: str | os.PathLike[str]) -> None:
        self._database = Path(database)
        self._folder = self._database.absolute().parent
        self.file = self._folder / NAME
        self._lock = Lock()
        #: Sounds and captions by their names below `MEDIA`.
        self._media: dict[str, SiteEntry] = {}
        self._open()
        self._refuse_read_only()
        data = self._read()
        if data is not None:
            self.page_document(data)

    def _open(self) -> None:
        self._stamp = self._state()
        with naming_command(self._database):
            folder = open_database(self._database)
            self._placer = TourPlacer(folder)
        self._model = folder.manifest.model

    def _state(self) -> tuple[int, ...]:
        return stamp_of(self._database / MANIFEST)

    def _refuse_read_only(self) -> None:
        target = self.file if self.file.exists() else self._folder
        for path in (self._folder, target):
            if not os.access(path, os.W_OK):
                kind = "file" if path == self.file else "folder"
                raise OutputError(
                    "PTM-O002",
                    f"the {kind} cannot be written, so that nothing could be saved",
                    file=path,
                    remedy="change its permissions, or copy the database to a folder of your own",
                )

    def load(self) -> tuple[dict[str, Any], str]:
        """The document, a new one if there is none, and its tag; raises as `read_tour`."""
        data = self._read()
        if data is None:
            return self._first(), ABSENT
        with naming(self.file):
            return document_of(data), tag_of(data)

    def _first(self) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "schema": SCHEMA,
            "model": self._model,
            "languages": ["en"],
            "labels": [],
            "stops": [],
        }

    def _read(self) -> bytes | None:
        return content_of(self.file, LARGEST) if os.path.lexists(self.file) else None

    def page_document(self, data: bytes) -> dict[str, Any]:
        """A tour as the page shows it, with sounds below `MEDIA`.

        Raises as `read_tour` and `Placing.anchors`; InputError: PTM-I870 of another model.
        """
        return self._place(tour_of(data, self.file))

    def _place(self, tour: Tour) -> dict[str, Any]:
        if tour.model and tour.model != self._model:
            raise InputError(
                "PTM-I870",
                f"is the tour of {tour.model}, not of {self._model}",
                file=self.file,
                place="model",
                remedy="move it elsewhere, or correct its model",
            )
        with naming(self.file):
            return self._current().page_document(tour, self._media_name)

    def _current(self) -> TourPlacer:
        """Of the database as it is: it may have been built again."""
        if self._state() != self._stamp:
            self._open()
        return self._placer

    def save(self, data: bytes, tag: str) -> tuple[dict[str, Any], str]:
        """Writes a document in the place of the one with a tag; returns it as the page shows it,
        and its own tag.

        Raises
        ------
        StaleError: the file has another tag.
        OutputError: PTM-O002, O003 it cannot be written.
        and as `page_document`.
        """
        with naming(self.file):
            document = document_of(data)
        with self._lock:
            before = self._read()
            if (ABSENT if before is None else tag_of(before)) != tag:
                raise StaleError
            if before is None:
                text = format_json(document) + "\n"
            else:
                text = rewrite(before.decode(), document)
            after = text.encode()
            shown = self.page_document(after)
            if after != before:
                write_bytes(self.file, after, force=True)
        return shown, tag_of(after)

    def pick(self, eye: Sequence[float], direction: Sequence[float]) -> list[dict[str, Any]]:
        """The objects on a ray, see `pick_objects`."""
        placer = self._current()
        start, along = np.array(eye, np.float64), np.array(direction, np.float64)
        return [
            asdict(p) for p in pick_objects(placer.scene, placer.placing.pictures, start, along)
        ]

    def rooms(self) -> list[str]:
        """The names that labels of rooms may have."""
        rooms = self._current().scene.rooms
        return list(dict.fromkeys(room.name for room in rooms if room.name and len(room.points)))

    def places(self) -> list[str]:
        """The names of places that a tour may change."""
        return [*self._current().place_names()]

    def sounds(self) -> list[str]:
        """Recordings in the folder of the tour and below, relative to it."""
        return sorted(self._files(SOUNDS))

    def captions(self) -> list[str]:
        """Captions, likewise."""
        return sorted(self._files(CAPTIONS))

    def _files(self, suffixes: Mapping[str, str]) -> Iterator[str]:
        count = 0
        for number, (folder, folders, names) in enumerate(os.walk(self._folder)):
            path = Path(folder)
            depth = len(path.relative_to(self._folder).parts)
            if number >= _MOST_FOLDERS:
                return
            # Databases and hidden folders hold none.
            folders[:] = sorted(
                name
                for name in folders
                if depth < _DEEPEST and name[0] != "." and not (path / name / MANIFEST).exists()
            )
            for name in sorted(names):
                if Path(name).suffix.lower() in suffixes and name[0] != "." and count < _MOST_FILES:
                    count += 1
                    yield (path / name).relative_to(self._folder).as_posix()

    def _media_name(self, file: Path, media: str) -> str:
        state = state_of(file.stat())
        name = f"{sha256(repr((str(file), state)).encode())[:16]}{file.suffix.lower()}"
        entry = SiteEntry(f"{MEDIA}/{name}", file, media, state=state)
        self._media[entry.name] = entry
        return name

    def media(self, name: str) -> SiteEntry | None:
        """The entry of a sound or of captions that a shown tour names."""
        return self._media.get(name)


def tag_of(data: bytes) -> str:
    """The entity tag of a tour's text."""
    return f'"{sha256(data)}"'
