"""Speed of the browser's decoder and of Python's: `python benchmarks/web_decoder.py [NAME…]`

Names are those of the sets of `benchmarks/codec/images.py`. Python with numba, and WebAssembly in
node, decode all levels of every image on one thread, in turn and several times; the minimum
processor time counts. MB are those of the finest level. ``--against COMMIT`` also times the
decoder of that commit, in turn with this one, and prints the ratio. ``--browser`` measures elapsed
time in a worker of headless Chromium, all levels as one order, beside `createImageBitmap` of the
same images as PNG (which may decode on a separate thread). The last table gives the download sizes
of a page.
"""

from __future__ import annotations

import argparse
import gzip
import io
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks" / "codec"), str(ROOT / "tests" / "e2e")]

from images import sets  # noqa: E402
from PIL import Image  # noqa: E402

from ptmtools.texture import decode_levels, encode, read_image  # noqa: E402

PACKAGE = ROOT / "web" / "ptm"
#: What a page downloads; a worker has modules of its own.
GLUE = sorted((PACKAGE / "src").glob("*.js"))
#: In one process, so that what compiles while it runs has done so.
ROUNDS = 10


@dataclass
class Timed:
    """A set of images: their files, and the least seconds of each by each decoder."""

    name: str
    files: list[Path]
    bytes: list[int]
    least: dict[str, list[float]] = field(default_factory=dict)

    def note(self, decoder: str, seconds: list[float]) -> None:
        """Takes the times of one round."""
        known = self.least.get(decoder, [inf] * len(seconds))
        self.least[decoder] = [min(pair) for pair in zip(known, seconds, strict=True)]

    def speed(self, decoder: str) -> float:
        """MB/s over the set."""
        return sum(self.bytes) / sum(self.least[decoder]) / 1e6


def encoded(name: str, sources: list[Path], folder: Path) -> Timed:
    """The 8-bit images of a set, as `.ptm` and as PNG."""
    actual = Timed(name, [], [])
    for number, source in enumerate(sources):
        image = read_image(source)
        if image.dtype != "uint8":
            continue
        file = folder / f"{name.replace(' ', '-')}-{number}.ptm"
        file.write_bytes(encode(image))
        plain = image[:, :, 0] if image.ndim == 3 and image.shape[2] == 1 else image
        Image.fromarray(plain).save(file.with_suffix(".png"))
        actual.files.append(file)
        actual.bytes.append(image.nbytes)
    return actual


def by_python(data: bytes) -> float:
    """Seconds."""
    begin = time.process_time()
    for _ in decode_levels(data):
        pass
    return time.process_time() - begin


def package_of(commit: str, folder: Path) -> Path:
    """The decoder of a commit, as files in a folder."""
    packed = subprocess.run(
        ["git", "archive", commit, "web/ptm"], cwd=ROOT, stdout=subprocess.PIPE, check=True
    )
    subprocess.run(["tar", "x", "-C", str(folder)], input=packed.stdout, check=True)
    return folder / "web" / "ptm"


def by_node(packages: dict[str, Path], timed: Timed) -> None:
    """Notes the least times of several rounds in one process."""
    script = ROOT / "benchmarks" / "web_decoder.mjs"
    folders = ",".join(map(str, packages.values()))
    command = ["node", str(script), str(ROUNDS), folders, *map(str, timed.files)]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True)
    for name, least in zip(packages, json.loads(done.stdout), strict=True):
        timed.note(name, [milliseconds / 1000 for milliseconds in least])


def in_browser(packages: dict[str, Path], timed: list[Timed], folder: Path, rounds: int) -> None:
    """Notes the times of the decoders and of `createImageBitmap` in one page."""
    from browsers import web

    files = [file.name for one in timed for file in one.files]
    code = (ROOT / "benchmarks" / "web_decoder_page.js").read_text()
    urls = {name: f"/package{i}" for i, name in enumerate(packages)}
    given = f"const files = {json.dumps(files)}, rounds = {rounds}, packages = {json.dumps(urls)};"
    page = f'{web.REPORTING}<script type="module">{given}\n{code}</script>'
    mounted = {f"package{i}": path for i, path in enumerate(packages.values())}
    visit = web.visit(page, {**mounted, "files": folder}, seconds=900)
    if visit.messages:
        sys.exit("; ".join(visit.messages))
    for decoder, milliseconds in json.loads(visit.body).items():
        left = [number / 1000 for number in milliseconds]
        for one in timed:
            one.note(f"Chromium, {decoder}", left[: len(one.files)])
            left = left[len(one.files) :]


def print_sizes() -> None:
    """What a page downloads, as it is and gzipped."""

    def gzipped(*files: Path) -> int:
        return sum(len(gzip.compress(file.read_bytes(), 9, mtime=0)) for file in files)

    def bare(file: Path) -> bytes:
        lines = (line for line in io.StringIO(file.read_text()))
        return "".join(x for x in lines if not x.lstrip().startswith(("//", "*", "/*"))).encode()

    module = PACKAGE / "src" / "decoder.wasm"
    uncommented = sum(len(gzip.compress(bare(file), 9, mtime=0)) for file in GLUE)
    print(f"\nmodule: {module.stat().st_size:,} bytes, gzipped {gzipped(module):,}")
    print(f"glue, {len(GLUE)} files: gzipped {gzipped(*GLUE):,}, without comments {uncommented:,}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    actual = sets()
    parser.add_argument("names", nargs="*", default=["Kodak", "textures"], help=", ".join(actual))
    parser.add_argument("--rounds", type=int, default=3, help="each of several within a process")
    parser.add_argument("--images", type=int, default=6, help="of each set at most")
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--against", metavar="COMMIT", help="also time the decoder of that commit")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="web-decoder-") as name:
        folder = Path(name)
        packages = {"wasm": PACKAGE}
        if given.against:
            packages[f"wasm of {given.against}"] = package_of(given.against, folder)
        timed = [encoded(one, actual[one][: given.images], folder) for one in given.names]
        for _ in range(given.rounds):
            for one in timed:
                one.note("Python", [by_python(file.read_bytes()) for file in one.files])
                by_node(packages, one)
        if given.browser:
            in_browser(packages, timed, folder, ROUNDS * given.rounds)
    decoders = list(timed[0].least)
    print(f"| MB/s (share of Python's) | {' | '.join(decoders)} |")
    print("|---" * (1 + len(decoders)) + "|")
    for one in timed:
        speeds = [one.speed(decoder) for decoder in decoders]
        cells = (f"{speed:.0f} ({speed / speeds[0]:.2f})" for speed in speeds)
        print(f"| {len(one.files)} {one.name} | {' | '.join(cells)} |")
    for one in timed if given.against else []:
        for decoder in decoders:
            if (old := f"{decoder} of {given.against}") in decoders:
                print(f"{one.name}, {decoder} / old: {one.speed(decoder) / one.speed(old):.2f}")
    print_sizes()


if __name__ == "__main__":
    main()
