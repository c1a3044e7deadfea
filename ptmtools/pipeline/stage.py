"""What a stage is: one frozen value that says all that a build has to know of it.

Each stands in a file of its own in `stages/`, and in the table there. Build, plan, status, info,
validate, tradeoff and the command line loop over that table.
"""

from __future__ import annotations

import json
import typing
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from types import UnionType
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, Union, get_args, get_origin

from ptmtools.errors import PtmError
from ptmtools.lazy import Lazy
from ptmtools.options import option_of
from ptmtools.store.layout import arrays_of

if TYPE_CHECKING:
    from ptmtools.pipeline.run import Artifacts, Job
    from ptmtools.store.manifest import StageRecord


A = TypeVar("A")

#: The options that a stage is run with: an instance of its `Stage.options`.
Options = Any
Counts = Mapping[str, Any]


def _nothing(*_: Any) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True, eq=False)
class Stage(Generic[A]):
    """One step from the model to the served files.

    Attributes
    ----------
    name: in the manifest, as a command, and of its arrays' file.
    about: what it does, a sentence for ``--help``.
    recipe: a number that is raised when the stage makes different bytes from the same inputs, so
        that a new release runs again what it changed and nothing else.
    changed: what the recipe changed that a user notices, for who has a database of an earlier one.
    options: the frozen class of its options. A field's metadata may have ``default_before``: a
        recipe, and what the default was before that.
    reads: the stages that it reads, in the order in which `compute` takes their artifacts; a
        function of the options if it depends on them.
    changes: the stage whose artifact it makes another of, of the same class; where it has stored no
        arrays it is that one. Who reads it reads the arrays of both.
    files: of the stages that it reads, those of which it reads all files, not the arrays alone.
    artifact: the class of what it makes, with ``to_arrays`` and ``from_arrays``; None if it makes
        files only.
    compute: ``compute(*artifacts, options, progress, executor)``, which makes the artifact.
    counts: its figures, of an artifact. They are recorded, and checked by ``ptm validate``.
    notes: what there is to say of an artifact and the options, one line each; `Warned` are those
        that are told first.
    summary: what was made, in one line, of the recorded counts.
    fits: for stages whose artifacts this one refers to: what is wrong with (own, other), or "".
    job: how it is run; the default computes the artifact and stores its arrays.
    inputs: ``inputs(artifacts, options)``: name → SHA-256 of what it reads; by default the arrays
        of the stages that it reads, or all the files of one that has none.
    foresee: ``foresee(artifacts, work)``: whether what others read of it is known before a run
        that would do ``work``; ``artifacts`` then hold it.
    tasks: ``tasks(artifacts, work)``: of a stage that consists of tasks, the names of those that a
        run would do.
    load: its artifact of the stored arrays, where that takes more than them.
    check: ``check(artifacts, artifact)``: what else of its files is missing, as (file, place,
        message), for ``ptm validate``.
    from_model: it reads the model itself: its command takes one.
    hidden: it has no command of its own, but is run by the next one's.
    joined: what it makes is committed with the next stage: a model that cannot be cut into cells
        leaves no database behind.
    one_thread: it leaves the other processors free for what can be done in the background.
    """

    name: str
    about: str
    recipe: int
    options: type
    changed: str = ""
    reads: tuple[Stage[Any], ...] | Callable[[Options], tuple[Stage[Any], ...]] = ()
    changes: Stage[A] | None = None
    files: tuple[Stage[Any], ...] = ()
    artifact: Lazy[Any] | None = None
    compute: Lazy[Callable[..., A]] | None = None
    counts: Callable[[A], Counts] | None = None
    notes: Callable[[A, Options], Iterable[str]] = _nothing
    summary: Callable[[Counts], str] = field(default=lambda counts: "")
    fits: Mapping[Stage[Any], Callable[[A, Any], str]] = field(default_factory=dict)
    job: Lazy[type[Job]] = field(default=Lazy("ptmtools.pipeline.run:ArraysJob"))
    inputs: Lazy[Callable[[Artifacts, Options], Mapping[str, str]]] | None = None
    foresee: Lazy[Callable[[Artifacts, StageRecord], bool]] | None = None
    tasks: Lazy[Callable[[Artifacts, StageRecord], list[str]]] | None = None
    load: Lazy[Callable[[Artifacts, Mapping[str, Any]], A]] | None = None
    check: Lazy[Callable[[Artifacts, A], Iterable[tuple[str, str, str]]]] | None = None
    from_model: bool = False
    hidden: bool = False
    joined: bool = False
    one_thread: bool = False

    def read_with(self, options: Options) -> tuple[Stage[Any], ...]:
        """The stages that it reads when it is run with these options."""
        return self.reads(options) if callable(self.reads) else self.reads

    def sources(self, options: Options) -> tuple[Stage[Any], ...]:
        """The stages whose files it reads: also those that one of `read_with` changes."""
        reads = self.read_with(options)
        changed = (read.changes for read in reads if read.changes)
        return tuple(dict.fromkeys((*changed, *reads)))

    def files_read(
        self, options: Options, outputs: Callable[[Stage[Any]], Mapping[str, str]]
    ) -> dict[str, str]:
        """Name → SHA-256 of what it reads of other stages, whose ``outputs`` are given; "" for
        arrays that are not among these."""
        found: dict[str, str] = {}
        for read in self.sources(options):
            there, name = outputs(read), arrays_of(read.name)
            if read.artifact is None or read in self.files:
                found |= there
            elif name in there or not read.changes:
                found[name] = there.get(name, "")
        return found

    def summarize(self, counts: Counts) -> str:
        """`summary`; a manifest may say anything."""
        try:
            return self.summary(counts)
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return "figures that make no sense"

    def recorded(self, record: StageRecord) -> Options:
        """The options of a run, of the parameters that its record has.

        Raises ValueError if they are not such. Fields that the class does not have any more are
        passed over, and those that it has gained have their default; so has what was the default
        when it was recorded.
        """
        parameters = record.parameters
        hints = typing.get_type_hints(self.options)
        given: dict[str, Any] = {}
        try:
            for each in fields(self.options):
                former = (name.replace("-", "_") for name in option_of(each).was)
                for name in (each.name, *former):
                    if name in parameters and each.compare:
                        value = _restored(hints[each.name], parameters[name])
                        recipe, former = option_of(each).default_before or (0, None)
                        if record.recipe >= recipe or value != former:
                            given[each.name] = value
                        break
            return self.options(**given)
        except (PtmError, AttributeError, LookupError, TypeError) as fault:
            raise ValueError(f"stage {self.name} has impossible parameters: {fault}") from fault


