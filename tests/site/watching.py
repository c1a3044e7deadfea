"""Records frames, arrivals, choices and requests of a simulated client, for replay by another."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.link import Conditions
from ptmtools.site.choice import Previews
from ptmtools.site.client import AVERAGING, BEHIND, HELD_ON, NEAREST
from ptmtools_lab.allocation import allocate
from ptmtools_lab.catalogue import Catalogue, Meshes
from ptmtools_lab.client import Client, FileKind
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.policies.engine import EngineClient
from ptmtools_lab.simulation import simulate
from ptmtools_lab.world import World
from tests.web.node import run

HERE = Path(__file__).resolve().parent
Event = dict[str, Any]


@dataclass
class Witness:
    """Watches a client in a world.

    Attributes
    ----------
    events: what happened to it. answers: what it did then: what it holds in texture memory, what
        it has downloaded, what it asked for.
    """

    world: World
    policy: str
    budget: int
    events: list[Event] = field(default_factory=list)
    answers: list[Any] = field(default_factory=list)

    def client(self, world: World, link: FluidLink, budget: int) -> Client:
        """The one that is watched."""
        client = POLICIES[self.policy].client(world, link, budget)
        client.ticks = 1
        look, fetch, arrived = client.look, client.fetch, client.receive
        #: Of all requests but that for the index, the next number.
        number: dict[Request, int] = {}

        def looked(frame: int) -> None:
            look(frame)
            eye, (x, y, z) = world.track.eye[frame].tolist(), world.track.direction[frame].tolist()
            chosen = [client.column.tolist(), _missing(client)]
            self._note(
                "look", chosen, now=float(world.track.time[frame]), eye=eye,
                cell=int(world.track.cell[frame]), still=bool(world.track.still[frame]),
                yaw=math.atan2(-x, -z), pitch=math.asin(max(-1.0, min(1.0, y))), **_seen(client),
            )  # fmt: skip

        def fetched() -> None:
            left = [[number[r], r.left] for r in client.waiting if r in number]
            levels = [request for request in client.waiting if request not in number]
            fetch()
            estimate = client.estimate
            actual = [request for request in client.waiting if request not in number]
            # Some policies ask for levels when they look; documents are asked for before these.
            actual.sort(key=levels.__contains__)
            rows = [r for r in actual if r.tag.kind != FileKind.INDEX]  # type: ignore[attr-defined]
            for request in rows:
                number[request] = len(number)
            if client.index:
                self._note(
                    "fetch", [_row(request) for request in rows], left=left,
                    bandwidth=estimate.bandwidth, latency=estimate.latency,
                )  # fmt: skip

        def came(request: Request) -> None:
            arrived(request)
            if request in number:
                part: Any = request.tag
                seen = {} if part.kind in (FileKind.TEXTURE, FileKind.PREVIEW) else _seen(client)
                self._note("arrived", client.have.tolist(), number=number[request], **seen)

        vars(client).update(look=looked, fetch=fetched, receive=came)
        return client

    def _note(self, act: str, answer: Any, **told: Any) -> None:
        self.events.append({"act": act, **told})
        self.answers.append(answer)

    def walk(self, conditions: Conditions) -> None:
        """Walks through the world, as a browser has to ask for ranges; without an opening, of which
        the viewer's client knows nothing: its `Stream` receives it."""
        simulate(
            replace(self.world, one_range=True, opening=()),
            replace(POLICIES[self.policy], client=self.client),
            conditions,
            self.budget,
        )

    def document(self) -> dict[str, Any]:
        """What `replay.mjs` takes."""
        own = {"policy": self.policy, "budget": self.budget, "events": self.events}
        return {**documents(self.world), **own}


def in_javascript(folder: Path, *witnesses: Witness) -> list[list[Any]]:
    """What the viewer's client answers to the events of each, in one process of node."""
    files = [folder / f"walk-{k}.json" for k in range(len(witnesses))]
    for file, witness in zip(files, witnesses, strict=True):
        write(file, witness.document())
    answers: list[list[Any]] = json.loads(run(HERE / "policy_walk.mjs", *files))
    return answers


def _seen(client: Client) -> Event:
    """What its policy sees."""
    if not isinstance(client, EngineClient) or client.cell < 0:
        return {}
    sight, hidden = client.sight(1), client.placeholders(1)
    return {"sight": sight.ravel().tolist(), "hidden": hidden.tolist()}


