"""The error of every decoder for bytes that no encoder writes."""

from __future__ import annotations

from ptmtools.errors import InputError


def damaged(what: str) -> InputError:
    """The error for a group whose contents contradict each other."""
    return InputError(
        "PTM-I112",
        f"the group cannot be decoded: {what}",
        remedy="the file is damaged or was not written by a conforming encoder; encode it again",
    )
