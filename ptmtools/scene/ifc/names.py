"""What things are called in an IFC file, and what is raised where it is wrong about them."""

from __future__ import annotations

from typing import Any

#: What is raised over an attribute that is not of its type: the kernel may do without it.
FAULTS = (AttributeError, LookupError, RuntimeError, TypeError, ValueError)


def one_line(text: object) -> str:
    """Text of a file as it may stand in a message: on one line, and nothing that UTF-8 lacks."""
    return " ".join(str(text).encode("utf-8", "replace").decode().split())


def name_of(thing: Any) -> str:
    """Its name; "" if it has none."""
    return one_line(getattr(thing, "Name", None) or "")


def called(product: Any) -> str:
    """A product's class and name, or, in want of a name, what tells it from all others."""
    return f"{product.is_a()} {name_of(product) or one_line(product.GlobalId)}"
