"""Declares what a scene file may hold, and reads it strictly: every fault is reported with key, value and expectation.

A section is a frozen dataclass whose fields carry a `Spec`. The same declaration gives the defaults, the checks and
the file "as flown" with everything filled in.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from itertools import pairwise
from typing import Any


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a scene file."""

    key: str  #: dotted path, list items by number: `scene.objects[2].height_m`
    value: str  #: as found
    expected: str

    def __str__(self) -> str:
        """Message without the file name."""
        return f"{self.key}: {self.value}; expected {self.expected}"


class Faults:
    """Collects what is wrong, so that the user sees everything at once."""

    def __init__(self) -> None:
        """Starts with none."""
        self.items: list[Fault] = []

    def add(self, key: str, value: object, expected: str) -> None:
        """Records a fault; the value is shown as found, cut to a readable length."""
        text = value if isinstance(value, _Said) else _shown(value)
        self.items.append(Fault(key, text, expected))

    def __bool__(self) -> bool:
        """True when something is wrong."""
        return bool(self.items)


class _Said(str):
    """Text that stands for a value in a message without being one."""


NOT_THERE = _Said("is missing")

_MAX_SHOWN = 60


def said(text: str) -> str:
    """Marks text as a remark, shown without quotes in place of a value."""
    return _Said(text)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _MAX_SHOWN else text[: _MAX_SHOWN - 3] + "..."


class Spec:
    """How one value is read. Returns the value, or None after recording a fault."""

    def read(self, value: object, key: str, faults: Faults) -> Any:
        """The checked value."""
        raise NotImplementedError


