"""Objects of a building are replaced: by what they look like, and nothing else is touched."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.diagnostics import Warned
from ptmtools.errors import InputError, LimitError
from ptmtools.executor import Executor
from ptmtools.parallel import open_executor
from ptmtools.scene import ingest
from ptmtools.scene.model import Scene
from ptmtools_systems.apo.octree import fault_of
from ptmtools_systems.apo.options import ReplaceOptions
from ptmtools_systems.apo.replacing import Replaced, Replacement, replace_objects
from ptmtools_systems.apo.traversal import look_up
from tests.systems.apo.statues import STATUES, statue, wrapped, write_rooms
from tests.systems.apo.test_making import source_normals

OPTIONS = ReplaceOptions(apo=("statue_*",), apo_faces=600, apo_error=0.1, apo_depth=8)
SUBDIVISIONS = 4
#: Half of an edge of a statue as modelled, metres; that of a simplified one is three times as long.
NARROW = 0.025


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The triangles of all objects are mixed."""
    scene = ingest(write_rooms(tmp_path_factory.mktemp("rooms") / "model", SUBDIVISIONS))
    order = np.random.default_rng(3).permutation(len(scene.triangles))
    names = ("triangles", "uv", "triangle_object", "triangle_material", "two_sided")
    return replace(scene, **{name: getattr(scene, name)[order] for name in names})


@pytest.fixture(scope="module")
def made(rooms: Scene) -> Replaced:
    return replace_objects(rooms, OPTIONS, Executor())


def of_object(scene: Scene, name: str) -> np.ndarray:
    return np.flatnonzero(scene.triangle_object == scene.objects.index(name))


def test_statues_are_light_and_all_else_is_as_it_was(rooms: Scene, made: Replaced) -> None:
    scene = made.scene
    assert made.notes == ()
    assert [o.name for o in made.objects] == list(STATUES)
    for each in made.objects:
        assert each.source == len(of_object(rooms, each.name)) == 5120
        assert each.faces == len(of_object(scene, each.name)) <= OPTIONS.apo_faces
        assert each.faces > OPTIONS.apo_faces / 2
    old, new = (~np.isin(s.triangle_object, [o.object for o in made.objects])
                for s in (rooms, scene))  # fmt: skip
    assert np.array_equal(rooms.corners[old], scene.corners[new])
    for name in ("uv", "triangle_object", "triangle_material", "two_sided"):
        assert np.array_equal(getattr(rooms, name)[old], getattr(scene, name)[new]), name
    for name in ("objects", "materials", "images", "tolerance", "kinds", "cameras", "space"):
        assert getattr(rooms, name) == getattr(scene, name), name
    assert np.array_equal(np.unique(scene.triangles), np.arange(len(scene.points)))


