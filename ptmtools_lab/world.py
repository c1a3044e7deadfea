"""Data shared by all runs of a walk: the served files, the screen along the walk, and the walker's
cells.

Preparing it takes most of the time; a run then takes a second.

A walk that begins at the first viewpoint, or in a small site, gets the opening
(`ptmtools.site.opening`): its parts arrive one after the other in one response, which is requested
together with the index.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.rays import Frustum, RayCamera
from ptmtools.rendering.records import Pyramids, Shows
from ptmtools.rendering.tone import show_vertex_light
from ptmtools.site.client import ITEM_PIXELS
from ptmtools.site.opening import NeedFinder, contents_of, ordered_steps, other_rooms
from ptmtools.walk import Browser
from ptmtools_lab.catalogue import Catalogue, catalogue_of
from ptmtools_lab.forms import FORMS, PTM
from ptmtools_lab.lossy import Lossy, read_lossy
from ptmtools_lab.relief import Relief
from ptmtools_lab.tables import PLAIN, Drawing, WalkViews, look
from ptmtools_lab.track import RATE, Track, track_of

if TYPE_CHECKING:
    from ptmtools.walk import Walk

#: Kind, number and end of each part, in order.
Parts = tuple[tuple[str, int, int], ...]
#: How far a walk may begin from the viewpoint, metres, and the cosine of the angle between them.
NEAR, ALIKE = 0.5, np.cos(np.radians(10.0))


def opening_of(served: Served, catalogue: Catalogue, eye: Floats, direction: Floats) -> Parts:
    """The parts for a walk that begins with a view; none without Embree, or if it begins elsewhere
    and the opening lacks other rooms.

    Parameters
    ----------
    catalogue: has the bytes of records and geometry on the link.
    eye, direction: (3,)
    """
    views = served.index["viewpoints"]
    # Databases of earlier releases have no site.
    if not views or any("differences" not in row for row in served.index["textures"]):
        return ()
    view = views[0]
    away = np.linalg.norm(eye - np.array(view["position"]))
    aside = direction @ np.array(view["direction"]) / np.linalg.norm(direction)
    try:
        needs = NeedFinder(served).needs(view)
    except ImportError:
        return ()
    sizes = {
        (name, cell): int(size)
        for name, bytes_ in (
            ("record", catalogue.record_bytes), ("geometry", catalogue.geometry_bytes),
        )
        for cell, size in enumerate(bytes_)
    }  # fmt: skip
    steps = ordered_steps(served.index, needs, view["cell"], sizes)
    rest = other_rooms(served.index, steps, sizes)
    if rest is None and (away > NEAR or aside < ALIKE):
        return ()
    # Each counts as its file, with more bytes than in the stream of the opening.
    parts, _ = contents_of([*steps, *(rest or ())])
    return tuple((part.kind, part.number, part.end) for part in parts)


#: Pixels of the item buffer that errors are summed over.
PIXELS = (160, 90)


@dataclass(frozen=True)
class World:
    """A walk through a database.

    Attributes
    ----------
    served: the served files. pyramids: all levels of the textures. lossy: see `Lossy`.
    catalogue: the catalogue of clients.
    track: the viewpoint, frame by frame. views: the tables of the screen, by `Track.view`.
    camera: the camera of the item buffer.
    one_range: whether a client requests one range of a file at a time, as browsers must.
    opening: kind, number and end of each part of the opening of a site, if the walk begins where
        that is made for.
    colored: whether clients know the mean colour of each texture; else it is grey until its first
        level arrives.
    form: form of the textures, a name in `ptmtools_lab.forms.FORMS`.
    shows: images of the columns, None for the levels of the pyramids and previews.
    relief: octrees, which come after the textures, and the reference of pictures; None: neither.
    other_forms: the same world in other forms, by name.
    """

    served: Served
    pyramids: Pyramids
    lossy: Lossy
    catalogue: Catalogue
    track: Track
    views: WalkViews
    camera: RayCamera
    colored: bool = True
    one_range: bool = False
    opening: Parts = ()
    form: str = PTM
    shows: Shows | None = None
    relief: Relief | None = None
    other_forms: Mapping[str, World] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.track.frames

    def in_form(self, form: str) -> World:
        """The same world for clients with textures in a form.

        Raises InputError PTM-I701 if it was not prepared for that form.
        """
        if form == self.form:
            return self
        if form not in self.other_forms:
            raise InputError(
                "PTM-I701",
                f"textures are not available as {FORMS[form].about} here",
                remedy="walk with another policy, or by `ptm simulate`",
            )
        return self.other_forms[form]

    def change_all(self, change: Callable[[World], World]) -> World:
        """Applies a change to this world and to its other forms."""
        other_forms = {name: change(world) for name, world in self.other_forms.items()}
        return replace(change(self), other_forms=other_forms)

    def counted_by_paper(self) -> World:
        """The same world with RGB of three bytes in texture memory."""
        columns = FORMS[self.form].columns(self.served, True)
        return replace(self, catalogue=self.catalogue.with_memory(columns.memory))

    def frustum(self, frame: int) -> Frustum:
        """The view frustum of a frame."""
        aspect, angle = self.camera.aspect, self.camera.field_of_view
        return Frustum(self.track.eye[frame], self.track.direction[frame], angle, aspect)

    def standing(self, seconds: float) -> World:
        """A visitor who stays at the first frame for this time."""
        return self.change_all(lambda world: replace(world, track=world.track.standing(seconds)))


def prepare(
    served: Served,
    walk: Walk,
    pyramids: Pyramids | None = None,
    *,
    rate: float = RATE,
    pixels: tuple[int, int] = PIXELS,
    progress: Progress = silent,
    views: WalkViews | None = None,
    drawing: Drawing = PLAIN,
) -> World:
    """The world of a walk.

    Parameters
    ----------
    pyramids: those of this database, if already read.
    rate: frames a second. pixels: of the item buffer, across and down.
    views: those of this walk, if already made.
    drawing: see `Drawing`; forms as read by `read_forms`, relief by `relief_of`.

    Raises
    ------
    InputError: PTM-I700 the walk does not lead through this database.
    LimitError: PTM-L400 it is too long.
    DatabaseError, LimitError: those of `read_pyramids` and `read_lossy`.
    """
    track, poses = track_of(served, walk, rate)
    browser, relief, forms = track.browser, drawing.relief, drawing.forms
    textures = read_pyramids(served, progress) if pyramids is None else pyramids
    lossy = read_lossy(served, progress) if drawing.lossy is None else drawing.lossy
    camera = RayCamera(*pixels, walk.field_of_view, walk.aspect)
    camera = _camera(walk, browser) if browser else camera
    form_views: list[WalkViews] = []
    if views is None:
        drawing = drawing._replace(lossy=lossy)
        eyes, directions = poses[:, :3], poses[:, 3:]
        views, *form_views = look(
            show_vertex_light(served).surfaces,
            textures,
            camera,
            eyes,
            directions,
            progress,
            drawing,
        )
    catalogue = catalogue_of(served, textures.differences, textures.mean)
    catalogue = catalogue.with_browser_sizes(browser) if browser else catalogue
    eye, direction = track.eye[0], track.direction[0]
    world = World(
        served=served,
        pyramids=textures,
        lossy=lossy,
        catalogue=catalogue,
        track=track,
        views=views,
        camera=camera,
        one_range=browser is not None,
        opening=() if browser else opening_of(served, catalogue, eye, direction),
        relief=relief,
    )
    world = _with_forms(world, forms, form_views)
    return _with_octrees(world, catalogue, relief) if relief else world


def _with_forms(world: World, forms: Mapping[str, Shows], views: list[WalkViews]) -> World:
    """The world with the ``forms`` of its textures, each with its views."""
    stock = world.catalogue
    other_forms = {
        name: replace(
            world,
            form=name,
            catalogue=stock.in_columns(FORMS[name].columns(world.served, False)),
            views=views_in_form,
            shows=shows,
        )
        for (name, shows), views_in_form in zip(forms.items(), views, strict=True)
    }
    return replace(world, other_forms=other_forms)


def _with_octrees(world: World, catalogue: Catalogue, relief: Relief) -> World:
    """The world with its octrees: without files for clients that draw none, and in the forms that
    have them beside ``catalogue``, that of the textures alone."""
    from ptmtools_lab.relief import with_octrees, without_octrees

    octrees = relief.octrees
    world = world.change_all(lambda w: replace(w, catalogue=without_octrees(w.catalogue, octrees)))
    if not octrees.number:
        return world
    names = [form.name for form in FORMS.values() if form.octrees]
    fetched = with_octrees(catalogue, world.served, octrees)
    more = {name: replace(world, form=name, catalogue=fetched, other_forms={}) for name in names}
    return replace(world, other_forms={**world.other_forms, **more})


def relief_of(
    served: Served,
    pyramids: Pyramids,
    against: Served | None = None,
    *,
    lit: bool = True,
    progress: Progress = silent,
) -> Relief | None:
    """The octrees of a database, and another one of the same model whose full picture is the
    reference; both are ``lit`` (`relief.light.lit`) or neither, and then there are no octrees.

    Raises
    ------
    InputError: PTM-I700 the other database has other textures.
    DatabaseError: those of `read_octrees` and `read_pyramids`.
    """
    from ptmtools_lab.relief import Reference
    from ptmtools_systems.apo.served_octrees import no_octrees, read_octrees

    if against is None and not lit:
        return None
    reference = None
    if against is not None:
        indices = served.index, against.index
        names = [[row["file"] for row in index["textures"]] for index in indices]
        if names[0] != names[1]:
            raise InputError(
                "PTM-I700",
                "has other textures than what is walked through",
                file=against.folder,
                remedy="use a database of the same model, with --against",
            )
        full = read_pyramids(against, progress)
        same = all(np.array_equal(full[k], pyramids[k]) for k in range(len(full)))
        surfaces = show_vertex_light(against).surfaces
        reference = Reference(surfaces, pyramids if same else full)
    octrees = read_octrees(served) if lit else no_octrees(served.surfaces)
    return Relief(octrees, reference)


def read_forms(
    served: Served, pyramids: Pyramids, names: Iterable[str], progress: Progress = silent
) -> dict[str, Shows]:
    """The images of textures in the named forms, without the `.ptm`s themselves.

    Raises DatabaseError, LimitError: see `Form.shows`.
    """
    known = (FORMS[name] for name in dict.fromkeys(names))
    return {f.name: f.shows(served, pyramids, progress) for f in known if f.shows}


def _camera(walk: Walk, browser: Browser) -> RayCamera:
    """A camera with twice as many pixels each way as the viewer's item buffer."""
    tall = max(1, round(np.sqrt(ITEM_PIXELS / walk.aspect)))
    wide = max(1, round(ITEM_PIXELS / tall))
    return RayCamera(2 * wide, 2 * tall, walk.field_of_view, walk.aspect, browser.lines)
