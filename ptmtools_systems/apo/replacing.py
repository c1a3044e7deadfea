"""Replaces objects of a building by simplified meshes, and makes octrees or maps of their normals.

The mesh is simplified with its materials, sides, texture coordinates and colours, whose borders
stay. Points that leave the box of the object are moved back into it. Each new triangle stands for
one of the object's own, has its material and sides, and takes its place in the order, so results
that depend on the order of the triangles do not change; nor do tolerances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.fabric import matches
from ptmtools.diagnostics import Warned
from ptmtools.errors import LimitError
from ptmtools.executor import Executor
from ptmtools.output.object_maps import ObjectMaps
from ptmtools.progress import Progress, silent
from ptmtools.quantities import count
from ptmtools.scene.model import Scene
from ptmtools.simplification import Mesh, Simplified, SimplifyOptions, simplify
from ptmtools.store.archive import Stored
from ptmtools_systems.apo.making import distinct, octree_around, smooth, weld
from ptmtools_systems.apo.model import ApoOptions, Octree
from ptmtools_systems.apo.normal_map import NormalMap, normal_map
from ptmtools_systems.apo.options import ReplaceOptions


@dataclass(frozen=True)
class Replacement:
    """New triangles for some objects of a scene.

    Attributes
    ----------
    objects: (K,) int32, replaced objects, ascending.
    points: (P, 3) float64, metres. triangles: (F, 3) int32 indices into them.
    source: (F,) int32, the triangle of the scene that each stands for, never descending: triangles
        that fill a hole stand for one beside it, which may also stand for itself.
    uv: (F, 3, 2) float64. colors: (F, 3, 3) uint8 if the scene has colours, else None.
    """

    objects: NDArray[np.int32]
    points: Floats
    triangles: NDArray[np.int32]
    source: NDArray[np.int32]
    uv: Floats
    colors: NDArray[np.uint8] | None = None

    def apply_to(self, scene: Scene) -> Scene:
        """The scene with these triangles; unused points are dropped.

        Raises ValueError if they do not fit the scene.
        """
        self._check(scene)
        kept, order, source = self._sources(scene)
        used, corners = np.unique(scene.triangles[kept], return_inverse=True)
        corners = corners.reshape(-1, 3)
        triangles = np.concatenate([corners, self.triangles + len(used)])[order]
        colors = None
        if scene.colors is not None and self.colors is not None:
            colors = np.concatenate([scene.colors[kept], self.colors])[order]
        normal_uv = None
        if scene.normal_uv is not None:  # replaced objects have other relief
            normal_uv = np.concatenate([scene.normal_uv[kept], np.zeros_like(self.uv)])[order]
        return replace(
            scene,
            points=np.concatenate([scene.points[used], self.points]),
            triangles=triangles.astype(np.int32),
            uv=np.concatenate([scene.uv[kept], self.uv])[order],
            triangle_object=scene.triangle_object[source],
            triangle_material=scene.triangle_material[source],
            two_sided=scene.two_sided[source],
            colors=colors,
            normal_uv=normal_uv,
        )

    def sources(self, scene: Scene) -> Ints:
        """(T,) the triangle of the scene that each triangle of `of` is, or stands for. Raises as
        `of`."""
        self._check(scene)
        return self._sources(scene)[2]

    def _sources(self, scene: Scene) -> tuple[Ints, Ints, Ints]:
        """The triangles that stay, the order of these and the new ones, and `sources`."""
        kept = np.flatnonzero(~np.isin(scene.triangle_object, self.objects))
        source = np.concatenate([kept, self.source.astype(np.int64)])
        order = np.argsort(source, kind="stable")
        return kept, order, source[order]

    def _check(self, scene: Scene) -> None:
        if self.objects.max(initial=-1) >= len(scene.objects):
            raise ValueError("a replaced object is not in the scene")
        if self.source.max(initial=-1) >= len(scene.triangles):
            raise ValueError("a triangle stands for one that is not in the scene")
        if not np.isin(scene.triangle_object[self.source], self.objects).all():
            raise ValueError("a triangle stands for one of another object")
        if (self.colors is None) != (scene.colors is None):
            raise ValueError("only one of scene and replacement has colours")

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The arrays for `from_arrays`."""
        colors = {} if self.colors is None else {"colors": self.colors}
        return {n: v for n, v in vars(self).items() if n != "colors"} | colors

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[Any]]) -> Replacement:
        """The replacement from arrays; raises KeyError or ValueError for invalid ones."""
        stored = Stored(arrays)
        points = stored.array("points", np.float64, None, 3, finite=True)
        triangles = stored.indices("triangles", np.int32, None, 3, high=len(points))
        n, highest = len(triangles), np.iinfo(np.int32).max
        result = Replacement(
            stored.indices("objects", np.int32, None, high=highest),
            points,
            triangles,
            stored.indices("source", np.int32, n, high=highest),
            stored.array("uv", np.float64, n, 3, 2, finite=True),
            stored.array("colors", np.uint8, n, 3, 3) if "colors" in arrays else None,
        )
        if (np.diff(result.source) < 0).any() or (np.diff(result.objects) <= 0).any():
            raise ValueError("triangles or objects are not in order")
        return result