def test_a_simplified_statue_stays_in_its_box_and_near_its_surface(
    rooms: Scene, made: Replaced
) -> None:
    import trimesh

    for each in made.objects:
        before, after = (s.corners[of_object(s, each.name)] for s in (rooms, made.scene))
        low, high = before.min(axis=(0, 1)), before.max(axis=(0, 1))
        assert (after >= low).all()
        assert (after <= high).all()
        away = np.abs(after.reshape(-1, 3).min(axis=0) - low).max()
        assert away < 4 * each.deviation
        mesh = trimesh.Trimesh(before.reshape(-1, 3), np.arange(before.size // 3).reshape(-1, 3))
        _, distance, _ = trimesh.proximity.closest_point_naive(mesh, after.reshape(-1, 3)[::40])
        assert distance.max() < 4 * each.deviation
        assert each.deviation < 0.02


def test_what_is_painted_stays_where_it_was(rooms: Scene, made: Replaced) -> None:
    name, other = STATUES
    scene = made.scene
    own = of_object(scene, name)
    image = scene.images[scene.materials[scene.triangle_material[own[0]]].image].name
    assert image == "room_a.png"
    assert len(np.unique(scene.triangle_material[own])) == 1
    # Where a corner is on the ball says what it is painted with.
    points, _ = statue(name, SUBDIVISIONS)
    shift = scene.corners[own].reshape(-1, 3).min(axis=0) - points.min(axis=0)
    expected = wrapped(
        (scene.corners[own] - shift).reshape(-1, 3), np.arange(3 * len(own)).reshape(-1, 3)
    )
    off = scene.uv[own] - expected
    off[..., 0] -= np.rint(off[..., 0])  # a turn further is the same place
    poles = np.abs(expected[..., 1] - 0.5) > 0.45  # all the way around in one step
    assert np.abs(off[~poles]).max() < 0.06
    assert np.abs(off[~poles]).mean() < 0.006
    # One without an image has no seam to keep.
    assert (scene.uv[of_object(scene, other)] == 0).all()


def test_the_normals_are_those_of_the_statue(rooms: Scene) -> None:
    rng = np.random.default_rng(2)
    made = replace_objects(rooms, replace(OPTIONS, apo_error=0.03, apo_density=60), Executor())
    for each in made.objects:
        assert fault_of(each.octree) is None
        own = of_object(rooms, each.name)
        points, triangles = np.unique(
            rooms.corners[own].reshape(-1, 3), axis=0, return_inverse=True
        )
        corner = made.scene.corners[of_object(made.scene, each.name)]
        chosen, weight = rng.integers(0, len(corner), 60), rng.dirichlet([1, 1, 1], 60)
        at = np.einsum("ij,ijk->ik", weight, corner[chosen])
        expected = source_normals(points, triangles.reshape(-1, 3), at)
        flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[chosen]
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        actual = look_up(each.octree, (at - each.octree.low) / each.octree.side).normals
        off, plain = (
            np.degrees(np.arccos(np.clip((n * expected).sum(axis=1), -1, 1)))
            for n in (actual, flat)
        )
        assert off.mean() < 2.5
        assert off.mean() < plain.mean() / 2


def test_borders_of_sides_and_of_colours_stay(rooms: Scene) -> None:
    own = of_object(rooms, "statue_02")
    middle = rooms.corners[own].mean(axis=1)
    x, y = middle.mean(axis=0)[:2]
    two_sided = rooms.two_sided.copy()
    two_sided[own] = middle[:, 1] > y
    colors = np.full((len(rooms.triangles), 3, 3), 255, np.uint8)
    colors[own[middle[:, 0] > x]] = [255, 0, 0]
    both = replace(rooms, two_sided=two_sided, colors=colors)
    scene = replace_objects(both, replace(OPTIONS, apo=("statue_02",)), Executor()).scene
    assert scene.colors is not None
    own = of_object(scene, "statue_02")
    assert len(own) < 1200
    corner = scene.corners[own]
    red = (scene.colors[own] == [255, 0, 0]).all(axis=(1, 2))
    for along, printed in ((corner[..., 0] - x, red), (corner[..., 1] - y, scene.two_sided[own])):
        assert along[printed].min() > -NARROW
        assert along[~printed].max() < NARROW
    rest = scene.triangle_object != scene.objects.index("statue_02")
    assert (scene.colors[rest] == 255).all()


def test_light_objects_and_unknown_names(rooms: Scene) -> None:
    actual = replace_objects(rooms, ReplaceOptions(apo=("*", "bust"), apo_faces=5120), Executor())
    assert actual.scene is rooms
    assert (actual.replacement, actual.objects) == (None, ())
    unknown, light = actual.notes
    assert unknown == "--apo: no object is called 'bust'"
    assert light.startswith("15 objects of --apo have no more triangles than --apo-faces 5,120")
    assert all(isinstance(note, Warned) for note in actual.notes)
    some = replace_objects(rooms, replace(OPTIONS, apo=("*",)), Executor())
    assert [isinstance(note, Warned) for note in some.notes] == [False]
    assert len(some.objects) == 2


def test_what_cannot_be_lighter_stays(rooms: Scene) -> None:
    """Each triangle has a material of its own: every edge is a border."""
    own = of_object(rooms, "statue_01")
    material = rooms.triangle_material.copy()
    material[own] = len(rooms.materials) + np.arange(len(own))
    materials = (*rooms.materials, *[rooms.materials[0]] * len(own))
    patched = replace(rooms, triangle_material=material, materials=materials)
    actual = replace_objects(patched, replace(OPTIONS, apo=("statue_01",)), Executor())
    assert actual.scene is patched
    assert "statue_01 stays as modelled: it cannot have fewer triangles" in actual.notes


def test_objects_of_one_name_are_two(rooms: Scene) -> None:
    names = tuple("statue" if name in STATUES else name for name in rooms.objects)
    actual = replace_objects(
        replace(rooms, objects=names), replace(OPTIONS, apo=("statue",)), Executor()
    )
    assert [each.name for each in actual.objects] == ["statue", "statue"]
    assert actual.objects[0].object != actual.objects[1].object
    for each in actual.objects:
        corner = actual.scene.corners[actual.scene.triangle_object == each.object]
        q = (corner - each.octree.low) / each.octree.side
        assert ((q >= 0) & (q < 1)).all()


def test_nothing_is_asked_for(rooms: Scene) -> None:
    actual = replace_objects(rooms, ReplaceOptions(), Executor())
    assert actual == Replaced(rooms, None, (), ())


def test_workers_and_the_way_through_a_file_change_nothing(rooms: Scene, made: Replaced) -> None:
    assert made.replacement
    again = Replacement.from_arrays(made.replacement.to_arrays()).apply_to(rooms)
    for name, array in made.scene.to_arrays().items():
        assert np.array_equal(array, again.to_arrays()[name]), name
    with open_executor(2) as executor:
        other = replace_objects(rooms, OPTIONS, executor)
    for name, array in made.scene.to_arrays().items():
        assert np.array_equal(array, other.scene.to_arrays()[name]), name
    for one, two in zip(made.objects, other.objects, strict=True):
        assert np.array_equal(one.octree.texels, two.octree.texels)


def test_holes_that_are_filled_go_the_way_through_a_file(rooms: Scene) -> None:
    """What fills a hole stands for a face beside it, as that may itself."""
    statue = np.flatnonzero(np.isin(rooms.triangle_object, list(map(rooms.objects.index, STATUES))))
    lost = np.random.default_rng(1).choice(statue, len(statue) // 20, replace=False)
    kept = np.setdiff1d(np.arange(len(rooms.triangles)), lost)
    names = ("triangles", "uv", "triangle_object", "triangle_material", "two_sided")
    holed = replace(rooms, **{name: getattr(rooms, name)[kept] for name in names})
    made = replace_objects(holed, OPTIONS, Executor())
    assert made.replacement
    assert any("holes are filled" in note for note in made.notes)
    assert (np.diff(made.replacement.source) == 0).any()
    again = Replacement.from_arrays(made.replacement.to_arrays()).apply_to(holed)
    for name, array in made.scene.to_arrays().items():
        assert np.array_equal(array, again.to_arrays()[name]), name


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("objects", lambda a: a + 99),
        ("objects", lambda a: a[::-1]),
        ("source", lambda a: a[::-1]),
        ("source", lambda a: a - a.min()),
        ("source", lambda a: a + 10**6),
        ("source", lambda a: a[1:]),
        ("triangles", lambda a: a + 1),
        ("triangles", lambda a: a.astype(float)),
        ("points", lambda a: a * np.nan),
        ("uv", lambda a: a[:, :2]),
        ("colors", lambda a: np.zeros((len(a), 3, 3), np.uint8)),
    ],
)
def test_a_replacement_that_is_none(rooms: Scene, made: Replaced, name: str, change) -> None:
    assert made.replacement
    arrays = made.replacement.to_arrays()
    arrays[name] = change(arrays.get(name, arrays["source"]))
    with pytest.raises(ValueError, match=r".+"):
        Replacement.from_arrays(arrays).apply_to(rooms)


def test_too_many_texels_are_refused(rooms: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ptmtools_systems.apo.octree.ADDRESS_BITS", 8)
    with pytest.raises(LimitError, match=r"statue_01: .*--apo-error.*--apo-depth.*PTM-L400"):
        replace_objects(rooms, OPTIONS, Executor())


@pytest.mark.parametrize(
    "wrong", [{"apo_faces": 3}, {"apo_error": -1}, {"apo_depth": 21}, {"apo_density": 0}]
)
def test_options_out_of_range(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=r"--apo-(faces|error|depth|density) .*PTM-I111"):
        ReplaceOptions(**wrong)  # type: ignore[arg-type]


def test_the_model_is_that_of_the_sample_and_statues(rooms: Scene, tmp_path: Path) -> None:
    assert len(rooms.triangles) == 40 + 2 * 5120
    assert len(rooms.objects) == 15


def test_an_object_that_is_far_off_once_simplified_is_told(rooms: Scene) -> None:
    name = rooms.objects[-1]
    reported = replace_objects(rooms, ReplaceOptions(apo=(name,), apo_faces=12), Executor()).notes
    assert any(isinstance(note, Warned) and "is off by about" in note for note in reported)
    fine = replace_objects(rooms, ReplaceOptions(apo=(name,), apo_faces=1000), Executor()).notes
    assert not any("is off by about" in note for note in fine)
