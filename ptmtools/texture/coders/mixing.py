"""Context mixing of one 8-bit level, or one tile of it, given the level below.

The planes are coded in the order green, red, blue, alpha; other kinds in their own order. Each may
look at the two before it. A plane is cut into vertical strips 32 blocks wide: strip i of a plane
needs strip i - 1 of the same and strip i + 1 of the plane before it, so the planes run after each
other in a pipeline, on as many threads as there are planes. Where the height is odd, one plane runs
after the other.

The state that the coder learns (`PlaneState`) starts the same for every plane and is copied for
tiles.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import PLAIN, Coding, Data, Shape
from ptmtools.texture.coders import mixing_decisions as decisions, mixing_strips as strips
from ptmtools.texture.coders.group import GroupReader, group_error, pack_varints, plane_order
from ptmtools.texture.coders.mixing_decisions import BATCH, FEATURES, LOGIT_TOP, SAMPLE, SQUASH
from ptmtools.texture.coders.mixing_strips import (
    MAGNITUDE,
    MAGNITUDES,
    POSITIONS,
    SECOND,
    Canvas,
    LevelTables,
    PlaneLayout,
    PlaneState,
)

#: Slots of a hashed context, entries of a match: powers of two, by the number of texels.
SLOT_BITS = (8, 16)
VALUE_BITS = (8, 18)


#: The state of all planes behind a level. Coding changes it in place: give it a copy.
Memory = tuple[PlaneState, ...]


def copy_memory(memory: Memory) -> Memory:
    return tuple(PlaneState(*(array.copy() for array in state)) for state in memory)


def fresh_state() -> PlaneState:
    """The state of a plane before anything is coded."""
    # A context's level of magnitude is that of a sum of nine residuals: its lowest, and a bit more.
    lowest = np.searchsorted(MAGNITUDE, np.arange(MAGNITUDES))
    scale = np.zeros((POSITIONS, MAGNITUDES, SECOND, 2), np.int32)
    scale[..., 0] = (lowest * 16384 + 41500)[None, :, None]
    weights = np.zeros(decisions.INPUTS, np.int32)
    weights[: decisions.CONSTANT] = 42600, 19661, 9830, 3277, 3277, 3277, 3277, 13107, 13107, 13107
    cells = SQUASH[np.minimum(np.arange(decisions.CELLS) * 256, 2 * LOGIT_TOP)]
    chances = np.full(decisions.CHANCES, 49152, np.int32)
    chances[: decisions.TRUST] = np.tile(cells, decisions.NODE_ROWS)
    return PlaneState(
        normal=np.zeros((POSITIONS, FEATURES, FEATURES)),
        pending=np.zeros((POSITIONS, BATCH, SAMPLE), np.int32),
        weights=np.zeros((POSITIONS, FEATURES), np.int32),
        seen=np.zeros((POSITIONS, 2), np.int64),
        bias=np.zeros(POSITIONS * 729, np.int32),
        scale=scale.reshape(-1, 2),
        mix=np.tile(weights, (decisions.NODE_ROWS + decisions.NEAR_ROWS, 1)),
        chances=chances,
        flat=np.full(16 * 3 * 9, decisions.FRESH, np.uint32),
    )


def level_tables(texels: int) -> LevelTables:
    """Tables learned for one plane of one level of that many ``texels`` and dropped after it."""
    bits = max(texels - 1, 0).bit_length()
    slots = min(max(bits - 1, SLOT_BITS[0]), SLOT_BITS[1])
    values = min(max(bits, VALUE_BITS[0]), VALUE_BITS[1])
    return LevelTables(
        slots=np.zeros((decisions.COUNTERS << slots) * decisions.SLOT, np.uint32),
        values=np.zeros(decisions.MATCHES << values, np.int32),
        notes=np.zeros(decisions.NOTES, np.int64),
        x=np.zeros(decisions.INPUTS, np.int32),
        weighted=np.zeros((FEATURES, FEATURES)),
        samples=np.zeros((FEATURES, FEATURES)),
    )


Level = NDArray[np.uint8]

#: Width of a strip in blocks.
STRIP = 32
PAD = 4


def encode_mixing(
    level: Level, below: Level, coding: Coding = PLAIN
) -> tuple[bytes | None, Level, Memory]:
    """``level`` (h, w, c), given ``below`` (h >> 1, w >> 1, c): its stream, the texels that a
    decoder will have, and what was learned. The stream is None if it grows beyond its buffer."""
    coded = _Pass(level, below, level.shape, coding, None)
    coded.run(coding.threads)
    return coded.stream(), coded.texels(), coded.memory


def decode_mixing(
    data: Data, below: Level, shape: Shape, coding: Coding = PLAIN
) -> tuple[Level, Memory]:
    """The inverse of `encode_mixing`. Raises InputError PTM-I112 for what no encoder writes."""
    coded = _Pass(None, below, shape, coding, data)
    coded.run(coding.threads)
    for stream in coded.streams:
        stream.check()
    return coded.texels(), coded.memory


def encode_even(level: Level, below: Level) -> bytes:
    """``level`` as if all blocks with the same mean were equally likely: the coder for noise."""
    stream = _Stream(2 * level.size + 64)
    _code_even(level, below, level.shape, stream)
    return stream.finish()


def decode_even(data: Data, below: Level, shape: Shape) -> Level:
    """The inverse of `encode_even`. Raises InputError PTM-I112 for what no encoder writes."""
    stream = _Stream(data)
    level = _code_even(None, below, shape, stream)
    stream.check()
    return level


def _code_even(level: Level | None, below: Level, shape: tuple[int, ...], stream: _Stream) -> Level:
    height, width, components = shape
    canvas, places = _lay_out(level, below, height, width, list(range(components)))
    for place in places:
        decisions.code_even(
            level is not None, height, width, place, canvas.cells, canvas.parents, canvas.goal,
            _ways(), stream.coder, stream.buffer,
        )  # fmt: skip
    return _crop(canvas, places, list(range(components)), shape)


@cache
def _ways() -> NDArray[np.int64]:
    """See `mixing_decisions.code_even`."""
    ways = np.zeros((4, 772), np.int64)
    sums = np.ones(1, np.int64)
    for open_texels in range(4):
        ends = np.convolve(sums, np.ones(4, np.int64))
        ways[open_texels, 1 : 1 + len(ends)] = ends
        sums = np.convolve(sums, np.ones(256, np.int64))
    return np.cumsum(ways, axis=1)


class _Pass:
    """One level on its way through the kernels, ``data`` None when it is to be encoded."""

    def __init__(
        self,
        level: Level | None,
        below: Level,
        shape: tuple[int, ...],
        coding: Coding,
        data: Data | None,
    ) -> None:
        height, width, components = shape
        self.shape = shape
        self.order = plane_order(components).tolist()
        self.step = 2 * coding.max_error + 1
        self.memory = copy_memory(coding.memory or (fresh_state(),) * components)
        self.tables = [level_tables(height * width) for _ in range(components)]
        self.canvas, self.places = _lay_out(level, below, height, width, self.order)
        self.strips = max((width // 2 + STRIP - 1) // STRIP, 1)
        # The planes of a narrow level share one stream: it cannot be a pipeline.
        count = components if self.strips > 1 else 1
        self.encoding = data is None
        room = 2 * height * width * (components // count) + 64
        parts = [room] * count if data is None else _split(data, count)
        self.streams = [_Stream(part) for part in parts]

    def run(self, threads: int) -> None:
        planes = len(self.order)
        if min(threads, planes, self.strips) == 1:
            for c in range(planes):
                for strip in range(self.strips):
                    self._task(c, strip)
            return
        done = [0] * planes
        ahead = self.strips if self.shape[0] % 2 else 2
        running: dict[Future[None], int] = {}
        with ThreadPoolExecutor(min(threads, planes)) as pool:
            while done[-1] < self.strips:
                # The plane furthest behind first: a plane waits only for those before it.
                for c in range(planes - 1, -1, -1):
                    needed = min(done[c] + ahead, self.strips)
                    ready = c == 0 or done[c - 1] >= needed
                    if done[c] < self.strips and ready and c not in running.values():
                        running[pool.submit(self._task, c, done[c])] = c
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    done[running.pop(future)] += 1
                    future.result()

    def _task(self, c: int, strip: int) -> None:
        height, width, _ = self.shape
        stream = self.streams[c if len(self.streams) > 1 else 0]
        end = min((strip + 1) * STRIP, width // 2)
        strips.code_strip(
            self.encoding, height, width, strip * STRIP, end, self.step, min(c, 2),
            self.places[c], self.canvas, self.memory[c], self.tables[c],
            stream.coder, stream.buffer,
        )  # fmt: skip

    def stream(self) -> bytes | None:
        if any(stream.coder[3] > stream.buffer.size for stream in self.streams):
            return None
        parts = [stream.finish() for stream in self.streams]
        return b"".join([pack_varints(*map(len, parts[:-1])), *parts])

    def texels(self) -> Level:
        return _crop(self.canvas, self.places, self.order, self.shape)


def _crop(
    canvas: Canvas, places: list[PlaneLayout], order: list[int], shape: tuple[int, ...]
) -> Level:
    height, width, components = shape
    level = np.empty(shape, np.uint8)
    cells = canvas.cells[: places[0].errors].reshape(components, -1, places[0].stride)
    level[:, :, order] = cells[:, PAD : PAD + height, PAD : PAD + width].transpose(1, 2, 0)
    return level


def _lay_out(
    level: Level | None, below: Level, height: int, width: int, order: list[int]
) -> tuple[Canvas, list[PlaneLayout]]:
    """Planes with a border of 2 blocks, 3 to the right and below: parents are repeated there."""
    if below.size == 0:
        below = np.full((max(height >> 1, 1), max(width >> 1, 1), len(order)), 128, np.uint8)
    border = (PAD // 2, PAD // 2 + 1)
    parents = np.pad(below.transpose(2, 0, 1)[order], [(0, 0), border, border], mode="edge")
    parents = parents.astype(np.int32)
    texels = parents.repeat(2, axis=1).repeat(2, axis=2)
    cells = np.concatenate([texels, np.zeros_like(texels)]).reshape(-1)
    goal = cells
    if level is not None:
        wanted = np.zeros_like(texels)
        wanted[:, PAD : PAD + height, PAD : PAD + width] = level.transpose(2, 0, 1)[order]
        goal = wanted.reshape(-1)
    planes, tall, stride = texels.shape
    size, across = tall * stride, stride // 2
    lists = (strips.TEXELS_AT, strips.PARENTS_AT, strips.COLOUR_AT)
    offsets = np.zeros((len(lists), POSITIONS, 8), np.int64)
    for row, positions in enumerate(lists):
        for k, near in enumerate(positions):
            step = across if row == 1 else stride
            offsets[row, k, : len(near)] = [dy * step + dx for dy, dx in near]
    places = [
        PlaneLayout(
            texels=c * size + PAD * stride + PAD,
            parents=c * size // 4 + PAD // 2 * across + PAD // 2,
            stride=stride,
            across=across,
            errors=planes * size,
            # The two planes before, also for alpha, which need not resemble green.
            first=-c * size,
            second=(1 - c) * size if c > 1 else 0,
            before=-c * size // 4,
        )
        for c in range(planes)
    ]
    flats = np.zeros(parents.size, np.uint8)
    return Canvas(cells, parents.reshape(-1), flats, goal, offsets), places


class _Stream:
    """The arithmetic coder and its bytes: those to read, or a buffer to write."""

    def __init__(self, data: Data | int) -> None:
        self.buffer = np.frombuffer(bytearray(data), np.uint8)
        first = 0 if isinstance(data, int) else 4
        window = int.from_bytes(self.buffer[:first].tobytes().ljust(4, b"\0"), "big")
        self.coder = np.array([0, 0xFFFFFFFF, window, first], np.int64)

    def finish(self) -> bytes:
        """The bytes written."""
        value, size = self._final()
        return self.buffer[: int(self.coder[3])].tobytes() + value.to_bytes(4, "big")[:size]

    def check(self) -> None:
        """Raise InputError PTM-I112 unless all was read."""
        value, size = self._final()
        if self.coder[2] != value or self.coder[3] - 4 + size != self.buffer.size:
            raise group_error("its stream does not end with its last texel")

    def _final(self) -> tuple[int, int]:
        """The value in low … high that needs the fewest bytes if zeros follow, and how many."""
        low, high = int(self.coder[0]), int(self.coder[1])
        for size in range(4):
            zeros = 32 - 8 * size
            value = -(-low >> zeros) << zeros
            if value <= high:
                return value, size
        return low, 4


def _split(data: Data, streams: int) -> list[memoryview]:
    """Lengths of all streams but the last, then the streams."""
    reader = GroupReader(data)
    lengths = [reader.varint() for _ in range(streams - 1)]
    return [*(reader.take(length) for length in lengths), reader.rest()]
