"""The score as one table for reading."""

from __future__ import annotations

from collections.abc import Callable

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from plumb_tools.score.compute import Score
from plumb_tools.score.consistency import Nees
from plumb_tools.score.errors import AlignedErrors

WIDTH = 88  #: of the output where it does not go to a terminal
NOT_AVAILABLE = "-"
COLUMN_TITLES = {"start": "start", "4dof": "4-dof", "se3": "SE(3)", "sim3": "Sim(3)", "none": "given"}
AXES = ("x", "y", "z")


def show(score: Score, console: Console) -> None:
    """Prints headline, table and notes."""
    console.print(_headline(score))
    console.print(_table(score))
    if score.consistency is not None:
        console.print(
            "The NEES bounds are those of independent samples. Poses of one run are correlated, so that a single "
            "run may leave them: judge the mean of several runs.",
            style="dim",
        )
    for note in score.notes:
        console.print(f"Note: {note}", style="yellow")


def _headline(score: Score) -> Text:
    text = Text()
    text.append(f"truth     {score.truth}\nestimate  {score.estimate}\n", style="dim")
    errors = score.alignments["4dof"]
    assert errors is not None  # the 4-dof alignment always exists
    text.append(f"ATE {errors.ate_rmse_m:.4f} m", style="bold green")
    if score.distance_m > 0.0:
        text.append(f" = {100.0 * errors.ate_rmse_m / score.distance_m:.2f} % of {score.distance_m:.2f} m")
    text.append(f"  (RMSE, 4-dof)   coverage {100.0 * score.coverage.covered:.1f} %   {score.pairs} poses")
    return text


def _table(score: Score) -> Table:
    names = list(score.alignments)
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("Error after alignment", no_wrap=True)
    for name in names:
        style = "bold" if name == score.selected else ""
        table.add_column(COLUMN_TITLES[name], justify="right", style=style, no_wrap=True)

    def section(title: str, cells: list[str]) -> None:
        table.add_section()
        table.add_row(title, *_fill(cells, len(names)), style="bold cyan")

    def row(title: str, cells: list[str]) -> None:
        table.add_row(title, *_fill(cells, len(names)))

    for title, cells in _alignment_rows(score, names):
        row(title, cells)
    if score.segments:
        section("Drift over segments", [f"{segment.length_m:g} m" for segment in score.segments])
        row("translation RMSE, %", [f"{segment.translation_percent:.2f}" for segment in score.segments])
        row("rotation RMSE, deg", [f"{segment.rotation_rmse_deg:.3f}" for segment in score.segments])
        row("pairs", [str(segment.pairs) for segment in score.segments])
    if score.consistency is not None:
        parts = [score.consistency.position, score.consistency.velocity, score.consistency.attitude]
        section("NEES (ideal 3)", ["position", "velocity", "attitude"])
        row("mean", [_nees(part, lambda n: f"{n.mean:.2f}") for part in parts])
        row("95 % bounds of mean", [_nees(part, lambda n: f"{n.lower:.2f}-{n.upper:.2f}") for part in parts])
        row("within own 95 %, %", [_nees(part, lambda n: f"{100.0 * n.inside:.1f}") for part in parts])
        row("samples (skipped)", [_nees(part, lambda n: f"{n.samples} ({n.skipped})") for part in parts])
    _run_rows(score, section, row)
    return table


def _fill(cells: list[str], width: int) -> list[str]:
    return cells[:width] + [""] * (width - len(cells))


def _alignment_rows(score: Score, names: list[str]) -> list[tuple[str, list[str]]]:
    def cells(value: Callable[[AlignedErrors], str | None]) -> list[str]:
        found = []
        for name in names:
            errors = score.alignments[name]
            found.append((None if errors is None else value(errors)) or NOT_AVAILABLE)
        return found

    def velocity(errors: AlignedErrors) -> str | None:
        return None if errors.velocity_rmse_m_s is None else f"{errors.velocity_rmse_m_s:.4f}"

    def axis_m(index: int) -> list[str]:
        return cells(lambda e: f"{e.axis_max_m[index]:.4f}")

    def axis_percent(index: int) -> list[str]:
        return cells(lambda e: None if e.axis_max_percent is None else f"{e.axis_max_percent[index]:.3f}")

    return [
        ("ATE RMSE, m", cells(lambda e: f"{e.ate_rmse_m:.4f}")),
        ("ATE max, m", cells(lambda e: f"{e.ate_max_m:.4f}")),
        *[(f"max {name} error, m", axis_m(index)) for index, name in enumerate(AXES)],
        *[(f"max {name} error, % of path", axis_percent(index)) for index, name in enumerate(AXES)],
        ("final position, m", cells(lambda e: f"{e.final_m:.4f}")),
        ("velocity RMSE, m/s", cells(velocity)),
        ("tilt RMSE, deg", cells(lambda e: f"{e.tilt_rmse_deg:.3f}")),
        ("tilt max, deg", cells(lambda e: f"{e.tilt_max_deg:.3f}")),
        ("heading RMSE, deg", cells(lambda e: f"{e.heading_rmse_deg:.3f}")),
        ("heading final, deg", cells(lambda e: f"{e.heading_final_deg:+.3f}")),
        ("scale applied", cells(lambda e: f"{e.scale:.5f}")),
    ]


def _nees(part: Nees | None, value: Callable[[Nees], str]) -> str:
    return NOT_AVAILABLE if part is None else value(part)


def _run_rows(score: Score, section: Callable[[str, list[str]], None], row: Callable[[str, list[str]], None]) -> None:
    ratio = NOT_AVAILABLE if score.path_ratio is None else f"{score.path_ratio:.5f}"
    section("Run", [])
    row("path length ratio", [ratio])
    row(f"coverage of {score.span_source}, %", [f"{100.0 * score.coverage.covered:.1f}"])
    row("span, s", [f"{score.coverage.span_s:.2f}"])
    row("first output after, s", [f"{score.coverage.first_output_s:.3f}"])
    row("longest gap, s", [f"{score.coverage.longest_gap_s:.3f}"])
    if score.resets:
        row("re-initialisations", [str(score.resets)])
    if score.standstill is None:
        row("drift in end standstill, m", [NOT_AVAILABLE])
    else:
        still = score.standstill
        row("drift in end standstill, m", [f"{still.drift_m:.4f}"])
        row("  the same of the truth, m", [f"{still.truth_drift_m:.4f}"])
        row("  standstill, s", [f"{still.duration_s:.1f}"])
