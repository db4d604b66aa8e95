"""tools/import kalibr: a rig that is known comes out as it is, by the flight software's own readers."""

from __future__ import annotations

import copy
import json
import subprocess
from pathlib import Path
from typing import Any

import lcm
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import made_flight
from plumb_tools.calibration.__main__ import main
from plumb_tools.message_types import types

ROOT = Path(__file__).resolve().parents[2]
BIN = ROOT / "build/flight/bin"

#: Where the camera is in the IMU's frame, and how it is turned: looks down, a little askew.
P_IC_M = np.array([0.11, -0.02, 0.035])
R_IC = Rotation.from_euler("x", 180.0, degrees=True) * Rotation.from_rotvec([0.01, -0.02, 0.03])
SHIFT_S = -0.00425

IMU: dict[str, Any] = {
    "rostopic": "/imu0",
    "update_rate": 250.0,
    "gyroscope_noise_density": 4.4e-5,
    "gyroscope_random_walk": 2.0e-6,
    "accelerometer_noise_density": 1.2e-3,
    "accelerometer_random_walk": 1.0e-4,
}


def _T_cam_imu() -> list[list[float]]:
    """What takes a point from the IMU's frame to the camera's: as many equations as unknowns, from four points."""
    in_imu = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    in_camera = R_IC.inv().apply(in_imu - P_IC_M)
    return list(np.linalg.solve(_ones(in_imu), _ones(in_camera)).T.tolist())


def _ones(points: np.ndarray) -> np.ndarray:
    return np.hstack([points, np.ones((len(points), 1))])


def _camchain() -> dict[str, Any]:
    camera = {
        "cam_overlaps": [],
        "camera_model": "pinhole",
        "distortion_coeffs": [-0.28, 0.07, 2e-4, -1e-4],
        "distortion_model": "radtan",
        "intrinsics": [100.5, 101.5, 80.25, 59.75],
        "resolution": [made_flight.WIDTH, made_flight.HEIGHT],
        "rostopic": "/cam0/image_raw",
        "timeshift_cam_imu": SHIFT_S,
        "T_cam_imu": _T_cam_imu(),
    }
    return {"cam0": camera}


def _write(folder: Path, camchain: object, imu: object) -> list[str]:
    paths = folder / "camchain-imucam.yaml", folder / "imu.yaml"
    for path, content in zip(paths, (camchain, imu), strict=True):
        path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return ["kalibr", *map(str, paths)]


def _imported(folder: Path, camchain: object, imu: object, *options: str) -> Path:
    out = folder / "out"
    assert main([*_write(folder, camchain, imu), "--out", str(out), *options]) == 0
    return out


def _camera(out: Path) -> dict[str, Any]:
    return dict(yaml.safe_load((out / "mav0/cam0/sensor.yaml").read_text()))


def test_the_camera_is_where_it_is(tmp_path: Path) -> None:
    camera = _camera(_imported(tmp_path, _camchain(), IMU))
    T_BS = np.reshape(camera["T_BS"]["data"], (4, 4))
    np.testing.assert_allclose(T_BS[:3, 3], P_IC_M, atol=1e-12)
    np.testing.assert_allclose(T_BS[:3, :3], R_IC.as_matrix(), atol=1e-12)
    assert list(T_BS[3]) == [0, 0, 0, 1]


def test_the_other_key_is_the_inverse(tmp_path: Path) -> None:
    """OpenVINS' files, with the directive of OpenCV at their beginning."""
    camchain = _camchain()
    T_imu_cam = np.linalg.inv(camchain["cam0"].pop("T_cam_imu"))
    camchain["cam0"]["T_imu_cam"] = T_imu_cam.tolist()
    imu = {"imu0": IMU | {"T_i_b": np.eye(4).tolist()}}
    out = _imported(tmp_path, "%YAML:1.0\n---\n" + yaml.safe_dump(camchain), imu)
    np.testing.assert_allclose(_camera(out)["T_BS"]["data"], T_imu_cam.ravel(), atol=1e-9)


