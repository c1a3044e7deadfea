"""Exact sizes of `.ptm` files: ``python benchmarks/codec/bytes.py [raw fast small …]``

Prints a Markdown table with a row for each profile: the bytes of all levels of the shared images,
and their share of the raw bytes of the finest level. The encoders are deterministic, so these
figures are the same on every machine; speeds and other formats are in sizes.py.
"""

from __future__ import annotations

import argparse

from images import sets

from ptmtools.texture import EncodeOptions, encode, read_image

PROFILES = ("raw", "fast", "small")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("profiles", nargs="*", default=PROFILES)
    given = parser.parse_args()
    found = sets()
    groups = [[read_image(file) for file in found[name]] for name in ("Kodak", "textures")]
    print(f"| profile | {len(groups[0])} Kodak images | | {len(groups[1])} textures | |")
    print("|---|---|---|---|---|")
    for profile in given.profiles:
        shown = []
        for group in groups:
            coded = sum(len(encode(image, EncodeOptions(profile=profile))) for image in group)
            raw = sum(image.nbytes for image in group)
            shown.append(f"{coded:,} | {coded / raw:.1%}")
        print(f"| `{profile}` | {' | '.join(shown)} |", flush=True)


if __name__ == "__main__":
    main()
