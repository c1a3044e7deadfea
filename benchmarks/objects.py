"""Measures what a texture costs the processes of a cluster that shares no disk.

    python benchmarks/objects.py [--textures 1000] [--size 64]

Model and database are objects in moto's S3; server, scheduler and two workers are processes of
their own. The table has the CPU time for one texture of each process that there is one of, and how
many workers therefore have something to do, if a texture takes a worker `--worker` ms (160 for the
images of the museum, 1.4 MB each). No bytes of images or textures pass through them, so small
textures give the same figures in less time. The time of the stage `scene`, which reads the images
on one machine, is printed beside.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import fsspec
import numpy as np

from ptmtools.coverage.options import AchOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.stages.scene import SceneStage
from ptmtools.pipeline.stages.textures import TEXTURES, TexturesTurn
from ptmtools.texture.images.png import png_bytes

WORKERS = (1, 8, 16, 32, 64, 128)
MILLION = 1_000_000


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--textures", type=int, default=1000)
    parser.add_argument("--size", type=int, default=64, help="side of an image, texels")
    parser.add_argument("--worker", type=float, default=160.0, help="ms of a worker for a texture")
    arguments = parser.parse_args()
    number = arguments.textures
    with ExitStack() as stack:
        url = stack.enter_context(s3_server())
        os.environ |= {"AWS_ENDPOINT_URL": url, "AWS_DEFAULT_REGION": "us-east-1"}
        os.environ |= {"AWS_ACCESS_KEY_ID": "benchmark", "AWS_SECRET_ACCESS_KEY": "benchmark"}
        caches = stack.enter_context(tempfile.TemporaryDirectory())
        os.environ["XDG_CACHE_HOME"] = caches
        store = fsspec.filesystem("s3")
        store.mkdir("benchmark")
        for name, data in model(number, arguments.size):
            store.pipe_file(f"benchmark/model/{name}", data)
        scheduler, address = stack.enter_context(cluster(2))
        spent = {"encode": 0.0, "make": 0.0}
        timed(TexturesTurn, "encode", spent)
        timed(SceneStage, "make", spent)
        before = cpu_seconds(scheduler.pid)
        build_scene(
            "s3://benchmark/model/hall.obj",
            "s3://benchmark/db",
            AchOptions(samples=1, backend="embree"),
            until=TEXTURES,
            scheduler=address,
        )
        of_scheduler = cpu_seconds(scheduler.pid) - before
    each = {
        "main process": spent["encode"] / number * 1e3,
        "scheduler": of_scheduler / number * 1e3,
    }
    print(f"{number:,} textures of {arguments.size} × {arguments.size} texels\n")
    print("| one texture | CPU time, ms | workers that it keeps busy |\n|---|---|---|")
    for process, cost in each.items():
        print(f"| {process} | {cost:.1f} | {arguments.worker / cost:.0f} |")
    print(f"| stage `scene`, before | {spent['make'] / number * 1e3:.1f} | |")
    slowest = max(each.values())
    print("\n| workers | hours for 10⁶ textures |\n|---|---|")
    for workers in WORKERS:
        hours = max(arguments.worker / workers, slowest) * MILLION / 3.6e6
        print(f"| {workers} | {hours:.2g} |")


def model(textures: int, size: int) -> Iterator[tuple[str, bytes]]:
    """A hall with pictures on its floor, each with an image of its own."""
    random = np.random.default_rng(1)
    side = int(np.ceil(np.sqrt(textures)))
    corners = [
        (x, y, z) for y in (0, 3) for x, z in ((-1, -1), (-1, side), (side, side), (side, -1))
    ]
    lines = ["mtllib hall.mtl", *(f"v {x} {y} {z}" for x, y, z in corners)]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "o hall"]
    lines += [f"f {a} {b} {c} {d}" for a, b, c, d in ((1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2))]
    lines += [f"f {a} {b} {c} {d}" for a, b, c, d in ((2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1))]
    materials = []
    for n in range(textures):
        x, z = n % side, n // side
        lines += [f"v {x + a} 0.01 {z + b}" for a, b in ((0, 0), (0, 0.9), (0.9, 0.9), (0.9, 0))]
        lines += [f"usemtl m{n}", "f -4/1 -3/2 -2/3 -1/4"]
        materials.append(f"newmtl m{n}\nmap_Kd i{n}.png")
        yield f"i{n}.png", png_bytes(random.integers(0, 256, (size, size, 3), np.uint8))
    yield "hall.mtl", "\n".join(materials).encode()
    yield "hall.obj", "\n".join(lines).encode()


def timed(kind: Any, name: str, spent: dict[str, float]) -> None:
    """Adds this process's CPU time in a method to ``spent``."""
    method: Callable[..., Any] = getattr(kind, name)

    def timing(*arguments: Any, **named: Any) -> Any:
        start = time.process_time()
        try:
            return method(*arguments, **named)
        finally:
            spent[name] += time.process_time() - start

    setattr(kind, name, timing)


def cpu_seconds(pid: int) -> float:
    """The CPU time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def running(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of this Python."""
    quiet = subprocess.DEVNULL
    with subprocess.Popen([sys.executable, "-m", *command], stdout=quiet, stderr=quiet) as process:
        try:
            yield process
        finally:
            process.terminate()


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def wait_for(process: subprocess.Popen[bytes], port: int) -> None:
    while process.poll() is None:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
            return
        time.sleep(0.1)
    raise SystemExit("a server did not start")


@contextmanager
def s3_server() -> Iterator[str]:
    """The URL of moto's S3."""
    port = free_port()
    with running("moto.server", "-H", "127.0.0.1", "-p", str(port)) as process:
        wait_for(process, port)
        yield f"http://127.0.0.1:{port}"


@contextmanager
def cluster(workers: int) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A scheduler and its address."""
    port = free_port()
    command = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    with ExitStack() as stack:
        scheduler = stack.enter_context(running("distributed.cli.dask_scheduler", *command))
        wait_for(scheduler, port)
        address = f"tcp://127.0.0.1:{port}"
        for _ in range(workers):
            options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
            stack.enter_context(running("distributed.cli.dask_worker", address, *options))
        yield scheduler, address


if __name__ == "__main__":
    main()
