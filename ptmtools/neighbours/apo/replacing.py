"""Objects of a building become simplified meshes, and octrees of the normals that they had.

What paper 2 does with one mesh, done with the statues of a museum: whoever draws no octree shows
the simplified mesh as any other, painted as before, and visibility and hints are computed of it.

The mesh is simplified with its materials, sides, texture coordinates and colours, whose borders
stay, so it may keep more triangles than one that is plain. Its points are brought back into the box
of the object where they left it: a statue that stands on a floor must not reach through it.

What becomes of a scene when objects of it are replaced by meshes of fewer triangles.

Each new triangle stands for one of the object's own, whose material and sides it has, and in whose
place it comes: so what is decided by the order of the triangles stays as it was. The tolerances
stay too. They are those of the model's coordinates, and a simplified mesh does not leave the box of
its object.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.roles import matches
from ptmtools.diagnostics import Warned
from ptmtools.errors import LimitError
from ptmtools.executor import Executor
from ptmtools.neighbours.apo.making import octree_around, once, smooth, welded
from ptmtools.neighbours.apo.model import ApoOptions, Octree
from ptmtools.neighbours.apo.options import ReplaceOptions
from ptmtools.progress import Progress, silent
from ptmtools.quantities import count
from ptmtools.scene.model import Scene
from ptmtools.simplification import Mesh, Simplified, SimplifyOptions, simplify
from ptmtools.store.archive import Stored


@dataclass(frozen=True)
class Replacement:
    """New triangles for some objects of a scene.

    Attributes
    ----------
    objects: (K,) int32, those that are replaced, ascending.
    points: (P, 3) float64, metres. triangles: (F, 3) int32 indices into them.
    source: (F,) int32, the triangle of the scene that each stands for, never descending: those that
        fill a hole stand for one beside it, which may stand for itself, too.
    uv: (F, 3, 2) float64. colors: (F, 3, 3) uint8 if the scene has colours, else None.
    """

    objects: NDArray[np.int32]
    points: Floats
    triangles: NDArray[np.int32]
    source: NDArray[np.int32]
    uv: Floats
    colors: NDArray[np.uint8] | None = None

    def of(self, scene: Scene) -> Scene:
        """The scene with these triangles; points that no triangle uses are dropped.

        Raises ValueError if they are not of this scene.
        """
        self._check(scene)
        kept = np.flatnonzero(~np.isin(scene.triangle_object, self.objects))
        source = np.concatenate([kept, self.source.astype(np.int64)])
        order = np.argsort(source, kind="stable")
        source = source[order]
        used, corners = np.unique(scene.triangles[kept], return_inverse=True)
        corners = corners.reshape(-1, 3)
        triangles = np.concatenate([corners, self.triangles + len(used)])[order]
        colors = None
        if scene.colors is not None and self.colors is not None:
            colors = np.concatenate([scene.colors[kept], self.colors])[order]
        return replace(
            scene,
            points=np.concatenate([scene.points[used], self.points]),
            triangles=triangles.astype(np.int32),
            uv=np.concatenate([scene.uv[kept], self.uv])[order],
            triangle_object=scene.triangle_object[source],
            triangle_material=scene.triangle_material[source],
            two_sided=scene.two_sided[source],
            colors=colors,
        )

    def _check(self, scene: Scene) -> None:
        if self.objects.max(initial=-1) >= len(scene.objects):
            raise ValueError("an object is replaced that the scene lacks")
        if self.source.max(initial=-1) >= len(scene.triangles):
            raise ValueError("a triangle stands for one that the scene lacks")
        if not np.isin(scene.triangle_object[self.source], self.objects).all():
            raise ValueError("a triangle stands for one of another object")
        if (self.colors is None) != (scene.colors is None):
            raise ValueError("either the scene has colours, or what replaces its objects")

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """What `from_arrays` makes it of again."""
        colors = {} if self.colors is None else {"colors": self.colors}
        return {n: v for n, v in vars(self).items() if n != "colors"} | colors

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[Any]]) -> Replacement:
        """Raises KeyError or ValueError for what is none."""
        stored = Stored(arrays)
        points = stored.array("points", np.float64, None, 3, finite=True)
        triangles = stored.indices("triangles", np.int32, None, 3, high=len(points))
        n, most = len(triangles), np.iinfo(np.int32).max
        result = Replacement(
            stored.indices("objects", np.int32, None, high=most),
            points,
            triangles,
            stored.indices("source", np.int32, n, high=most),
            stored.array("uv", np.float64, n, 3, 2, finite=True),
            stored.array("colors", np.uint8, n, 3, 3) if "colors" in arrays else None,
        )
        if (np.diff(result.source) < 0).any() or (np.diff(result.objects) <= 0).any():
            raise ValueError("triangles or objects are not in order")
        return result


def joined(parts: list[Replacement]) -> Replacement:
    """Replacements of different objects of one scene as one."""
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    source = np.concatenate([part.source for part in parts])
    order = np.argsort(source, kind="stable")
    triangles = [part.triangles + begin for part, begin in zip(parts, first, strict=False)]
    colors = [part.colors for part in parts if part.colors is not None]
    return Replacement(
        np.sort(np.concatenate([part.objects for part in parts])),
        np.concatenate([part.points for part in parts]),
        np.concatenate(triangles)[order].astype(np.int32),
        source[order],
        np.concatenate([part.uv for part in parts])[order],
        np.concatenate(colors)[order] if colors else None,
    )


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

    Objects of one name are replaced one by one. Raises LimitError PTM-L400: an octree has too many
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
    simplified = simplify(
        mesh, SimplifyOptions(faces), lambda done, total, _: progress(done, total, what)
    )
    left = simplified.mesh
    uv = np.zeros((len(left.triangles), 3, 2)) if left.uv is None else left.uv
    return simplified, Replacement(
        np.array([number], np.int32),
        np.clip(left.points, points.min(axis=0), points.max(axis=0)),
        left.triangles,
        own[simplified.source].astype(np.int32),
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
        fault.remedy = "give a greater --apo-error, a smaller --apo-depth or --apo-density"
        raise
    faces = len(part.triangles)
    return ReplacedObject(number, name, octree, len(own), faces, simplified.error, missed)