def _missing(client: Client) -> int | None:
    """Records, geometry and textures that the view could use: of those the item buffer shows, and
    with all downloaded would be in texture memory."""
    if not isinstance(client, EngineClient):
        return None
    stock = client.world.catalogue
    here = int(client.world.track.cell[client.frame])
    count = int(not client.records.whole[here])
    if client.cell < 0 or client._worth is None:
        return count
    known = client.visible_set()
    seen = client.frustum.meets_boxes(stock.low[known], stock.high[known])
    seen |= (known == here) | (client.placeholders(1)[known] > 0)
    count += int((seen & ~client.geometry.whole[known]).sum())
    shown = client.geometry.whole & np.isin(np.arange(stock.cell_count), known)
    gains = stock.meshes.gains(client.meshes.whole, client.frustum, NEAREST, BEHIND)
    ahead = client.frustum.meets_boxes(stock.meshes.low, stock.meshes.high)
    count += int(((gains > 0) & ahead & shown[stock.meshes.cell]).sum())
    hold, kept, wanted = client._worth.hold, client._kept, np.zeros(len(stock.levels), np.int64)
    worth = hold + HELD_ON * kept + HELD_ON**2 * stock.gains
    allocate(worth[: len(wanted)], stock.memory, stock.levels, client.budget, wanted, False)
    last = np.maximum(wanted, client.column)
    return count + sum(_lacks(client, t, int(last[t])) for t in range(len(last)))


def _lacks(client: Client, texture: int, last: int) -> bool:
    """Whether a texture could be shown better, in the finest column up to ``last`` that the view
    wants and that some source has or could have: exactly, or at all."""
    stock = client.world.catalogue
    sight, previews = client.sight(1)[texture], stock.previews  # type: ignore[attr-defined]
    own = previews.texture == texture
    for column in range(last, int(client.exact[texture]), -1):
        if not sight[column] > 0:
            continue
        shows = own & (previews.column >= column)
        none = not (shows & client.previews.whole).any()
        if column <= stock.stored[texture] or (shows & (none | previews.exact)).any():
            return True
        if not none:
            return False
    return False


def _row(request: Request) -> list[Any]:
    part: Any = request.tag
    priority = request.priority if math.isfinite(request.priority) else None
    return [part.kind.name.lower(), part.number, part.begin, part.end, priority]


def tables(stock: Catalogue) -> dict[str, Any]:
    """A catalogue as the viewer has it."""
    count, wide = stock.ends.shape
    arrays = {
        "levels": stock.levels,
        "stored": stock.stored,
        "ends": stock.ends,
        "memory": stock.memory,
        "differences": stock.differences,
        "gains": stock.gains,
        "colors": stock.colors,
        "low": stock.low,
        "high": stock.high,
        "recordBytes": stock.record_bytes,
        "geometryBytes": stock.geometry_bytes,
    }
    sizes = {"T": count, "C": stock.cell_count, "K": wide, "whole": stock.whole}
    flat = {name: np.asarray(array).tolist() for name, array in arrays.items()}
    meshes = mesh_rows(stock.meshes)
    return {**sizes, **flat, "previews": preview_tables(stock.previews), "meshes": meshes}


def mesh_rows(meshes: Meshes) -> list[dict[str, Any]]:
    """Finer meshes as the viewer has them, without the names of their files."""
    names = [f.name for f in fields(meshes)]
    columns = [getattr(meshes, name).tolist() for name in names]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def preview_tables(previews: Previews) -> dict[str, Any]:
    """Previews as the viewer has them."""
    return {
        "first": previews.first.tolist(),
        "column": previews.column.tolist(),
        "bytes": previews.bytes.tolist(),
        "loss": (previews.difference * AVERAGING**previews.column).tolist(),
    }


def documents(world: World) -> dict[str, Any]:
    """What there is to fetch in a world, and the angles of its camera."""
    stock, camera = world.catalogue, world.camera
    shapes: list[list[Any]] = [[] for _ in range(stock.cell_count)]
    rows = stock.shapes
    columns = (x.tolist() for x in (rows.cell, rows.texture, rows.low, rows.high))
    for cell, texture, low, high in zip(*columns, strict=True):
        shapes[cell].append({"texture": texture, "low": low, "high": high})
    return {
        "catalogue": tables(stock),
        "records": stock.records,
        "shapes": shapes,
        "view": [camera.field_of_view, camera.aspect],
    }


def write(file: Path, document: Any) -> None:
    """JSON, in which what is infinite is a number, too."""
    file.write_text(json.dumps(document).replace("Infinity", "1e999"))


def called(folder: Path, calls: Sequence[tuple[str, Event]]) -> list[Any]:
    """What functions of ``calls.mjs`` return; all in one process."""
    write(folder / "calls.json", calls)
    answers: list[Any] = json.loads(run(HERE / "calls.mjs", folder / "calls.json"))
    return answers


def same(one: Any, other: Any) -> bool:
    """Whether answers are the same, priorities but for rounding: sums are added up in another
    order."""
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float):
        return math.isclose(one, other, rel_tol=1e-9)
    return bool(one == other)
