"""Diagnostics: the findings of a check of files, its report, and notes and warnings on results.

A warning is a note whose oversight may be expensive: a guess with a likely alternative, a model on
its side, missing images. Warnings are few; they are shown as soon as they are known, before the
long stages. Other notes are counted, and listed on request.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

#: A word with a digit in it, such as a size or the name of a file.
_NUMBERED = re.compile(r"\S*\d\S*")
#: Characters of a place or message.
_LONGEST = 300

Severity = Literal["error", "warning"]

#: The meaning of PTM-D713, in databases and in folders.
TOO_LARGE: tuple[Severity, str] = (
    "warning",
    "a file is too large for --limit: only its checksum was checked",
)
#: Findings in the folders of `ptm interlace`, `ptm apo` and `ptm campus`: code → severity and
#: meaning. docs/formats/codes.md repeats both tables.
FOLDER_CODES: dict[str, tuple[Severity, str]] = {
    "PTM-D713": TOO_LARGE,
    "PTM-D800": (
        "error",
        "the index cannot be read, does not match its schema or contradicts itself",
    ),
    "PTM-D803": ("error", "a file that the index lists is missing or cannot be read"),
    "PTM-D804": ("error", "a file is damaged, or not the file that the index describes"),
    "PTM-D806": ("warning", "a file or a texture that the index does not use"),
    "PTM-D808": ("warning", "the sizes of an interlaced image do not match its minimum size"),
}

#: Findings in databases, likewise.
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
        "a VRML file does not have the form that ptmtools writes: its text or its brackets",
    ),
    "PTM-D671": ("error", "a URL is malformed, points outside the served folder or names no file"),
    "PTM-D675": ("warning", "names of served files differ only in case"),
    "PTM-D676": ("error", "a .gz copy is damaged, or differs from the file without .gz"),
    "PTM-D677": ("warning", "a texture or an octree texture that no other file names or uses"),
    "PTM-D690": ("error", "a list of cells is out of order"),
    "PTM-D692": ("error", "ach values do not sum to 1, or are not aligned"),
    "PTM-D699": ("error", "a count, a GLB or a viewpoint does not fit the cells"),
    "PTM-D700": ("error", "the hints do not match their schemas, or contradict each other"),
    "PTM-D703": (
        "warning",
        "pixels fell on cells outside the potentially visible set (PVS): missed mass",
    ),
    "PTM-D704": ("error", "hints.json and a texture or a GLB disagree"),
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


@dataclass(frozen=True)
class Issue:
    """One finding of a validation; the codes stand in docs/formats/codes.md.

    Attributes
    ----------
    code: stable identifier, PTM-D650 and up.
    severity: an error makes the file wrong, a warning makes it doubtful.
    file: relative to the database, or the path that was given.
    place: where in the file, "" for all of it.
    message: one line.
    count: number of faults that the issue stands for.
    """

    code: str
    severity: Severity
    file: str
    place: str
    message: str
    count: int = 1

    def __str__(self) -> str:
        where = f"{self.file}: {self.place}" if self.place else self.file
        return f"{where}: {self.severity}: {self.message} [{self.code}]"


@dataclass(frozen=True)
class ValidationReport:
    """
    Attributes
    ----------
    issues: errors and warnings, by file, the worst of each first.
    files: how many files were read.
    bytes: how many bytes they hold.
    notes: remarks, one line each.
    """

    issues: tuple[Issue, ...]
    files: int
    bytes: int
    notes: tuple[str, ...] = ()

    @property
    def errors(self) -> tuple[Issue, ...]:
        return tuple(i for i in self.issues if i.severity == "error")

    @property
    def warnings(self) -> tuple[Issue, ...]:
        return tuple(i for i in self.issues if i.severity == "warning")

    @property
    def error_count(self) -> int:
        """Errors, those summed up included."""
        return sum(i.count for i in self.errors)

    @property
    def warning_count(self) -> int:
        """Warnings, likewise."""
        return sum(i.count for i in self.warnings)

    @property
    def ok(self) -> bool:
        """Whether there is no error."""
        return not self.errors


class Findings:
    """Gathers issues: the first few alike in a file one by one, the others as a count. Issues are
    alike if they have one code and, numbers aside, one message.

    Messages may quote damaged files, so they are made printable and cut.
    """

    #: Issues of one message kept one by one, per file; and issues of one code.
    MOST, MOST_OF_CODE = 5, 20

    def __init__(self, codes: Mapping[str, tuple[Severity, str]]) -> None:
        """``codes``: code → its severity and meaning."""
        self._codes = codes
        self._issues: dict[tuple[str, str], list[Issue]] = {}
        self._alike: Counter[tuple[str, str, str]] = Counter()
        self._more: Counter[tuple[str, str]] = Counter()
        #: Severities of the issues, some of which have codes of other checks.
        self._severity: dict[str, Severity] = {}

    def add(self, code: str, file: str, place: str, message: str) -> None:
        """One issue; its severity is the code's."""
        severity, _ = self._codes[code]
        self.take([Issue(code, severity, one_line(file), one_line(place), one_line(message))])

    def place(self, file: str, place: str = "") -> Place:
        """A place in a file, to add issues."""
        return Place(self, file, place)

    def take(self, issues: Iterable[Issue]) -> None:
        """Adds issues of another check."""
        for issue in issues:
            key = (issue.file, issue.code)
            self._severity[issue.code] = issue.severity
            kept = self._issues.setdefault(key, [])
            alike = (*key, _NUMBERED.sub("", issue.message))
            if (
                issue.count == 1
                and self._alike[alike] < self.MOST
                and len(kept) < self.MOST_OF_CODE
            ):
                self._alike[alike] += 1
                kept.append(issue)
            else:
                self._more[key] += issue.count

    def issues(self) -> tuple[Issue, ...]:
        """All of them, see `worst_first`."""
        issues = [issue for kept in self._issues.values() for issue in kept]
        for (file, code), more in self._more.items():
            message = f"{more} more of these"
            issues.append(Issue(code, self._severity[code], file, "", message, more))
        return worst_first(issues)


@dataclass(frozen=True)
class Place:
    """A place in a file, named relative to the database; "" is the whole file."""

    findings: Findings
    file: str
    place: str = ""

    def add(self, code: str, message: str, place: str = "") -> None:
        """Adds an issue here, or at another place in the file."""
        self.findings.add(code, self.file, place or self.place, message)

    def with_place(self, place: str) -> Place:
        """Another place in the file."""
        return Place(self.findings, self.file, place)


def worst_first(issues: Iterable[Issue]) -> tuple[Issue, ...]:
    """Sorts issues by file, errors before warnings, and code; faults of a whole file have the
    lowest codes."""
    return tuple(sorted(issues, key=lambda i: (i.file, i.severity != "error", i.code, i.count > 1)))


def one_line(text: str) -> str:
    """Text on one line that any terminal prints."""
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


class Warned(str):
    """The text of a note that is a warning."""

    __slots__ = ()


def warnings_in(notes: Iterable[str]) -> tuple[str, ...]:
    """The warnings among notes, as plain text."""
    return tuple(str(note) for note in notes if isinstance(note, Warned))
