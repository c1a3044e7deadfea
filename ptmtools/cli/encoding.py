"""The work of `ptm encode` on one image file, in this process or by the workers of a cluster."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING

from ptmtools.cli.batch import STANDARD, Batch, FileJob, Report, standard_input
from ptmtools.errors import WorkerError, naming
from ptmtools.executor import _portable
from ptmtools.files import writing
from ptmtools.options import option
from ptmtools.texture.previews import Exact, PreviewOptions

if TYPE_CHECKING:
    from ptmtools.texture.model import EncodeOptions
    from ptmtools.texture.steps import EncodedSteps


@dataclass(frozen=True)
class FilePreviews(PreviewOptions):
    """Options of the previews beside a `.ptm`."""

    preview: int = option(
        0,
        "Also write previews of this quality, 1 to 100: lossy images of single levels, "
        "NAME-SIDE.webp. 0 writes none.",
        metavar="QUALITY",
    )
    exact: Exact = option(
        "always",
        "Levels in the .ptm: always all of them; lossless-sources only the coarsest of a JPEG, "
        "lossy WebP or AVIF, whose own bytes become the finest preview, and of an image that is "
        "smaller than its levels, which becomes lossless WebP; never more than the coarsest, and "
        "the finest preview is the finest level.",
    )

    @property
    def wanted(self) -> bool:
        """Whether there are files beside the `.ptm`."""
        return bool(self.preview) or self.exact != "always"


@dataclass(frozen=True)
class FileCoding:
    """All options for the images of a command."""

    options: EncodeOptions
    previews: FilePreviews
    orient: bool
    batch: Batch


def encoded_file(coding: FileCoding, job: FileJob, threads: int = 1) -> Report:
    """Encodes an image file and writes its `.ptm` and its previews; the properties of these.

    Raises as `load_image`, `encode_to`, `encode_steps` and `write_with`.
    """
    from ptmtools.texture.container import HEAD_MAX, read_header
    from ptmtools.texture.encoder import encode_to, level_above
    from ptmtools.texture.images import load_image
    from ptmtools.texture.steps import encode_steps

    source, target, batch = job.source, job.target, coding.batch
    report: Report = {
        "image": source,
        "file": os.fspath(target) if target else STANDARD,
        "skipped": batch.skips(target),
    }
    if report["skipped"]:
        return report

    def write(file: IO[bytes]) -> None:
        if encoded:
            file.write(encoded.ptm)
        else:
            texels, description = picture.texels, picture.description
            encode_to(file, texels, coding.options, description=description, threads=threads)
        report["ptm_bytes"] = file.tell()
        file.seek(0)
        header = read_header(file.read(HEAD_MAX))
        file.seek(0, os.SEEK_END)
        report["raw_bytes"] = header.width * header.height * header.texel_bytes
        report["levels"] = len(header.levels)
        finest, above = header.levels[-1], level_above(header)
        report["finest"] = finest.width, finest.height
        report["left_out"] = above and dict(zip(("width", "height", "bytes"), above, strict=True))

    with naming(source):
        data = standard_input() if source == STANDARD else source
        picture = load_image(data, batch.limits)
        report["image_bytes"] = len(data) if isinstance(data, bytes) else os.path.getsize(data)
        report["lossy"] = picture.lossy and picture.lossy.format
        if coding.orient and picture.description.orientation != 1:
            picture = replace(picture.upright(), lossy=None)
        encoded = None
        if coding.previews.wanted:
            read = data if isinstance(data, bytes) else Path(data).read_bytes()
            encoded = encode_steps(picture, read, coding.options, coding.previews, threads)
        job.put(write, batch.force)
        if encoded and target:
            report["previews"] = list(_put_previews(target, encoded, batch.force))
    return report


def _put_previews(target: Path, encoded: EncodedSteps, force: bool) -> Iterator[dict[str, object]]:
    """Writes the previews beside a `.ptm`; the properties of each."""
    from ptmtools.files import write_bytes
    from ptmtools.texture.previews import FORMATS, LOSSLESS

    for preview, data in zip(encoded.steps.previews, encoded.previews, strict=True):
        side, suffix = max(preview.width, preview.height), FORMATS[preview.format].suffix
        mark = "-exact" if preview.format == LOSSLESS else ""
        file = target.with_name(f"{target.stem}-{side}{mark}{suffix}")
        write_bytes(file, data, force=force)
        yield {"file": os.fspath(file), **asdict(preview)}


def encoded_by_cluster(
    coding: FileCoding, jobs: Sequence[FileJob], scheduler: str
) -> Iterator[Report | Exception]:
    """As `encoded_file` of each job, by the workers of a Dask scheduler, which see the files under
    the same paths; yields the failure of a job in its place.

    Raises WorkerError: PTM-W005 a worker does not see the folder of the results; and as
    `open_executor`.
    """
    from ptmtools.parallel import open_executor

    if not jobs:
        return
    batch = coding.batch
    # The console stays here.
    sent = replace(coding, batch=replace(batch, console=type(batch.console)()))
    folder = next((job.target.absolute().parent for job in jobs if job.target), Path.cwd())
    with open_executor(batch.workers, scheduler) as executor:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            probe = folder / f".ptm-{secrets.token_hex(8)}"
            probe.touch()
        try:
            tasks = range(4 * executor.workers)
            if not all(executor.each(_sees, str(probe), tasks, releases_lock=True)):
                raise WorkerError(
                    "PTM-W005",
                    "a worker does not see this folder",
                    file=folder,
                    remedy="mount it under the same path on all machines, or run `ptm encode "
                    "--shard K/N` on each",
                )
        finally:
            with writing(probe):
                probe.unlink()
        away = (_absolute(job) for job in jobs)
        done = executor.each(_encoded_or_fault, sent, away, releases_lock=True)
        for job, result in zip(jobs, done, strict=True):
            yield result if isinstance(result, Exception) else _as_given(job, result)


def _sees(probe: str, _: int) -> bool:
    return os.path.exists(probe)


def _encoded_or_fault(coding: FileCoding, job: FileJob) -> Report | Exception:
    """In a worker: the report or the failure of a job."""
    if job.fault:
        return job.fault
    try:
        return encoded_file(coding, job)
    except Exception as fault:
        return _portable(fault)


def _absolute(job: FileJob) -> FileJob:
    return replace(
        job,
        source=os.path.abspath(job.source),
        target=job.target and job.target.absolute(),
        folder=job.folder and job.folder.absolute(),
    )


def _as_given(job: FileJob, report: Report) -> Report:
    """The report with the names that the user gave."""
    named = report | {"image": job.source, "file": os.fspath(job.target or STANDARD)}
    if job.target and "previews" in report:
        named["previews"] = [
            preview | {"file": os.fspath(job.target.with_name(os.path.basename(preview["file"])))}
            for preview in report["previews"]
        ]
    return named
