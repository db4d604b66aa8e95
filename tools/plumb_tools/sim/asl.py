"""Writes a flight in the ASL (EuRoC) layout with the added range sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from scipy.spatial.transform import Rotation

from plumb_tools.sim import imu as imu_model
from plumb_tools.sim import lrf as lrf_model
from plumb_tools.sim.flight import SimulatedFlight
from plumb_tools.trajectory import FloatArray

_IMU_HEADER = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)
_TRUTH_HEADER = (
    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
    "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],"
    "b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],"
    "b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]"
)


def _write_csv(path: Path, header: str, t_ns: npt.NDArray[np.int64], columns: FloatArray, digits: str) -> None:
    row = ",".join([digits] * columns.shape[1])
    with path.open("w", encoding="ascii") as file:
        file.write(header + "\n")
        for stamp, values in zip(t_ns.tolist(), columns.tolist(), strict=True):
            file.write(f"{stamp},{row % tuple(values)}\n")


def _write_yaml(path: Path, content: dict[str, object]) -> None:
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=200), encoding="utf-8")


def _transform(rotation: FloatArray, translation: FloatArray) -> dict[str, object]:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation
    return {"cols": 4, "rows": 4, "data": [float(value) for value in matrix.ravel()]}


def folder(root: Path, name: str) -> Path:
    """A sensor's folder, made if need be."""
    path = root / "mav0" / name
    path.mkdir(parents=True, exist_ok=True)
    return path


def _write_imu(root: Path, flight: SimulatedFlight) -> None:
    """imu0. The body frame is the IMU's."""
    imu, path = flight.scene.sensors.imu, folder(root, "imu0")
    gyro_density, accel_density = imu_model.effective_densities(imu)
    gyro_bias, accel_bias = imu_model.effective_biases(imu, flight.scene.scene.gravity_m_s2)
    _write_yaml(
        path / "sensor.yaml",
        {
            "sensor_type": "imu",
            "comment": "simulated; noise densities include the rotors' broadband vibration",
            "T_BS": _transform(np.eye(3), np.zeros(3)),
            "rate_hz": imu.rate_hz,
            "gyroscope_noise_density": gyro_density,
            "gyroscope_random_walk": imu.gyro_bias_walk,
            "accelerometer_noise_density": accel_density,
            "accelerometer_random_walk": imu.accel_bias_walk,
            "gyroscope_bias_stddev": gyro_bias,
            "accelerometer_bias_stddev": accel_bias,
            "gravity_mps2": flight.scene.scene.gravity_m_s2,
        },
    )
    values = np.hstack([flight.imu_gyro_rad_s, flight.imu_accel_m_s2])
    _write_csv(path / "data.csv", _IMU_HEADER, flight.imu_t_ns, values, "%.10g")


def _write_range(root: Path, flight: SimulatedFlight) -> None:
    """range0: 0 is no return."""
    lrf, path = flight.scene.sensors.lrf, folder(root, "range0")
    _write_yaml(
        path / "sensor.yaml",
        {
            "sensor_type": "range",
            "comment": f"simulated {lrf.device}; 0 = no return; noise includes quantisation",
            "rate_hz": lrf.rate_hz,
            "noise_stddev_m": lrf_model.effective_noise_m(lrf),
            "max_range_m": lrf.max_range_m,
            "axis_in_cam": list(flight.calibration.u_C),
            "origin_in_cam_m": list(flight.calibration.p_CR_m),
        },
    )
    _write_csv(path / "data.csv", "#timestamp [ns],range [m]", flight.range_t_ns, flight.range_m[:, None], "%.6g")


def _write_camera(root: Path, flight: SimulatedFlight) -> None:
    """cam0 without the images themselves, which are there already."""
    camera, path = flight.calibration, folder(root, "cam0")
    R_IC = Rotation.from_quat(camera.q_IC_wxyz, scalar_first=True).as_matrix()
    _write_yaml(
        path / "sensor.yaml",
        {
            "sensor_type": "camera",
            "comment": "simulated; stamps are the middle of the exposure",
            "T_BS": _transform(R_IC, np.array(camera.p_IC_m)),
            "rate_hz": flight.scene.sensors.camera.rate_hz,
            "resolution": [camera.width, camera.height],
            "camera_model": "pinhole",
            "intrinsics": list(camera.intrinsics),
            "distortion_model": camera.distortion_model,
            "distortion_coefficients": list(camera.distortion_coefficients),
        },
    )
    with (path / "data.csv").open("w", encoding="ascii") as file:
        file.write("#timestamp [ns],filename\n")
        file.writelines(f"{stamp},{image.name}\n" for stamp, image in flight.images)
    with (path / "exposure.csv").open("w", encoding="ascii") as file:
        file.write("#timestamp [ns],exposure [s],gain []\n")
        rows = zip(flight.images, flight.image_exposure_s.tolist(), flight.image_gain.tolist(), strict=True)
        file.writelines(f"{stamp},{exposure:.6g},{gain:.6g}\n" for (stamp, _), exposure, gain in rows)


def _write_truth(root: Path, flight: SimulatedFlight) -> None:
    """state_groundtruth_estimate0 at the IMU's instants, with the true biases."""
    path = folder(root, "state_groundtruth_estimate0")
    _write_yaml(
        path / "sensor.yaml",
        {
            "sensor_type": "visual-inertial",
            "comment": "simulated: exact",
            "T_BS": _transform(np.eye(3), np.zeros(3)),
        },
    )
    columns = (
        flight.truth_p_m,
        flight.truth_q_wxyz,
        flight.truth_v_m_s,
        flight.truth_b_gyro_rad_s,
        flight.truth_b_accel_m_s2,
    )
    _write_csv(path / "data.csv", _TRUTH_HEADER, flight.truth_t_ns, np.hstack(columns), "%.12g")


def write(root: Path, flight: SimulatedFlight) -> None:
    """Everything but the images."""
    _write_imu(root, flight)
    _write_range(root, flight)
    _write_camera(root, flight)
    _write_truth(root, flight)
