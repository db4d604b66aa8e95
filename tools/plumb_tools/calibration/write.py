"""Writes a calibration in the two forms that Plumb reads: sensor.yaml files, and sections of a configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from plumb_tools import files
from plumb_tools.calibration.kalibr import Camera, Imu
from plumb_tools.trajectory import NS_PER_S, FloatArray, InputError, data_lines, read_text

CAMERA_FILE = Path("mav0/cam0/sensor.yaml")
IMU_FILE = Path("mav0/imu0/sensor.yaml")
IMAGES_FILE = Path("mav0/cam0/data.csv")
CONFIGURATION_FILE = Path("calibration.yaml")

_CONFIGURATION_NOTE = """\
# From {source}. These keys stand in the sections of the same name
# of a configuration of plumb-fsw (config/example.yaml).
"""
_SHIFT_NOTE = """\
# Images are to be stamped {shift_s:+.6f} s later, to be on the IMU's clock: that is not in these keys.
"""


def _pose(matrix: FloatArray) -> dict[str, Any]:
    return {"rows": 4, "cols": 4, "data": [float(value) for value in matrix.ravel()]}


def _camera(camera: Camera) -> dict[str, Any]:
    """The keys that both forms share; the body is the IMU."""
    return {
        "T_BS": _pose(camera.T_IC),
        "camera_model": "pinhole",
        "resolution": list(camera.resolution),
        "intrinsics": list(camera.intrinsics),
        "distortion_model": camera.distortion_model,
        "distortion_coefficients": list(camera.distortion_coefficients),
    }


def _imu(imu: Imu) -> dict[str, Any]:
    return {"T_BS": _pose(np.eye(4)), **imu.noise}


def _text(content: dict[str, Any]) -> str:
    return str(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=200))


def _shifted(images: Path, shift_s: float) -> str:
    """A table of images with their stamps on the IMU's clock."""
    shift_ns = round(shift_s * NS_PER_S)
    lines = ["#timestamp [ns],filename"]
    for number, line in data_lines(read_text(images)):
        stamp, comma, name = line.partition(",")
        if not comma or not stamp.strip().isdigit():
            raise InputError(f"{images}:{number}: {line[:40]!r}; expected a stamp in whole ns, a comma and a file name")
        lines.append(f"{int(stamp) + shift_ns},{name}")
    return "\n".join(lines) + "\n"


def write(folder: Path, camera: Camera, imu: Imu, source: str, images: Path | None) -> list[Path]:
    """Writes all files; InputError where one is there already, or cannot be written."""
    note = _CONFIGURATION_NOTE.format(source=source)
    if camera.shift_s != 0.0:
        note += _SHIFT_NOTE.format(shift_s=camera.shift_s)
    comment = {"comment": f"from {source}"}
    texts = {
        CAMERA_FILE: _text({"sensor_type": "camera", **comment, **_camera(camera)}),
        IMU_FILE: _text({"sensor_type": "imu", **comment, **_imu(imu), "rate_hz": imu.rate_hz}),
        CONFIGURATION_FILE: note + _text({"imu": _imu(imu), "camera": _camera(camera)}),
    }
    if images is not None:
        texts[IMAGES_FILE] = _shifted(images, camera.shift_s)
    paths = {folder / name: text for name, text in texts.items()}
    for path in paths:
        if path.exists():
            raise InputError(f"{path}: is there already; expected a folder without, or take it away first")
    for path, text in paths.items():
        files.write_text(path, text)
    return list(paths)
