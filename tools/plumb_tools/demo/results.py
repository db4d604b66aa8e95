"""What came of a scene: figures of both replays, as a row on the terminal, in Markdown and in a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from plumb_tools.report.headline import Cost, Headline
from plumb_tools.report.run import absence

NONE = "-"
WIDE = 120  #: characters from which a table's titles have room
RANGE_VIO, VIO = "range-VIO", "VIO"


@dataclass(frozen=True)
class Figures:
    """Figures of one replay."""

    headline: Headline
    cost: Cost

    @staticmethod
    def from_json(tree: dict[str, Any]) -> Figures:
        """From what `asdict` made of it."""
        return Figures(Headline(**tree["headline"]), Cost(**tree["cost"]))


@dataclass(frozen=True)
class Outcome:
    """Figures of one flight. A replay that gave no solution to score has none, and a reason instead."""

    scene: str
    seed: int | None  #: None: not simulated here
    range_vio: Figures | None
    vio: Figures | None
    reasons: dict[str, str]  #: why a replay has no figures, by its name; it begins with what it came to

    def replays(self) -> tuple[tuple[str, Figures | None], ...]:
        """Both replays with their names, range-VIO first."""
        return (RANGE_VIO, self.range_vio), (VIO, self.vio)

    def as_json(self) -> dict[str, Any]:
        """A tree of plain values."""
        return asdict(self)

    @staticmethod
    def from_json(tree: dict[str, Any]) -> Outcome:
        """The inverse of as_json. Throws KeyError or TypeError when the tree is not one of these."""
        figures = {
            name: None if tree[name] is None else Figures.from_json(tree[name]) for name in ("range_vio", "vio")
        }
        known = {field.name for field in fields(Outcome)}
        return Outcome(**{**{key: value for key, value in tree.items() if key in known}, **figures})


@dataclass(frozen=True)
class Column:
    """A figure that tables show."""

    title: str
    short: str  #: title where there is little room
    unit: str
    value: Callable[[Figures], float | None]
    digits: int
    signed: bool = False  #: the sign says which way; means and worsts are of its size
    least_is_worst: bool = False


COLUMNS = (
    Column("max axis error", "axis", "% of distance", lambda f: f.headline.max_axis_percent, 2),
    Column("max axis error", "axis", "m", lambda f: f.headline.max_axis_m, 3),
    Column("ATE", "ATE", "m", lambda f: f.headline.ate_m, 3),
    Column("scale error", "scale", "%", lambda f: f.headline.scale_error_percent, 2, signed=True),
    Column("velocity RMSE", "vel.", "m/s", lambda f: f.headline.velocity_rmse_m_s, 3),
    Column("NEES position", "NEES\npos.", "ideal 3", lambda f: f.headline.nees_position, 1),
    Column("NEES velocity", "NEES\nvel.", "ideal 3", lambda f: f.headline.nees_velocity, 1),
    Column("NEES attitude", "NEES\natt.", "ideal 3", lambda f: f.headline.nees_attitude, 1),
    Column("CPU per frame", "CPU", "ms", lambda f: f.cost.cpu_ms, 2),
    Column("real-time factor", "real\ntime", "x", lambda f: f.cost.realtime_factor, 1, least_is_worst=True),
)

_SHORT_UNITS = {"% of distance": "%", "ideal 3": "(3)"}


def cell(figures: Figures | None, column: Column) -> str:
    """A figure as text."""
    value = None if figures is None else column.value(figures)
    if value is None:
        return NONE
    digits = column.digits if abs(value) < 1000.0 else 0
    return f"{value:{'+' if column.signed else ''}.{digits}f}"


def terminal_table(outcomes: Sequence[Outcome], width: int) -> Table:
    """Two rows per flight, range-VIO and VIO, in as many characters as the terminal is wide, 80 at least."""
    wide = width >= WIDE
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0) if wide else 0)
    table.add_column("scene", no_wrap=True)
    table.add_column("", no_wrap=True)
    for column in COLUMNS:
        title, unit = (column.title, column.unit) if wide else (column.short, _SHORT_UNITS.get(column.unit, column.unit))
        table.add_column(f"{title}\n[dim]{unit}[/]", justify="right", no_wrap=not wide)
    for outcome in outcomes:
        for name, figures in outcome.replays():
            colour = "bright_blue" if name == RANGE_VIO else "orange3"
            first = outcome.scene if name == RANGE_VIO else ""
            cells = [cell(figures, column) for column in COLUMNS]
            if figures is None and name in outcome.reasons:
                words = absence(outcome.reasons[name]).replace(" ", "\n")  # in a line they would widen the column
                cells = [words, *([""] * (len(COLUMNS) - 1))]
            table.add_row(first, f"[{colour}]{name}[/]", *cells)
        table.add_section()
    return table


def footnotes(outcomes: Sequence[Outcome]) -> list[str]:
    """A sentence for each replay that has no figures."""
    return [f"{outcome.scene}, {name}: {why}." for outcome in outcomes for name, why in outcome.reasons.items()]


def mean_and_worst(figures: Sequence[Figures], column: Column) -> tuple[float, float] | None:
    """Mean and worst value over flights, of sizes where the figure has a sign; None when nothing is known."""
    values = [value for entry in figures if (value := column.value(entry)) is not None]
    sizes = [abs(value) for value in values] if column.signed else values
    worst = min if column.least_is_worst else max
    return (sum(sizes) / len(sizes), worst(sizes)) if sizes else None


def error_ratio(outcomes: Sequence[Outcome]) -> float | None:
    """Mean greatest error on an axis of VIO over that of range-VIO, over flights in which both had a solution."""
    both = [(o.range_vio.headline, o.vio.headline) for o in outcomes if o.range_vio is not None and o.vio is not None]
    with_range = sum(first.max_axis_m for first, _ in both)
    return sum(second.max_axis_m for _, second in both) / with_range if with_range > 0.0 else None
