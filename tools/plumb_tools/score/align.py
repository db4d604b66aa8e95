"""Alignment of an estimate to the truth.

Monocular visual-inertial odometry observes roll and pitch, and with a range finder scale: only position and yaw are
free. Hence four degrees of freedom are the alignment to judge by; SE(3) and Sim(3) hide tilt and scale errors.
All functions return the transform that takes the estimate's world frame to the truth's, both z-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from evo.core import geometry
from scipy.spatial.transform import Rotation

from plumb_tools.trajectory import FloatArray

#: Below this mean product of horizontal deviations [m^2] positions do not tell the yaw: it is taken from attitudes.
MIN_HORIZONTAL_SPREAD_M2 = 1e-8


@dataclass(frozen=True)
class Alignment:
    """p' = scale * rotation * p + translation_m."""

    name: str
    rotation: Rotation
    translation_m: FloatArray  #: (3,)
    scale: float = 1.0

    def positions(self, p_m: FloatArray) -> FloatArray:
        """Positions (N, 3) in the frame aligned to."""
        return np.asarray(self.scale * self.rotation.apply(p_m) + self.translation_m)

    def velocities(self, v_m_s: FloatArray) -> FloatArray:
        """Velocities (N, 3) in the frame aligned to."""
        return np.asarray(self.scale * self.rotation.apply(v_m_s))

    def rotations(self, rotation: Rotation) -> Rotation:
        """Attitudes (body to world) in the frame aligned to."""
        return self.rotation * rotation


def yaw_rotation(yaw_rad: float) -> Rotation:
    """Rotation about the z axis."""
    return Rotation.from_rotvec([0.0, 0.0, yaw_rad])


def twist_about_z(rotation: Rotation) -> FloatArray:
    """Angle [rad] of the rotation about z nearest to each given rotation, (N,).

    Unlike an Euler yaw it has no singularity where the body's x axis is vertical, as it is in EuRoC.
    """
    quaternions = np.atleast_2d(rotation.as_quat())
    angle = 2.0 * np.arctan2(quaternions[:, 2], quaternions[:, 3])
    return np.asarray((angle + math.pi) % (2.0 * math.pi) - math.pi)


def identity() -> Alignment:
    """No alignment: the frames are taken as given."""
    return Alignment("none", Rotation.identity(), np.zeros(3))


def at_pose(truth_p_m: FloatArray, truth: Rotation, est_p_m: FloatArray, est: Rotation) -> Alignment:
    """Position and yaw that make one estimated pose meet the true one; tilt errors stay."""
    rotation = yaw_rotation(float(twist_about_z(truth * est.inv())[0]))
    return Alignment("start", rotation, truth_p_m - rotation.apply(est_p_m))


def four_dof(truth_p_m: FloatArray, truth: Rotation, est_p_m: FloatArray, est: Rotation) -> Alignment:
    """Least-squares position and yaw over all poses, in closed form.

    With deviations d from the means, sum |d_truth - Rz(yaw) d_est|^2 is least where
    cos(yaw) * sum(dot of the horizontal parts) + sin(yaw) * sum(their cross product) is greatest.
    """
    truth_mean, est_mean = truth_p_m.mean(axis=0), est_p_m.mean(axis=0)
    d_truth, d_est = truth_p_m - truth_mean, est_p_m - est_mean
    dot = float(np.mean(d_est[:, 0] * d_truth[:, 0] + d_est[:, 1] * d_truth[:, 1]))
    cross = float(np.mean(d_est[:, 0] * d_truth[:, 1] - d_est[:, 1] * d_truth[:, 0]))
    if math.hypot(dot, cross) > MIN_HORIZONTAL_SPREAD_M2:
        yaw = math.atan2(cross, dot)
    else:
        yaw = float(twist_about_z((truth * est.inv()).mean())[0])
    rotation = yaw_rotation(yaw)
    return Alignment("4dof", rotation, truth_mean - rotation.apply(est_mean))


def umeyama(truth_p_m: FloatArray, est_p_m: FloatArray, with_scale: bool) -> Alignment | None:
    """SE(3) or Sim(3) alignment of the positions; None where they do not determine it (a line, a point)."""
    try:
        rotation, translation, scale = geometry.umeyama_alignment(est_p_m.T, truth_p_m.T, with_scale)
    except geometry.GeometryException:
        return None
    if not scale > 0.0:
        return None
    name = "sim3" if with_scale else "se3"
    return Alignment(name, Rotation.from_matrix(rotation), np.asarray(translation), float(scale))
