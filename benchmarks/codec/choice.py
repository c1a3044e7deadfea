"""Bytes against decoding time, by coder: `python benchmarks/codec/choice.py [SET…]`

Sets are those of `images.py`, or folders of images. Profile `fast` codes a tile by *repeats* only
if that is shorter than a share of what *Haar* takes (`fast.WORTH`). For several shares this prints
the bytes of a set, relative to those of the largest share, and the speed of the decoder of
`web/ptm` in node: MB of the finest level for each second of processor time, all levels, the least
of several rounds.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks"), str(ROOT / "benchmarks" / "codec")]

from images import image_files, sets  # noqa: E402
from web_decoder import PACKAGE, Timed, by_node  # noqa: E402

from ptmtools.texture import encode, read_image  # noqa: E402
from ptmtools.texture.profiles import fast  # noqa: E402

SHARES = (1.0, 0.97, 0.95, 0.9, 0.85, 0.8, 0.7)


def measured(sources: list[Path], share: float, folder: Path, rounds: int) -> tuple[int, float]:
    """Bytes, and MB/s, of the 8-bit images coded with that share."""
    fast.WORTH = share
    timed = Timed("", [], [])
    for number, source in enumerate(sources):
        image = read_image(source)
        if image.dtype == "uint8":
            file = folder / f"{number}.ptm"
            file.write_bytes(encode(image))
            timed.files.append(file)
            timed.bytes.append(image.nbytes)
    for _ in range(rounds):
        by_node({"wasm": PACKAGE}, timed)
    return sum(file.stat().st_size for file in timed.files), timed.speed("wasm")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    known = sets()
    parser.add_argument(
        "names", nargs="*", default=list(known), help=f"{', '.join(known)}; folders"
    )
    parser.add_argument("--rounds", type=int, default=1, help="of ten each")
    given = parser.parse_args()
    print("| set | share | kB | relative | MB/s |")
    print("|---|--:|--:|--:|--:|")
    for name in given.names:
        sources = known.get(name) or image_files(Path(name))
        first = 0
        for share in SHARES:
            with tempfile.TemporaryDirectory(prefix="choice-") as folder:
                size, speed = measured(sources, share, Path(folder), given.rounds)
            first = first or size
            relative = size / first
            label = Path(name).name
            print(f"| {label} | {share} | {size / 1e3:,.0f} | {relative:.4f} | {speed:.0f} |")


if __name__ == "__main__":
    main()
