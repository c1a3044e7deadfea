"""What there is to say of a result: lines for people, of two ranks.

A warning is a note that may cost an afternoon if it is overlooked: a guess that could as well have
gone the other way, a model on its side, images that are missing. Warnings are few; they are shown
as soon as they are known, before the stages that take long. All others are counted, and listed
when asked for.
"""

from __future__ import annotations

from collections.abc import Iterable


class Warned(str):
    """The text of a note that is a warning."""

    __slots__ = ()


def warnings_in(notes: Iterable[str]) -> tuple[str, ...]:
    """Those of some notes that are warnings, as plain text."""
    return tuple(str(note) for note in notes if isinstance(note, Warned))
