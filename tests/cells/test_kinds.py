"""Effect of the classes of objects on the structure; the user's options take precedence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells import SubdivideOptions, structural_triangles, subdivide
from ptmtools.cells.fabric import Fabric
from ptmtools.scene.model import Kind, Scene
from tests.cells.doored_rooms import leaf, leaf_names, rooms, scene, solid
from tests.cells.test_detail import ball
from tests.conftest import scene_of


def classed(made: Scene, **kinds: Kind) -> Scene:
    """The objects of these names are of these kinds."""
    return replace(made, kinds=tuple(kinds.get(name, "") for name in made.objects))


def with_ball(**kinds: Kind) -> Scene:
    """Two rooms and a thing that looks like a statue."""
    walls = scene(rooms())
    thing = scene_of(ball(12), ["thing"] * 528)
    points = np.concatenate([walls.points, thing.points])
    triangles = np.concatenate([walls.triangles, thing.triangles + len(walls.points)])
    both = replace(
        walls,
        points=points,
        triangles=triangles,
        uv=np.concatenate([walls.uv, thing.uv]),
        triangle_object=np.concatenate([walls.triangle_object, thing.triangle_object * 0 + 1]),
        triangle_material=np.zeros(len(triangles), np.int32),
        two_sided=np.ones(len(triangles), bool),
        objects=("masonry", "thing"),
    )
    return classed(both.with_points(points), **kinds)


def same(one: Scene, options: SubdivideOptions, other: Scene) -> bool:
    """Whether one scene with options is divided as another without."""
    first, second = subdivide(one, options).to_arrays(), subdivide(other).to_arrays()
    return first.keys() == second.keys() and all(np.array_equal(first[k], second[k]) for k in first)


THING = solid((1, 0, -1), (3, 2.5, 1))


def test_detail_as_if_named() -> None:
    made = scene(rooms(), thing=THING)
    named = SubdivideOptions(detail=("thing",))
    assert same(made, named, classed(made, thing="detail"))
    assert not same(made, named, made)


def test_a_door_as_if_named() -> None:
    """A gate 15 cm thick: no leaf by its shape."""
    gate = leaf(4.02, thickness=0.15)
    made = scene(rooms(), gate=gate)
    assert leaf_names(made) == []
    assert leaf_names(classed(made, gate="door")) == ["gate"]
    named = SubdivideOptions(door=("gate",))
    assert same(made, named, classed(made, gate="door"))
    assert not same(made, named, made)


def test_structure_is_never_detail_by_shape() -> None:
    options = SubdivideOptions()
    assert np.count_nonzero(~structural_triangles(with_ball(), options)) == 528
    assert structural_triangles(with_ball(thing="structural"), options).all()


def test_structure_is_never_a_door() -> None:
    """A part of a wall that is as large as a leaf, fills a doorway, and may even be called so."""
    for name in ("thing", "Door"):
        made = scene(rooms(), **{name: leaf(4.05)})
        assert leaf_names(made) == [name]
        assert leaf_names(classed(made, **{name: "structural"})) == []


def test_structure_divides_by_its_area() -> None:
    """A step of 0.5 m² does not by its class, and does by its name."""
    step = solid((1, 0, -0.5), (1.5, 0.5, 0.5))
    made = scene(rooms(), step=step)
    plain = subdivide(made).leaf_count
    assert subdivide(classed(made, step="structural")).leaf_count == plain
    assert subdivide(made, SubdivideOptions(structural=("step",))).leaf_count > plain


@pytest.mark.parametrize("kind", ["structural", "detail", "door", ""])
@pytest.mark.parametrize("option", ["structural", "detail", "door"])
@pytest.mark.parametrize("pattern", ["thing", "pla*"])
def test_the_user_comes_first(kind: Kind, option: str, pattern: str) -> None:
    """By the name of the object or by that of its material, which all objects share."""
    made = classed(scene(rooms(), thing=THING), thing=kind, masonry="structural")
    options = SubdivideOptions(**{option: (pattern,)})  # type: ignore[arg-type]
    printed = Fabric.from_scene(made, options)
    thing = made.triangle_object == made.objects.index("thing")
    for name in ("structural", "detail", "door"):
        assert (getattr(printed, name)[thing] == (name == option)).all()
    everywhere = pattern == "pla*"
    assert (printed.structural[~thing] == (not everywhere or option == "structural")).all()
    assert (printed.forced == (thing | everywhere) & (option == "structural")).all()


def test_no_classes_no_difference() -> None:
    made = scene(rooms(), thing=THING)
    assert same(made, SubdivideOptions(), classed(made))
