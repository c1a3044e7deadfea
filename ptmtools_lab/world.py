"""Data shared by all runs of a walk: the served files, the screen along the walk, and the walker's
cells.

Preparing it takes most of the time; a run then takes a second.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import InputError, LimitError
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.rendering.lossy import read_lossy
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.rays import Frustum, RayCamera
from ptmtools.rendering.records import Lossy, Pyramids, Shows
from ptmtools.walk import Browser
from ptmtools_lab.catalogue import Catalogue, catalogue_of
from ptmtools_lab.forms import FORMS, PTM
from ptmtools_lab.opening import Parts, opening_of
from ptmtools_lab.relief.tables import Relief
from ptmtools_lab.tables import Views, look

if TYPE_CHECKING:
    from ptmtools.walk import Walk

#: Evaluated frames per second.
RATE = 5.0
#: Pixels of the item buffer that errors are summed over.
PIXELS = (160, 90)
#: Pixels of the item buffer of a browser, whatever the aspect of its screen.
_ITEM_PIXELS = 3600
#: Frames of a walk at most: some five hours.
MOST_FRAMES = 100_000
#: Share of the walk that may lie in no cell.
_ASTRAY = 0.05
#: A viewpoint is still if it moved less (metres) and turned less (cosine) in the last second.
STILL_SECONDS, _STILL_METRES, _STILL_COSINE = 1.0, 1e-3, np.cos(np.radians(1.0))


@dataclass(frozen=True)
class World:
    """A walk through a database.

    Attributes
    ----------
    served: the served files. pyramids: all levels of the textures. lossy: see `Lossy`.
    catalogue: the catalogue of clients.
    views, view: the tables of the screen, and (F,) the view of each frame.
    camera: the camera of the item buffer.
    time: (F,) s. eye, direction: (F, 3).
    cell: (F,) cell of the eye; outside of cells the last one.
    still: (F,) whether the viewpoint has not moved for a second.
    rate: frames a second.
    one_range: whether a client requests one range of a file at a time, as browsers must.
    opening: kind, number and end of each part of the opening of a site, if the walk begins where
        that is made for (`ptmtools_lab.opening`).
    browser: conditions of a recording in a browser, or None. Times are then since navigation, and a
        frame has the view of the available item buffer.
    drawn: (F,) the frame in which that item buffer was drawn, -1 without one; None unless in a
        browser.
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
    views: Views
    view: Ints
    camera: RayCamera
    time: Floats
    eye: Floats
    direction: Floats
    cell: Ints
    still: Bools
    rate: float = RATE
    colored: bool = True
    one_range: bool = False
    opening: Parts = ()
    browser: Browser | None = None
    drawn: Ints | None = None
    form: str = PTM
    shows: Shows | None = None
    relief: Relief | None = None
    other_forms: Mapping[str, World] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.time)

    def still_after(self, seconds: float) -> Bools:
        """(F,) the frames in which the viewpoint has not moved for ``seconds``."""
        if seconds == STILL_SECONDS:
            return self.still
        return _still(self.time, self.eye, self.direction, seconds)

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

    def changed(self, change: Callable[[World], World]) -> World:
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
        return Frustum(self.eye[frame], self.direction[frame], angle, aspect)

    def standing(self, seconds: float) -> World:
        """A visitor who stays at the first frame for this time."""
        rate = RATE if self.browser else self.rate
        count = int(np.ceil(seconds * rate)) + 1
        first = np.zeros(count, np.int64)
        time = np.arange(count) / rate
        return replace(
            self,
            view=self.view[first],
            time=time,
            eye=self.eye[first],
            direction=self.direction[first],
            cell=self.cell[first],
            still=time >= STILL_SECONDS,
            rate=rate,
            browser=None,
            drawn=None,
            other_forms={name: world.standing(seconds) for name, world in self.other_forms.items()},
        )