def join_replacements(parts: list[Replacement]) -> Replacement:
    """Joins replacements of different objects of one scene."""
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


#: Most names in one note.
_NAMED = 3
#: A greater share of samples whose rays miss the original is reported.
_MISSED = 0.01
#: A greater deviation, as a share of the object's size, is reported.
_FAR_OFF = 0.02


@dataclass(frozen=True)
class ReplacedObject:
    """An object with a simplified mesh.

    Attributes
    ----------
    object: index into `Scene.objects`. name: its name there.
    octree: of its normals; its cube is in world metres. None if its relief is a normal map.
    source, faces: numbers of triangles before and after.
    deviation: estimate by the quadrics of the simplified mesh's distance, metres.
    missed: share of samples of the octree whose rays do not hit the original.
    """

    object: int
    name: str
    octree: Octree | None
    source: int
    faces: int
    deviation: float
    missed: float


@dataclass(frozen=True)
class Replaced:
    """The result of `replace_objects`.

    Attributes
    ----------
    scene: the scene with the simplified meshes; the same object if nothing is replaced.
    replacement: the new triangles; None if nothing is replaced.
    objects: the replaced ones, ascending.
    notes: messages, one line each.
    """

    scene: Scene
    replacement: Replacement | None
    objects: tuple[ReplacedObject, ...]
    notes: tuple[str, ...]