def parameters(options: Any) -> dict[str, Any]:
    """The options that can change an artifact, as JSON reads them back; those that cannot are not
    compared in their class (``field(compare=False)``)."""
    if not is_dataclass(options) or isinstance(options, type):
        raise TypeError(f"{options!r} is not an options dataclass")
    plain = asdict(options)
    for each in fields(options):
        if not each.compare:
            del plain[each.name]
    result: dict[str, Any] = json.loads(json.dumps(plain))
    return result


def _restored(hint: Any, value: Any) -> Any:
    """What JSON makes of an option of the type ``hint``, as it was; raises TypeError if it is no
    such option."""
    parts = get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        for part in parts:
            with suppress(TypeError):
                return _restored(part, value)
    elif get_origin(hint) is tuple and isinstance(value, list):
        inner = [parts[0]] * len(value) if parts[-1] is Ellipsis else parts
        if len(inner) == len(value):
            return tuple(map(_restored, inner, value))
    elif isinstance(hint, type) and is_dataclass(hint) and isinstance(value, dict):
        hints = typing.get_type_hints(hint)
        return hint(**{name: _restored(hints.get(name), each) for name, each in value.items()})
    elif (
        (get_origin(hint) is Literal and value in parts)
        or type(value) is hint
        or (hint is float and type(value) is int)
    ):
        return value
    raise TypeError(f"{value!r} is not {hint}")