def prepare(
    served: Served,
    walk: Walk,
    pyramids: Pyramids | None = None,
    *,
    rate: float = RATE,
    pixels: tuple[int, int] = PIXELS,
    progress: Progress = silent,
    full: Pyramids | None = None,
    same_maps: bool = False,
    views: Views | None = None,
    forms: Mapping[str, Shows] | None = None,
    relief: Relief | None = None,
    lossy: Lossy | None = None,
) -> World:
    """The world of a walk.

    Parameters
    ----------
    pyramids: those of this database, if already read.
    rate: frames a second. pixels: of the item buffer, across and down.
    full, same_maps: another reference of pictures; see `look`.
    views: those of this walk, if already made.
    forms: other forms of textures, as read by `read_forms`.
    relief: octrees and another reference database (`relief_of`).
    lossy: previews of this database, if already read.

    Raises
    ------
    InputError: PTM-I700 the walk does not lead through this database.
    LimitError: PTM-L400 it is too long.
    DatabaseError, LimitError: those of `read_pyramids` and `read_lossy`.
    """
    time, browser = frame_times(walk, rate), walk.browser
    if browser:
        _require_fitting(browser, served)
        rate, time = (len(walk.time) - 1) / walk.duration, walk.time
        eye, direction, cell = walk.eye, walk.direction, browser.cell
        if (cell < 0).any():
            cell = np.where(cell < 0, served.locator.along(eye), cell)
    else:
        eye, direction = walk.at(time)
        cell = served.locator.along(eye)
    astray = cell < 0
    if astray.mean() > _ASTRAY:
        raise InputError(
            "PTM-I700",
            f"{astray.mean():.0%} of the walk lies in none of the cells",
            remedy="use a walk through this very database, such as `ptm path DB` makes",
        )
    known = np.maximum.accumulate(np.where(astray, -1, np.arange(len(cell))))
    cell = cell[np.where(known < 0, int(np.argmax(~astray)), known)]
    textures = read_pyramids(served, progress) if pyramids is None else pyramids
    lossy = read_lossy(served, progress) if lossy is None else lossy
    if full is None and relief and relief.reference:
        full = relief.reference.pyramids
    camera = RayCamera(*pixels, walk.field_of_view, walk.aspect)
    pose, drawn = np.concatenate([eye, direction], axis=1), None
    if browser:
        camera, drawn = _camera(walk, browser), _drawn(time, browser.age)
        pose = pose[np.where(drawn < 0, np.arange(len(time)), drawn)]
    seen, view = np.unique(pose, axis=0, return_inverse=True)
    others: list[Views] = []
    if views is None:
        eyes, looks = seen[:, :3], seen[:, 3:]
        shows = [*(forms or {}).values()]
        views, *others = look(
            served.surfaces, textures, camera, eyes, looks, progress, forms=shows, full=full,
            same_maps=same_maps, relief=relief, lossy=lossy,
        )  # fmt: skip
    catalogue = catalogue_of(served, textures.differences, textures.mean)
    catalogue = catalogue.with_browser_sizes(browser) if browser else catalogue
    opening = () if browser else opening_of(served, catalogue, eye[0], direction[0])
    world = World(
        served=served,
        pyramids=textures,
        lossy=lossy,
        catalogue=catalogue,
        views=views,
        view=view.reshape(-1).astype(np.int64),
        camera=camera,
        time=time + browser.begun if browser else time,
        eye=eye,
        direction=direction,
        cell=cell,
        still=_still(time, eye, direction),
        rate=rate,
        one_range=browser is not None,
        opening=opening,
        browser=browser,
        drawn=drawn,
        relief=relief,
    )
    other_forms = {
        name: replace(
            world,
            form=name,
            catalogue=world.catalogue.in_columns(FORMS[name].columns(served, False)),
            views=form_views,
            shows=shown,
        )
        for (name, shown), form_views in zip((forms or {}).items(), others, strict=True)
    }
    world = replace(world, other_forms=other_forms)
    if relief is None:
        return world
    from ptmtools_lab.relief.stock import with_octrees, without_octrees

    octrees = relief.octrees
    world = world.changed(lambda w: replace(w, catalogue=without_octrees(w.catalogue, octrees)))
    if not octrees.number:
        return world
    drawing = [form.name for form in FORMS.values() if form.octrees]
    fetched = with_octrees(catalogue, served, octrees)
    more = {name: replace(world, form=name, catalogue=fetched, other_forms={}) for name in drawing}
    return replace(world, other_forms={**world.other_forms, **more})


