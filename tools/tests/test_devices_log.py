"""The log of device bytes: read back with LCM's own event log, in order, whole, and with every number in its place."""

from __future__ import annotations

import struct
import subprocess
import sys
from collections import Counter
from pathlib import Path

import lcm
import numpy as np
import pytest
from PIL import Image

from devices_flight import HEIGHT, WIDTH, CompleteFlight, MadeUpCalibration, MadeUpFlight, made_up_flight, write_images
from plumb_tools.message_types import types
from plumb_tools.sim.devices.can_range import CanRangeSettings
from plumb_tools.sim.devices.log import DeviceSettings, write_log
from plumb_tools.sim.devices.stim300 import Stim300Settings

SECONDS = 1.0


@pytest.fixture
def flight(tmp_path: Path) -> MadeUpFlight:
    made = made_up_flight(SECONDS)
    folder = tmp_path / "images"
    folder.mkdir()
    made.images = write_images(folder, SECONDS)
    return made


def read(path: Path) -> list[lcm.Event]:
    return list(lcm.EventLog(path))


def decoded(path: Path, channel: str, type_name: str) -> list:
    of_type = getattr(types(), type_name)
    return [of_type.decode(event.data) for event in read(path) if event.channel == channel]


@pytest.mark.parametrize("lrf, channel", [("lidar_lite", "RAW_LIDAR_LITE"), ("can", "RAW_CAN")])
def test_log_reads_back_in_order_with_its_counts(flight: MadeUpFlight, tmp_path: Path, lrf: str, channel: str) -> None:
    path = tmp_path / "flight.lcm"
    counts = write_log(flight, path, lrf)
    events = read(path)
    assert [event.eventnum for event in events] == list(range(len(events)))
    assert Counter(event.channel for event in events) == counts
    assert set(counts) == {"CALIBRATION", "RAW_STIM300", channel, "RAW_CAMERA", "CAMERA", "TRUTH"}
    assert events[0].channel == "CALIBRATION"
    stamps = [event.timestamp for event in events]
    assert stamps == sorted(stamps)
    assert counts["CALIBRATION"] == 1
    assert counts["RAW_STIM300"] == 3 + 175 + len(flight.imu_t_ns)
    assert counts["CAMERA"] == counts["RAW_CAMERA"] == len(flight.images)
    assert counts["TRUTH"] == len(flight.truth_t_ns)
    if lrf == "can":
        assert counts[channel] == 3 * len(flight.range_t_ns) + 1
    assert list(tmp_path.glob("*.partial")) == []


def test_stamps_of_the_events_are_those_of_the_arrivals(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path)
    channels = {"RAW_STIM300": "raw_bytes_t", "RAW_LIDAR_LITE": "i2c_transfer_t", "TRUTH": "truth_t"}
    for event in read(path):
        if event.channel in channels:
            message = getattr(types(), channels[event.channel]).decode(event.data)
            assert event.timestamp == message.time_ns // 1000


def test_serial_bytes_are_whole_in_the_log(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path)
    chunks = decoded(path, "RAW_STIM300", "raw_bytes_t")
    assert [chunk.bytes[0] for chunk in chunks[:4]] == [0xB1, 0xB5, 0xBC, 0x91]
    assert all(len(chunk.bytes) == 256 and not any(chunk.bytes[chunk.size :]) for chunk in chunks)
    samples = chunks[-len(flight.imu_t_ns) :]
    delay_ns = 7_950_000 + 506_000 + round(28 * 10 * 1e9 / 921600)  # of the filter, to the line, on the line
    assert [chunk.time_ns - delay_ns for chunk in samples] == flight.imu_t_ns.tolist()
    x_counts = [int.from_bytes(chunk.bytes[1:4], "big", signed=True) for chunk in samples]
    rates_deg_s = np.array(x_counts) * 250.0 / 2**21  # angles in the time of one sample
    assert np.max(np.abs(rates_deg_s - np.degrees(flight.imu_gyro_rad_s[:, 0]))) < 250.0 / 2**21


def test_transfers_of_the_range_finder_are_whole_in_the_log(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path)
    transfers = decoded(path, "RAW_LIDAR_LITE", "i2c_transfer_t")
    assert all(transfer.address == 0x62 and transfer.acknowledged for transfer in transfers)
    after_pointer = [
        read for write, read in zip(transfers, transfers[1:]) if not write.is_read and write.bytes[:1] == b"\x8f"
    ]
    assert all(transfer.is_read and transfer.size == 2 for transfer in after_pointer)
    ranges = [int.from_bytes(transfer.bytes[:2], "big") / 100.0 for transfer in after_pointer]
    assert np.max(np.abs(np.array(ranges) - flight.range_m)) <= 0.005001


