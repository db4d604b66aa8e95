"""Errors of associated poses under one alignment, and their summary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from evo.core.metrics import APE, PoseRelation, StatisticsType
from evo.core.trajectory import PosePath3D
from scipy.spatial.transform import Rotation

from plumb_tools.score.align import Alignment, twist_about_z
from plumb_tools.score.pairs import Pairs
from plumb_tools.trajectory import FloatArray


@dataclass(frozen=True)
class AlignedErrors:
    """Summary of the errors after one alignment; axes are those of the truth's world frame, z up."""

    ate_rmse_m: float
    ate_max_m: float
    final_m: float  #: position error of the last pose
    axis_max_m: tuple[float, float, float]
    axis_max_percent: tuple[float, float, float] | None  #: of the distance travelled; None without motion
    velocity_rmse_m_s: float | None
    tilt_rmse_deg: float  #: angle between the true and the estimated direction of gravity
    tilt_max_deg: float
    heading_rmse_deg: float  #: about the vertical
    heading_final_deg: float
    scale: float  #: factor applied to the estimate


def rms(values: FloatArray) -> float:
    """Root of the mean square; of vectors (N, 3), of their lengths."""
    squares = np.square(values)
    return float(np.sqrt(np.mean(squares.sum(axis=1) if values.ndim == 2 else squares)))


def tilt_rad(truth: Rotation, est: Rotation) -> FloatArray:
    """Angle between the verticals that two sets of attitudes see in the body frame, (N,)."""
    up = np.array([0.0, 0.0, 1.0])
    true_up, est_up = truth.inv().apply(up), est.inv().apply(up)
    cross = np.linalg.norm(np.cross(true_up, est_up), axis=-1)
    return np.asarray(np.arctan2(cross, np.sum(true_up * est_up, axis=-1)))


def heading_rad(truth: Rotation, est: Rotation) -> FloatArray:
    """Rotation about the vertical from the true to the estimated attitudes, (N,)."""
    return twist_about_z(est * truth.inv())


def position_errors(pairs: Pairs, alignment: Alignment) -> FloatArray:
    """Aligned estimate minus truth, (N, 3), in the truth's world frame."""
    return alignment.positions(pairs.est_p_m) - pairs.truth_p_m


def evo_path(p_m: FloatArray, rotation: Rotation) -> PosePath3D:
    """Poses in the form evo takes."""
    return PosePath3D(p_m, rotation.as_quat(scalar_first=True))


def summarise(pairs: Pairs, alignment: Alignment, distance_m: float) -> AlignedErrors:
    """Summary of the errors under an alignment. `distance_m`: what the truth travelled."""
    rotation = alignment.rotations(pairs.est_rotation)
    ape = APE(PoseRelation.translation_part)
    ape.process_data(
        (evo_path(pairs.truth_p_m, pairs.truth_rotation), evo_path(alignment.positions(pairs.est_p_m), rotation))
    )
    error = position_errors(pairs, alignment)
    worst = np.abs(error).max(axis=0)
    velocity = None
    if pairs.est_v_m_s is not None:
        velocity = rms(alignment.velocities(pairs.est_v_m_s) - pairs.truth_v_m_s)
    tilt = np.degrees(tilt_rad(pairs.truth_rotation, rotation))
    heading = np.degrees(heading_rad(pairs.truth_rotation, rotation))
    return AlignedErrors(
        ate_rmse_m=float(ape.get_statistic(StatisticsType.rmse)),
        ate_max_m=float(ape.get_statistic(StatisticsType.max)),
        final_m=float(np.linalg.norm(error[-1])),
        axis_max_m=_three(worst),
        axis_max_percent=_three(100.0 * worst / distance_m) if distance_m > 0.0 else None,
        velocity_rmse_m_s=velocity,
        tilt_rmse_deg=rms(tilt),
        tilt_max_deg=float(tilt.max()),
        heading_rmse_deg=rms(heading),
        heading_final_deg=float(heading[-1]),
        scale=alignment.scale,
    )


def _three(values: FloatArray) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
