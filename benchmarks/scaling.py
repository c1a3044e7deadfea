"""What many workers bring: ``python benchmarks/scaling.py [--only tasks here …]``

tasks       CPU seconds of each task: encoding an image of the sample museum (or ``--model``), and
            the portal searches and hints of a museum of ``--rooms``, and of what one process does
            alone. Also the portal searches of a Quake map, ``--map``.
collection  What one texture more costs the process that builds, whoever encodes it: reading,
            decoding, hashing, writing, the manifest, the emitted files; the textures also with a
            cluster that sees the disk, so that only names travel. From rooms with ``--pictures`` of
            4 × 4 texels and with four times as many.
overhead    What a task without work, a megabyte there or back, and a round of tasks take on a Dask
            cluster of two processes on this machine: CPU seconds of the process that builds, in
            which the scheduler runs here too, and wall seconds.
here        ``ptm build-scene`` with -j 1, -j 2 and such a cluster: wall and CPU seconds; the
            most memory that each process, the cluster's included, ever held (VmHWM); whether the
            bytes are equal.
simulate    From the figures above: tasks are drawn from those of the museum and handed out in order
            as the executors do it (twice as many as workers at most); one process sends and
            receives, one after the other, and a texture's bytes pass a link of ``--gigabits``. Wall
            time by workers, and the share of it that they work. Nothing gets slower as there is
            more of it, and no worker fails.

What a part finds is kept in ``--folder``, from where ``simulate`` takes it. CPU seconds do not mind
what else the machine does; wall seconds, ``overhead`` and ``here`` want it quiet.
"""

from __future__ import annotations

import argparse
import json
import operator
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from heapq import heapreplace
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from prt import read_prt

from ptmtools.cells import subdivide
from ptmtools.coverage import ach as coverage
from ptmtools.coverage.options import AchOptions
from ptmtools.database.model import EmitOptions
from ptmtools.executors import Executor, open_executor
from ptmtools.executors.model import AHEAD
from ptmtools.executors.serial import SerialSharing
from ptmtools.files import write_bytes
from ptmtools.pipeline import TextureOptions, background, build_scene, run_stage
from ptmtools.pipeline.encoding import encoded_image
from ptmtools.pipeline.stages import CELLS
from ptmtools.portal_flow.flow import portal_flow
from ptmtools.scene import ingest
from ptmtools.texture import read_image
from ptmtools.visibility import PvsOptions, compute_pvs

ROOT = Path(__file__).resolve().parent.parent
SMALL = ROOT / "sample_data/two_rooms/two_rooms.obj"
#: Workers and textures of the simulation.
WORKERS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
TEXTURES = (10**3, 10**4, 10**5, 10**6)
#: Tasks under way at a time.
UNDER_WAY = (4, 32, 256)
#: Processors of the machine that builds, which decodes the images with all of them.
PROCESSORS = 16


#: Bytes of a process that does no work.
TRIFLE = 40_000_000


class Recorder(Executor):
    """Does everything itself, and notes the CPU seconds of every task, round by round."""

    def __init__(self) -> None:
        self.rounds: list[list[float]] = []

    @property
    def workers(self) -> int:
        return 2  # with one, some stages need no executor

    @contextmanager
    def sharing(self, shared: Any, *, releases_lock: bool = False) -> Iterator[Any]:
        yield _Recording(shared, self.rounds)

    def close(self) -> None:
        pass


class _Recording(SerialSharing[Any]):
    def __init__(self, shared: Any, rounds: list[list[float]]) -> None:
        super().__init__(shared)
        self._rounds = rounds

    def each(
        self, function: Callable[..., Any], tasks: Iterable[Any], *, chunk: int = 1
    ) -> Iterator[Any]:
        took: list[float] = []
        self._rounds.append(took)

        def timed(shared: Any, task: Any) -> Any:
            found, seconds = cpu(lambda: function(shared, task))
            took.append(seconds)
            return found

        return super().each(timed, tasks, chunk=chunk)