def test_frames_of_the_can_bus_are_whole_in_the_log(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path, "can", settings=DeviceSettings(can_range=CanRangeSettings(node_id=125, priority=24)))
    frames = decoded(path, "RAW_CAN", "can_frame_t")
    measurements = [frame for frame in frames if frame.id == 0x18041A7D]
    assert all(frame.is_extended and len(frame.bytes) == 8 for frame in frames)
    assert [frame.size for frame in measurements] == [8, 8, 4] * len(flight.range_m)
    halves = [struct.unpack("<e", frame.bytes[1:3])[0] for frame in measurements[2::3]]
    assert np.allclose(halves, flight.range_m, rtol=2**-11, atol=0.0)


def test_images_are_whole_in_the_log(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path)
    images = decoded(path, "CAMERA", "image_t")
    buffers = decoded(path, "RAW_CAMERA", "camera_buffer_t")
    assert [image.time_ns for image in images] == [t_ns for t_ns, _ in flight.images]
    for image, buffer, (_, file) in zip(images, buffers, flight.images, strict=True):
        pixels = np.frombuffer(image.pixels, dtype=np.uint8).reshape(image.height, image.width)
        assert np.array_equal(pixels, np.asarray(Image.open(file)))
        assert (image.sequence, image.size) == (buffer.sequence, buffer.size)
        assert (buffer.width, buffer.height, buffer.stride) == (WIDTH, HEIGHT, WIDTH)
        assert struct.pack("<I", buffer.pixel_format) == b"GREY"
        assert buffer.flags == 0x2000
        exposure_ns = round(buffer.exposure_lines * 928 / 48e6 * 1e9)
        assert buffer.time_ns - buffer.readout_ns - exposure_ns // 2 == image.time_ns
    order = [event.channel for event in read(path) if event.channel in ("CAMERA", "RAW_CAMERA")]
    assert order == ["RAW_CAMERA", "CAMERA"] * len(images)


def test_truth_and_calibration_are_whole_in_the_log(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path)
    truth = decoded(path, "TRUTH", "truth_t")
    assert [state.time_ns for state in truth] == flight.truth_t_ns.tolist()
    assert np.array_equal([state.p_WI_m for state in truth], flight.truth_p_m)
    assert np.array_equal([state.v_WI_m_s for state in truth], flight.truth_v_m_s)
    assert np.array_equal([state.q_WI for state in truth], flight.truth_q_wxyz)
    assert np.all(np.isnan([state.b_gyro_rad_s for state in truth]))

    (calibration,) = decoded(path, "CALIBRATION", "calibration_t")
    expected = flight.calibration
    assert (calibration.width, calibration.height, calibration.distortion) == (WIDTH, HEIGHT, 1)
    assert (calibration.fx, calibration.fy, calibration.cx, calibration.cy) == expected.intrinsics
    assert tuple(calibration.coefficients) == expected.distortion_coefficients
    assert tuple(calibration.q_IC) == expected.q_IC_wxyz
    assert (tuple(calibration.p_IC_m), tuple(calibration.p_CR_m)) == (expected.p_IC_m, expected.p_CR_m)
    assert np.linalg.norm(calibration.u_C) == pytest.approx(1.0, abs=1e-12)
    assert calibration.u_C == pytest.approx(expected.u_C)
    assert calibration.focal_px == 40.5
    assert calibration.half_fov_x > 0.8


