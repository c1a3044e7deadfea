"""Speed of emission, and file sizes compared with other writers.

    python benchmarks/emission.py [MODEL…]

The first table gives the speed of number formatting, in megabytes of text per second, of ptmtools
and of Python's own conversion. The second gives, for every model, the VRML and GLB files of a
database beside those written by pymeshlab (VRML97) and trimesh (GLB) for the model itself, without
images; the last three columns are ratios of their bytes, bytes per triangle and seconds to those of
ptmtools. A database has more triangles than the model because cells cut them, and faces in a
boundary belong to two files; its VRML files also hold hulls, visible sets and hints. The last table
repeats the first model with its triangles quartered several times.

Seconds are processor time, the best of three, without waiting for the disk.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scenes import MODELS, MUSEUM, model_file

from ptmtools import AchOptions, compute_ach
from ptmtools.cells import Cells, subdivide
from ptmtools.coverage.model import Ach
from ptmtools.output import EmitExtras, EmitOptions, TextureRecord, emit
from ptmtools.output.content import Content
from ptmtools.output.emission import compress
from ptmtools.output.geometry import Geometry
from ptmtools.output.gltf import gltf_files
from ptmtools.output.numbers import row_texts
from ptmtools.output.vrml import field
from ptmtools.scene import Scene, ingest
from ptmtools.visibility import Pvs, compute_pvs

#: Repetitions; the best time counts.
TIMES = 3
#: Least number of triangles of the large scene.
MANY = 400_000


def best(work: Callable[[], object]) -> float:
    """Seconds."""
    taken = []
    for _ in range(TIMES):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    return min(taken)


def numbers() -> None:
    random = np.random.default_rng(1)
    n = 150_000
    bits = random.integers(0, 2**32, n, dtype=np.uint32).view(np.float32)
    kinds = {
        "any bits": np.where(np.isfinite(bits), bits, 1),
        "metres, full precision": random.normal(0, 20, n),
        "metres, whole millimetres": np.round(random.normal(0, 20, n), 3),
        "whole metres": random.integers(-99, 99, n),
        "texture coordinates": random.random(n),
        "indices": random.integers(0, 20_000, n),
    }
    print("numbers as text, MB/s           ours  Python")
    for name, values in kinds.items():
        whole = name == "indices"
        rows = (values if whole else values.astype(np.float32) + np.float32(0)).reshape(-1, 3)
        text = field(row_texts(rows))
        ours = best(lambda rows=rows: field(row_texts(rows)))
        some = rows[: n // 30].ravel()
        own = best(lambda some=some: ",".join([str(v) for v in some])) * 10
        print(f"{name:27}{len(text) / ours / 1e6:9.1f}{len(text) / own / 1e6:8.1f}")
    print(flush=True)


def records(scene: Scene) -> tuple[TextureRecord, ...]:
    """As if every image had been encoded."""
    return tuple(
        TextureRecord(i, f"textures/{i}.ptm", f"textures/{i}.png", 1, 1, 3, (), "0" * 64)
        for i in range(len(scene.images))
    )


def quartered(cells: Cells) -> Cells:
    """Every piece cut into four, at the middles of its edges."""
    a, b, c = cells.triangle.T
    n, m = len(cells.vertex), len(cells.triangle)
    ab, bc, ca = (n + m * i + np.arange(m) for i in range(3))
    quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))

    def with_middles(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate(
            [rows, *((rows[p] + rows[q]) / 2 for p, q in ((a, b), (b, c), (c, a)))]
        )

    return replace(
        cells,
        vertex=with_middles(cells.vertex),
        vertex_uv=with_middles(cells.vertex_uv),
        triangle=np.concatenate([np.stack(q, axis=1) for q in quarters]).astype(np.int32),
        triangle_source=np.tile(cells.triangle_source, 4),
        triangle_cell=np.tile(cells.triangle_cell, (4, 1)),
    )


@dataclass(frozen=True)
class Written:
    """What a writer made: its files, without images, and the seconds that it took."""

    triangles: int
    files: list[bytes]
    seconds: float

    @property
    def size(self) -> int:
        return sum(map(len, self.files))

    def row(self, name: str, other: Written | None = None) -> None:
        packed = sum(len(compress(data)) for data in self.files)
        line = (
            f"  {name:24}{self.triangles:9}{self.size / 1e3:10.1f}{packed / 1e3:9.1f}"
            f"{self.size / self.triangles:9.1f}{self.seconds:9.3f}"
            f"{self.size / self.seconds / 1e6:8.1f}"
        )
        if other:
            line += f"{self.size / other.size:9.2f}"
            line += f"{self.size / self.triangles / (other.size / other.triangles):10.2f}"
            line += f"{self.seconds / other.seconds:9.2f}"
        print(line, flush=True)


def heading(name: str) -> None:
    print(
        f"{name:26}triangles        kB  gzip -9  B/tri.  seconds    MB/s"
        "  × bytes  × B/tri.  × seconds"
    )


def emitted(scene: Scene, cells: Cells, pvs: Pvs, ach: Ach, folder: Path) -> Written:
    """The VRML files and the hints, as they are on the disk."""
    some, out, options = records(scene), folder / "www", EmitOptions(format="vrml")
    extras = EmitExtras(force=True)
    seconds = best(lambda: emit(scene, cells, pvs, ach, some, out, options, extras))
    report = emit(scene, cells, pvs, ach, some, out, options, extras)
    return Written(report.triangles, [(out / name).read_bytes() for name in report.files], seconds)


def emitted_gltf(scene: Scene, cells: Cells, pvs: Pvs, ach: Ach) -> Written:
    def work() -> list[bytes]:
        content = Content(scene, cells, pvs, ach, records(scene))
        files = islice(gltf_files(content), cells.cell_count)
        return [data for _, data in files if isinstance(data, bytes)]

    return Written(len(Geometry(scene, cells).triangle), work(), best(work))


def by_trimesh(model: Path) -> Written:
    """Its GLB of the model, every image a single texel."""
    loaded = trimesh.load_scene(model)
    for shape in loaded.geometry.values():
        material = getattr(shape.visual, "material", None)
        if getattr(material, "image", None) is not None:
            material.image = Image.new("RGB", (1, 1))
    data: bytes = loaded.export(file_type="glb")
    seconds = best(lambda: loaded.export(file_type="glb"))
    return Written(sum(len(g.faces) for g in loaded.geometry.values()), [data], seconds)


def by_pymeshlab(model: Path, folder: Path) -> Written:
    """Its VRML97 of the model; raises ImportError where it lacks libGL."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(model))
    out = folder / "model.wrl"
    seconds = best(lambda: meshes.save_current_mesh(str(out), save_textures=False))
    return Written(meshes.current_mesh().face_number(), [out.read_bytes()], seconds)


