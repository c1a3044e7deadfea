"""Context mixing of one 8-bit level, or one tile of it, given the level below.

The planes are coded in the order green, red, blue, alpha; other kinds in their own order. Each may
look at the two before it. A plane is cut into vertical strips 32 blocks wide: strip i of a plane
needs strip i - 1 of the same and strip i + 1 of the plane before it, and nothing else, so the
planes run after each other in a pipeline, on as many threads as there are planes. Where the height
is odd, the last row of blocks also looks at the odd row of the plane before it, which comes after
the last strip: then one plane runs after the other.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.mixing.memory import Memory, fresh_memory, level_tables
from ptmtools.texture.coders.reading import Reader, damaged, pack_varints

if TYPE_CHECKING:
    from ptmtools.texture.coders.mixing.kernels import Canvas, Place

Level = NDArray[np.uint8]

#: Width of a strip in blocks.
STRIP = 32
PAD = 4


def encode_mixing(
    level: Level, below: Level, max_error: int = 0, memory: Memory | None = None, threads: int = 1
) -> tuple[bytes | None, Level, Memory]:
    """``level`` (h, w, c), given ``below`` (h >> 1, w >> 1, c): its stream, the texels that a
    decoder will have, and what was learned. No stream (None) if it grows beyond all measure."""
    coded = _Pass(level, below, level.shape, max_error, memory, None)
    coded.run(threads)
    return coded.stream(), coded.texels(), coded.memory


def decode_mixing(
    data: bytes | memoryview,
    below: Level,
    shape: tuple[int, int, int],
    max_error: int = 0,
    memory: Memory | None = None,
    threads: int = 1,
) -> tuple[Level, Memory]:
    """The inverse of `encode_mixing`. Raises InputError PTM-I112 for what no encoder writes."""
    coded = _Pass(None, below, shape, max_error, memory, data)
    coded.run(threads)
    coded.check()
    return coded.texels(), coded.memory


def encode_even(level: Level, below: Level) -> bytes:
    """``level`` as if all blocks with the same mean were equally likely: the coder for noise."""
    coder, buffer = _coder(None), np.zeros(2 * level.size + 64, np.uint8)
    _even(level, below, level.shape, coder, buffer)
    return _closed(coder, buffer)


def decode_even(data: bytes | memoryview, below: Level, shape: tuple[int, int, int]) -> Level:
    """The inverse of `encode_even`. Raises InputError PTM-I112 for what no encoder writes."""
    buffer = np.frombuffer(bytearray(data), np.uint8)
    coder = _coder(buffer)
    level = _even(None, below, shape, coder, buffer)
    _check(coder, buffer)
    return level


def _even(
    level: Level | None,
    below: Level,
    shape: tuple[int, ...],
    coder: NDArray[np.int64],
    buffer: NDArray[np.uint8],
) -> Level:
    from ptmtools.texture.coders.mixing.even import code_even

    height, width, components = shape
    order = list(range(components))
    canvas, places = _canvas(level, below, height, width, order)
    for place in places:
        code_even(
            level is not None, height, width, place, canvas.cells, canvas.parents, canvas.goal,
            _ways(), coder, buffer,
        )  # fmt: skip
    return _cropped(canvas, places, order, shape)


@cache
def _ways() -> NDArray[np.int64]:
    """See `even.code_even`."""
    ways = np.zeros((4, 772), np.int64)
    sums = np.ones(1, np.int64)
    for left in range(4):
        ends = np.convolve(sums, np.ones(4, np.int64))
        ways[left, 1 : 1 + len(ends)] = ends
        sums = np.convolve(sums, np.ones(256, np.int64))
    return np.cumsum(ways, axis=1)


class _Pass:
    """One level on its way through the kernels, ``data`` None when it is to be encoded."""

    def __init__(
        self,
        level: Level | None,
        below: Level,
        shape: tuple[int, ...],
        max_error: int,
        memory: Memory | None,
        data: bytes | memoryview | None,
    ) -> None:
        height, width, components = shape
        self.shape = height, width, components
        self.order = [1, 0, 2, 3][:components] if components > 2 else list(range(components))
        self.step = 2 * max_error + 1
        self.memory = memory.copied() if memory else fresh_memory(components)
        self.tables = [level_tables(height * width) for _ in range(components)]
        self.canvas, self.places = _canvas(level, below, height, width, self.order)
        self.strips = max((width // 2 + STRIP - 1) // STRIP, 1)
        # The planes of a narrow level share one stream: it cannot be a pipeline.
        streams = components if self.strips > 1 else 1
        self.encoding = data is None
        if data is None:
            size = 2 * height * width * (components // streams) + 64
            self.buffers = [np.zeros(size, np.uint8) for _ in range(streams)]
        else:
            parts = _split(data, streams)
            self.buffers = [np.frombuffer(bytearray(part), np.uint8) for part in parts]
        self.coders = [_coder(None if self.encoding else b) for b in self.buffers]

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
                # The plane furthest behind first: others wait for none but those before them.
                for c in range(planes - 1, -1, -1):
                    needed = min(done[c] + ahead, self.strips)
                    ready = c == 0 or done[c - 1] >= needed
                    if done[c] < self.strips and ready and c not in running.values():
                        running[pool.submit(self._task, c, done[c])] = c
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    done[running.pop(future)] += 1
                    future.result()

    def _task(self, c: int, strip: int) -> None:
        from ptmtools.texture.coders.mixing.kernels import code_strip

        height, width, _ = self.shape
        stream = c if len(self.buffers) > 1 else 0
        end = min((strip + 1) * STRIP, width // 2)
        code_strip(
            self.encoding, height, width, strip * STRIP, end, self.step, min(c, 2),
            self.places[c], self.canvas, self.memory.planes[c], self.tables[c],
            self.coders[stream], self.buffers[stream],
        )  # fmt: skip

    def stream(self) -> bytes | None:
        if any(c[3] > b.size for c, b in zip(self.coders, self.buffers, strict=True)):
            return None
        parts = [_closed(c, b) for c, b in zip(self.coders, self.buffers, strict=True)]
        return b"".join([pack_varints(*map(len, parts[:-1])), *parts])

    def check(self) -> None:
        for coder, buffer in zip(self.coders, self.buffers, strict=True):
            _check(coder, buffer)

    def texels(self) -> Level:
        return _cropped(self.canvas, self.places, self.order, self.shape)


def _cropped(
    canvas: Canvas, places: list[Place], order: list[int], shape: tuple[int, ...]
) -> Level:
    height, width, components = shape
    level = np.empty(shape, np.uint8)
    size = places[0].errors // components
    for c, plane in enumerate(order):
        cells = canvas.cells[c * size : (c + 1) * size].reshape(-1, places[0].stride)
        level[:, :, plane] = cells[PAD : PAD + height, PAD : PAD + width]
    return level


def _canvas(
    level: Level | None, below: Level, height: int, width: int, order: list[int]
) -> tuple[Canvas, list[Place]]:
    """Planes with a border of 2 blocks, 3 to the right and below: parents are repeated there."""
    from ptmtools.texture.coders.mixing import kernels

    if below.size == 0:
        below = np.full((max(height >> 1, 1), max(width >> 1, 1), len(order)), 128, np.uint8)
    border = [(PAD // 2, PAD // 2 + 1)] * 2
    parents = np.stack([np.pad(below[:, :, c], border, mode="edge") for c in order])
    parents = parents.astype(np.int32)
    texels = parents.repeat(2, axis=1).repeat(2, axis=2)
    cells = np.concatenate([texels, np.zeros_like(texels)]).reshape(-1)
    goal = cells
    if level is not None:
        wanted = np.zeros_like(texels)
        for c, plane in enumerate(order):
            wanted[c, PAD : PAD + height, PAD : PAD + width] = level[:, :, plane]
        goal = wanted.reshape(-1)
    planes, tall, stride = texels.shape
    across = stride // 2
    lists = (kernels.TEXELS_AT, kernels.PARENTS_AT, kernels.COLOUR_AT)
    offsets = np.zeros((len(lists), kernels.POSITIONS, 8), np.int64)
    for row, positions in enumerate(lists):
        for k, near in enumerate(positions):
            step = across if row == 1 else stride
            offsets[row, k, : len(near)] = [dy * step + dx for dy, dx in near]
    places = [
        kernels.Place(
            texels=c * tall * stride + PAD * stride + PAD,
            parents=c * (tall // 2) * across + (PAD // 2) * across + PAD // 2,
            stride=stride,
            across=across,
            errors=planes * tall * stride,
            # The two planes before; of alpha too, which need not be like green.
            first=-c * tall * stride,
            second=(1 - c) * tall * stride if c > 1 else 0,
            before=-c * (tall // 2) * across,
        )
        for c in range(planes)
    ]
    flats = np.zeros(parents.size, np.uint8)
    return kernels.Canvas(cells, parents.reshape(-1), flats, goal, offsets), places


def _coder(buffer: Any) -> NDArray[np.int64]:
    window = 0 if buffer is None else int.from_bytes(buffer[:4].tobytes().ljust(4, b"\0"), "big")
    return np.array([0, 0xFFFFFFFF, window, 0 if buffer is None else 4], np.int64)


def _final(coder: NDArray[np.int64]) -> tuple[int, int]:
    """The value in low … high that needs the fewest bytes if zeros follow, and how many."""
    low, high = int(coder[0]), int(coder[1])
    for size in range(4):
        zeros = 32 - 8 * size
        value = -(-low >> zeros) << zeros
        if value <= high:
            return value, size
    return low, 4


def _closed(coder: NDArray[np.int64], buffer: NDArray[np.uint8]) -> bytes:
    value, size = _final(coder)
    return buffer[: int(coder[3])].tobytes() + value.to_bytes(4, "big")[:size]


def _check(coder: NDArray[np.int64], buffer: NDArray[np.uint8]) -> None:
    value, size = _final(coder)
    if coder[2] != value or coder[3] - 4 + size != buffer.size:
        raise damaged("its stream does not end with its last texel")


def _split(data: bytes | memoryview, streams: int) -> list[memoryview]:
    """Lengths of all streams but the last, then the streams."""
    reader = Reader(data)
    lengths = [reader.varint() for _ in range(streams - 1)]
    return [*(reader.take(length) for length in lengths), reader.rest()]