def replace_objects(
    scene: Scene, options: ReplaceOptions, executor: Executor, progress: Progress = silent
) -> Replaced:
    """The scene with the objects of certain names replaced.

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
    parts, objects = [], []
    for i in (i for i in chosen if i not in set(light)):
        simplified, part = _simplify(scene, i, triangles[i], options.apo_faces, progress)
        notes += [f"{scene.objects[i]}: {note}" for note in simplified.notes]
        if not 0 < len(part.source) < len(triangles[i]):
            notes.append(f"{scene.objects[i]} stays as modelled: it cannot have fewer triangles")
            continue
        size = float(np.linalg.norm(np.ptp(scene.corners[triangles[i]], axis=(0, 1))))
        if simplified.error > _FAR_OFF * size:
            notes.append(
                Warned(
                    f"{scene.objects[i]} is off by about {simplified.error:.2g} m once simplified, "
                    f"of {size:.2g} m; use more --apo-faces, or leave it out of --apo"
                )
            )
        parts.append(part)
        objects.append(_object(scene, triangles[i], simplified, part, options, executor, progress))
    if light:
        stay = _unchanged_note([scene.objects[i] for i in light], options.apo_faces)
        notes.append(stay if parts else Warned(stay))
    notes += [
        f"{replaced.name}: from {replaced.missed:.1%} of the samples nothing of the original was "
        "found; there the octree has the normals of the simplified mesh"
        for replaced in objects
        if replaced.missed > _MISSED
    ]
    if not parts:
        return Replaced(scene, None, (), tuple(notes))
    replacement = join_replacements(parts)
    return Replaced(replacement.apply_to(scene), replacement, tuple(objects), tuple(notes))


def _by_object(scene: Scene, chosen: Sequence[int]) -> dict[int, Ints]:
    """The triangles of each of the ``chosen`` objects, ascending."""
    order = np.argsort(scene.triangle_object, kind="stable")
    begin, end = (
        np.searchsorted(scene.triangle_object[order], chosen, side) for side in ("left", "right")
    )
    return {i: order[a:b] for i, a, b in zip(chosen, begin, end, strict=True)}


def _unchanged_note(names: Sequence[str], faces: int) -> str:
    named = ", ".join(names[:_NAMED]) + (", …" if len(names) > _NAMED else "")
    have, stay = ("has", "stays") if len(names) == 1 else ("have", "stay")
    return (
        f"{count(len(names), 'object')} of --apo {have} no more triangles than --apo-faces "
        f"{faces:,}, and {stay} as modelled: {named}"
    )


def _simplify(
    scene: Scene, number: int, members: Ints, faces: int, progress: Progress
) -> tuple[Simplified, Replacement]:
    """The simplified mesh of the object with the triangles ``members``."""
    phase = f"simplifying {scene.objects[number]}"
    used, corners = np.unique(scene.triangles[members], return_inverse=True)
    points, material = scene.points[used], scene.triangle_material[members]
    images = np.array([m.image for m in scene.materials])
    painted = bool((images[material] >= 0).any())
    mesh = Mesh(
        points,
        corners.reshape(-1, 3).astype(np.int32),
        # A change of sides is a border, like one of materials.
        (2 * material + scene.two_sided[members]).astype(np.int32),
        scene.uv[members] if painted else None,
        None if scene.colors is None else scene.colors[members],
    )
    simplified = simplify(
        mesh, SimplifyOptions(faces), lambda done, total, _: progress(done, total, phase)
    )
    result = simplified.mesh
    uv = np.zeros((len(result.triangles), 3, 2)) if result.uv is None else result.uv
    return simplified, Replacement(
        np.array([number], np.int32),
        np.clip(result.points, points.min(axis=0), points.max(axis=0)),
        result.triangles,
        members[simplified.source].astype(np.int32),
        uv,
        result.colors,
    )


def apo_options(options: ReplaceOptions) -> ApoOptions:
    """The options of the relief of one object."""
    return ApoOptions(
        faces=options.apo_faces,
        error=options.apo_error,
        depth=options.apo_depth,
        density=options.apo_density,
    )


def mesh_of(scene: Scene, faces: Ints) -> tuple[Floats, NDArray[np.int32]]:
    """Distinct points, and the triangles ``faces`` of a scene between them, of which those in one
    place count once."""
    used, corners = np.unique(scene.triangles[faces], return_inverse=True)
    points, triangles = weld(scene.points[used], corners.reshape(-1, 3).astype(np.int32))
    return points, distinct(triangles)[0]


def _object(
    scene: Scene,
    faces: Ints,
    simplified: Simplified,
    part: Replacement,
    options: ReplaceOptions,
    executor: Executor,
    progress: Progress,
) -> ReplacedObject:
    """An object, with the octree of its normals around its replacement if the options ask for
    one."""
    number, count = int(part.objects[0]), len(part.triangles)
    name = scene.objects[number]
    if options.relief != "octree":
        return ReplacedObject(number, name, None, len(faces), count, simplified.error, 0.0)
    try:
        octree, missed = octree_around(
            smooth(part.points, part.triangles),
            *mesh_of(scene, faces),
            apo_options(options),
            None,
            executor,
            progress,
        )
    except LimitError as fault:
        fault.place = name
        fault.remedy = "use a greater --apo-error, a smaller --apo-depth or --apo-density"
        raise
    return ReplacedObject(number, name, octree, len(faces), count, simplified.error, missed)


@dataclass(frozen=True)
class Replacing:
    """The scene as modelled, and with simplified meshes, and the options of the maps."""

    source: Scene
    shown: Scene
    options: ApoOptions

    def normal_map(self, number: int) -> NormalMap:
        """The normal map of a replaced object; raises as `normal_map`."""
        faces = np.flatnonzero(self.shown.triangle_object == number)
        used, corners = np.unique(self.shown.triangles[faces], return_inverse=True)
        mesh = smooth(self.shown.points[used], corners.reshape(-1, 3).astype(np.int32))
        modelled = np.flatnonzero(self.source.triangle_object == number)
        return normal_map(mesh, *mesh_of(self.source, modelled), self.options)


def object_maps(shown: Scene, objects: NDArray[np.int32], maps: list[NormalMap]) -> ObjectMaps:
    """The places of ``objects``, ascending, in their maps."""
    faces = [np.flatnonzero(shown.triangle_object == number) for number in objects.tolist()]
    order = np.argsort(np.concatenate(faces), kind="stable")
    return ObjectMaps(
        objects,
        np.array([len(relief.texels) for relief in maps], np.int32),
        np.concatenate([relief.uv for relief in maps])[order],
        np.concatenate([relief.frame for relief in maps])[order],
    )
