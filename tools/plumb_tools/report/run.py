"""An output folder of plumb-replay as the report needs it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any

from plumb_tools.report.tables import Table, header_of, read_table
from plumb_tools.score.estimate import NEVER_STARTED, STATES_FILE, SUMMARY_FILE, Estimate, read_estimate
from plumb_tools.trajectory import InputError

TIMING_FILE = "timing.csv"
FEATURES_FILE = "features.csv"

POSITION = ("p_WI_x_m", "p_WI_y_m", "p_WI_z_m")
FACET = ("range_facet_0", "range_facet_1", "range_facet_2")
_STATES = (
    "sequence",
    "valid",
    "mode",
    "reset_count",
    *POSITION,
    "tracks",
    "slam_features",
    "slam_used",
    "slam_rejected",
    "msckf_used",
    "msckf_rejected",
    "range_outcome",
    "range_measured_m",
    "range_predicted_m",
    "range_sigma_m",
    "zero_velocity",
)

#: What else than NEVER_STARTED a replay without figures may have come to.
NO_TRUTH = "no truth"

#: What the report needs of summary.json.
_SUMMARY = ("source", "configuration", "inputs", "image_span_s", "wall_s", "counters", "run_hash")

STAGE_SUFFIX = "_us"
#: Columns of timing.csv that are sums of others.
_SUMS = ("filter_us", "step_us")


class Mode(IntEnum):
    """NavMode of fsw/measurement/nav_state.h."""

    INITIALISING = 0
    RANGE_VIO = 1
    VIO = 2
    INERTIAL = 3
    FAILED = 4


class RangeOutcome(IntEnum):
    """RangeOutcome of fsw/estimator/report.h."""

    NONE = 0
    USED = 1
    GATED = 2
    NO_FACET = 3
    BAD_GEOMETRY = 4
    STALE = 5
    FEATURE = 6
    SPARE = 7


#: Outcomes of ranges that went into the filter, or into a track that brings them.
AIDING = (RangeOutcome.USED, RangeOutcome.FEATURE)


@dataclass(frozen=True)
class Run:
    """One replay."""

    label: str  #: how it is called in the report
    folder: Path
    estimate: Estimate
    states: Table  #: one row per processed image
    timing: Table
    stages: tuple[str, ...]  #: names of the stages of the nav job, in order of execution
    summary: dict[str, Any]

    @property
    def features_file(self) -> Path | None:
        """Where the features of each image are; None when this replay did not write them."""
        path = self.folder / FEATURES_FILE
        return path if path.is_file() else None


def stage_names(header: list[str]) -> tuple[str, ...]:
    """Stages that timing.csv has columns for, in its order."""
    return tuple(
        name.removesuffix(STAGE_SUFFIX) for name in header if name.endswith(STAGE_SUFFIX) and name not in _SUMS
    )


def absence(reason: str) -> str:
    """The few words for a table of why a replay has no figures."""
    return next((words for words in (NEVER_STARTED, NO_TRUTH) if words in reason), "no solution")


def read_run(folder: Path, label: str) -> Run:
    """Reads an output folder of plumb-replay."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that plumb-replay wrote with --out")
    stages = stage_names(header_of(folder / TIMING_FILE))
    return Run(
        label,
        folder,
        read_estimate(folder),
        read_table(folder / STATES_FILE, _STATES, FACET),
        read_table(folder / TIMING_FILE, [stage + STAGE_SUFFIX for stage in stages] + ["step_us"]),
        stages,
        _read_summary(folder / SUMMARY_FILE),
    )


def _read_summary(path: Path) -> dict[str, Any]:
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; did the replay end?") from None
    except (OSError, ValueError) as error:  # the latter of text that is not JSON, or no text at all
        raise InputError(f"{path}: not a summary of plumb-replay: {error}") from None
    if not isinstance(summary, dict):
        raise InputError(f"{path}: holds no keys; not a summary of plumb-replay")
    missing = [key for key in _SUMMARY if key not in summary]
    if missing:
        raise InputError(f"{path}: missing {', '.join(missing)}; not a summary of plumb-replay")
    return summary
