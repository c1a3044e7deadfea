"""The last stage: all artifacts become the served files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ptmtools.database import EmitOptions, emit
from ptmtools.pipeline.run import Run
from ptmtools.pipeline.textures import SERVED, texture_records


def put_files(run: Run, options: EmitOptions) -> None:
    """Runs the stage `emit`; raises what `ptmtools.database.emit` and `Run.inputs` raise."""
    textures = run.db.record("textures")
    inputs = run.inputs("scene", "cells", "pvs", "ach") | dict(textures.outputs)

    def compute() -> tuple[Mapping[str, Any], tuple[str, ...]]:
        report = emit(
            run.scene,
            run.cells,
            run.pvs,
            run.ach,
            texture_records(run),
            run.writer.staging / SERVED,
            options,
            run.progress,
            force=True,
        )
        for name in report.files:
            run.writer.adopt(f"{SERVED}/{name}")
        return {
            "files": len(report.files),
            "bytes": report.bytes,
            "shapes": report.shapes,
            "triangles": report.triangles,
            "collapsed": report.collapsed,
            "viewpoints": len(report.viewpoints),
        }, report.notes

    run.stage("emit", options, inputs, compute)
