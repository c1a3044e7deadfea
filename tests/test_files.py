"""Files that come to be while another is being written."""

from __future__ import annotations

from pathlib import Path
from typing import IO

import pytest

from ptmtools.errors import OutputError
from ptmtools.files import write_with


@pytest.mark.parametrize("force", [False, True])
def test_a_file_that_came_to_be_meanwhile_is_not_written_over(tmp_path: Path, force: bool) -> None:
    target = tmp_path / "a"

    def write(file: IO[bytes]) -> None:
        file.write(b"mine")
        target.write_bytes(b"theirs")

    if force:
        write_with(target, write, force=True)
        assert target.read_bytes() == b"mine"
    else:
        with pytest.raises(OutputError, match="PTM-O001"):
            write_with(target, write)
        assert target.read_bytes() == b"theirs"
    assert list(tmp_path.iterdir()) == [target]
