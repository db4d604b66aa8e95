"""plumb-decode reads what the simulator's own encoder of STIM300 datagrams writes: two implementations, one data sheet."""

from __future__ import annotations

import csv
import io
import subprocess
from pathlib import Path

import numpy as np
import pytest

from devices_flight import made_up_flight
from plumb_tools.sim.devices.stim300 import Stim300Settings
from plumb_tools.sim.devices.stim300_stream import serial_chunks

DECODE = Path(__file__).resolve().parents[2] / "build" / "flight" / "bin" / "plumb-decode"

pytestmark = pytest.mark.skipif(not DECODE.is_file(), reason=f"{DECODE} is not built")


@pytest.mark.parametrize("incremental, crlf", [(False, True), (True, False)])
@pytest.mark.parametrize("accel_range_g", [5, 10, 30, 80])
def test_a_simulated_flight_comes_back(tmp_path: Path, incremental: bool, crlf: bool, accel_range_g: int) -> None:
    flight = made_up_flight()
    flight.imu_accel_m_s2 *= 0.1  # within 5 g
    settings = Stim300Settings(crlf=crlf, accel_range_g=accel_range_g, incremental=incremental)
    capture = tmp_path / "capture.bin"
    capture.write_bytes(b"".join(chunk.data for chunk in serial_chunks(flight, settings)))
    done = subprocess.run([DECODE, "stim300", capture], check=True, capture_output=True, text=True)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    used = rows[-len(flight.imu_t_ns) :]
    assert {row["gyro_status"] for row in used} == {row["accel_status"] for row in used} == {"0"}
    assert {row["gyro_status"] for row in rows[: -len(used)]} >= {"64"}

    def columns(name: str, unit: str) -> np.ndarray:
        return np.array([[float(row[f"{name}_{axis}_{unit}"]) for axis in "xyz"] for row in used])

    rate_hz = 250
    gyro_step = np.radians(rate_hz / 2.0**21 if incremental else 2.0**-14)
    bits = {5: 20, 10: 19, 30: 18, 80: 16}[accel_range_g]
    accel_step = rate_hz / 2.0 ** (bits + 3) if incremental else 9.80665 / 2.0**bits
    assert np.max(np.abs(columns("gyro", "rad_s") - flight.imu_gyro_rad_s)) <= 0.501 * gyro_step + 1e-8
    assert np.max(np.abs(columns("accel", "m_s2") - flight.imu_accel_m_s2)) <= 0.501 * accel_step + 1e-7
    t_s = np.array([float(row["t_s"]) for row in used])
    assert np.allclose(t_s - t_s[0], (flight.imu_t_ns - flight.imu_t_ns[0]) * 1e-9, atol=1e-4)
    assert f"plumb-decode: {len(rows)} measurements at 250 Hz" in done.stderr
    assert done.stderr.endswith("3 other datagrams, 0 checksum errors, 0 bytes skipped, 0 gaps (0 datagrams missing)\n")
