"""Replaces objects of the scene by simplified meshes with octree textures (paper 2), or without:
the stage `relief` then bakes normal maps.

Only the new arrays of the scene are stored. The octrees are served files, listed in a file of
their own, so that a finer octree changes neither the cells nor the stages after them.

Stages that concern the drawn geometry read this stage; those that concern the model and its images
read the scene. Without objects to replace, this stage writes nothing.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ptmtools.lazy import Lazy, component
from ptmtools.output.names import plain_name
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.stage import Counts, SceneOrigin, Stage, complete
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count, size
from ptmtools.store.layout import SERVED, STAGES_FOLDER, arrays_of
from ptmtools_systems.apo.declarations import OCTREES
from ptmtools_systems.apo.options import ReplaceOptions

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.output.representation import Represented
    from ptmtools.scene.model import Scene
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools_systems.apo.model import Octree
    from ptmtools_systems.apo.replacing import ReplacedObject

OCTREE_LIST = f"{STAGES_FOLDER}/octrees.json"
_FILE = re.compile(rf"{OCTREES.folder}/[A-Za-z0-9_]+\.bin")


def octree_files(objects: Iterable[str]) -> list[str]:
    """The file of each object's octree, relative to the served folder."""
    return [f"{OCTREES.folder}/{stem}.bin" for stem in object_stems(objects)]


def object_stems(objects: Iterable[str]) -> list[str]:
    """A stem for the files of each object, unique without regard to case."""
    taken: set[str] = set()
    stems = []
    for name in objects:
        stem = unique = plain_name(name, "object")
        number = 1
        while unique.casefold() in taken:
            number += 1
            unique = f"{stem}_{number}"
        taken.add(unique.casefold())
        stems.append(unique)
    return stems


def _row(file: str, replaced: ReplacedObject, octree: Octree) -> tuple[dict[str, Any], bytes]:
    """The row of an octree in the list, and its stream."""
    import numpy as np

    from ptmtools_systems.apo.files import encode_stream

    data, levels = encode_stream(octree.texels, octree)
    row = {
        "object": replaced.name,
        "number": replaced.object,
        "file": file,
        "low": octree.low.tolist(),
        "side": octree.side,
        "levels": np.diff(octree.start).tolist(),
        **levels,
        "source": replaced.source,
        "faces": replaced.faces,
        "deviation": replaced.deviation,
        "missed": replaced.missed,
    }
    return row, data


def octree_records(artifacts: Artifacts) -> tuple[OctreeRecord, ...]:
    """The octree textures of a database, for the served files; raises PTM-D004 to PTM-D006."""
    if OCTREE_LIST not in artifacts.outputs(APO):
        return ()

    def read() -> tuple[OctreeRecord, ...]:
        rows = json.loads(artifacts.db.read_output(APO.name, OCTREE_LIST))["octrees"]
        return tuple(map(_record, rows))

    return artifacts.cached(OCTREE_LIST, read)


@dataclass(frozen=True)
class OctreeRecord:
    """The octree texture of an object, for the emitted files (docs/formats/apo.md).

    Attributes
    ----------
    object, number: its name, which objects may share, and its index in the scene.
    file: the stream of texels, relative to the served folder, "apo/NAME.bin".
    low, side: corner and side of the cube, world metres.
    levels: texels of each level, from the root on.
    ends: the length of the prefix of the file that holds each level and those before it.
    crc32: of the texels of each level.
    """

    object: str
    number: int
    file: str
    low: tuple[float, ...]
    side: float
    levels: tuple[int, ...]
    ends: tuple[int, ...]
    crc32: tuple[int, ...]

    def row(self) -> dict[str, Any]:
        """The row in the index of the hints."""
        return {
            "object": self.object,
            "file": quote(self.file),
            "cube": {"low": list(self.low), "side": self.side},
            "levels": list(self.levels),
            "ends": list(self.ends),
            "crc32": list(self.crc32),
        }


def _record(row: Mapping[str, Any]) -> OctreeRecord:
    """Raises ValueError, KeyError or TypeError for a row that no list has."""
    low, side = tuple(map(float, row["low"])), float(row["side"])
    levels, ends, checks = (tuple(map(int, row[name])) for name in ("levels", "ends", "crc32"))
    number = int(row["number"])
    if not isinstance(row["object"], str) or number < 0 or not _FILE.fullmatch(row["file"]):
        raise ValueError("an octree with an impossible name")
    if len(low) != 3 or not all(map(math.isfinite, low)) or not 0 < side < math.inf:
        raise ValueError("an octree without a place")
    if not len(levels) == len(ends) == len(checks) > 0:
        raise ValueError("an octree whose lists are not aligned")
    return OctreeRecord(row["object"], number, row["file"], low, side, levels, ends, checks)


