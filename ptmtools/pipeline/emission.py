"""The last stage: all artifacts become the served files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.run import Run
from ptmtools.pipeline.stages import SERVED
from ptmtools.pipeline.textures import texture_inputs, texture_records
from ptmtools.pipeline.transaction import Transaction

if TYPE_CHECKING:
    from ptmtools.database.model import EmitOptions


def put_files(run: Run, options: EmitOptions) -> None:
    """Runs the stage `emit`; raises what `ptmtools.database.emit` and `Run.inputs` raise."""
    textures = run.db.record("textures")
    if textures.inputs != texture_inputs(run.image_digests):
        raise DatabaseError(
            "PTM-D008",
            "the textures stage was computed from another scene",
            file=run.db.path,
            remedy="run `ptm textures DB` or `ptm build-scene MODEL -o DB` first",
        )

    def compute(transaction: Transaction) -> tuple[Mapping[str, Any], tuple[str, ...]]:
        from ptmtools.database import emit

        report = emit(
            run.scene,
            run.cells,
            run.pvs,
            run.ach,
            texture_records(run),
            transaction.made(SERVED),
            options,
            run.progress,
            force=True,
        )
        for name in report.files:
            transaction.adopt(f"{SERVED}/{name}")
        return {
            "files": len(report.files),
            "bytes": report.bytes,
            "shapes": report.shapes,
            "triangles": report.triangles,
            "collapsed": report.collapsed,
            "viewpoints": len(report.viewpoints),
        }, report.notes

    run.stage("emit", options, compute, also=textures.outputs)