@pytest.mark.parametrize(
    ("kalibr", "coefficients", "plumb"),
    [
        ("radtan", [-0.28, 0.07, 2e-4, -1e-4], "radial-tangential"),
        ("equidistant", [0.01, -0.02, 0.03, -0.04], "equidistant"),
        ("fov", [0.9], "fov"),
        ("none", [], "none"),
    ],
)
def test_lens_models_have_other_names(tmp_path: Path, kalibr: str, coefficients: list[float], plumb: str) -> None:
    camchain = _camchain()
    camchain["cam0"] |= {"distortion_model": kalibr, "distortion_coeffs": coefficients}
    camera = _camera(_imported(tmp_path, camchain, IMU))
    assert (camera["distortion_model"], camera["distortion_coefficients"]) == (plumb, coefficients)


def test_a_late_stamp_becomes_earlier(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Kalibr's shift is negative where the camera's stamp is later than the IMU's clock."""
    images = tmp_path / "data.csv"
    images.write_text("#timestamp [ns],filename\n1403636579763555584,a.png\n1403636579813555456,b.png\n")
    out = _imported(tmp_path, _camchain(), IMU, "--images", str(images))
    rows = (out / "mav0/cam0/data.csv").read_text().splitlines()
    assert rows == ["#timestamp [ns],filename", "1403636579759305584,a.png", "1403636579809305456,b.png"]
    assert "warning" not in capsys.readouterr().err
    assert "-0.004250 s later" in (out / "calibration.yaml").read_text()


def test_a_shift_that_nobody_applied_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _imported(tmp_path, _camchain(), IMU)
    assert "warning: images are to be stamped -0.004250 s later" in capsys.readouterr().err


Change = dict[str, Any]
BAD: list[tuple[Change, Change, str]] = [
    ({"camera_model": "omni"}, {}, "cam0.camera_model: 'omni'; expected one of pinhole"),
    ({"distortion_model": "plumb"}, {}, "cam0.distortion_model: 'plumb'; expected one of radtan, equidistant"),
    ({"distortion_coeffs": [0.1]}, {}, "cam0.distortion_coeffs: [0.1]; expected 4 numbers, as radtan has"),
    ({"intrinsics": [1, 2, "c", 4]}, {}, "cam0.intrinsics: [1, 2, 'c', 4]; expected fx, fy, cx, cy in px"),
    ({"intrinsics": [-1, 100, 80, 60]}, {}, "expected focal lengths above 0 px"),
    ({"intrinsics": [100, 100, 800, 60]}, {}, "expected a principal point within 160 x 120 px"),
    ({"resolution": [160.5, 120]}, {}, "cam0.resolution: [160.5, 120]; expected width and height in whole px"),
    ({"resolution": None}, {}, "cam0.resolution: is missing; expected width and height in px"),
    ({"T_cam_imu": None}, {}, "cam0.T_cam_imu: is missing; expected a calibration with the IMU"),
    ({"T_cam_imu": np.diag([2, 1, 1, 1]).tolist()}, {}, "expected four rows of four numbers: a rotation"),
    ({"T_cam_imu": np.diag([-1, 1, 1, 1]).tolist()}, {}, "expected four rows of four numbers: a rotation"),
    ({"T_cam_imu": [[1, 0, 0, 110], *np.eye(4).tolist()[1:]]}, {}, "a translation in m (less than 50)"),
    ({"T_cam_imu": np.eye(3).tolist()}, {}, "expected four rows of four numbers"),
    ({"T_imu_cam": np.eye(4).tolist()}, {}, "cam0.T_imu_cam: beside T_cam_imu; expected one of the two"),
    ({"timeshift_cam_imu": 4.25}, {}, "cam0.timeshift_cam_imu: 4.25; expected seconds to be added to an image's stamp"),
    ({}, {"gyroscope_noise_density": 0.0}, "gyroscope_noise_density: 0.0; expected a number above 0"),
    ({}, {"accelerometer_random_walk": None}, "accelerometer_random_walk: is missing"),
    ({}, {"update_rate": "fast"}, "update_rate: 'fast'; expected samples a second"),
    ({}, {"T_i_b": (2 * np.eye(4)).tolist()}, "T_i_b: "),
]


def _changed(content: dict[str, Any], changes: Change) -> dict[str, Any]:
    return {key: value for key, value in (content | changes).items() if value is not None}


@pytest.mark.parametrize(("camera", "imu", "expected"), BAD, ids=[str(row[2])[:40] for row in BAD])
def test_what_is_wrong_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], camera: Change, imu: Change, expected: str
) -> None:
    camchain = {"cam0": _changed(_camchain()["cam0"], camera)}
    words = _write(tmp_path, camchain, _changed(copy.deepcopy(IMU), imu))
    assert main([*words, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"import: {words[2 if imu else 1]}: ") and expected in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("camchain", "options", "expected"),
    [
        ("cam0: [", [], "camchain-imucam.yaml:1: "),
        ("just text", [], "is no map; expected the camchain-imucam.yaml"),
        ({"cam1": {}}, [], "cam0: is no section, it has cam1; expected"),
        (_camchain(), ["--camera", "cam1"], "cam1: is no section, it has cam0; expected"),
        (_camchain(), ["--images", "/no/data.csv"], "/no/data.csv: no such file"),
        (_camchain(), ["--images", __file__], ":1: "),
        ("cam0: {resolution: [1, 2], resolution: [3, 4]}", [], ":1: key 'resolution' is given twice"),
    ],
)
def test_files_that_cannot_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], camchain: object, options: list[str], expected: str
) -> None:
    assert main([*_write(tmp_path, camchain, IMU), "--out", str(tmp_path / "out"), *options]) == 2
    assert expected in capsys.readouterr().err