def _is_number(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that is beyond any floating-point one
        return False


@dataclass(frozen=True)
class Real(Spec):
    """A number with unit and limits; `above` and `below` exclude the limit itself."""

    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None

    @property
    def expected(self) -> str:
        """The condition in words."""
        unit = f" {self.unit}" if self.unit else ""
        if self.low is not None and self.high is not None:
            return f"a number from {self.low:g} to {self.high:g}{unit}"
        if self.above is not None and self.high is not None:
            return f"a number above {self.above:g} and at most {self.high:g}{unit}"
        if self.low is not None:
            return f"a number of at least {self.low:g}{unit}"
        if self.above is not None:
            return f"a number above {self.above:g}{unit}"
        return f"a number{' in' + unit if unit else ''}"

    def accepts(self, value: object) -> bool:
        """Whether the value keeps type and limits."""
        if not _is_number(value):
            return False
        number = float(value)  # type: ignore[arg-type]
        return (
            (self.low is None or number >= self.low)
            and (self.high is None or number <= self.high)
            and (self.above is None or number > self.above)
        )

    def read(self, value: object, key: str, faults: Faults) -> float | None:
        """The number as float."""
        if self.accepts(value):
            return float(value)  # type: ignore[arg-type]
        faults.add(key, value, self.expected)
        return None


@dataclass(frozen=True)
class Whole(Spec):
    """An integer within limits."""

    low: int
    high: int

    def read(self, value: object, key: str, faults: Faults) -> int | None:
        """The integer."""
        if isinstance(value, int) and not isinstance(value, bool) and self.low <= value <= self.high:
            return value
        faults.add(key, value, f"a whole number from {self.low} to {self.high}")
        return None


@dataclass(frozen=True)
class Flag(Spec):
    """true or false."""

    def read(self, value: object, key: str, faults: Faults) -> bool | None:
        """The truth value."""
        if isinstance(value, bool):
            return value
        faults.add(key, value, "true or false")
        return None


@dataclass(frozen=True)
class Text(Spec):
    """One line of text."""

    def read(self, value: object, key: str, faults: Faults) -> str | None:
        """The text."""
        if isinstance(value, str):
            return value
        faults.add(key, value, "text")
        return None


@dataclass(frozen=True)
class Choice(Spec):
    """One of a few words."""

    words: tuple[str, ...]

    def read(self, value: object, key: str, faults: Faults) -> str | None:
        """The word."""
        if isinstance(value, str) and value in self.words:
            return value
        faults.add(key, value, f"one of {', '.join(self.words)}")
        return None


@dataclass(frozen=True)
class Vector(Spec):
    """A list of numbers of fixed length, each within the limits of `each`."""

    length: int
    each: Real = field(default_factory=Real)
    ascending: bool = False

    def read(self, value: object, key: str, faults: Faults) -> tuple[float, ...] | None:
        """The numbers."""
        if isinstance(value, list | tuple) and len(value) == self.length and all(map(self.each.accepts, value)):
            numbers = tuple(float(item) for item in value)
            if not self.ascending or all(a < b for a, b in pairwise(numbers)):
                return numbers
        order = ", ascending" if self.ascending else ""
        faults.add(key, value, f"a list of {self.length} numbers, each {self.each.expected}{order}")
        return None


@dataclass(frozen=True)
class Points(Spec):
    """A list of at least `least` points, each a list of `length` numbers."""

    length: int
    least: int
    unit: str = "m"

    def read(self, value: object, key: str, faults: Faults) -> tuple[tuple[float, ...], ...] | None:
        """The points."""
        if isinstance(value, list | tuple) and len(value) >= self.least:
            rows = [Vector(self.length).read(row, f"{key}[{i}]", faults) for i, row in enumerate(value)]
            return None if any(row is None for row in rows) else tuple(row for row in rows if row is not None)
        faults.add(key, value, f"a list of at least {self.least} points of {self.length} numbers in {self.unit}")
        return None


@dataclass(frozen=True)
class Section(Spec):
    """A mapping that becomes a dataclass."""

    type: type

    def read(self, value: object, key: str, faults: Faults) -> Any:
        """The section with defaults filled in."""
        return read_section(self.type, value, key, faults)


@dataclass(frozen=True)
class Items(Spec):
    """A list of mappings, each made one of several dataclasses by its tag."""

    tag: str
    types: tuple[type, ...]

    def read(self, value: object, key: str, faults: Faults) -> tuple[Any, ...] | None:
        """The items in order."""
        if not isinstance(value, list | tuple):
            faults.add(key, value, f"a list of items with '{self.tag}'")
            return None
        return tuple(self._item(item, f"{key}[{i}]", faults) for i, item in enumerate(value))

    def _item(self, item: object, key: str, faults: Faults) -> Any:
        by_name = {cls.TAG: cls for cls in self.types}  # type: ignore[attr-defined]
        if not isinstance(item, Mapping):
            faults.add(key, item, f"a section with '{self.tag}'")
            return None
        name = item.get(self.tag, NOT_THERE)
        if not isinstance(name, str) or name not in by_name:
            faults.add(f"{key}.{self.tag}", name, f"one of {', '.join(by_name)}")
            return None
        rest = {k: v for k, v in item.items() if k != self.tag}
        return read_section(by_name[name], rest, key, faults, also=(self.tag,))


def key(spec: Spec, default: Any = MISSING) -> Any:
    """A dataclass field read by `spec`; without a default the key must be in the file."""
    return field(default=default, metadata={"spec": spec})


def section(cls: type, *, required: bool = False) -> Any:
    """A nested section, all defaults when it is not in the file."""
    if required:
        return field(metadata={"spec": Section(cls)})
    return field(default_factory=cls, metadata={"spec": Section(cls)})


def read_section(cls: type, value: object, path: str, faults: Faults, also: tuple[str, ...] = ()) -> Any:
    """Fills a dataclass from a mapping; None after a fault in it. `also`: keys that were dealt with before."""
    if value is None:
        value = {}
    if not isinstance(value, Mapping):
        faults.add(path or "top level", value, f"a section with {', '.join(f.name for f in fields(cls))}")
        return None
    known = {f.name: f for f in fields(cls)}
    before = len(faults.items)
    for name in value:
        if name not in known:
            faults.add(_join(path, str(name)), said("unknown key"), _suggestion(str(name), [*also, *known]))
    values: dict[str, Any] = {}
    for name, item in known.items():
        where = _join(path, name)
        if name in value:
            values[name] = item.metadata["spec"].read(value[name], where, faults)
        elif item.default is MISSING and item.default_factory is MISSING:
            if isinstance(item.metadata["spec"], Section):
                values[name] = item.metadata["spec"].read({}, where, faults)
            else:
                faults.add(where, NOT_THERE, _expectation(item.metadata["spec"], where))
    return None if len(faults.items) > before else cls(**values)


def _expectation(spec: Spec, where: str) -> str:
    """What a value would have to be, told by letting the specification refuse nothing at all."""
    probe = Faults()
    spec.read(NOT_THERE if not isinstance(spec, Text) else 0, where, probe)
    return probe.items[0].expected


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _suggestion(name: str, known: list[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    return f"{f'{close[0]!r}, or ' if close else ''}one of {', '.join(known)}"


def as_plain(value: Any) -> Any:
    """The section as mappings, lists and scalars, tags first: what goes into the file as flown."""
    if is_dataclass(value) and not isinstance(value, type):
        tag_key = getattr(value, "TAG_KEY", None)
        tag = {} if tag_key is None else {tag_key: getattr(value, "TAG", None)}
        return tag | {f.name: as_plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, tuple):
        return [as_plain(item) for item in value]
    return value
