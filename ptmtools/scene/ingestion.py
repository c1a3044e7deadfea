"""Ingest: reads a model file into a `Scene` in world metres, Y up.

A reader (`obj`, `gltf`, `formats`) returns the triangles in the space of the file. Ingest cleans
the faces, determines unit and up axis, and keeps the materials and images that some remaining face
uses. Notes record what was guessed, dropped or missing; docs/guide/cli.md lists their codes.
"""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_regular
from ptmtools.progress import Progress, silent
from ptmtools.scene.baking import LARGEST, bake, emitted_wraps, near_origin
from ptmtools.scene.faces import KeptFaces, keep_faces
from ptmtools.scene.images import ImageStore
from ptmtools.scene.lighting import lights_of
from ptmtools.scene.model import Camera, Material, RoomVolume, Scene, Space, Storey
from ptmtools.scene.normal_maps import NormalMaps
from ptmtools.scene.notes import Findings
from ptmtools.scene.options import GLTF, IngestOptions
from ptmtools.scene.orientation.facing import TURNED_AWAY, share_turned_away
from ptmtools.scene.orientation.main_axes import tolerance_of
from ptmtools.scene.orientation.space import DeclaredSpace, parse_unit, rotated, settle, to_world
from ptmtools.scene.orientation.up_axis import NamedFaces
from ptmtools.scene.source import MAX_VERTICES, Source, SourceMaterial
from ptmtools.scene.texels import uses_holes
from ptmtools.tolerance import PLANE_SHARE

