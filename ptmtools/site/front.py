"""The page of a walk with what leads to it: the tour, its catalogue, and the web application
manifest. They are made anew when the tour changes; the walk's data are not.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

from ptmtools.options import option
from ptmtools.output.served import Served
from ptmtools.site.about import About, description_of, folder_of
from ptmtools.site.catalogue import ANGLE, CatalogueContent, catalogue_of
from ptmtools.site.entry import SiteEntry
from ptmtools.site.files import DATA, SiteFiles, add_manifest
from ptmtools.site.program import (
    ELEMENT,
    HTML,
    WORKER,
    add_policy,
    fixed_script,
    page,
    program_files,
    registration,
)
from ptmtools.site.tours import SiteTour, site_tour
from ptmtools.store.folder import DatabaseFolder


@dataclass(frozen=True)
class SiteOptions:
    """Options of `ptmtools.site.content.site_of`."""

    heading: ClassVar[str] = "Site"

    title: str = option(
        "", "Title of the page. Default: that of the tour, or the name of the database."
    )
    poster: str = option(
        "",
        "Picture (JPEG, PNG or WebP) to show while the building loads. Default: a rendered image "
        "from the first viewpoint, unless the building itself is small.",
        metavar="FILE",
    )
    description: str = option(
        "",
        "Description of the site for search engines and link previews. Default: that of the "
        "tour, or the first places.",
    )
    address: str = option(
        "",
        "Address of the site, such as https://example.org/walk/: link previews and search engines "
        "get absolute URLs.",
        metavar="URL",
    )
    pictures: bool = option(True, "Render a poster and images of the viewpoints.")
    exact: Literal["built", "never"] = option(
        "built",
        "Levels of the textures: as built, or never the exact ones where a preview has the finest "
        "level, for a site of a few megabytes.",
    )
    preview: bool = option(
        True, "Include the previews; without them, only levels that exist as images have one."
    )
    opening: bool = option(
        True,
        "Write openings: each is one file with everything small that a viewpoint needs, which the "
        "page fetches together with its program. The first viewpoint has one, others while they "
        "add little to the site.",
    )
    tour: str = option(
        "",
        "Labels and stops (docs/formats/tour.md), or none. Default: tour.json in the folder that "
        "contains the database, if it exists.",
        metavar="FILE",
    )
    offline: bool = option(
        False,
        "Let browsers keep what a visitor has seen, so that the walk works without a network "
        "(docs/formats/offline.md). The host needs https.",
    )
    clients: Literal["page", "vrml"] = option(
        "page",
        "Clients that the site supports: page (only its own page) or vrml (also VRML browsers, "
        "which adds files).",
        name="for",
    )


@dataclass(frozen=True)
class Front:
    """The page of a database.

    Attributes
    ----------
    title: of the site, if its tour has none.
    index: the document that the page reads first. url: its URL.
    poster: the URL of the poster, "" without one. picture: of that for link previews.
    openings: those of the openings, and the addresses of their views; see `program.page`.
    """

    folder: DatabaseFolder
    served: Served
    options: SiteOptions
    title: str
    index: Mapping[str, Any]
    url: str
    poster: str
    picture: str
    openings: Mapping[str, Sequence[float]]

    def add(self, files: SiteFiles) -> str:
        """Adds the files; returns the title of the page. Raises as `site_tour`; InputError
        PTM-I122: the program is incomplete."""
        program = program_files()
        for entry in (*program.values(), fixed_script(ELEMENT)):
            files.put(entry)
        tour = self._tour(files)
        title = (tour and tour.text("title")) or self.options.title or self.title
        settings = {
            "index": self.url,
            "worker": program["worker.js"].name,
            "wasm": program["decoder.wasm"].name,
            "poster": self.poster or None,
            "title": title,
            **(self._tour_files(tour, title, files) if tour else {}),
        }
        preload = [self.url, program["decoder.wasm"].name]
        viewpoints = self.index["viewpoints"]
        if not self.openings:
            first = self.index["cells"][viewpoints[0]["cell"]]
            preload += [f"{DATA}/{first[kind]}" for kind in ("record", "geometry")]
        written = self.options.description or (tour and tour.text("description"))
        description = written or description_of(viewpoints, *([tour.place] if tour else []))
        head = [*About(title, description, self.picture, self.options.address).lines()]
        if self.options.offline:
            files.put(fixed_script(WORKER))
            head.append(registration(program))
        files.put(page(settings, program["viewer.js"].name, preload, self.openings, head))
        add_manifest(files, title)
        return title

    def _tour(self, files: SiteFiles) -> SiteTour | None:
        """The tour, None without one and with one that a visitor would see nothing of."""
        tour, note = site_tour(
            self.folder,
            self.options.tour,
            lambda file, media: files.add(file.stem, file.suffix, media, file.read_bytes()),
        )
        if note:
            files.note(note)
        if tour and tour.empty:
            files.note("the tour is empty: the site has none")
            return None
        options = {"title": self.options.title, "description": self.options.description}
        chosen = {name: {"": text} for name, text in options.items() if text}
        return tour and replace(tour, document=tour.document | chosen)

    def _tour_files(self, tour: SiteTour, title: str, files: SiteFiles) -> dict[str, str]:
        """Adds the tour and its catalogue; returns the settings of the page for them: their URLs. A
        tour without labels has no catalogue."""
        text = json.dumps(tour.document, ensure_ascii=False, separators=(",", ":")).encode()
        name = files.add("tour", ".json", "application/json", text, compressed=True)
        settings = {"tour": f"{DATA}/{name}"}
        if not tour.document["labels"]:
            return settings
        pages = catalogue_of(self._catalogue(tour, title, files))
        for name, html in pages.items():
            files.put(SiteEntry(name, add_policy(html).encode(), HTML, compressed=True))
        return settings | {"catalogue": next(iter(pages))}

    def _catalogue(self, tour: SiteTour, title: str, files: SiteFiles) -> CatalogueContent:
        stops: dict[int, Mapping[str, Any]] = {}
        for stop in tour.document["stops"]:
            if "label" in stop:
                stops.setdefault(stop["label"], stop | {"fieldOfView": ANGLE})
        pictures: dict[int, str] = {}
        if self.options.pictures and stops:
            works = files.render(lambda: self._works([*stops.values()]), self.folder.path)
            for number, data in zip(stops, works or (), strict=False):
                id = tour.document["labels"][number]["id"]
                pictures[number] = f"{DATA}/{files.add(f'work-{id}', '.jpg', 'image/jpeg', data)}"
        rooms: dict[int, str] = {}
        for viewpoint in self.served.index["viewpoints"]:
            rooms.setdefault(viewpoint["cell"], viewpoint["description"])
        address = folder_of(self.options.address)
        return CatalogueContent(
            tour.document, title, rooms, pictures, tour.transcripts, f"{DATA}/", address
        )

    def _works(self, views: Sequence[Mapping[str, Any]]) -> list[bytes]:
        from ptmtools.site.pictures import WORK, pictures_of

        return list(pictures_of(self.served, [(WORK, view) for view in views]))
