"""The stage `apo`: objects of the scene become simplified meshes and octree textures (paper 2).

What is stored of the scene is what is new in it. The octrees are served files, and a list of them
is kept beside the arrays, so that a finer octree touches neither the cells nor what follows from
them.
"""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ptmtools.diagnostics import warnings_in
from ptmtools.output.names import OCTREE_FOLDER
from ptmtools.pipeline.run import Artifacts, Job
from ptmtools.pipeline.stages.apo import APO
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.store.layout import OCTREE_LIST, SERVED, arrays_of
from ptmtools.store.manifest import StageRecord
from ptmtools.store.transaction import Transaction

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.neighbours.apo.replacing import ReplacedObject
    from ptmtools.output.model import OctreeRecord
    from ptmtools.scene.model import Scene

_ILLEGAL = re.compile(r"[^A-Za-z0-9_]+")
_FILE = re.compile(rf"{OCTREE_FOLDER}/[A-Za-z0-9_]+\.bin")
#: Longer names of objects are cut: they come from generators and say nothing more.
_LONGEST = 48


class ReplacingJob(Job):
    """Replaces the objects that are asked for; without any it makes nothing."""

    def make(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        """Raises what `replaced` raises."""
        if not self.options.apo:
            return replace(work, counts={"octrees": 0})
        from ptmtools.neighbours.apo.replacing import replaced

        run = self.run
        made = replaced(run[SCENE], self.options, run.workers.executor, run.progress)
        rows = []
        for file, each in zip(
            octree_files(o.name for o in made.octrees), made.octrees, strict=True
        ):
            row, data = _written(file, each)
            rows.append(row)
            transaction.put(f"{SERVED}/{file}", data)
        if made.replacement:
            transaction.put_arrays(APO.name, made.replacement.to_arrays())
            text = json.dumps({"octrees": rows}, indent=1, ensure_ascii=False) + "\n"
            transaction.put(OCTREE_LIST, text.encode())
            run.hold(OCTREE_LIST, tuple(map(_record, rows)))
        run.keep(APO, made.scene)
        counts = {
            "octrees": len(rows),
            "source": sum(row["source"] for row in rows),
            "faces": sum(row["faces"] for row in rows),
            "texels": sum(sum(row["levels"]) for row in rows),
            "bytes": sum(row["ends"][-1] for row in rows),
            "triangles": len(made.scene.triangles),
            "deviation": max((row["deviation"] for row in rows), default=0.0),
        }
        notes = tuple(map(str, made.notes))
        return replace(work, counts=counts, notes=notes, warnings=warnings_in(made.notes))


def foresee(artifacts: Artifacts, work: StageRecord) -> bool:
    """See `Stage.foresee`: known if nothing was replaced, and nothing will be."""
    before = artifacts.before(APO)
    return not work.parameters["apo"] and not (before and before.outputs)


def octree_files(objects: Iterable[str]) -> list[str]:
    """The file of each object's octree, relative to the served folder, unique without regard to
    case."""
    taken: set[str] = set()
    found = []
    for name in objects:
        plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        wanted = _ILLEGAL.sub("_", plain).strip("_")[:_LONGEST] or "object"
        unique, number = wanted, 1
        while unique.casefold() in taken:
            number += 1
            unique = f"{wanted}_{number}"
        taken.add(unique.casefold())
        found.append(f"{OCTREE_FOLDER}/{unique}.bin")
    return found


def _written(file: str, made: ReplacedObject) -> tuple[dict[str, Any], bytes]:
    """The row of an octree in the list, and its stream."""
    import numpy as np

    from ptmtools.neighbours.apo.files import streamed

    data, levels = streamed(made.octree.texels, made.octree)
    row = {
        "object": made.name,
        "number": made.object,
        "file": file,
        "low": made.octree.low.tolist(),
        "side": made.octree.side,
        "levels": np.diff(made.octree.start).tolist(),
        **levels,
        "source": made.source,
        "faces": made.faces,
        "deviation": made.deviation,
        "missed": made.missed,
    }
    return row, data


def octree_records(artifacts: Artifacts) -> tuple[OctreeRecord, ...]:
    """What the emitted files say of the octree textures of a database; raises PTM-D004 to
    PTM-D006."""
    if OCTREE_LIST not in artifacts.outputs(APO):
        return ()

    def read() -> tuple[OctreeRecord, ...]:
        rows = json.loads(artifacts.db.read_output(APO.name, OCTREE_LIST))["octrees"]
        return tuple(map(_record, rows))

    return artifacts.held(OCTREE_LIST, read)


def _record(row: Mapping[str, Any]) -> OctreeRecord:
    """Raises ValueError, KeyError or TypeError for what is no row of the list."""
    from ptmtools.output.model import OctreeRecord

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


def load_scene(artifacts: Artifacts, arrays: Mapping[str, NDArray[np.generic]]) -> Scene:
    """See `Stage.load`."""
    from ptmtools.neighbours.apo.replacing import Replacement

    replacement = Replacement.from_arrays(arrays)
    numbers = [record.number for record in octree_records(artifacts)]
    if numbers != replacement.objects.tolist():
        raise ValueError(f"{arrays_of(APO.name)} and {OCTREE_LIST} are of other objects")
    return replacement.of(artifacts[SCENE])


def missing_octrees(artifacts: Artifacts, scene: Scene) -> Iterator[tuple[str, str, str]]:
    """The octrees that the database has no file of, see `Stage.check`."""
    outputs = artifacts.outputs(APO)
    for record in octree_records(artifacts):
        if f"{SERVED}/{record.file}" not in outputs:
            yield OCTREE_LIST, record.object, "has no octree in the database"