#: Default colours: of faces without an image, and of images.
PLAIN, WHITE = (0.8, 0.8, 0.8), (1.0, 1.0, 1.0)
#: Errors of the system for circular links and sockets, and of `open_regular` for pipes and devices.
_NO_FILE = {
    errno.ELOOP: "no such file",
    errno.ENXIO: "not a regular file",
    errno.EINVAL: "not a regular file",
}


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
    path: an OBJ, GLB, glTF, IFC, USD, PLY, STL, OFF, DAE, 3DS, 3MF, X3D, VRML or CTM file.
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
        with ``strict`` also for misses (`Findings`). PTM-I236: the unit cannot be guessed, or
        is not that of the format.
    LimitError: PTM-L203 more vertices than int32 can number, or more triangles than ``options``
        allow; PTM-L204 an impossible extent, a line or a material library that is too long;
        PTM-L104 an image of more texels than ``options`` allow.
    MissingComponentError: a format needs a library that is not installed.
    """
    model = Path(path)
    metres = None if options.unit is None else parse_unit(options.unit)
    check_file(model)
    findings = Findings(model, options.allow_outside)
    source = _read(model, findings, progress, options)
    if len(source.points) > MAX_VERTICES or len(source.triangles) > MAX_VERTICES:
        raise LimitError(
            "PTM-L203",
            f"more than {MAX_VERTICES} vertices or faces",
            file=model,
            remedy="split the model",
        )

    kept = keep_faces(source.points, source.triangles)
    if not len(kept.triangles):
        raise InputError(
            "PTM-I247",
            f"none of the {len(source.triangles)} faces has an area "
            f"({kept.degenerate} degenerate, {kept.not_finite} with non-finite coordinates)",
            file=model,
        )
    _note_faces(kept, source, findings)
    named = NamedFaces.of(
        (source.objects, source.triangle_object[kept.source]),
        ([material.name for material in source.materials], source.triangle_material[kept.source]),
    )
    space = settle(
        model,
        kept.points,
        kept.triangles,
        named,
        DeclaredSpace(metres, options.up),
        DeclaredSpace(source.metres, source.up, model.suffix.lower() in GLTF),
        findings,
        ask=ask,
    )
    uv = _coordinates(source, kept, findings)
    used_material, triangle_material = np.unique(
        source.triangle_material[kept.source], return_inverse=True
    )
    used_object, triangle_object = np.unique(
        source.triangle_object[kept.source], return_inverse=True
    )
    store = ImageStore(findings, options.limit << 20)
    grouped = np.argsort(triangle_material, kind="stable")
    faces = np.split(grouped, np.cumsum(np.bincount(triangle_material))[:-1])
    used = [source.materials[index] for index in used_material.tolist()]
    written = uv
    baked, uv = bake(used, faces, uv, store, findings, progress, workers=workers)
    colors = None if source.colors is None else source.colors[kept.source]
    if colors is not None and (colors == 255).all():
        colors = None
    materials = []
    for done, (material, rows) in enumerate(zip(baked, faces, strict=True)):
        progress(done, len(faces), "materials")
        if colors is not None and (colors[rows] != 255).any():
            # Merged into the colours of corners, so that a face has one tint only.
            tint = np.array(material.color or WHITE)
            colors[rows] = np.rint(colors[rows] * tint).astype(np.uint8)
            material = replace(material, color=WHITE)
        materials.append(_material(material, uv[rows], store, findings))
    maps = NormalMaps(store, findings)
    for number, rows in enumerate(faces):
        if (normal := used[number].normal) is not None:
            moved = uv is not written and not np.array_equal(uv[rows], written[rows])
            image = maps.add(normal, baked[number].texture, moved=moved)
            materials[number] = replace(materials[number], normal=image)
    normal_uv = _normal_coordinates(source, kept, materials, triangle_material, written)
    progress(len(faces), len(faces), "materials")
    points, triangles = to_world(kept.points, space), kept.triangles.astype(np.int32)
    two_sided = ~kept.paired if options.two_sided else _two_sided(kept, source)
    lights = lights_of(source, kept, used_material, space, store, findings, options)
    share = share_turned_away(points, triangles, two_sided | kept.paired)
    if share > TURNED_AWAY:
        findings.note(
            "PTM-N235",
            f"the model seems to be inside out: {share:.0%} of the surfaces around its rooms face "
            "away from them and are invisible; use --two-sided to draw both sides of every face, "
            "or flip the normals",
        )
    tolerance = tolerance_of(points, triangles, source.step * space.metres)
    if tolerance.plane > PLANE_SHARE * tolerance.extent:
        step, plane = 1000 * source.step * space.metres, 1000 * tolerance.plane
        findings.note(
            "PTM-N201",
            f"compressed: coordinates are rounded to {step:.2g} mm, so points within {plane:.2g} "
            "mm of a plane count as in it",
        )
    if options.strict:
        findings.enforce()
    return Scene(
        points=points,
        triangles=triangles,
        uv=uv,
        triangle_object=triangle_object.astype(np.int32),
        triangle_material=triangle_material.astype(np.int32),
        two_sided=two_sided,
        objects=tuple(source.objects[i] for i in used_object.tolist()),
        materials=tuple(materials),
        tolerance=tolerance,
        images=store.images,
        cameras=tuple(_camera(camera, space) for camera in source.cameras),
        colors=colors,
        normal_uv=normal_uv,
        kinds=tuple(source.kinds[i] for i in used_object.tolist()) if source.kinds else (),
        storeys=_storeys(source, space),
        rooms=tuple(
            RoomVolume(room.name, to_world(room.points, space), room.triangles)
            for room in source.rooms
        ),
        space=space,
        notes=findings.notes,
        files=tuple(findings.folder.sought),
        shines=tuple(material.shine for material in used),
        lights=lights,
    )


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


def _read(model: Path, findings: Findings, progress: Progress, options: IngestOptions) -> Source:
    suffix, most = model.suffix.lower(), options.max_triangles
    normals = options.normal_maps == "draw"
    try:
        if suffix == ".obj":
            from ptmtools.scene.obj import read_obj

            return read_obj(model, findings, progress, most, normals=normals)
        if suffix in (".glb", ".gltf"):
            from ptmtools.scene.gltf.reader import read_gltf

            return read_gltf(model, findings, most, normals=normals)
        from ptmtools.scene.formats import read_other

        return read_other(model, findings, most)
    except OSError as error:
        raise InputError(
            "PTM-I122", error.strerror or str(error), file=error.filename or model
        ) from None


def _note_faces(kept: KeptFaces, source: Source, findings: Findings) -> None:
    if len(kept.strays):
        corners = source.points[source.triangles[kept.strays]].reshape(-1, 3)
        x, y, z = corners[np.abs(corners).max(axis=1).argmax()].tolist()
        share = 100 * len(kept.strays) / len(source.triangles)
        message = (
            f"faces a thousand sizes of the model away from it left out, {share:.2g}% of all, one "
            f"with a corner at {x:.6g}, {y:.6g}, {z:.6g}"
        )
        findings.miss("PTM-N210", message, "", len(kept.strays))
    dropped = np.flatnonzero((kept.keeper >= 0) & (kept.keeper != np.arange(len(kept.keeper))))
    material = source.triangle_material
    other = int((material[dropped] != material[kept.keeper[dropped]]).sum())
    others = "duplicate faces of another material dropped, the first kept"
    pairs = "pairs of coincident faces with opposite winding; each is visible from its own side"
    for record, code, message, count in (
        (findings.miss, "PTM-N214", "degenerate faces dropped", kept.degenerate),
        (findings.miss, "PTM-N210", "faces with non-finite coordinates dropped", kept.not_finite),
        (findings.note, "PTM-N211", "duplicate faces dropped", len(dropped) - other),
        (findings.note, "PTM-N211", others, other),
        (findings.note, "PTM-N211", pairs, int(kept.paired.sum()) // 2),
    ):
        if count:
            record(code, message, "", count)


def _coordinates(source: Source, kept: KeptFaces, findings: Findings) -> NDArray[np.float64]:
    """(T, 3, 2) of kept faces, all finite, and near the origin for repeating textures."""
    uv = source.uv[kept.source]
    unusable: NDArray[np.bool_] = np.logical_not(np.isfinite(uv).all(axis=(1, 2)))
    uv[unusable] = 0.0
    textures = [material.texture for material in source.materials]
    repeats = np.array(
        [(t is None or t.wrap_s != "clamp", t is None or t.wrap_t != "clamp") for t in textures]
    )
    material, owner = source.triangle_material[kept.source], source.triangle_object[kept.source]
    uv = near_origin(uv, material * np.int64(len(source.objects)) + owner, repeats[material])
    unusable |= (np.abs(uv) > LARGEST).any(axis=(1, 2))
    if unusable.any():
        message = f"texture coordinates not finite or beyond {LARGEST:,.0f} replaced by 0"
        findings.note("PTM-N211", message, "", int(unusable.sum()))
        uv[unusable] = 0.0
    return uv


def _normal_coordinates(
    source: Source,
    kept: KeptFaces,
    materials: list[Material],
    material: NDArray[np.int64],
    uv: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """(T, 3, 2) of kept faces, finite and near the origin, in the normal maps that have their own
    coordinates: those of the source, or else ``uv``; ``material`` (T,) of each face. None without.
    """
    own = np.array([m.normal is not None and m.normal.own for m in materials], np.bool_)[material]
    if not own.any():
        return None
    result = np.zeros_like(uv)
    result[own] = uv[own]
    if source.normal_uv is not None:
        given = source.normal_uv[kept.source]
        has = [m.normal is not None and m.normal.own for m in source.materials]
        other = own & np.array(has, np.bool_)[source.triangle_material[kept.source]]
        result[other] = given[other]
    fits = np.isfinite(result).all(axis=(1, 2)) & (np.abs(result) <= LARGEST).all(axis=(1, 2))
    result[~fits] = 0.0
    wraps = [(m.normal.wrap_s, m.normal.wrap_t) if m.normal else ("clamp",) * 2 for m in materials]
    repeats = np.array([[wrap == "repeat" for wrap in each] for each in wraps], np.bool_)
    owner = source.triangle_object[kept.source]
    return near_origin(result, material * np.int64(len(source.objects)) + owner, repeats[material])


def _two_sided(kept: KeptFaces, source: Source) -> NDArray[np.bool_]:
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


def _storeys(source: Source, space: Space) -> tuple[Storey, ...]:
    """The storeys in world metres, the lowest first."""
    floor = space.origin[1 if space.up == "y" else 2]
    raised = [Storey(s.name, (s.height - floor) * space.metres) for s in source.storeys]
    return tuple(sorted(raised, key=lambda storey: storey.height))


def _camera(camera: Camera, space: Space) -> Camera:
    position = to_world(np.array([camera.position]), space)[0].tolist()
    direction = rotated(np.array([camera.direction]), space.up)[0].tolist()
    return Camera(camera.name, tuple(position), tuple(direction), camera.field_of_view)


def _material(
    material: SourceMaterial, uv: NDArray[np.float64], store: ImageStore, findings: Findings
) -> Material:
    """The emitted form of a material whose kept faces have these (n, 3, 2) coordinates."""
    texture, image = material.texture, -1
    wraps = emitted_wraps(texture)
    transparent = material.see_through or material.opacity < 1
    if texture is not None and (added := store.add(texture)) is not None:
        image, holes = added
        if holes is not None and not (transparent or material.ignores_alpha):
            transparent = uses_holes(holes, uv, *wraps)
    if material.opacity == 0:
        findings.note("PTM-N211", f"material {material.name} is invisible (opacity 0)")
    return Material(
        name=material.name,
        color=material.color or (PLAIN if image < 0 else WHITE),
        opacity=material.opacity,
        image=image,
        wrap_s=wraps[0],
        wrap_t=wraps[1],
        transparent=transparent,
        cutoff=material.cutoff if image >= 0 else None,
    )
