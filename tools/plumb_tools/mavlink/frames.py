"""Frames of Plumb and of MAVLink, and covariances carried from one to the other.

W is Plumb's world (z up), I its IMU. L is MAVLink's local frame and B its body: x forward or north, y right or east,
z down. Errors of position and velocity are additive. An attitude error is a small turn: Plumb's about the axes of I,
MAVLink's about those of L, so that the third is that of the heading whatever the attitude.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from plumb_tools.trajectory import FloatArray

#: Turns W into L. Where the heading is not known, x of both is that of the start; where it is, x of W is east.
R_LW_START = np.diag([1.0, -1.0, -1.0])
R_LW_NORTH = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])

#: Unit vectors of B by the letter of where they point: forward, back, right, left, down, up.
_POINTING = {"F": (1, 0, 0), "B": (-1, 0, 0), "R": (0, 1, 0), "L": (0, -1, 0), "D": (0, 0, 1), "U": (0, 0, -1)}

_UPPER = np.triu_indices(6)


def body_from_imu(axes: str, tilt_deg: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> FloatArray:
    """R_BI of an IMU by where its x, y and z point, such as FLU, and by how roll, pitch and yaw turn it from there.

    ValueError where the letters are no right-handed frame.
    """
    letters = axes.upper()
    if len(letters) == 3 and all(letter in _POINTING for letter in letters):
        nominal = np.array([_POINTING[letter] for letter in letters], dtype=np.float64).T
        if np.linalg.det(nominal) > 0.5:
            return np.asarray(Rotation.from_euler("xyz", tilt_deg, degrees=True).as_matrix() @ nominal)
    raise ValueError(axes)


def skew(vector: FloatArray) -> FloatArray:
    """The matrix of a cross product from the left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def local_covariance(covariance: FloatArray, r_LW: FloatArray, r_WI: FloatArray) -> FloatArray:
    """Covariance of position, velocity and attitude in L, 9 x 9, from that of a NAV_STATE."""
    turn = np.zeros((9, 9))
    turn[:3, :3] = turn[3:6, 3:6] = r_LW
    turn[6:, 6:] = r_LW @ r_WI
    return turn @ covariance[:9, :9] @ turn.T


def pose_covariance(local: FloatArray) -> FloatArray:
    """Upper triangle by rows of the covariance of x, y, z and the turns about the axes of L."""
    kept = [0, 1, 2, 6, 7, 8]
    return np.asarray(local[np.ix_(kept, kept)][_UPPER])


def velocity_covariance(local: FloatArray, r_BL: FloatArray, v_L_m_s: FloatArray) -> FloatArray:
    """Upper triangle by rows of the covariance of the velocity in B, which an error of the attitude turns as well.

    NaN where it speaks of the turn rates, which are not sent.
    """
    jacobian = r_BL @ np.hstack([np.eye(3), skew(v_L_m_s)])
    whole = np.full((6, 6), np.nan)
    whole[:3, :3] = jacobian @ local[3:, 3:] @ jacobian.T
    return np.asarray(whole[_UPPER])