class ReplacingStage(Stage["Scene"]):
    """Replaces the selected objects."""

    name = "apo"
    about = "Replace objects with simplified meshes and their relief."
    recipe = 3
    changed = "meshes with many small holes, handles or parts are simplified as far as others"
    options = ReplaceOptions
    artifact = Lazy("ptmtools.scene.model:Scene")
    changes = SCENE
    represents = True
    optional = True
    joined = True

    def read_with(self, options: ReplaceOptions) -> tuple[Stage[Any], ...]:
        return (SCENE,) if options.apo else ()

    def check_options(self, options: ReplaceOptions) -> None:
        """Raises MissingComponentError: PTM-M100 xatlas is not installed, which a later stage
        needs."""
        if options.apo and options.relief == "normal-map":
            component("xatlas", "PTM-M100", "baking normal maps needs xatlas", "light")

    def load(self, artifacts: Artifacts, arrays: Mapping[str, NDArray[np.generic]]) -> Scene:
        from ptmtools_systems.apo.replacing import Replacement

        replacement = Replacement.from_arrays(arrays)
        numbers = [record.number for record in octree_records(artifacts)]
        has_list = OCTREE_LIST in artifacts.outputs(self)
        if has_list and numbers != replacement.objects.tolist():
            raise ValueError(f"{arrays_of(self.name)} and {OCTREE_LIST} are of other objects")
        return replacement.apply_to(artifacts.original(SCENE))

    def missing(self, artifacts: Artifacts, scene: Scene) -> Iterator[tuple[str, str, str]]:
        """The octrees without a file in the database."""
        outputs = artifacts.outputs(self)
        for record in octree_records(artifacts):
            if f"{SERVED}/{record.file}" not in outputs:
                yield OCTREE_LIST, record.object, "has no octree in the database"

    def foresee(self, artifacts: Artifacts, work: StageRecord) -> bool:
        """Known if nothing was replaced, and nothing will be."""
        before = artifacts.before(self)
        return not work.parameters["apo"] and not (before and before.outputs)

    def make(
        self, run: Run, options: ReplaceOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord:
        """Raises the errors of `replace_objects`."""
        if not options.apo:
            return replace(work, counts={"octrees": 0})
        from ptmtools_systems.apo.replacing import replace_objects

        result = replace_objects(run.original(SCENE), options, run.workers.executor, run.progress)
        rows = []
        files = octree_files(thing.name for thing in result.objects)
        for file, thing in zip(files, result.objects, strict=True):
            if thing.octree is not None:
                row, data = _row(file, thing, thing.octree)
                rows.append(row)
                transaction.put(f"{SERVED}/{file}", data)
        if result.replacement:
            transaction.put_arrays(self.name, result.replacement.to_arrays())
        if rows:
            text = json.dumps({"octrees": rows}, indent=1, ensure_ascii=False) + "\n"
            transaction.put(OCTREE_LIST, text.encode())
            run.cache(OCTREE_LIST, tuple(map(_record, rows)))
        run.keep(self, result.scene)
        counts = {
            "octrees": len(rows),
            "objects": len(result.objects),
            "source": sum(thing.source for thing in result.objects),
            "faces": sum(thing.faces for thing in result.objects),
            "texels": sum(sum(row["levels"]) for row in rows),
            "bytes": sum(row["ends"][-1] for row in rows),
            "triangles": len(result.scene.triangles),
            "deviation": max((thing.deviation for thing in result.objects), default=0.0),
        }
        return complete(work, counts, result.notes)

    def counts(self, scene: Scene) -> Counts:
        return {"triangles": len(scene.triangles)}

    def summary(self, n: Counts) -> str:
        if not (objects := n.get("objects", n["octrees"])):  # 0.2.0 counts octrees only
            return "no object replaced"
        octrees = f"; {count(n['texels'], 'texel')} of octrees, {size(n['bytes'])}"
        return (
            f"{count(objects, 'object')} of {count(n['source'], 'triangle')} → {n['faces']:,}, "
            f"error about {n['deviation']:.2g} m{octrees if n['octrees'] else ''}"
        )

    def origin(self, artifacts: Artifacts) -> SceneOrigin:
        """What the replaced objects come from; raises PTM-D004 to PTM-D006."""
        from ptmtools_systems.apo.replacing import Replacement

        arrays = artifacts.db.read_arrays(self.name)
        with artifacts.reading(arrays_of(self.name)):
            replacement = Replacement.from_arrays(arrays)
        return SceneOrigin(replacement.objects, replacement.sources(artifacts.original(SCENE)))

    def represented(self, artifacts: Artifacts) -> Represented:
        """The objects with octree textures; raises PTM-D004 to PTM-D006."""
        from ptmtools.output.representation import Represented

        records = octree_records(artifacts)
        rows = [record.row() for record in records]
        return Represented(tuple(record.number for record in records), OCTREES, rows)


APO = ReplacingStage()
