"""Objects of a building become simplified meshes, and octrees of the normals that they had.

What paper 2 does with one mesh, done with the statues of a museum: whoever draws no octree shows
the simplified mesh as any other, painted as before, and visibility and hints are computed of it.

The mesh is simplified with its materials, sides, texture coordinates and colours, whose borders
stay, so it may keep more triangles than one that is plain. Its points are brought back into the box
of the object where they left it: a statue that stands on a floor must not reach through it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ptmtools.apo.making import octree_around, once, smooth, welded
from ptmtools.apo.model import ApoOptions, Octree
from ptmtools.apo.options import ReplaceOptions
from ptmtools.apo.replacement import Replacement, joined
from ptmtools.arrays import Ints
from ptmtools.cells.naming import matches
from ptmtools.errors import LimitError
from ptmtools.executors import Executor
from ptmtools.notes import Warned
from ptmtools.progress import Progress, silent
from ptmtools.quantities import count
from ptmtools.scene.model import Scene
from ptmtools.simplification import Mesh, Simplified, SimplifyOptions, simplify

#: Objects that are named in one note.
_NAMED = 3
#: A greater share of samples that found nothing of the original is told.
_MISSED = 0.01
#: So is an object that is simplified by more than this share of its size.
_FAR_OFF = 0.02


@dataclass(frozen=True)
class ReplacedObject:
    """An object that has a simplified mesh and an octree texture.

    Attributes
    ----------
    object: index into `Scene.objects`. name: as it stands there.
    octree: its cube is in world metres.
    source, faces: triangles before and after.
    deviation: of the simplified mesh, metres, as the quadrics estimate it.
    missed: share of the samples from which no ray found the original.
    """

    object: int
    name: str
    octree: Octree
    source: int
    faces: int
    deviation: float
    missed: float


@dataclass(frozen=True)
class Replaced:
    """What `replaced` makes of a scene.

    Attributes
    ----------
    scene: with the simplified meshes; the very same where nothing is replaced.
    replacement: what of it is new; None if nothing is.
    octrees: of each object that was replaced, in the order of the objects.
    notes: what there is to say, one line each.
    """

    scene: Scene
    replacement: Replacement | None
    octrees: tuple[ReplacedObject, ...]
    notes: tuple[str, ...]


def replaced(
    scene: Scene, options: ReplaceOptions, executor: Executor, progress: Progress = silent
) -> Replaced:
    """A scene whose objects of certain names are replaced.

    Objects of one name are replaced one by one. Raises LimitError PTM-L840: an octree has too many
    texels.
    """
    notes: list[str] = [
        Warned(f"--apo: no object is called {pattern!r}")
        for pattern in options.apo
        if not any(matches(name, (pattern,)) for name in scene.objects)
    ]
    named = [i for i, name in enumerate(scene.objects) if matches(name, options.apo)]
    triangles = _by_object(scene, named)
    chosen = [i for i in named if len(triangles[i])]
    light = [i for i in chosen if len(triangles[i]) <= options.apo_faces]
    parts, octrees = [], []
    for i in (i for i in chosen if i not in set(light)):
        simplified, part = _simplified(scene, i, triangles[i], options.apo_faces, progress)
        notes += [f"{scene.objects[i]}: {note}" for note in simplified.notes]
        if not 0 < len(part.source) < len(triangles[i]):
            notes.append(f"{scene.objects[i]} stays as modelled: it cannot have fewer triangles")
            continue
        size = float(np.linalg.norm(np.ptp(scene.corners[triangles[i]], axis=(0, 1))))
        if simplified.error > _FAR_OFF * size:
            notes.append(
                Warned(
                    f"{scene.objects[i]} is off by about {simplified.error:.2g} m once simplified, "
                    f"of {size:.2g} m; give more --apo-faces, or leave it out of --apo"
                )
            )
        parts.append(part)
        octrees.append(_octree(scene, triangles[i], simplified, part, options, executor, progress))
    if light:
        stay = _that_stay([scene.objects[i] for i in light], options.apo_faces)
        notes.append(stay if parts else Warned(stay))
    notes += [
        f"{each.name}: from {each.missed:.1%} of the samples nothing of the original was found; "
        "there the octree has the normals of the simplified mesh"
        for each in octrees
        if each.missed > _MISSED
    ]
    if not parts:
        return Replaced(scene, None, (), tuple(notes))
    replacement = joined(parts)
    return Replaced(replacement.of(scene), replacement, tuple(octrees), tuple(notes))


def _by_object(scene: Scene, chosen: Sequence[int]) -> dict[int, Ints]:
    """The triangles of each of these objects, ascending."""
    order = np.argsort(scene.triangle_object, kind="stable")
    begin, end = (
        np.searchsorted(scene.triangle_object[order], chosen, side) for side in ("left", "right")
    )
    return {i: order[a:b] for i, a, b in zip(chosen, begin, end, strict=True)}


def _that_stay(names: Sequence[str], faces: int) -> str:
    named = ", ".join(names[:_NAMED]) + (", …" if len(names) > _NAMED else "")
    have, stay = ("has", "stays") if len(names) == 1 else ("have", "stay")
    return (
        f"{count(len(names), 'object')} of --apo {have} no more triangles than --apo-faces "
        f"{faces:,}, and {stay} as modelled: {named}"
    )


def _simplified(
    scene: Scene, number: int, own: Ints, faces: int, progress: Progress
) -> tuple[Simplified, Replacement]:
    """The simplified mesh of an object of which these are the triangles."""
    what = f"simplifying {scene.objects[number]}"
    used, corners = np.unique(scene.triangles[own], return_inverse=True)
    points, material = scene.points[used], scene.triangle_material[own]
    images = np.array([m.image for m in scene.materials])
    painted = bool((images[material] >= 0).any())
    mesh = Mesh(
        points,
        corners.reshape(-1, 3).astype(np.int32),
        # Where sides change there is a border like one of materials.
        (2 * material + scene.two_sided[own]).astype(np.int32),
        scene.uv[own] if painted else None,
        None if scene.colors is None else scene.colors[own],
    )
    found = simplify(
        mesh, SimplifyOptions(faces), lambda done, total, _: progress(done, total, what)
    )
    left = found.mesh
    uv = np.zeros((len(left.triangles), 3, 2)) if left.uv is None else left.uv
    return found, Replacement(
        np.array([number], np.int32),
        np.clip(left.points, points.min(axis=0), points.max(axis=0)),
        left.triangles,
        own[found.source].astype(np.int32),
        uv,
        left.colors,
    )


def _octree(
    scene: Scene,
    own: Ints,
    simplified: Simplified,
    part: Replacement,
    options: ReplaceOptions,
    executor: Executor,
    progress: Progress,
) -> ReplacedObject:
    """The octree of the normals of an object around what replaces it."""
    number = int(part.objects[0])
    name = scene.objects[number]
    wanted = ApoOptions(
        faces=options.apo_faces,
        error=options.apo_error,
        depth=options.apo_depth,
        density=options.apo_density,
    )
    used, corners = np.unique(scene.triangles[own], return_inverse=True)
    points, triangles = welded(scene.points[used], corners.reshape(-1, 3).astype(np.int32))
    triangles, _ = once(triangles)
    try:
        octree, missed = octree_around(
            smooth(part.points, part.triangles), points, triangles, wanted, None, executor, progress
        )
    except LimitError as fault:
        fault.place = name
        if fault.remedy:
            fault.remedy = fault.remedy.replace("--", "--apo-")
        raise
    faces = len(part.triangles)
    return ReplacedObject(number, name, octree, len(own), faces, simplified.error, missed)
