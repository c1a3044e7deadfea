"""What `ptm info` says of a model."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.cli.output import Voice
from ptmtools.quantities import count, size

if TYPE_CHECKING:
    from ptmtools.cells.entrances import Enclosure
    from ptmtools.scene.inspection import Guess, Inspection
    from ptmtools.scene.options import IngestOptions

#: So many objects, images and doors are named without ``-v``.
_SHOWN = 5


def info_model(voice: Voice, target: str, options: IngestOptions, as_json: bool) -> None:
    """Reads a model and prints what it is. Raises what `ptmtools.scene.ingest` raises."""
    from ptmtools.cells.entrances import enclosure
    from ptmtools.parallel import processors
    from ptmtools.scene.inspection import inspect

    with voice.progress() as progress:
        found = inspect(Path(target), options, progress, workers=processors())
    around = enclosure(found.scene)
    if as_json:
        voice.emit_json(_record(found, around))
        return
    scene, many = found.scene, voice.verbose
    by = f", written by {found.generator}" if found.generator else ""
    voice.say(f"{target}: {found.format}, {size(found.bytes)}{by}")
    for name, outcome in found.extensions.items():
        _row(voice, "extension", f"{name}: {outcome}")
    _row(voice, "triangles", f"{len(scene.triangles):,} in {count(len(scene.objects), 'object')}")
    named = [f"{name} {triangles:,}" for name, triangles in found.objects.items()]
    _row(voice, "", f"most in {_some(named, many)}")
    _row(voice, "materials", _materials(found))
    _row(voice, "images", _images(found))
    sizes = [f"{i.name} {i.width} x {i.height}" for i in found.images]
    if sizes:
        _row(voice, "", _some(sizes, many))
    _say_space(voice, found)
    _row(voice, "closed", _closed(around))
    doors = f"{len(around.doors)} recognised"
    _row(voice, "doors", f"{doors}: {_some(list(around.doors), many)}" if around.doors else doors)
    if scene.storeys:
        named = [f"{storey.name} at {storey.height:.3g} m" for storey in scene.storeys]
        _row(voice, "storeys", _some(named, many))
    _say_notes(voice, scene.notes)


def _row(voice: Voice, name: str, text: str) -> None:
    voice.say(f"{name:<10} {text}")


def _some(names: list[str], many: bool) -> str:
    shown = names if many else names[:_SHOWN]
    more = f" and {len(names) - len(shown):,} more" if len(names) > len(shown) else ""
    return ", ".join(shown) + more


def _materials(found: Inspection) -> str:
    materials = found.scene.materials
    plain = sum(material.image < 0 for material in materials)
    through = sum(material.transparent for material in materials)
    parts = [f"{plain:,} without an image"] if plain else []
    parts += [f"{through:,} see-through"] if through else []
    return f"{len(materials):,}" + (f", of which {', '.join(parts)}" if parts else "")


def _images(found: Inspection) -> str:
    kinds = Counter(image.format for image in found.images)
    if not kinds:
        return "none"
    texels = sum(image.width * image.height for image in found.images)
    files = ", ".join(f"{number:,} {kind}" for kind, number in kinds.most_common())
    total = sum(image.bytes for image in found.images)
    return f"{files}; {size(total)}, {texels / 1e6:,.1f} million texels"


def _say_space(voice: Voice, found: Inspection) -> None:
    scene = found.scene
    space = scene.space
    width, height, depth = (scene.points.max(axis=0) - scene.points.min(axis=0)).tolist()
    _row(voice, "size", f"{width:.3g} x {depth:.3g} m, {height:.3g} m high")
    guessed = "guessed" if space.unit_guessed else "given"
    _row(voice, "unit", f"{space.metres:g} m ({guessed})")
    _row(voice, "up axis", f"{space.up} ({'guessed' if space.up_guessed else 'given'})")
    _row(voice, "looks like", _guess(found.best))
    for place, other in enumerate(found.others):
        if place == 0 or other.rival:
            _row(voice, "or like", _guess(other))


def _guess(guess: Guess) -> str:
    why = f" ({', '.join(guess.reasons)})" if guess.reasons else ""
    return f"{guess.unit}, {guess.up} up: {guess.size}{why}"


def _closed(around: Enclosure) -> str:
    if not around.rooms:
        return "no place under a roof and between walls found"
    if around.closed:
        return "looks closed: no sight line from its rooms leaves it"
    roof = "" if around.roofed > 0.99 else f"; {1 - around.roofed:.0%} of the floor has no ceiling"
    return f"looks open: {around.leaving:.1%} of the sight lines from its rooms leave it{roof}"


def _say_notes(voice: Voice, notes: Any) -> None:
    from ptmtools.scene.notes import line, warnings

    for warning in warnings(notes):
        _row(voice, "warning", warning)
    if voice.verbose:
        for note in notes:
            _row(voice, "note", line(note))


def _record(found: Inspection, around: Enclosure) -> dict[str, Any]:
    scene = found.scene
    return {
        "format": found.format,
        "generator": found.generator,
        "bytes": found.bytes,
        "extensions": found.extensions,
        "triangles": len(scene.triangles),
        "objects": found.objects,
        "materials": [vars(material) for material in scene.materials],
        "images": [asdict(image) for image in found.images],
        "space": vars(scene.space),
        "size": (scene.points.max(axis=0) - scene.points.min(axis=0)).tolist(),
        "looks": [asdict(guess) for guess in (found.best, *found.others)],
        "enclosure": asdict(around) | {"closed": around.closed},
        "storeys": [vars(storey) for storey in scene.storeys],
        "notes": [vars(note) for note in scene.notes],
    }
