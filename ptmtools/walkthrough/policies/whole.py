"""Clients that ask for files whole, and for documents and geometry as soon as they know of them."""

from __future__ import annotations

from abc import ABC

from ptmtools.walkthrough.client import Client, Kind


class WholeClient(Client, ABC):
    """A client that does."""

    def documents(self) -> bool:
        """Asks for the index, then for the record of the cell and the geometry of what that may
        see; whether the index is there."""
        self.whole(Kind.INDEX, 0)
        if not self.index:
            return False
        self.whole(Kind.RECORD, int(self.world.cell[self.frame]))
        if self.cell >= 0:
            for cell in self.world.catalogue.visible[self.cell].tolist():
                self.whole(Kind.GEOMETRY, cell)
        return True

    def whole(self, kind: Kind, number: int) -> None:
        """Asks for a file, behind all that was asked for before, unless it was."""
        files = self.files[kind]
        if not files.asked[number]:
            self.ask(kind, number, int(files.size[number]), -self.link.requests)