def frame_times(walk: Walk, rate: float) -> Floats:
    """(F,) s, the times of the frames of a walk at a rate. Raises LimitError PTM-L400 if they are
    too many."""
    if walk.duration * rate > MOST_FRAMES:
        raise LimitError(
            "PTM-L400",
            f"a walk of {walk.duration:g} s has more than {MOST_FRAMES:,} frames",
            remedy="use a shorter one",
        )
    return np.asarray(np.arange(int(np.floor(walk.duration * rate + 1e-9)) + 1) / rate)


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
    from ptmtools_lab.relief.tables import Reference
    from ptmtools_systems.apo.served_octrees import no_octrees, read_octrees

    if against is None and not lit:
        return None
    reference = None
    if against is not None:
        names = [[row["file"] for row in each.index["textures"]] for each in (served, against)]
        if names[0] != names[1]:
            raise InputError(
                "PTM-I700",
                "has other textures than what is walked through",
                file=against.folder,
                remedy="use a database of the same model, with --against",
            )
        full = read_pyramids(against, progress)
        same = all(np.array_equal(full[k], pyramids[k]) for k in range(len(full)))
        reference = Reference(against.surfaces, pyramids if same else full)
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


def _require_fitting(browser: Browser, served: Served) -> None:
    previews = sum(len(row.get("previews", ())) for row in served.index["textures"])
    for kind, present in (("preview", previews), ("mesh", sum(map(len, served.mesh_bytes)))):
        numbers = [file.number for file in browser.files if file.kind == kind]
        if max(numbers, default=-1) >= present:
            raise InputError(
                "PTM-I700",
                f"was recorded with {kind} {max(numbers)}, and there are {present}",
                remedy="use the database whose site it was recorded on",
            )
    if len(browser.record_bytes) != served.cell_count:
        raise InputError(
            "PTM-I700",
            f"was recorded among {len(browser.record_bytes)} cells, not {served.cell_count}",
            remedy="use the database whose site it was recorded on",
        )


def _camera(walk: Walk, browser: Browser) -> RayCamera:
    """A camera with twice as many pixels each way as the viewer's item buffer."""
    tall = max(1, round(np.sqrt(_ITEM_PIXELS / walk.aspect)))
    wide = max(1, round(_ITEM_PIXELS / tall))
    return RayCamera(2 * wide, 2 * tall, walk.field_of_view, walk.aspect, browser.lines)


def _drawn(time: Floats, age: Floats) -> Ints:
    """(F,) the frame in which the available item buffer of each frame was drawn, -1 without one."""
    # The time of an item buffer is the beginning of its frame, that of a frame its end.
    frames: Ints = np.where(age < 0, -1, np.searchsorted(time, time - age, "right"))
    return frames


def _still(time: Floats, eye: Floats, direction: Floats, seconds: float = STILL_SECONDS) -> Bools:
    still = np.zeros(len(time), dtype=bool)
    begin = np.searchsorted(time, time - seconds - 1e-9)
    for f in np.flatnonzero(time >= seconds).tolist():
        last = slice(int(begin[f]), f + 1)
        moved = np.abs(eye[last] - eye[f]).max()
        still[f] = moved < _STILL_METRES and (direction[last] @ direction[f]).min() > _STILL_COSINE
    return still
