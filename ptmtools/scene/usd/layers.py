"""Opens a USD stage from files in the model's folder only.

The library opens every layer that another one refers to, in any folder. So this module first
resolves the references of all layers, and raises an error before a layer outside the folder is
opened. References that are expressions, and clips, are known only to the composed stage and are
checked there. No resolver of the library reads a network.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, Literal

from pxr import Ar, Sdf, Tf, Usd, UsdGeom

from ptmtools.errors import InputError
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.sandbox import unreadable

#: Name of the library in messages.
LIBRARY = "usd-core"
#: Namespace of the library's functions.
_NAMESPACE = re.compile(r"pxrInternal\w*::")
#: Largest length of a message of the library, in characters.
_LONGEST = 300
#: The first value of an attribute that changes, the only one of others.
TIME = Usd.TimeCode.EarliestTime()


def open_stage(path: Path, notes: IngestNotes) -> tuple[Any, list[str]]:
    """The composed stage of a model; and its other files, missing ones included, relative to the
    model's folder.

    Raises InputError PTM-I254 for a layer that the library cannot read, and PTM-I205 for one
    outside the model's folder. Missing layers are misses (PTM-N203), as are other errors of the
    composition (PTM-N214).
    """
    layer = _layer(os.fspath(path), path)
    context = Ar.GetResolver().CreateDefaultContextForAsset(os.fspath(path))
    files: dict[str, None] = {}
    absent: dict[str, tuple[str, str]] = {}
    with Ar.ResolverContextBinder(context):
        layers = _gather_layers(layer, files, absent, notes)
        try:
            stage = Usd.Stage.Open(layer, None, context)  # without a session
        except Tf.ErrorException as error:
            raise unreadable(LIBRARY, path, reason(error)) from None
    files.update(_note_faults(stage, absent, notes))
    del layers  # kept until here so that the stage does not read them again
    return stage, list(files | used_files(stage, path, notes))


def used_files(stage: Any, path: Path, notes: IngestNotes) -> dict[str, None]:
    """The other files that a stage was read from, relative to the model's folder.

    Clips are opened when their values are read, so the result is complete only after reading.
    Raises InputError PTM-I205 for a file outside the folder.
    """
    files: dict[str, None] = {}
    for used in stage.GetUsedLayers(includeClipLayers=True):
        if not used.anonymous:
            files[_relative_name(file_of(used.realPath), notes)] = None
    files.pop(path.name, None)
    return files


def metres_of(stage: Any) -> float | None:
    """Metres in one unit, if the stage defines it."""
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        return None
    metres = float(UsdGeom.GetStageMetersPerUnit(stage))
    return metres if 0 < metres < float("inf") else None


def up_axis(stage: Any) -> Literal["y", "z"] | None:
    """The up axis, if the stage defines it."""
    if not stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis):
        return None
    up: Literal["y", "z"] = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    return up


def file_of(resolved: str) -> Path:
    """The file of a resolved path, which may point into a package."""
    if Ar.IsPackageRelativePath(resolved):
        return Path(Ar.SplitPackageRelativePathOuter(resolved)[0])
    return Path(resolved)


def reason(error: Any) -> str:
    """The message of an error of the library, in one line without locations in its source."""
    for fault in error.args:
        if lines := str(getattr(fault, "commentary", fault)).strip().splitlines():
            return _NAMESPACE.sub("", lines[0])[:_LONGEST]
    return type(error).__name__


def _layer(identifier: str, file: Path) -> Any:
    try:
        layer = Sdf.Layer.FindOrOpen(identifier)
    except Tf.ErrorException as error:
        raise unreadable(
            LIBRARY, file, reason(error).replace(f"{file.parent}{os.sep}", "")
        ) from None
    if layer is None:
        raise unreadable(LIBRARY, file, "not a layer")
    return layer


def _gather_layers(
    root: Any, files: dict[str, None], absent: dict[str, tuple[str, str]], notes: IngestNotes
) -> list[Any]:
    """All layers that are reachable from the root, in all variants. Adds the missing ones to
    ``absent``, by identifier: name, and place of the reference."""
    resolver = Ar.GetResolver()
    layers, visited = [root], {root.identifier}
    for layer in layers:
        for name in sorted(layer.GetCompositionAssetDependencies()):
            if not name or name.startswith("`"):
                continue
            identifier = Sdf.ComputeAssetPathRelativeToLayer(layer, name)
            if identifier in visited:
                continue
            visited.add(identifier)
            resolved = resolver.Resolve(identifier).GetPathString()
            if not resolved:
                place = notes.folder.label(file_of(layer.realPath))
                absent[identifier] = name, place
                continue
            file = file_of(resolved)
            _relative_name(file, notes, name)
            layers.append(_layer(identifier, file))
    return layers


def _relative_name(file: Path, notes: IngestNotes, name: str = "") -> str:
    """The file relative to the model's folder. Raises InputError PTM-I205 if it is not allowed."""
    folder = notes.folder
    if not folder.allow_outside and not file.resolve().is_relative_to(folder.root.resolve()):
        raise InputError(
            "PTM-I205",
            f"{name or file.name}: lies outside the model's folder",
            file=notes.model,
            remedy="copy it into the folder, or pass --allow-outside",
        )
    return Path(os.path.relpath(file, folder.root)).as_posix()


def _note_faults(
    stage: Any, absent: dict[str, tuple[str, str]], notes: IngestNotes
) -> dict[str, None]:
    """Records the composition errors of a stage as misses; returns the names of missing files."""
    missing: dict[str, None] = {}
    for text in sorted(" ".join(str(error).split()) for error in stage.GetCompositionErrors()):
        reference = next((entry for key, entry in absent.items() if f"@{key}@" in text), None)
        if reference is not None:
            name, place = reference
            notes.miss("PTM-N203", f"{name}: not found", place)
            missing[name] = None
        else:
            text = text.replace(f"{notes.folder.root}{os.sep}", "")
            notes.miss("PTM-N214", text[:_LONGEST])
    return missing
