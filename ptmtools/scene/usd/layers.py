"""Opens a USD stage from the files of a model's folder, and from nothing else.

The library opens every layer that another one names, wherever it lies. So the layers are gone
through first, each with the names that it refers to: one that lies outside of the folder ends the
reading before it is opened. Names that are expressions, and clips, are known only to the composed
stage, and are looked at there. Layers are files: of the library's resolvers none reads a network.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, Literal

from pxr import Ar, Sdf, Tf, Usd, UsdGeom

from ptmtools.errors import InputError
from ptmtools.scene.notes import Findings
from ptmtools.scene.sandbox import unreadable

#: What the library is called in messages.
LIBRARY = "usd-core"
#: What the library calls its own functions by.
_INNER = re.compile(r"pxrInternal\w*::")
#: So much of a message of the library is passed on, in characters.
_LONGEST = 300
#: An attribute that changes has its first value, one that does not change its only one.
TIME = Usd.TimeCode.EarliestTime()


def open_stage(path: Path, findings: Findings) -> tuple[Any, list[str]]:
    """The composed stage of a model; and what it was read from beside the model, and what was not
    found, relative to its folder.

    Raises InputError PTM-I254 for a layer that the library cannot read, and PTM-I205 for one
    outside of the model's folder. Layers that are not there are missed (PTM-N203), as are other
    faults of the composition (PTM-N214).
    """
    layer = _layer(os.fspath(path), path)
    context = Ar.GetResolver().CreateDefaultContextForAsset(os.fspath(path))
    files: dict[str, None] = {}
    absent: dict[str, tuple[str, str]] = {}
    with Ar.ResolverContextBinder(context):
        layers = _gathered(layer, files, absent, findings)
        try:
            stage = Usd.Stage.Open(layer, None, context)  # without a session
        except Tf.ErrorException as error:
            raise unreadable(LIBRARY, path, reason(error)) from None
    files.update(_note_faults(stage, absent, findings))
    del layers  # held so long, so that the stage did not read them again
    return stage, list(files | used_files(stage, path, findings))


def used_files(stage: Any, path: Path, findings: Findings) -> dict[str, None]:
    """What a stage was read from beside the model, relative to its folder.

    Clips are opened as their values are asked for: what is used is known for sure in the end only.
    Raises InputError PTM-I205 for what lies outside of that folder.
    """
    files: dict[str, None] = {}
    for used in stage.GetUsedLayers(includeClipLayers=True):
        if not used.anonymous:
            files[_inside(file_of(used.realPath), findings)] = None
    files.pop(path.name, None)
    return files


def metres_of(stage: Any) -> float | None:
    """Metres in one unit, if the stage says it."""
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        return None
    metres = float(UsdGeom.GetStageMetersPerUnit(stage))
    return metres if 0 < metres < float("inf") else None


def up_of(stage: Any) -> Literal["y", "z"] | None:
    """The up axis, if the stage says it."""
    if not stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis):
        return None
    up: Literal["y", "z"] = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    return up


def file_of(resolved: str) -> Path:
    """The file on the disk of a resolved path, which may lead into a package."""
    if Ar.IsPackageRelativePath(resolved):
        return Path(Ar.SplitPackageRelativePathOuter(resolved)[0])
    return Path(resolved)


def reason(error: Any) -> str:
    """What an error of the library says, in a line without the places of its own source."""
    for fault in error.args:
        if lines := str(getattr(fault, "commentary", fault)).strip().splitlines():
            return _INNER.sub("", lines[0])[:_LONGEST]
    return type(error).__name__


def _layer(identifier: str, file: Path) -> Any:
    try:
        layer = Sdf.Layer.FindOrOpen(identifier)
    except Tf.ErrorException as error:
        raise unreadable(
            LIBRARY, file, reason(error).replace(f"{file.parent}{os.sep}", "")
        ) from None
    if layer is None:
        raise unreadable(LIBRARY, file, "it is no layer")
    return layer


def _gathered(
    root: Any, files: dict[str, None], absent: dict[str, tuple[str, str]], findings: Findings
) -> list[Any]:
    """All layers that the root leads to, of all variants. ``absent`` becomes what is missing, by
    what the library calls it: its name, and where that stands."""
    resolver = Ar.GetResolver()
    layers, known = [root], {root.identifier}
    for layer in layers:
        for name in sorted(layer.GetCompositionAssetDependencies()):
            if not name or name.startswith("`"):
                continue
            identifier = Sdf.ComputeAssetPathRelativeToLayer(layer, name)
            if identifier in known:
                continue
            known.add(identifier)
            resolved = resolver.Resolve(identifier).GetPathString()
            if not resolved:
                place = findings.folder.label(file_of(layer.realPath))
                absent[identifier] = name, place
                continue
            file = file_of(resolved)
            _inside(file, findings, name)
            layers.append(_layer(identifier, file))
    return layers


def _inside(file: Path, findings: Findings, name: str = "") -> str:
    """The file relative to the model's folder. Raises InputError PTM-I205 if it may not be read."""
    folder = findings.folder
    if not folder.allow_outside and not file.resolve().is_relative_to(folder.root.resolve()):
        raise InputError(
            "PTM-I205",
            f"{name or file.name}: lies outside the model's folder",
            file=findings.model,
            remedy="copy it into the folder, or pass --allow-outside",
        )
    return Path(os.path.relpath(file, folder.root)).as_posix()


def _note_faults(
    stage: Any, absent: dict[str, tuple[str, str]], findings: Findings
) -> dict[str, None]:
    """Misses what the composed stage lacks; the names of files among it."""
    missed: dict[str, None] = {}
    for text in sorted(" ".join(str(error).split()) for error in stage.GetCompositionErrors()):
        known = next((names for each, names in absent.items() if f"@{each}@" in text), None)
        if known is not None:
            name, place = known
            findings.miss("PTM-N203", f"{name}: not found", place)
            missed[name] = None
        else:
            text = text.replace(f"{findings.folder.root}{os.sep}", "")
            findings.miss("PTM-N214", text[:_LONGEST])
    return missed
