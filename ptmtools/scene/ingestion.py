"""Ingest: a model file becomes a `Scene` in world metres, Y up.

A reader turns the file into triangles as the model has them (`obj`, `gltf`, `formats`); faces are
then cleaned, the space is settled, and of the materials and images those are kept that some
remaining face uses. What was guessed, dropped or missed stands in the notes, whose codes are in
docs/guide/cli.md.
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
from ptmtools.scene.faces import KeptFaces, keep_faces
from ptmtools.scene.facing import TURNED_AWAY, turned_away
from ptmtools.scene.images import ImageStore, masked
from ptmtools.scene.model import Camera, Material, Scene, Space, Storey
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.orientation import tolerance_of
from ptmtools.scene.source import MAX_VERTICES, Findings, Source, SourceMaterial
from ptmtools.scene.space import Said, parse_unit, settle, to_world, turned
from ptmtools.scene.texels import uses_holes, without_alpha
from ptmtools.scene.up_axis import Named
from ptmtools.scene.wrapping import MOST, near_origin, told, unmirrored
from ptmtools.tolerance import PLANE_SHARE

#: Colours where the model gives none: plain faces, and a tint that leaves an image as it is.
PLAIN, WHITE = (0.8, 0.8, 0.8), (1.0, 1.0, 1.0)
#: What the system says of links in a circle, of sockets, and `open_regular` of pipes and devices.
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
) -> Scene:
    """Read a model file.

    Parameters
    ----------
    path: an OBJ, GLB, glTF, IFC, USD, PLY, STL, OFF, DAE, 3DS, 3MF, X3D, VRML or CTM file.
    options: see `IngestOptions`.
    progress: called with bytes while reading, then with images and materials.
    workers: threads that decode images; never changes the result.

    Returns
    -------
    The scene, see `ptmtools.scene.model.Scene`; at least one triangle.

    Raises
    ------
    InputError: the file is absent, empty, damaged, of an unknown kind, or has no usable face;
        with ``strict`` also for anything that it asks for and does not get.
    LimitError: PTM-L200 more vertices than int32 can number, PTM-L201 a size that cannot be right,
        PTM-L202 and PTM-L204 a line or a library of materials that is too long, PTM-L203 more
        triangles and PTM-L104 an image of more texels than ``options`` allow, PTM-L106.
    MissingComponentError: a format needs a library that is not installed.
    """
    model = Path(path)
    metres = None if options.unit is None else parse_unit(options.unit)
    check_file(model)
    findings = Findings(model, options.allow_outside)
    source = _read(model, findings, progress, options.max_triangles)
    if len(source.points) > MAX_VERTICES or len(source.triangles) > MAX_VERTICES:
        raise LimitError(
            "PTM-L200",
            f"more than {MAX_VERTICES} vertices or faces",
            file=model,
            remedy="split the model",
        )

    kept = keep_faces(source.points, source.triangles)
    if not len(kept.triangles):
        raise InputError(
            "PTM-I248",
            f"none of the {len(source.triangles)} faces has an area "
            f"({kept.degenerate} degenerate, {kept.not_finite} with non-finite coordinates)",
            file=model,
        )
    _note_faces(kept, source, findings)
    named = Named.of(
        (source.objects, source.triangle_object[kept.source]),
        ([material.name for material in source.materials], source.triangle_material[kept.source]),
    )
    space = settle(
        model,
        kept.points,
        kept.triangles,
        named,
        Said(metres, options.up),
        Said(source.metres, source.up),
        findings,
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
    source = masked(source, used_material, store, findings)
    source, uv = unmirrored(source, used_material, faces, uv, store, findings)
    textures = [source.materials[index].texture for index in used_material.tolist()]
    store.examine((texture for texture in textures if texture is not None), workers, progress)
    source = without_alpha(source, used_material, faces, uv, store)
    colors = None if source.colors is None else source.colors[kept.source]
    if colors is not None and (colors == 255).all():
        colors = None
    materials = []
    for done, index in enumerate(used_material.tolist()):
        progress(done, len(used_material), "materials")
        given = source.materials[index]
        if colors is not None and (colors[faces[done]] != 255).any():
            # What has colours of its own has a white material: one kind of tint is enough.
            tint = np.array(given.color or WHITE)
            colors[faces[done]] = np.rint(colors[faces[done]] * tint).astype(np.uint8)
            given = replace(given, color=WHITE)
        materials.append(_material(given, uv[faces[done]], store, findings))
    progress(len(used_material), len(used_material), "materials")
    points, triangles = to_world(kept.points, space), kept.triangles.astype(np.int32)
    two_sided = ~kept.paired if options.two_sided else _two_sided(kept, source)
    away = turned_away(points, triangles, two_sided | kept.paired)
    if away > TURNED_AWAY:
        findings.say(
            "PTM-N235",
            f"the model seems to be inside out: {away:.0%} of what bounds its rooms is turned away "
            "from them and not seen; give --two-sided to draw every face from both sides, or turn "
            "the normals",
        )
    tolerance = tolerance_of(points, triangles, source.step * space.metres)
    if tolerance.plane > PLANE_SHARE * tolerance.extent:
        step, plane = 1000 * source.step * space.metres, 1000 * tolerance.plane
        findings.say(
            "PTM-N237",
            f"compressed: coordinates are rounded to {step:.2g} mm, so what is less than "
            f"{plane:.2g} mm from a plane counts as in it",
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
        kinds=tuple(source.kinds[i] for i in used_object.tolist()) if source.kinds else (),
        storeys=_storeys(source, space),
        space=space,
        notes=findings.notes,
        files=tuple(findings.folder.sought),
        shines=tuple(source.materials[i].shine for i in used_material.tolist()),
    )


def check_file(model: Path) -> None:
    """Raises InputError if there is no file that could be a model."""
    try:
        with open_regular(model) as stream:
            if not stream.read(1):
                raise InputError("PTM-I242", "empty file", file=model)
    except (FileNotFoundError, NotADirectoryError, ValueError):  # also a NUL byte in the name
        raise InputError("PTM-I240", "no such file", file=model) from None
    except OSError as error:
        if os.path.isdir(model):  # also one that may not be read
            remedy = "name the model file in it"
            raise InputError("PTM-I241", "is a directory", file=model, remedy=remedy) from None
        if what := _NO_FILE.get(error.errno or 0):
            raise InputError("PTM-I240", what, file=model) from None
        raise InputError("PTM-I256", error.strerror or str(error), file=model) from None


def _read(model: Path, findings: Findings, progress: Progress, max_triangles: int) -> Source:
    suffix = model.suffix.lower()
    try:
        if suffix == ".obj":
            from ptmtools.scene.obj import read_obj

            return read_obj(model, findings, progress, max_triangles)
        if suffix in (".glb", ".gltf"):
            from ptmtools.scene.gltf.reader import read_gltf

            return read_gltf(model, findings, max_triangles)
        from ptmtools.scene.formats import read_other

        return read_other(model, findings, max_triangles)
    except OSError as error:
        raise InputError(
            "PTM-I256", error.strerror or str(error), file=error.filename or model
        ) from None


def _note_faces(kept: KeptFaces, source: Source, findings: Findings) -> None:
    dropped = np.flatnonzero((kept.also >= 0) & (kept.also != np.arange(len(kept.also))))
    material = source.triangle_material
    other = int((material[dropped] != material[kept.also[dropped]]).sum())
    others = "duplicate faces of another material dropped, the first kept"
    pairs = "pairs of coincident faces with opposite winding; each shows on its own side"
    for tell, code, message, count in (
        (findings.miss, "PTM-N209", "degenerate faces dropped", kept.degenerate),
        (findings.miss, "PTM-N210", "faces with coordinates not finite dropped", kept.not_finite),
        (findings.say, "PTM-N211", "duplicate faces dropped", len(dropped) - other),
        (findings.say, "PTM-N212", others, other),
        (findings.say, "PTM-N213", pairs, int(kept.paired.sum()) // 2),
    ):
        if count:
            tell(code, message, "", count)


def _coordinates(source: Source, kept: KeptFaces, findings: Findings) -> NDArray[np.float64]:
    """(T, 3, 2) of kept faces, all of them finite, and near the origin where textures repeat."""
    uv = source.uv[kept.source]
    unusable: NDArray[np.bool_] = np.logical_not(np.isfinite(uv).all(axis=(1, 2)))
    uv[unusable] = 0.0
    textures = [material.texture for material in source.materials]
    repeats = np.array(
        [(t is None or t.wrap_s != "clamp", t is None or t.wrap_t != "clamp") for t in textures]
    )
    material, each = source.triangle_material[kept.source], source.triangle_object[kept.source]
    uv = near_origin(uv, material * np.int64(len(source.objects)) + each, repeats[material])
    unusable |= (np.abs(uv) > MOST).any(axis=(1, 2))
    if unusable.any():
        what = f"texture coordinates that are not finite, or beyond {MOST:,.0f}, count as 0"
        findings.say("PTM-N228", what, "", int(unusable.sum()))
        uv[unusable] = 0.0
    return uv


def _two_sided(kept: KeptFaces, source: Source) -> NDArray[np.bool_]:
    """(T,) a kept face has a back if it or a duplicate of it has, and if nothing lies there."""
    backed = np.array([m.two_sided for m in source.materials], dtype=bool)
    position = np.full(len(kept.also), -1, dtype=np.int64)
    position[kept.source] = np.arange(len(kept.source))
    standing = kept.also >= 0
    result = np.zeros(len(kept.source), dtype=bool)
    np.logical_or.at(
        result,
        position[kept.also[standing]],
        backed[source.triangle_material[standing]],
    )
    return result & ~kept.paired


def _storeys(source: Source, space: Space) -> tuple[Storey, ...]:
    """Its storeys, the lowest first."""
    floor = space.origin[1 if space.up == "y" else 2]
    raised = [Storey(s.name, (s.height - floor) * space.metres) for s in source.storeys]
    return tuple(sorted(raised, key=lambda storey: storey.height))


def _camera(camera: Camera, space: Space) -> Camera:
    position = to_world(np.array([camera.position]), space)[0].tolist()
    direction = turned(np.array([camera.direction]), space.up)[0].tolist()
    return Camera(camera.name, tuple(position), tuple(direction), camera.field_of_view)


def _material(
    given: SourceMaterial, uv: NDArray[np.float64], store: ImageStore, findings: Findings
) -> Material:
    """The material as its kept faces, of these (n, 3, 2) coordinates, need it."""
    texture = given.texture
    image = -1
    transparent = given.see_through or given.opacity < 1
    if texture is not None:
        decoded = store.add(texture)
        if decoded is not None:
            image, holes = decoded
            if holes is not None and not (transparent or given.ignores_alpha):
                wraps = told(texture.wrap_s), told(texture.wrap_t)
                transparent = uses_holes(holes, uv, *wraps)
    if given.opacity == 0:
        findings.say("PTM-N231", f"material {given.name} is invisible (opacity 0)")
    return Material(
        name=given.name,
        color=given.color or (PLAIN if image < 0 else WHITE),
        opacity=given.opacity,
        image=image,
        wrap_s=told(texture.wrap_s) if texture else "repeat",
        wrap_t=told(texture.wrap_t) if texture else "repeat",
        transparent=transparent,
        cutoff=given.cutoff if image >= 0 else None,
    )