def test_nothing_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = _imported(tmp_path, _camchain(), IMU)
    (out / "mav0/cam0/sensor.yaml").unlink()
    assert main([*_write(tmp_path, _camchain(), IMU), "--out", str(out)]) == 2
    assert "imu0/sensor.yaml: is there already" in capsys.readouterr().err
    assert not (out / "mav0/cam0/sensor.yaml").exists()


def _program(name: str) -> Path:
    if not (BIN / name).is_file():
        pytest.skip(f"{name} is not built: cmake --preset flight && cmake --build --preset flight")
    return BIN / name


def test_the_replay_flies_with_it(tmp_path: Path) -> None:
    """What the flight software makes of the files is in its log and its summary."""
    flight = made_flight.write_flight(tmp_path / "flight")
    for sensor in ("cam0", "imu0"):
        (flight / "mav0" / sensor / "sensor.yaml").unlink()
    assert main([*_write(tmp_path, _camchain(), IMU), "--out", str(flight)]) == 0
    command = [_program("plumb-replay"), "--asl", flight, "--out", tmp_path / "run", "--record", tmp_path / "log"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "key" not in done.stderr  # none that nothing knows
    parameters = json.loads((tmp_path / "run/summary.json").read_text())["parameters"]
    assert parameters["imu.gyro_noise_density"] == IMU["gyroscope_noise_density"]
    assert parameters["imu.accel_bias_walk"] == IMU["accelerometer_random_walk"]
    event = next(event for event in lcm.EventLog(str(tmp_path / "log"), "r") if event.channel == "CALIBRATION")
    calibration = types().calibration_t.decode(event.data)
    np.testing.assert_allclose(calibration.p_IC_m, P_IC_M, atol=1e-12)
    turn = Rotation.from_quat(calibration.q_IC, scalar_first=True)
    assert (turn * R_IC.inv()).magnitude() < 1e-9
    assert (calibration.fx, calibration.fy, calibration.cx, calibration.cy) == (100.5, 101.5, 80.25, 59.75)
    assert calibration.distortion == 1 and list(calibration.coefficients) == [-0.28, 0.07, 2e-4, -1e-4]


def test_plumb_fsw_takes_its_sections(tmp_path: Path) -> None:
    out = _imported(tmp_path, _camchain(), IMU)
    configuration = yaml.safe_load((ROOT / "config/example.yaml").read_text())
    configuration["camera"]["model"] = "any"  # of another size than an OV7251, whose exposure it has not either
    del configuration["camera"]["longest_exposure_ms"]
    for section, keys in yaml.safe_load((out / "calibration.yaml").read_text()).items():
        configuration[section] |= keys
    path = tmp_path / "flight.yaml"
    for rate_hz, expected in ((250, 0), (1, 2)):  # and it would say so if something were wrong
        configuration["imu"]["rate_hz"] = rate_hz
        path.write_text(yaml.safe_dump(configuration))
        done = subprocess.run([_program("plumb-fsw"), "--dry-run", path], capture_output=True, text=True, check=False)
        assert done.returncode == expected, done.stderr
