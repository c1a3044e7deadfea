"""Measures what a texture costs the main process of a cluster whose workers share no disk.

    python benchmarks/objects.py DB

The process sends the image as an object and fetches the files of the texture, as a build at a URL
does (`ptmtools.store.remote`). The server is moto's S3 in another process of this machine, so the
table has the CPU time of the main process, not that of a network.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ptmtools.parallel import ordered
from ptmtools.pipeline.encoding import stem_of
from ptmtools.pipeline.stages.textures import OBJECTS_AHEAD
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import IMAGES
from ptmtools.store.remote import RemoteDatabase


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("db", type=Path)
    folder = DatabaseFolder.open(parser.parse_args().db)
    scene, textures = (folder.record(name).outputs for name in ("scene", "textures"))
    images = {digest: name for name, digest in scene.items() if name.startswith(f"{IMAGES}/")}
    files: dict[str, list[str]] = defaultdict(list)
    with s3_server() as url:
        os.environ |= {"AWS_ENDPOINT_URL": url, "AWS_DEFAULT_REGION": "us-east-1"}
        os.environ |= {"AWS_ACCESS_KEY_ID": "benchmark", "AWS_SECRET_ACCESS_KEY": "benchmark"}
        urllib.request.urlopen(urllib.request.Request(f"{url}/benchmark", method="PUT")).close()
        database = RemoteDatabase("s3://benchmark/db")
        for name, digest in textures.items():
            database.write(digest, folder.read(name, digest))
            files[stem_of(name)].append(digest)

        def send(digest: str) -> None:
            database.provide(digest, lambda: folder.read(images[digest], digest))

        def fetch(digests: list[str]) -> None:
            for digest in digests:
                database.read(digest)

        start = time.process_time()
        for _ in ordered(send, images, OBJECTS_AHEAD):
            pass
        sent = time.process_time()
        for _ in ordered(fetch, files.values(), OBJECTS_AHEAD):
            pass
        fetched = time.process_time()
    sizes = [(folder.path / name).stat().st_size for name in textures]
    print(f"{len(files)} textures of {len(sizes) / len(files):.1f} files, ", end="")
    print(
        f"{sum(sizes) / len(files) / 1e6:.2f} MB each; CPU time of the main process for one, ms\n"
    )
    print("| sending the image | fetching the files |\n|---|---|")
    print(f"| {(sent - start) / len(images) * 1e3:.1f} |", end="")
    print(f" {(fetched - sent) / len(files) * 1e3:.1f} |")


@contextmanager
def s3_server() -> Iterator[str]:
    """The URL of moto's S3 in a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet) as process:
        try:
            url = f"http://127.0.0.1:{port}"
            while process.poll() is None:
                with suppress(OSError):
                    urllib.request.urlopen(url, timeout=20).close()
                    break
                time.sleep(0.1)
            yield url
        finally:
            process.terminate()


if __name__ == "__main__":
    main()
