"""The codes of all findings of a validation."""

from __future__ import annotations

from ptmtools.diagnostics import TOO_LARGE, Severity

#: Code → (severity, meaning). docs/formats/codes.md repeats this table.
CODES: dict[str, tuple[Severity, str]] = {
    "PTM-D650": (
        "error",
        "the manifest is missing or damaged, or records options that a stage cannot have",
    ),
    "PTM-D651": ("error", "a file of the database is missing or cannot be read"),
    "PTM-D652": ("error", "the hash of a file differs from the manifest: the file was changed"),
    "PTM-D653": ("warning", "a file that no stage wrote, in a folder of ptmtools"),
    "PTM-D655": ("warning", "the database is not finished: the stage `emit` has not run"),
    "PTM-D656": (
        "error",
        "a stage is out of date: its inputs have changed since, or another release ran it",
    ),
    "PTM-D657": (
        "error",
        "a link that points outside the database, a linked folder, a pipe or a device is served",
    ),
    "PTM-D661": (
        "error",
        "a VRML file does not have the form that ptmtools writes: its text, nodes or numbers",
    ),
    "PTM-D671": ("error", "a URL is malformed, points outside the served folder or names no file"),
    "PTM-D675": ("warning", "names of served files differ only in case"),
    "PTM-D676": ("error", "a .gz copy is damaged, or differs from the file without .gz"),
    "PTM-D677": ("warning", "a texture or an octree texture that no other file names or uses"),
    "PTM-D683": ("error", "a hull or a leaf is not convex and closed, or is in the wrong position"),
    "PTM-D690": ("error", "a list of cells is out of order"),
    "PTM-D692": ("error", "ach values do not sum to 1, or are not aligned"),
    "PTM-D699": ("error", "a count, a GLB, a portal or a viewpoint does not fit the cells"),
    "PTM-D700": ("error", "the hints do not match their schemas, or contradict each other"),
    "PTM-D703": (
        "warning",
        "pixels fell on cells outside the potentially visible set (PVS): missed mass",
    ),
    "PTM-D704": ("error", "hints.json and a texture, a GLB or a first-look bundle disagree"),
    "PTM-D708": ("warning", "a texture is listed in hints.json that no cell uses"),
    "PTM-D710": ("error", "a texture file, its fallback or its interlaced image is damaged"),
    "PTM-D713": TOO_LARGE,
    "PTM-D720": ("error", "the arrays of a stage cannot be read, or do not fit other stages"),
    "PTM-D731": ("error", "a GLB is damaged, or does not have the form that ptmtools writes"),
}

#: Codes of changed files: a build detects these by itself.
SEEN_BY_BUILD = frozenset(f"PTM-D{n}" for n in (651, 652, 655, 656))
#: Codes that no build can repair: foreign files, the memory limit, and properties of the model.
NOT_BUILT = frozenset(f"PTM-D{n}" for n in (653, 657, 675, 703, 708, 713))
