"""OpenGL, which is reported where it is missing."""

from __future__ import annotations

import pytest

from ptmtools.coverage.backends.opengl import APT, create_context
from ptmtools.errors import MissingComponentError


@pytest.fixture(scope="session")
def has_gl() -> bool:
    try:
        create_context().release()
    except MissingComponentError:
        return False
    return True


@pytest.fixture
def gl(has_gl, require) -> None:
    """For tests that need OpenGL."""
    if not has_gl:
        require("OpenGL", APT)
