"""Damaged files for the readers that run in processes of their own: Draco, KTX2, IFC, USD.

    python -m benchmarks.fuzz.foreign [--count 400] [--seed 1] [--jobs 1]

Each input starts a process, so there are few. A file is a finding if anything but a `PtmError`
comes out, or if it takes longer than `SECONDS`; a reader that dies is none, as that is what its
process is for, but is counted. Exit status 1 if there was a finding.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.fuzz.mutation import damaged
from ptmtools.errors import PtmError
from ptmtools.scene import IngestOptions, ingest

SECONDS = 30.0
OPTIONS = IngestOptions(limit=16, max_triangles=300_000)


def draco() -> tuple[str, bytes]:
    """What a primitive of a GLB holds, and where in it."""
    import DracoPy

    rng = np.random.default_rng(5)
    points = rng.random((200, 3))
    faces = rng.integers(0, 200, (300, 3)).astype(np.uint32)
    return "drc", DracoPy.encode(
        points, faces, quantization_bits=12, tex_coord=points[:, :2].copy()
    )


def usd() -> tuple[str, bytes]:
    """A stage of one mesh in the binary form."""
    from pxr import Usd, UsdGeom

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.usdc")
        stage = Usd.Stage.CreateNew(str(path))
        mesh = UsdGeom.Mesh.Define(stage, "/wall")
        mesh.CreatePointsAttr([(0, 0, 0), (10, 0, 0), (10, 4, 0), (0, 4, 0)])
        mesh.CreateFaceVertexCountsAttr([4])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
        stage.Save()
        del stage, mesh
        return "usdc", path.read_bytes()


def ifc() -> tuple[str, bytes]:
    """A wall."""
    from ifcopenshell import api, template

    model = template.create(schema_identifier="IFC4")
    wall = api.run("root.create_entity", model, ifc_class="IfcWall", name="wall")
    body = next(c for c in model.by_type("IfcGeometricRepresentationContext"))
    shape = api.run(
        "geometry.add_wall_representation", model, context=body, length=5, height=3, thickness=0.2
    )
    api.run("geometry.assign_representation", model, product=wall, representation=shape)
    api.run("geometry.edit_object_placement", model, product=wall)
    return "ifc", model.to_string().encode()


MAKERS = {"draco": draco, "usd": usd, "ifc": ifc}


def read(kind: str, seed: int, number: int) -> tuple[str, float]:
    """What came of an input, and in how many seconds."""
    suffix, data = MAKERS[kind]()
    changed = damaged(Random(f"{seed} {kind} {number}"), data)
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"a.{suffix}")
        path.write_bytes(changed)
        try:
            outcome = (
                _decoded(path) if kind == "draco" else str(len(ingest(path, OPTIONS).triangles))
            )
            outcome = "read" if outcome else "nothing"
        except PtmError as error:
            died = "ended with status" in error.message or "did not end" in error.message
            outcome = "died" if died else error.code
        except Exception as error:
            outcome = f"! {type(error).__name__}: {error}"
    return outcome, time.perf_counter() - start


def _decoded(path: Path) -> str:
    """As the reader of glTF has it decoded."""
    from ptmtools.scene.gltf import compression as reader
    from ptmtools.scene.sandbox import run_in_sandbox

    path.rename(path.with_name("0.drc"))
    run_in_sandbox(
        reader.__name__, "Draco", path.with_name("0.drc"), "meshes", str(path.parent), "1"
    )
    return "read" if path.with_name("0.npz").exists() else ""


def main() -> None:
    """Prints what came of them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz.foreign")
    parser.add_argument("--count", type=int, default=400, help="inputs of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    given = parser.parse_args()
    actual = 0
    with ProcessPoolExecutor(given.jobs) as pool:
        for kind in MAKERS:
            tasks = [pool.submit(read, kind, given.seed, n) for n in range(given.count)]
            results = [task.result() for task in tasks]
            longest = max(seconds for _, seconds in results)
            outcome = Counter(what for what, _ in results)
            wrong = [
                n for n, (what, s) in enumerate(results) if what.startswith("!") or s > SECONDS
            ]
            counts = ", ".join(f"{what} {count}" for what, count in outcome.most_common())
            print(f"{kind:<8} {len(results)} inputs, longest {longest:.1f} s: {counts}", flush=True)
            for n in wrong:
                print(f"         ! {kind}:{n} {results[n]}", flush=True)
            actual += len(wrong)
    print(f"{actual} findings")
    sys.exit(bool(actual))


if __name__ == "__main__":
    main()