def cpu(work: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    found = work()
    return found, time.process_time() - start


def head(title: str, columns: Sequence[str]) -> None:
    print(f"\n{title}\n")
    row(*columns)


def row(name: str, *figures: object) -> None:
    print(f"{name:<30}" + "".join(f"{figure!s:>13}" for figure in figures), flush=True)


# tasks


def tasks(given: argparse.Namespace) -> dict[str, Any]:
    for image in ingest(SMALL).images:  # compiles and loads
        _image(image.name, image.load())
    images = [_image(image.name, image.load()) for image in ingest(given.model).images]
    _building(SMALL)
    stages = _building(_museum(given.folder / f"museum-{given.rooms}", given.rooms))
    if given.map.exists():
        portals, _ = read_prt(given.map)
        recorder = Recorder()
        _, all_ = cpu(lambda: portal_flow(portals, PvsOptions().budget, executor=recorder))
        stages[f"pvs {given.map.stem}"] = _stage(recorder, all_)

    head("Tasks, CPU seconds", ("task", "number", "sum", "median", "most"))
    for name in ("encode", "decode"):
        _row_of(f"{name} an image of the museum", [image[name] for image in images])
    for name, stage in stages.items():
        _row_of(f"{name}: tasks", list(chain(*stage["rounds"])))
        _row_of(f"{name}: alone", [stage["alone"]])
    for way in ("sent", "received"):
        size = sum(image[way] for image in images)
        print(f"{way}: {size / 1e6:.1f} MB, {size / len(images) / 1e6:.2f} each")
    return {"images": images, "stages": stages}


def _building(model: Path) -> dict[str, Any]:
    """The stages of a model but for its textures: seconds alone, and of the tasks of each round."""
    coverage.WORTH_A_PROCESS = 0.0
    scene, reading = cpu(lambda: ingest(model))
    cells, cutting = cpu(lambda: subdivide(scene))
    tracing, sampling = Recorder(), Recorder()
    pvs, seeing = cpu(lambda: compute_pvs(cells, executor=tracing))
    options = AchOptions(backend="embree")
    _, covering = cpu(lambda: coverage.compute_ach(scene, cells, pvs, options, executor=sampling))
    return {
        "scene": {"alone": reading, "rounds": []},
        "cells": {"alone": cutting, "rounds": []},
        "pvs": _stage(tracing, seeing),
        "ach": _stage(sampling, covering),
    }


def _stage(recorder: Recorder, seconds: float) -> dict[str, Any]:
    return {"alone": seconds - sum(map(sum, recorder.rounds)), "rounds": recorder.rounds}


def _museum(folder: Path, rooms: int) -> Path:
    maker = [sys.executable, str(ROOT / "sample_data/make_museum.py"), "-o", str(folder)]
    if not (folder / "museum.obj").is_file():
        options = ["--rooms", str(rooms), "--size", "16"]
        subprocess.run([*maker, *options], check=True, stdout=subprocess.DEVNULL)
    return folder / "museum.obj"


def _row_of(name: str, took: list[float]) -> None:
    if took:
        most, middle = max(took), float(np.median(took))
        row(name, len(took), f"{sum(took):.2f}", f"{middle:.4f}", f"{most:.3f}")


def _image(name: str, source: bytes) -> dict[str, float]:
    made, encoding = cpu(lambda: encoded_image(TextureOptions(), (name, source)))
    _, decoding = cpu(lambda: read_image(source))
    sent, received = len(source), sum(map(len, made))
    return {"encode": encoding, "decode": decoding, "sent": sent, "received": received}


# collection


def collection(given: argparse.Namespace) -> dict[str, Any]:
    counts = (8, given.pictures, 4 * given.pictures)  # the first compiles and loads
    seconds: dict[str, list[tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory(dir=given.folder) as folder, two_processes(8) as address:
        for count in counts:
            model, db = pictures(Path(folder, str(count)), count), Path(folder, f"{count}.db")
            took = _stages(model, db) | _shared_disk(model, Path(folder, f"{count}.disk"), address)
            for stage, figures in took.items():
                seconds.setdefault(stage, []).append(figures)
        manifest = (db / "manifest.json").stat().st_size / counts[2]
        megabyte = bytes(10**6)
        _, took = cpu(lambda: [write_bytes(db / "a", megabyte, force=True) for _ in range(50)])
        _, more = cpu(lambda: [sha256(megabyte).digest() for _ in range(50)])
    head(
        f"One texture more, ms of the process that builds (from {counts[1]:,} to {counts[2]:,})",
        ("", "CPU", "wall"),
    )
    found: dict[str, Any] = {"megabyte": (took + more) / 50, "each": {}}
    for stage, (_, less, more) in seconds.items():
        each = [(b - a) / (counts[2] - counts[1]) for a, b in zip(less, more, strict=True)]
        found["each"][stage] = each
        row(stage, *(f"{1e3 * each_:.2f}" for each_ in each))
    print(f"hashing and writing a megabyte: {1e3 * found['megabyte']:.2f} ms of CPU")
    print(f"manifest.json: {manifest:.0f} bytes each")
    return found


def _shared_disk(model: Path, db: Path, address: str) -> dict[str, tuple[float, float]]:
    """CPU and wall seconds of the textures, where workers see the disk; the scheduler's included,
    which runs in this process."""
    background.open_executor = open_executor
    build_scene(model, db, until=CELLS, workers=1)
    start = time.perf_counter()
    _, took = cpu(lambda: run_stage(db, TextureOptions(), scheduler=address))
    return {"textures, by name": (took, time.perf_counter() - start)}


def _stages(model: Path, db: Path) -> dict[str, tuple[float, float]]:
    """CPU and wall seconds of each stage without its tasks."""
    recorder = Recorder()
    background.open_executor = lambda *_: recorder  # type: ignore[assignment]
    hints = AchOptions(samples=1, backend="embree")
    found = {}
    for name, stage in {
        "scene and cells": lambda: build_scene(model, db, until=CELLS, workers=1),
        "pvs and ach": lambda: (run_stage(db, PvsOptions()), run_stage(db, hints)),
        "textures": lambda: run_stage(db, TextureOptions()),
        "emit": lambda: run_stage(db, EmitOptions()),
    }.items():
        recorder.rounds.clear()
        start = time.perf_counter()
        _, took = cpu(stage)
        inside = sum(map(sum, recorder.rounds))
        found[name] = took - inside, time.perf_counter() - start - inside
    return found


def pictures(folder: Path, count: int) -> Path:
    """A room of 20 × 20 × 4 m, on a wall of which hang ``count`` pictures of 4 × 4 texels."""
    folder.mkdir()
    rng = np.random.default_rng(0)
    faces = (1, 5, 6, 2), (3, 4, 8, 7), (1, 2, 4, 3), (5, 7, 8, 6), (1, 3, 7, 5), (2, 6, 8, 4)
    obj = ["mtllib pictures.mtl"]
    obj += [f"v {x} {y} {z}" for x in (-10, 10) for y in (0, 4) for z in (-10, 10)]
    obj += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "usemtl wall"]
    obj += [f"f {' '.join(map(str, face))}" for face in faces]
    mtl = ["newmtl wall", "Kd 0.8 0.8 0.8"]
    across = int(np.ceil(np.sqrt(5 * count)))
    step = 19 / across
    for i in range(count):
        x, y = -9.5 + step * (i % across), 0.1 + step * (i // across)
        obj += [f"v {x + a * step} {y + b * step} -9.99" for a, b in ((0, 0), (0.8, 0), (0.8, 0.8))]
        obj += [f"v {x} {y + 0.8 * step} -9.99", f"usemtl m{i}", "f -4/1 -3/2 -2/3 -1/4"]
        mtl += [f"newmtl m{i}", f"map_Kd p{i}.png"]
        texels = rng.integers(0, 256, (4, 4, 3), dtype=np.uint8)
        Image.fromarray(texels).save(folder / f"p{i}.png")
    (folder / "pictures.mtl").write_text("\n".join(mtl) + "\n")
    (folder / "pictures.obj").write_text("\n".join(obj) + "\n")
    return folder / "pictures.obj"


# overhead


@contextmanager
def two_processes(threads: int) -> Iterator[str]:
    """The address of a Dask cluster on this machine."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=threads, host="127.0.0.1", dashboard_address=":0"
    ) as cluster:
        yield cluster.scheduler_address


def overhead(given: argparse.Namespace) -> dict[str, Any]:
    found: dict[str, Any] = {"task": {}}
    head(
        "A task without work, on a Dask cluster of two processes, ms", ("under way", "CPU", "wall")
    )
    with two_processes(max(UNDER_WAY) // AHEAD // 2) as address:
        for under_way in UNDER_WAY:
            with open_executor(under_way // AHEAD, address) as executor:
                _each(executor, [b""] * under_way)
                found["task"][under_way], wall = _each(executor, [b""] * given.tasks)
            row(str(under_way), f"{1e3 * found['task'][under_way]:.2f}", f"{1e3 * wall:.2f}")
        with open_executor(16, address) as executor:
            some = [bytes(10**6)] * (given.tasks // 8)
            empty, full = _each(executor, [b""] * len(some))[0], _each(executor, some)[0]
            found["megabyte"] = max(0.0, full - empty) / 2
            found["round"] = _round(executor, given.tasks // 20)
    print(f"a megabyte there or back: {1e3 * found['megabyte']:.2f} ms of CPU")
    print(f"a round of 32 tasks, 4 together, and a change of 80 kB: {1e3 * found['round']:.1f} ms")
    return found


def _each(executor: Executor, payload: list[bytes]) -> tuple[float, float]:
    """CPU seconds of this process, which holds the scheduler too, and wall seconds, for each of as
    many tasks, which return what they are given."""
    start = time.perf_counter()
    _, took = cpu(lambda: list(executor.each(operator.add, b"", payload, releases_lock=True)))
    return took / len(payload), (time.perf_counter() - start) / len(payload)


def _round(executor: Executor, rounds: int) -> float:
    """Wall seconds of a round of the portal flow without its work: the quickest of four quarters,
    in case that the machine has other things to do."""
    took = []
    with executor.sharing(np.zeros(10**4), releases_lock=True) as shared:
        for i in range(rounds):
            start = time.perf_counter()
            list(shared.each(operator.getitem, [0] * 32, chunk=4))
            shared.change(operator.iadd, np.full(10**4, i))
            took.append(time.perf_counter() - start)
    return float(np.quantile(took, 0.25))


# here


def here(given: argparse.Namespace) -> dict[str, Any]:
    found = {}
    head(
        f"ptm build-scene {given.model.name} {' '.join(given.options)}",
        ("", "wall s", "CPU s", "", "MB of each process"),
    )
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        with two_processes(1) as address:
            for options in (["-j", "2"], ["--scheduler", address]):  # compiles
                _build(SMALL, Path(folder, options[0]), options)
            run = ["--scheduler", address, *given.options]
            found["--scheduler"] = _build(given.model, Path(folder, "many"), run)
        for name in ("-j 2", "-j 1"):
            run = [*name.split(), *given.options]
            found[name] = _build(given.model, Path(folder, name), run)
        digests = {_digest(Path(folder, name)) for name in ("-j 1", "-j 2", "many")}
    for name, run in sorted(found.items()):
        memory = ", ".join(f"{peak / 1e6:.0f}" for peak in run["peaks"])
        row(name, f"{run['wall']:.1f}", f"{run['cpu']:.1f}", "", memory)
    print(f"-j 2 is {found['-j 1']['wall'] / found['-j 2']['wall']:.2f} times as fast as -j 1")
    print(f"the databases are {'equal, byte for byte' if len(digests) == 1 else 'NOT EQUAL'}")
    return found


def _build(model: Path, db: Path, options: list[str]) -> dict[str, Any]:
    """Wall and CPU seconds of a build, those of a cluster's workers left out; and the peak memory
    of each process that takes part, bytes."""
    command = [sys.executable, "-m", "ptmtools", "build-scene", str(model), "-o", str(db), "-q"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    process = subprocess.Popen([*command, *options])
    peaks: dict[int, int] = {}
    while process.poll() is None:
        for member in _family(os.getpid())[1:]:
            peaks[member] = max(peaks.get(member, 0), _peak(member))
        time.sleep(0.05)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} failed")
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    # Those that only watch over others are small.
    return {"wall": wall, "cpu": took, "peaks": [p for p in peaks.values() if p > TRIFLE]}


def _family(process: int) -> list[int]:
    try:
        tasks = list(Path(f"/proc/{process}/task").iterdir())
        children = [int(c) for t in tasks for c in (t / "children").read_text().split()]
    except OSError:
        return []
    return [process, *chain(*map(_family, children))]


def _peak(process: int) -> int:
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM")), 0)


def _digest(db: Path) -> str:
    digest = sha256()
    for file in sorted(db.rglob("*")):
        if file.is_file() and not file.name.startswith(".ptm-"):
            digest.update(file.relative_to(db).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()


# simulate


def schedule(
    durations: Iterable[float],
    sent: Iterable[float],
    received: Iterable[float],
    workers: int,
    start: float = 0.0,
    ready: float = 0.0,
) -> float:
    """When the last result has been received. One process sends and receives, which takes it
    ``sent`` and ``received`` seconds for each task; a task goes to the worker that is first free,
    at the earliest at ``ready``.
    """
    free = [max(start, ready)] * workers
    now, waiting = start, deque[tuple[float, float]]()
    for duration, out, back in zip(durations, sent, received, strict=False):
        if len(waiting) == AHEAD * workers:
            done, before = waiting.popleft()
            now = max(now, done) + before
        now += out
        done = max(now, free[0]) + duration
        heapreplace(free, done)
        waiting.append((done, back))
    for done, back in waiting:
        now = max(now, done) + back
    return now


def simulate(given: argparse.Namespace) -> dict[str, Any]:
    known = {part: json.loads((given.folder / f"{part}.json").read_text()) for part in PARTS[:3]}
    simulate_textures(known, given.gigabits)
    simulate_stages(known, given.rooms)
    return {}


def simulate_textures(known: dict[str, Any], gigabits: float) -> None:
    images, each = known["tasks"]["images"], known["collection"]["each"]
    handling = known["collection"]["megabyte"] / 1e6
    message = known["overhead"]["task"][str(UNDER_WAY[-1])]
    travelling = known["overhead"]["megabyte"] / 1e6 + 8e-9 / gigabits
    drawn = np.random.default_rng(0).integers(0, len(images), max(TEXTURES))
    encode, decode, out, back = (
        np.array([image[name] for image in images])[drawn]
        for name in ("encode", "decode", "sent", "received")
    )
    before = each["scene and cells"][0] + out.mean() * handling + decode.mean() / PROCESSORS
    after = each["emit"][0] + each["pvs and ach"][0]
    by_name = np.full(len(drawn), each["textures, by name"][0] / 2)
    kept = back * handling + each["textures"][0]
    sending, receiving = message / 2 + out * travelling, message / 2 + back * travelling + kept
    head("Textures: what one of them costs on average, ms", ("",))
    for name, seconds in {
        "encoding, by a worker": encode.mean(),
        "through the process that builds": float(np.mean(sending + receiving)),
        "by name": 2 * by_name.mean(),
        "reading and decoding first": before,
        "all other stages": after,
    }.items():
        row(name, f"{1e3 * seconds:.1f}")
    for title, work, send, receive in (
        (f"through the process that builds, {gigabits:g} Gbit/s", encode, sending, receiving),
        ("by name, over a shared disk", encode + (out + back) * handling, by_name, by_name),
    ):
        head(
            f"Textures {title}: hours, and the share of it that workers encode",
            ("textures", *(f"{count:,}" for count in TEXTURES)),
        )
        for workers in WORKERS:
            cells = []
            for count in TEXTURES:
                durations, sent, received = (a[:count].tolist() for a in (work, send, receive))
                last = schedule(durations, sent, received, workers, count * before)
                last += count * after
                busy = encode[:count].sum() / workers / last
                cells.append(f"{last / 3600:.3f} {busy:4.0%}")
            row(f"{workers} workers", *cells)
        kept_busy = work.mean() / (send + receive).mean()
        print(f"workers that one process can keep busy meanwhile: {kept_busy:.0f}")


def simulate_stages(known: dict[str, Any], rooms: int) -> None:
    stages, costs = known["tasks"]["stages"], known["overhead"]
    cost = costs["task"][str(UNDER_WAY[1])] / 2
    barrier = max(0.0, costs["round"] - 16 * cost)
    head(
        f"Stages of a museum of {rooms} rooms on a cluster: seconds by workers; 1 is none",
        ("workers", *stages),
    )
    for workers in WORKERS:
        apart = workers > 1
        seconds = []
        for name, stage in stages.items():
            now, before = stage["alone"], 0.0
            for first, *rest in stage["rounds"]:
                mean = before or float(np.mean([first, *rest]))
                chunk, setup = int(min(32, max(1, 0.02 // mean))), 0.0
                before = float(np.mean([first, *rest]))
                if name == "ach":  # a worker's first task builds its trees
                    chunk, typical = 4, float(np.median(rest))
                    setup, first = max(0.0, first - typical), min(first, typical)
                each = [first, *rest]
                some = [sum(each[i : i + chunk]) for i in range(0, len(each), chunk)]
                costs_each = repeat(cost * apart)
                now = schedule(some, costs_each, costs_each, workers, now, now + setup)
                now += barrier * apart
            seconds.append(f"{now:.1f}")
        row(str(workers), *seconds)


PARTS = ("tasks", "collection", "overhead", "here", "simulate")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--model", type=Path, default=ROOT / "build/museum/museum.obj")
    parser.add_argument("--folder", type=Path, default=ROOT / "build/bench/scaling")
    parser.add_argument("--rooms", type=int, default=200)
    parser.add_argument("--map", type=Path, default=ROOT.parent / "shared/prt/e1m1.prt")
    parser.add_argument("--pictures", type=int, default=500)
    parser.add_argument("--tasks", type=int, default=2000)
    parser.add_argument("--gigabits", type=float, default=10.0)
    parser.add_argument("--options", nargs="*", default=["--backend", "embree"])
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for part in given.only:
        found = globals()[part](given)
        (given.folder / f"{part}.json").write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
