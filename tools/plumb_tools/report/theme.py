"""Colours and words that every figure shares. All colours read on white and on near-black."""

from __future__ import annotations

from plumb_tools.report.run import Mode, RangeOutcome

RANGE_VIO = "#2f81f7"
VIO = "#e8833a"
TRUTH = "#8b95a5"
ALERT = "#e5484d"
GOOD = "#2ea876"
MUTED = "#8b95a5"

AXIS_NAMES = ("x", "y", "z")

MODE_COLOURS = {
    Mode.INITIALISING: MUTED,
    Mode.RANGE_VIO: RANGE_VIO,
    Mode.VIO: VIO,
    Mode.INERTIAL: ALERT,
    Mode.FAILED: ALERT,
}
MODE_NAMES = {
    Mode.INITIALISING: "initialising",
    Mode.RANGE_VIO: "range-VIO",
    Mode.VIO: "VIO",
    Mode.INERTIAL: "inertial only",
    Mode.FAILED: "failed",
}

OUTCOME_COLOURS = {
    RangeOutcome.USED: RANGE_VIO,
    RangeOutcome.GATED: ALERT,
    RangeOutcome.NO_FACET: MUTED,
    RangeOutcome.BAD_GEOMETRY: "#b08800",
    RangeOutcome.STALE: "#8957e5",
    RangeOutcome.FEATURE: "#3fb6c6",
    RangeOutcome.SPARE: "#6f86a8",
}
#: Of single ranges; a full circle where nothing else is said.
OUTCOME_SYMBOLS = {RangeOutcome.GATED: "x", RangeOutcome.SPARE: "circle-open"}
OUTCOME_NAMES = {
    RangeOutcome.NONE: "no range",
    RangeOutcome.USED: "accepted",
    RangeOutcome.GATED: "gated",
    RangeOutcome.NO_FACET: "no facet",
    RangeOutcome.BAD_GEOMETRY: "bad geometry",
    RangeOutcome.STALE: "stale",
    RangeOutcome.FEATURE: "given to a feature",
    RangeOutcome.SPARE: "spare",
}

STAGE_NAMES = {
    "front_end": "image front end",
    "initialisation": "initialisation",
    "propagation": "propagation",
    "range": "range update",
    "visual_rows": "visual rows",
    "visual_update": "visual update",
}
STAGE_COLOURS = ("#7aa6da", "#8b95a5", "#2ea876", "#e5484d", "#d4a72c", "#8957e5", "#e8833a", "#3fb6c6")


def colour_of(label: str) -> str:
    """Colour of a replay, by what it is called."""
    return VIO if label == "VIO" else RANGE_VIO


def faded(colour: str, opacity: float) -> str:
    """A colour `#rrggbb` with an opacity."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"


def stage_name(stage: str) -> str:
    """How a stage of the nav job is called in the report."""
    return STAGE_NAMES.get(stage, stage.replace("_", " "))
