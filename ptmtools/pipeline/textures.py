"""The images of a scene become progressive textures, several at a time.

Threads serve: the compiled kernels and zlib let go of the interpreter, and the images stay in one
process. An image whose bytes and options are those of the last run keeps its files.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from ptmtools.database import TextureLevel, TextureRecord
from ptmtools.errors import naming
from ptmtools.pipeline.run import Run, parameters
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.texture import EncodeOptions, decode, encode, read_header, read_image
from ptmtools.texture.images import png_bytes
from ptmtools.version import __version__

SERVED = "www"
FOLDER = "textures"
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class TextureOptions(EncodeOptions):
    """How the images of a scene are encoded.

    Attributes
    ----------
    fallback: write a PNG twin of each texture, for clients that cannot read `.ptm`.
    """

    fallback: bool = True


def check_options(options: TextureOptions) -> None:
    """Raises what `encode` raises for impossible options; tried on the smallest image."""
    encode(np.zeros((1, 1, 1), dtype=np.uint8), options)


def texture_names(images: Iterable[SourceImage]) -> list[str]:
    """The name of each texture without suffix, unique without regard to case: the image's stem,
    and with its suffix where two images share a stem."""
    names = [image.name.rpartition(".") for image in images]
    stems = [stem or suffix for stem, _, suffix in names]
    taken: set[str] = set()
    found = []
    for (_, _, suffix), stem in zip(names, stems, strict=True):
        shared = sum(other.casefold() == stem.casefold() for other in stems) > 1
        wanted = f"{stem}_{re.sub('[^A-Za-z0-9]', '', suffix)}" if shared else stem
        name, count = wanted, 1
        while name.casefold() in taken:
            count += 1
            name = f"{wanted}_{count}"
        taken.add(name.casefold())
        found.append(name)
    return found


def check_images(scene: Scene) -> None:
    """Raises what `read_image` raises for an image that cannot be stored exactly."""
    for image in scene.images:
        with naming(image.name):
            read_image(image.load())


def put_textures(run: Run, options: TextureOptions, workers: int) -> None:
    """Runs the stage `textures`; raises what `encode` raises."""
    run.inputs("scene")
    images = run.scene.images
    names = texture_names(images)
    inputs = {f"{FOLDER}/{n}.ptm": i.sha256 for n, i in zip(names, images, strict=True)}

    def compute() -> tuple[Mapping[str, Any], tuple[str, ...]]:
        kept = _kept(run, options, inputs)

        def work(job: tuple[str, SourceImage]) -> tuple[list[tuple[str, bytes]], int, int]:
            name, image = job
            held = kept.get(name)
            files = held() if held else _encoded(name, image, options)
            header = read_header(files[0][1])
            finest = header.levels[-1]
            raw = finest.width * finest.height * header.texel_bytes
            return files, raw, len(files[0][1])

        raw = stored = 0
        with ThreadPoolExecutor(workers) as pool:
            jobs = list(zip(names, images, strict=True))
            for done, (files, *sizes) in enumerate(_ordered(pool, work, jobs, workers)):
                run.progress(done, len(jobs), "textures")
                raw, stored = raw + sizes[0], stored + sizes[1]
                for name, data in files:
                    run.writer.put(name, data)
        run.progress(len(jobs), len(jobs), "textures")
        return {"textures": len(jobs), "raw_bytes": raw, "ptm_bytes": stored}, ()

    run.stage("textures", options, inputs, compute)


def texture_records(run: Run) -> tuple[TextureRecord, ...]:
    """What the emitted files say of the textures of a database."""
    images = run.scene.images
    outputs = run.db.record("textures").outputs
    records = []
    for i, name in enumerate(texture_names(images)):
        file, twin = f"{FOLDER}/{name}.ptm", f"{FOLDER}/{name}.png"
        digest = outputs[f"{SERVED}/{file}"]
        header = read_header(run.db.read(f"{SERVED}/{file}", digest))
        levels = tuple(
            TextureLevel(
                width=level.width,
                height=level.height,
                offset=level.offset,
                length=level.length,
                gpu_bytes=level.width * level.height * header.texel_bytes,
            )
            for level in header.levels
        )
        served = f"{SERVED}/{twin}" in outputs
        records.append(
            TextureRecord(
                image=i,
                file=file,
                fallback=twin if served else None,
                fallback_level=len(levels) - 1 if served else None,
                width=levels[-1].width,
                height=levels[-1].height,
                components=header.components,
                levels=levels,
                sha256=digest,
            )
        )
    return tuple(records)


Files = list[tuple[str, bytes]]


def _encoded(name: str, image: SourceImage, options: TextureOptions) -> Files:
    source = image.load()
    with naming(image.name):
        texels = read_image(source)
        data = encode(texels, options)
    files = [(f"{SERVED}/{FOLDER}/{name}.ptm", data)]
    if options.fallback:
        if options.max_error or read_header(data).trimmed:
            twin = png_bytes(decode(data))
        elif source.startswith(PNG_MAGIC):
            twin = bare_png(source)
        else:
            twin = png_bytes(texels)
        files.append((f"{SERVED}/{FOLDER}/{name}.png", twin))
    return files


def bare_png(data: bytes) -> bytes:
    """An intact PNG reduced to what makes its texels: no gamma, colour profile, text or date.

    Deflating a megatexel again takes half a second, three times as long as encoding it, and gives
    other bytes with another zlib.
    """
    kept, at = [data[: len(PNG_MAGIC)]], len(PNG_MAGIC)
    while at < len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        kind = data[at + 4 : at + 8]
        if kind in (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"):
            kept.append(data[at:end])
        if kind == b"IEND":
            break
        at = end
    return b"".join(kept)


def _kept(
    run: Run, options: TextureOptions, inputs: Mapping[str, str]
) -> dict[str, Callable[[], Files]]:
    """Name → what reads its files again, for textures that the last run made of the same image."""
    before = run.db.manifest.stages.get("textures")
    if before is None or before.software != __version__:
        return {}
    if dict(before.parameters) != parameters(options):
        return {}
    kept: dict[str, Callable[[], Files]] = {}
    for file, digest in inputs.items():
        name = file.removeprefix(f"{FOLDER}/").removesuffix(".ptm")
        wanted = [f"{SERVED}/{FOLDER}/{name}.{s}" for s in ("ptm", "png")[: 1 + options.fallback]]
        held = {n: before.outputs[n] for n in wanted if n in before.outputs}
        if before.inputs.get(file) == digest and len(held) == len(wanted) and run.db.intact(held):

            def read(held: Mapping[str, str] = held) -> Files:
                return [(n, run.db.read(n, h)) for n, h in held.items()]

            kept[name] = read
    return kept


def _ordered(
    pool: ThreadPoolExecutor,
    work: Callable[[tuple[str, SourceImage]], tuple[Files, int, int]],
    jobs: list[tuple[str, SourceImage]],
    workers: int,
) -> Iterable[tuple[Files, int, int]]:
    """Results in the order of the jobs, with few more in flight than there are workers: what
    waits to be written is memory."""
    ahead = [pool.submit(work, job) for job in jobs[: workers + 1]]
    for following in range(workers + 1, len(jobs) + workers + 1):
        if not ahead:
            return
        yield ahead.pop(0).result()
        if following < len(jobs):
            ahead.append(pool.submit(work, jobs[following]))
