"""Damaged buildings through the whole toolchain: only a sound database or a refusal may come out.

    python -m benchmarks.fuzz.geometry [--count 10000] [--seed 1] [--jobs 1] [--only rooms,office]
    python -m benchmarks.fuzz.geometry --show office:1234 [-o model.obj]

`benchmarks.fuzz.bases` are the models, `benchmarks.fuzz.distortion` is the damage, and
`benchmarks.fuzz.building` says what a finding is. One input in fifty is built again in another
process, and must give the same bytes. Inputs follow from seed, base and number: ``--show`` builds
one again, with the traceback of its fault, and with ``-o`` writes the model to a file. Exit status
1 if there was a finding.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from benchmarks.fuzz.bases import BASES, SCENES
from benchmarks.fuzz.building import BLIND, INVALID, OTHER, Building, Outcome, name_of
from benchmarks.fuzz.child import generator
from benchmarks.fuzz.distortion import DISTORTIONS
from benchmarks.fuzz.runner import Summary, run

#: Processor time that an input may take, seconds; and after how many of the clock it hangs.
SLOW, HANGS = 60.0, 600.0
#: One input in this number is built twice.
TWICE = 50
#: Findings that are printed for a base.
SHOWN = 15
COLUMNS = ("inputs", "built", "refused", "internal", "blind", "invalid", "other")


@dataclass
class Row:
    """The outcomes of some inputs: with one base, or one distortion.

    Attributes
    ----------
    counts: by column; ``other`` counts all further findings.
    codes: refusals by code.
    """

    counts: Counter[str] = field(default_factory=Counter)
    codes: Counter[str] = field(default_factory=Counter)

    def add(self, result: Outcome | str) -> None:
        """Counts an input by its outcome or its finding."""
        self.counts["inputs"] += 1
        if isinstance(result, str):
            self.counts[column(result)] += 1
            return
        self.counts["refused" if result.code else "built"] += 1
        self.codes.update([result.code] if result.code else [])

    def text(self, name: str, seconds: float | None = None) -> str:
        """A line of the table."""
        cells = "".join(f"{self.counts[key]:>9,}" for key in COLUMNS)
        slowest = f"{seconds:>9.1f} s" if seconds is not None else " " * 11
        codes = ", ".join(f"{code} {n:,}" for code, n in self.codes.most_common(6))
        return f"{name:<10}{cells}{slowest}  {codes}".rstrip()


def column(what: str) -> str:
    """The column of a finding."""
    for name, words in (("blind", BLIND), ("invalid", INVALID)):
        if words in what:
            return name
    plain = ("took", "hangs", "the process ended", "something changed", OTHER)
    return "other" if what.startswith(plain) else "internal"


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz.geometry")
    parser.add_argument("--count", type=int, default=10_000, help="inputs of all bases together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=int, default=0, help="number of the first input")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", default="", help=f"bases, of {','.join(BASES)}")
    parser.add_argument("--show", default="", metavar="BASE:NUMBER", help="one input, built aloud")
    parser.add_argument("-o", "--output", help="where that model goes")
    given = parser.parse_args()
    if given.show:
        show(given.show, given.seed, given.output)
        return
    names = [name for name in BASES if not given.only or name in given.only.split(",")]
    if missing := [name for name in SCENES if name not in BASES]:
        print(f"not at hand, see PTM_SHARED: {', '.join(missing)}")
    os.nice(19)
    print(f"{'base':<10}{''.join(f'{key:>9}' for key in COLUMNS)}{'slowest':>11}", flush=True)
    rows = {name: Row() for name in DISTORTIONS}
    total, seconds = Row(), 0.0
    for name in names:
        summary = fuzz(name, given.seed, given.start, max(1, given.count // len(names)), given.jobs)
        for distortions, result in results(summary, given.seed):
            for row in (total, *(rows[one] for one in sorted(set(distortions)))):
                row.add(result)
        row = row_of(summary, given.seed)
        print(row.text(name, summary.tally.longest), flush=True)
        print_findings(summary)
        seconds += summary.seconds
    print(total.text("all"))
    print("by distortion; most inputs have several")
    for name, row in rows.items():
        print(row.text(name))
    findings = sum(total.counts[key] for key in COLUMNS[3:])
    print(f"{total.counts['inputs']:,} inputs, seed {given.seed}, in {seconds:,.0f} s: "
          f"{findings} findings")  # fmt: skip
    sys.exit(bool(findings))


def fuzz(
    base: str, seed: int, start: int, count: int, jobs: int = 1, **planted: str | bool
) -> Summary:
    """Builds inputs of a base, and some of them twice; ``planted``: as for `Building`."""
    make = partial(Building, base=base, **planted)
    summary = run(base, make, seed, start, count, jobs, SLOW, HANGS)
    again = run(base, make, seed, start, -(-count // TWICE), 1, SLOW, HANGS)
    first, second = (databases(each) for each in (summary, again))
    different = [name for name in second if first.get(name, second[name]) != second[name]]
    if different:
        numbers = numbers_of(base, seed, range(start, start + -(-count // TWICE)), different)
        summary.tally.findings += [(number, OTHER) for number in numbers]
    return summary


def databases(summary: Summary) -> Mapping[str, str]:
    """Digest of an input → that of its database."""
    outcomes = (Outcome.read(text) for text in summary.tally.outcomes if "\t" in text)
    return {outcome.input: outcome.database for outcome in outcomes}


def numbers_of(base: str, seed: int, numbers: Iterable[int], names: Iterable[str]) -> list[int]:
    """The numbers of the inputs that have these digests."""
    wanted = set(names)
    with tempfile.TemporaryDirectory() as scratch:
        target = Building(Path(scratch), Path(scratch), base=base)
        return [n for n in numbers if name_of(target.make(generator(seed, base, n))) in wanted]


def row_of(summary: Summary, seed: int) -> Row:
    """The outcomes of the inputs of one base."""
    row = Row()
    for _, result in results(summary, seed):
        row.add(result)
    return row


def results(summary: Summary, seed: int) -> Iterable[tuple[tuple[str, ...], Outcome | str]]:
    """For each input its distortions, and its outcome or its first finding."""
    for text, count in summary.tally.outcomes.items():
        if "\t" in text:
            outcome = Outcome.read(text)
            yield from [(outcome.distortions, outcome)] * count
    once: dict[int, str] = {}
    for number, what in summary.tally.findings:
        once.setdefault(number, what)
    with tempfile.TemporaryDirectory() as scratch:
        target = Building(Path(scratch), Path(scratch), base=summary.name)
        for number, what in once.items():
            case = target.make(generator(seed, summary.name, number))
            yield case.facts.distortions, what


def print_findings(summary: Summary) -> None:
    """Prints the findings of a base, those alike on one line."""
    alike: dict[str, list[tuple[int, str]]] = {}
    for number, what in summary.tally.findings:
        alike.setdefault(re.sub(r"-?\d[\d.,e-]*", "N", what), []).append((number, what))
    for findings in list(alike.values())[:SHOWN]:
        number, what = findings[0]
        others = "".join(f", {other}" for other, _ in findings[1:6])
        print(f"    ! {summary.name}:{number}{others} ({len(findings)}): {what}", flush=True)


def show(which: str, seed: int, output: str | None) -> None:
    """Builds an input again; what is raised is shown."""
    name, _, number = which.partition(":")
    with tempfile.TemporaryDirectory() as scratch:
        target = Building(Path(scratch), Path(scratch), base=name)
        case = target.make(generator(seed, name, int(number)))
        print(f"{len(case.data)} bytes, {case.facts}")
        if output:
            Path(output).write_bytes(case.data)
        print(target.read(case).replace("\t", " | "))


if __name__ == "__main__":
    main()
