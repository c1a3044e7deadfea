"""The error tree as the head of `ptmtools/errors.py` draws it."""

from __future__ import annotations

import re

from ptmtools import errors
from ptmtools.errors import PtmError


def test_the_drawn_tree_is_that_of_the_classes() -> None:
    drawn = re.findall(r"^ .*?(\w+Error) +([A-Z])  (\d)$", errors.__doc__ or "", re.MULTILINE)
    classes = [cls for cls in vars(errors).values() if isinstance(cls, type)]
    subclasses = {cls for cls in classes if issubclass(cls, PtmError) and cls is not PtmError}
    assert {(cls.__name__, str(cls.exit_status)) for cls in subclasses} == {
        (name, status) for name, _, status in drawn
    }
    for name, letter, _ in drawn:
        assert f"Codes PTM-{letter}xxx." in (getattr(errors, name).__doc__ or "")
    assert re.search(r"InputError .*\n +│   └── LimitError", errors.__doc__ or "")
