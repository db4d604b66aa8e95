"""Where the instruments sit on the vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from plumb_tools.sim.flight import Calibration
from plumb_tools.sim.motion import Motion
from plumb_tools.sim.sensors import Camera, RangeFinder
from plumb_tools.trajectory import FloatArray

#: Camera looking straight down, image up is forward: columns are x right, y down, z forward of C in I.
_NADIR = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@dataclass(frozen=True)
class Rig:
    """Camera C and range finder on the IMU I."""

    R_IC: FloatArray  #: (3, 3) from C to I
    p_IC_m: FloatArray  #: origin of C in I
    p_CR_m: FloatArray  #: origin of the beam in C
    u_C: FloatArray  #: unit direction of the beam in C

    def cameras(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Camera positions (N, 3) in W and rotations (N, 3, 3) from C to W."""
        return motion.p_WI_m + motion.R_WI @ self.p_IC_m, motion.R_WI @ self.R_IC

    def beams(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Origins (N, 3) and unit directions (N, 3) of the beam in W."""
        position, rotation = self.cameras(motion)
        return position + rotation @ self.p_CR_m, rotation @ self.u_C


def calibration(camera: Camera, on_board: Rig) -> Calibration:
    """The rig in the words of the flight's calibration."""
    lens = camera.lens
    count = {"none": 0, "fov": 1}.get(lens.model, 4)
    return Calibration(
        width=camera.width_px,
        height=camera.height_px,
        intrinsics=(*lens.focal_px, *lens.center_px),
        distortion_model=lens.model,
        distortion_coefficients=lens.coefficients[:count],
        q_IC_wxyz=tuple(Rotation.from_matrix(on_board.R_IC).as_quat(scalar_first=True).tolist()),
        p_IC_m=tuple(on_board.p_IC_m.tolist()),
        p_CR_m=tuple(on_board.p_CR_m.tolist()),
        u_C=tuple(on_board.u_C.tolist()),
    )


def rig(camera: Camera, lrf: RangeFinder) -> Rig:
    """The rig of a scene. Turning about the camera's x axis brings its view from the nadir towards the nose."""
    tilt = Rotation.from_euler("x", camera.forward_tilt_deg, degrees=True)
    misalignment = Rotation.from_rotvec(np.radians(camera.misalignment_deg))
    slopes = np.tan(np.radians(lrf.tilt_deg))
    beam = np.array([slopes[0], slopes[1], 1.0])
    return Rig(
        np.asarray(_NADIR @ tilt.as_matrix() @ misalignment.as_matrix()),
        np.array(camera.position_in_imu_m),
        np.array(lrf.origin_in_cam_m),
        beam / np.linalg.norm(beam),
    )