def compare(model: Path, folder: Path) -> None:
    scene = ingest(model)
    cells = subdivide(scene)
    pvs = compute_pvs(cells)
    ach = compute_ach(scene, cells, pvs, AchOptions(samples=8, face=8))
    heading(model.stem)
    ours = emitted(scene, cells, pvs, ach, folder)
    ours.row("VRML and hints")
    vrml = Written(ours.triangles, ours.files[: cells.cell_count], ours.seconds)
    hints = Written(ours.triangles, ours.files[cells.cell_count + 1 :], ours.seconds)
    vrml.row("  of them the cells")
    hints.row("  of them the hints")
    try:
        by_pymeshlab(model, folder).row("pymeshlab VRML", vrml)
    except ImportError as fault:
        print(f"  pymeshlab cannot be loaded: {fault}")
    glb = emitted_gltf(scene, cells, pvs, ach)
    glb.row("GLBs")
    by_trimesh(model).row("trimesh GLB", glb)
    if len(cells.triangle) < MANY and model.stem == MUSEUM:
        while len(cells.triangle) < MANY:
            cells = quartered(cells)
        heading(f"\n{model.stem}, quartered")
        emitted(scene, cells, pvs, ach, folder).row("VRML and hints")
    print()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    usual = [MODELS[name] for name in (MUSEUM, "hospital", "gallery")]
    parser.add_argument("models", nargs="*", type=model_file, default=usual, help="names or files")
    models = [model for model in parser.parse_args().models if model.is_file()]
    numbers()
    with tempfile.TemporaryDirectory(prefix="emission-") as folder:
        for model in models:
            compare(model, Path(folder) / model.stem)


if __name__ == "__main__":
    main()
