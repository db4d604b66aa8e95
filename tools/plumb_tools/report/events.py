"""What happened in a flight, in order, from the rows of states.csv."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plumb_tools.report import theme
from plumb_tools.report.analysis import stretches
from plumb_tools.report.flight import Flight
from plumb_tools.report.run import AIDING, Mode, RangeOutcome, Run

#: Gated ranges nearer to each other than this are one event.
BURST_GAP_S = 0.5
#: Time without a usable range that is worth an event.
RANGE_SILENCE_S = 1.0


@dataclass(frozen=True)
class Event:
    """Something that happened."""

    t_s: float  #: since the first image
    kind: str  #: info or warning
    text: str


def events_of(flight: Flight, run: Run) -> list[Event]:
    """Events of a replay in order of time."""
    found = [*_modes(flight, run), *_resets(flight, run)]
    if run.states["range_outcome"].any():
        found += [*_gated(flight, run), *_silences(flight, run)]
    return sorted(found, key=lambda event: event.t_s)


def _modes(flight: Flight, run: Run) -> list[Event]:
    states = run.states
    t_s = flight.seconds(states.t_ns)
    mode = np.where(states["valid"] > 0.0, states["mode"], Mode.INITIALISING).astype(np.int64)
    found = []
    for stretch in stretches(t_s, mode)[1:]:
        name = theme.MODE_NAMES[Mode(stretch.value)]
        kind = "warning" if stretch.value in (Mode.INERTIAL, Mode.INITIALISING) else "info"
        found.append(Event(stretch.start_s, kind, f"mode: {name}"))
    return found


def _resets(flight: Flight, run: Run) -> list[Event]:
    states = run.states
    t_s = flight.seconds(states.t_ns)
    rows = np.flatnonzero(np.diff(states["reset_count"]) > 0.0) + 1
    return [Event(float(t_s[row]), "warning", "the filter started anew") for row in rows]


def _gated(flight: Flight, run: Run) -> list[Event]:
    states = run.states
    rows = np.flatnonzero(states["range_outcome"] == RangeOutcome.GATED)
    if not rows.size:
        return []
    t_s = flight.seconds(states.t_ns)[rows]
    bursts = np.split(np.arange(len(rows)), np.flatnonzero(np.diff(t_s) > BURST_GAP_S) + 1)
    found = []
    for burst in bursts:
        measured = states["range_measured_m"][rows[burst]]
        predicted = states["range_predicted_m"][rows[burst]]
        worst = int(np.argmax(np.abs(measured - predicted)))
        count = "range" if len(burst) == 1 else f"{len(burst)} ranges"
        text = f"{count} gated: measured {measured[worst]:.2f} m, the filter says {predicted[worst]:.2f} m"
        found.append(Event(float(t_s[burst[0]]), "warning", text))
    return found


def _silences(flight: Flight, run: Run) -> list[Event]:
    states = run.states
    t_s = flight.seconds(states.t_ns)
    used = np.isin(states["range_outcome"], AIDING).astype(np.int64)
    first = int(np.argmax(used)) if used.any() else len(used)
    found = []
    for stretch in stretches(t_s, used):
        length = stretch.end_s - stretch.start_s
        if not stretch.value and length >= RANGE_SILENCE_S and first < len(t_s) and stretch.start_s > t_s[first]:
            found.append(Event(stretch.start_s, "info", f"no range used for {length:.1f} s"))
    return found
