"""The declaration of a command, in the table of `ptmtools.cli.main` or in an entry point of the
group ``ptmtools.commands``."""

from __future__ import annotations

from dataclasses import dataclass

import click

from ptmtools.lazy import Lazy


@dataclass(frozen=True)
class Entry:
    """A command that is imported when it is called.

    Attributes
    ----------
    heading: the heading of ``ptm --help`` under which it stands.
    about: its line there.
    place: ``module:function``, which is the `click.Command` or makes it.
    hidden: whether ``ptm --help`` leaves it out.
    """

    heading: str
    about: str
    place: str
    hidden: bool = False

    def load(self) -> click.Command:
        """The command; imports its module."""
        command: object = Lazy[object](self.place).load()
        if isinstance(command, click.Command):
            return command
        assert callable(command)
        made = command()
        assert isinstance(made, click.Command)
        return made