def test_true_biases_and_exposures_are_written_where_the_flight_has_them(flight: MadeUpFlight, tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    complete = CompleteFlight(
        **vars(flight),
        truth_b_gyro_rad_s=random.normal(size=(len(flight.truth_t_ns), 3)),
        truth_b_accel_m_s2=random.normal(size=(len(flight.truth_t_ns), 3)),
        image_exposure_s=np.full(len(flight.images), 5e-3),
        image_gain=np.full(len(flight.images), 2.5),
    )
    path = tmp_path / "flight.lcm"
    write_log(complete, path)
    truth = decoded(path, "TRUTH", "truth_t")
    assert np.array_equal([state.b_gyro_rad_s for state in truth], complete.truth_b_gyro_rad_s)
    assert np.array_equal([state.b_accel_m_s2 for state in truth], complete.truth_b_accel_m_s2)
    buffers = decoded(path, "RAW_CAMERA", "camera_buffer_t")
    assert {(buffer.exposure_lines, buffer.gain) for buffer in buffers} == {(259, 40)}


def test_same_flight_same_bytes(flight: MadeUpFlight, tmp_path: Path) -> None:
    write_log(flight, tmp_path / "one.lcm")
    write_log(flight, tmp_path / "two.lcm")
    assert (tmp_path / "one.lcm").read_bytes() == (tmp_path / "two.lcm").read_bytes()


def test_progress_rises_to_the_end(flight: MadeUpFlight, tmp_path: Path) -> None:
    fractions: list[float] = []
    write_log(flight, tmp_path / "flight.lcm", progress=fractions.append)
    assert fractions == sorted(set(fractions))
    assert fractions[-1] == 1.0
    assert 50 < len(fractions) <= 200


def test_a_failure_leaves_neither_a_log_nor_a_part_of_one(flight: MadeUpFlight, tmp_path: Path) -> None:
    flight.images[-1][1].unlink()
    path = tmp_path / "flight.lcm"
    with pytest.raises(FileNotFoundError):
        write_log(flight, path)
    assert list(tmp_path.glob("flight*")) == []


def test_an_interrupt_leaves_the_log_of_before(flight: MadeUpFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.lcm"
    write_log(flight, path)
    before = path.read_bytes()

    def interrupt(fraction: float) -> None:
        if fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_log(flight, path, "can", progress=interrupt)
    assert path.read_bytes() == before
    assert list(tmp_path.glob("*.partial")) == []


def test_a_full_disk_is_reported(flight: MadeUpFlight, tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    (tmp_path / "flight.lcm.partial").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left on device|is the disk full"):
        write_log(flight, tmp_path / "flight.lcm")
    assert list(tmp_path.glob("flight*")) == []


@pytest.mark.parametrize(
    "member, value, message",
    [
        ("imu_t_ns", np.array([5, 5]), "imu_t_ns: expected stamps in ns"),
        ("range_m", np.zeros(3), r"range_m: expected finite numbers of shape \(25,\), found shape \(3,\)"),
        ("truth_p_m", np.full((250, 3), np.nan), "truth_p_m: expected finite numbers"),
        ("truth_q_wxyz", np.ones((250, 4)), "truth_q_wxyz: expected unit quaternions"),
        ("imu_accel_m_s2", np.zeros((250, 2)), "imu_accel_m_s2: expected finite numbers of shape"),
        ("calibration", MadeUpCalibration(u_C=(0.0, 0.0, 2.0)), "calibration.u_C: expected 3 numbers of length 1"),
        ("calibration", MadeUpCalibration(distortion_model="omni"), "calibration.distortion_model: 'omni'"),
    ],
)
def test_what_cannot_be_written_is_named(
    flight: MadeUpFlight, tmp_path: Path, member: str, value: object, message: str
) -> None:
    setattr(flight, member, value)
    with pytest.raises(ValueError, match=message):
        write_log(flight, tmp_path / "flight.lcm")
    assert list(tmp_path.glob("flight*")) == []


def test_an_unknown_range_finder_is_refused(flight: MadeUpFlight, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="lrf: 'sonar'; expected lidar_lite or can"):
        write_log(flight, tmp_path / "flight.lcm", "sonar")


def test_devices_cannot_start_before_the_zero_of_the_clock(flight: MadeUpFlight, tmp_path: Path) -> None:
    flight.imu_t_ns = flight.imu_t_ns - flight.imu_t_ns[0]
    settings = DeviceSettings(stim300=Stim300Settings())
    with pytest.raises(ValueError, match="RAW_STIM300: the device would have to start"):
        write_log(flight, tmp_path / "flight.lcm", settings=settings)


def test_the_log_player_plays_it(flight: MadeUpFlight, tmp_path: Path) -> None:
    path, played = tmp_path / "flight.lcm", tmp_path / "played.lcm"
    counts = write_log(flight, path)
    player = [sys.executable, "-c", "from lcm import run_logplayer; run_logplayer()"]
    url = f"file://{played}?mode=w"
    done = subprocess.run([*player, "--speed", "20", "--lcm-url", url, str(path)], capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert Counter(event.channel for event in read(played)) == counts
