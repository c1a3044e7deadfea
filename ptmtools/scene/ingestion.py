"""Ingest: reads a model file into a `Scene` in world metres, Y up.

The reader of the format (`formats`) returns the triangles in the space of the file. The steps of
`STEPS` clean the faces, find unit and up axis, keep the materials and images that some remaining
face uses, and gather the lights. Notes record what was guessed, dropped or missing;
docs/formats/codes.md lists their codes.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, areas, sum_by_group
from ptmtools.errors import InputError
from ptmtools.files import open_regular
from ptmtools.progress import Progress, silent
from ptmtools.scene.faces import KeptFaces, keep_faces
from ptmtools.scene.formats import ModelFormat, format_of
from ptmtools.scene.images import ImageStore, OptionalImages
from ptmtools.scene.lighting import add_maps, lights_of, show_emission
from ptmtools.scene.lights import Lights
from ptmtools.scene.materials import SceneMaterials, gather_materials
from ptmtools.scene.model import Camera, RoomVolume, Scene, Space, Storey
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.orientation.facing import TURNED_AWAY, share_turned_away
from ptmtools.scene.orientation.main_axes import tolerance_of
from ptmtools.scene.orientation.space import (
    DeclaredSpace,
    parse_unit,
    rotate,
    settle,
    to_world,
)
from ptmtools.scene.orientation.up_axis import NamedFaces
from ptmtools.scene.source import ModelSource
from ptmtools.tolerance import PLANE_SHARE, Tolerance

#: Errors of the system for circular links and sockets, and of `open_regular` for pipes and devices.
_NO_FILE = {
    errno.ELOOP: "no such file",
    errno.ENXIO: "not a regular file",
    errno.EINVAL: "not a regular file",
}


@dataclass(eq=False)
class Draft:
    """A model on its way to a scene. The fields that have no value yet are those of `STEPS`, in
    their order; ``ask`` as in `ingest`."""

    model: Path
    options: IngestOptions
    notes: IngestNotes
    format: ModelFormat
    progress: Progress
    workers: int
    ask: bool
    store: ImageStore
    source: ModelSource = field(init=False)
    kept: KeptFaces = field(init=False)
    space: Space = field(init=False)
    images: OptionalImages = field(init=False)
    surfaces: SceneMaterials = field(init=False)
    points: Floats = field(init=False)
    triangles: NDArray[np.int32] = field(init=False)
    two_sided: Bools = field(init=False)
    lights: Lights = field(init=False)
    tolerance: Tolerance = field(init=False)


def ingest(
    path: str | os.PathLike[str],
    options: IngestOptions = IngestOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
    *,
    workers: int = 1,
    ask: bool = True,
) -> Scene:
    """Read a model file.

    Parameters
    ----------
    path: a file of one of the input formats, such as OBJ, GLB, glTF, IFC or USD.
    options: see `IngestOptions`.
    progress: called with bytes while reading, then with images and materials.
    workers: threads that decode images; does not change the result.
    ask: whether an impossible unit is an error or a note PTM-N236.

    Returns
    -------
    The scene, with at least one triangle.

    Raises
    ------
    InputError: the file is absent, empty, damaged, of an unknown format, or has no usable face;
        with ``strict`` also for misses (`IngestNotes`). PTM-I236: the unit cannot be guessed, or
        is not that of the format.
    LimitError: PTM-L203 more vertices than int32 can number, or more triangles than ``options``
        allow; PTM-L204 an impossible extent, a line or a material library that is too long;
        PTM-L104 an image of more texels than ``options`` allow.
    MissingComponentError: a format needs a library that is not installed.
    """
    model = Path(path)
    check_file(model)
    notes = IngestNotes(model, options.allow_outside)
    store = ImageStore(notes, options.limit << 20)
    draft = Draft(model, options, notes, format_of(model), progress, workers, ask, store)
    for step in STEPS:
        step(draft)
    if options.strict:
        notes.enforce()
    return _scene(draft)


def check_file(model: Path) -> None:
    """Raises InputError unless the path is a readable file with content."""
    try:
        with open_regular(model) as stream:
            if not stream.read(1):
                raise InputError("PTM-I243", "empty file", file=model)
    except (FileNotFoundError, NotADirectoryError, ValueError):  # also a NUL byte in the name
        raise InputError("PTM-I120", "no such file", file=model, remedy="check the path") from None
    except OSError as error:
        if os.path.isdir(model):  # also one that may not be read
            remedy = "specify the model file in it"
            raise InputError(
                "PTM-I122", "is a folder, not a file", file=model, remedy=remedy
            ) from None
        if reason := _NO_FILE.get(error.errno or 0):
            raise InputError("PTM-I120", reason, file=model, remedy="check the path") from None
        raise InputError("PTM-I122", error.strerror or str(error), file=model) from None


def read_model(draft: Draft) -> None:
    """Reads the file. Raises as `ModelFormat.read`."""
    draft.source = draft.format.read(draft.model, draft.notes, draft.options, draft.progress)


def clean_faces(draft: Draft) -> None:
    """Welds points and drops unusable faces (`keep_faces`). Raises InputError PTM-I247 if none
    remains."""
    source, notes = draft.source, draft.notes
    draft.kept = kept = keep_faces(source.points, source.triangles)
    if not len(kept.triangles):
        raise InputError(
            "PTM-I247",
            f"none of the {len(source.triangles)} faces has an area "
            f"({kept.degenerate} degenerate, {kept.not_finite} with non-finite coordinates)",
            file=draft.model,
        )
    if len(kept.strays):
        corners = source.points[source.triangles[kept.strays]].reshape(-1, 3)
        x, y, z = corners[np.abs(corners).max(axis=1).argmax()].tolist()
        share = 100 * len(kept.strays) / len(source.triangles)
        message = (
            f"faces a thousand sizes of the model away from it left out, {share:.2g}% of all, one "
            f"with a corner at {x:.6g}, {y:.6g}, {z:.6g}"
        )
        notes.miss("PTM-N210", message, "", len(kept.strays))
    dropped = np.flatnonzero((kept.keeper >= 0) & (kept.keeper != np.arange(len(kept.keeper))))
    material = source.triangle_material
    unlike = int((material[dropped] != material[kept.keeper[dropped]]).sum())
    conflict = "duplicate faces of another material dropped, the first kept"
    pairs = "pairs of coincident faces with opposite winding; each is visible from its own side"
    for record, code, message, count in (
        (notes.miss, "PTM-N214", "degenerate faces dropped", kept.degenerate),
        (notes.miss, "PTM-N210", "faces with non-finite coordinates dropped", kept.not_finite),
        (notes.note, "PTM-N211", "duplicate faces dropped", len(dropped) - unlike),
        (notes.note, "PTM-N211", conflict, unlike),
        (notes.note, "PTM-N211", pairs, int(kept.paired.sum()) // 2),
    ):
        if count:
            record(code, message, "", count)


def find_space(draft: Draft) -> None:
    """Settles unit and up axis. Raises as `settle`."""
    source, kept, row = draft.source, draft.kept, draft.format
    options, up = draft.options, row.up or source.up
    named = NamedFaces.from_names(
        (source.objects, source.triangle_object[kept.source]),
        ([material.name for material in source.materials], source.triangle_material[kept.source]),
    )
    draft.space = settle(
        kept.points,
        kept.triangles,
        named,
        DeclaredSpace(None if options.unit is None else parse_unit(options.unit), options.up),
        DeclaredSpace(
            row.metres or source.metres,
            up,
            prescribed=row.metres is not None,
            usual_up=row.usual_up,
            rooms=tuple(float(np.ptp(room.points[:, 1 + (up == "z")])) for room in source.rooms),
        ),
        draft.notes,
        ask=draft.ask,
    )


def find_materials(draft: Draft) -> None:
    """Keeps the materials and images that faces use. Raises as `gather_materials`."""
    draft.images = OptionalImages(draft.store, draft.notes)
    draft.source = show_emission(draft.source, draft.kept, draft.images)
    draft.surfaces = gather_materials(
        draft.source,
        draft.kept,
        draft.store,
        draft.notes,
        draft.progress,
        workers=draft.workers,
    )


def place_faces(draft: Draft) -> None:
    """Maps the faces to world coordinates, and decides which are visible from both sides."""
    kept = draft.kept
    draft.points = to_world(kept.points, draft.space)
    draft.triangles = kept.triangles.astype(np.int32)
    draft.two_sided = ~kept.paired if draft.options.two_sided else _two_sided(kept, draft.source)


def find_lights(draft: Draft) -> None:
    """Gathers the lights. Raises as the reader of the format."""
    used, second = draft.surfaces.used, draft.format.second
    area = areas(draft.points[draft.triangles])
    shares = sum_by_group(draft.surfaces.triangle_material, area / area.sum(), len(used))
    draft.lights = lights_of(draft.source, used, draft.space, draft.images, shares)
    read = second.load()(draft.model, draft.options, "lightmap") if second else None
    if read is not None:
        draft.lights = add_maps(draft.lights, read, draft.kept, used, draft.images)


def check_facing(draft: Draft) -> None:
    """Notes a model that is inside out."""
    sides = draft.two_sided | draft.kept.paired
    share = share_turned_away(draft.points, draft.triangles, sides)
    if share > TURNED_AWAY:
        draft.notes.note(
            "PTM-N235",
            f"the model seems to be inside out: {share:.0%} of the surfaces around its rooms face "
            "away from them and are invisible; use --two-sided to draw both sides of every face, "
            "or flip the normals",
        )


def derive_tolerance(draft: Draft) -> None:
    """Derives the tolerances of all later stages, and notes a coarse grid of coordinates."""
    step = draft.source.step * draft.space.metres
    draft.tolerance = tolerance = tolerance_of(draft.points, draft.triangles, step)
    if tolerance.plane > PLANE_SHARE * tolerance.extent:
        draft.notes.note(
            "PTM-N201",
            f"compressed: coordinates are rounded to {1000 * step:.2g} mm, so points within "
            f"{1000 * tolerance.plane:.2g} mm of a plane count as in it",
        )


#: Each step completes the draft by what it is named for, and adds its notes.
STEPS: tuple[Callable[[Draft], None], ...] = (
    read_model,
    clean_faces,
    find_space,
    find_materials,
    place_faces,
    find_lights,
    check_facing,
    derive_tolerance,
)


def _scene(draft: Draft) -> Scene:
    source, surfaces, space = draft.source, draft.surfaces, draft.space
    used_object, triangle_object = np.unique(
        source.triangle_object[draft.kept.source], return_inverse=True
    )
    return Scene(
        points=draft.points,
        triangles=draft.triangles,
        uv=surfaces.uv,
        triangle_object=triangle_object.astype(np.int32),
        triangle_material=surfaces.triangle_material.astype(np.int32),
        two_sided=draft.two_sided,
        objects=tuple(source.objects[i] for i in used_object.tolist()),
        materials=surfaces.materials,
        tolerance=draft.tolerance,
        images=draft.store.images,
        cameras=tuple(_camera(camera, space) for camera in source.cameras),
        colors=surfaces.colors,
        normal_uv=surfaces.normal_uv,
        kinds=tuple(source.kinds[i] for i in used_object.tolist()) if source.kinds else (),
        storeys=_storeys(source, space),
        rooms=tuple(
            RoomVolume(room.name, to_world(room.points, space), room.triangles)
            for room in source.rooms
        ),
        space=space,
        notes=draft.notes.entries,
        files=tuple(draft.notes.folder.sought),
        shines=tuple(source.materials[number].shine for number in surfaces.used.tolist()),
        lights=draft.lights,
    )


def _two_sided(kept: KeptFaces, source: ModelSource) -> Bools:
    """(T,) whether a kept face or a duplicate of it is two-sided and no other face is behind it."""
    two_sided = np.array([m.two_sided for m in source.materials], dtype=bool)
    position = np.full(len(kept.keeper), -1, dtype=np.int64)
    position[kept.source] = np.arange(len(kept.source))
    valid = kept.keeper >= 0
    result = np.zeros(len(kept.source), dtype=bool)
    np.logical_or.at(
        result, position[kept.keeper[valid]], two_sided[source.triangle_material[valid]]
    )
    return result & ~kept.paired


def _storeys(source: ModelSource, space: Space) -> tuple[Storey, ...]:
    """The storeys in world metres, the lowest first."""
    floor = space.origin[1 if space.up == "y" else 2]
    raised = [Storey(s.name, (s.height - floor) * space.metres) for s in source.storeys]
    return tuple(sorted(raised, key=lambda storey: storey.height))


def _camera(camera: Camera, space: Space) -> Camera:
    position = to_world(np.array([camera.position]), space)[0].tolist()
    direction = rotate(np.array([camera.direction]), space.up)[0].tolist()
    return Camera(camera.name, tuple(position), tuple(direction), camera.field_of_view)
