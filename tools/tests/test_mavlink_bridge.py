"""tools/mavlink_bridge over real sockets, a real serial line and real LCM."""

from __future__ import annotations

import os
import pty
import shutil
import signal
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lcm
import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink
from scipy.spatial.transform import Rotation

import sim_scenes
from mavlink_flight import PATIENCE_S, PERIOD_NS, START_NS, Autopilot, Event, output, state, write_log
from plumb_tools.mavlink.__main__ import main
from plumb_tools.message_types import types

ROOT = Path(__file__).resolve().parents[2]
REPLAY = ROOT / "build/flight/bin/plumb-replay"
LCM_URL = "udpm://239.255.76.67:7683?ttl=0"
#: The first byte of a packet of MAVLink 2.
MAGIC_V2 = 0xFD


@pytest.fixture(name="autopilot")
def fixture_autopilot() -> Iterator[Autopilot]:
    autopilot = Autopilot()
    yield autopilot
    autopilot.socket.close()


@contextmanager
def _bridge(*words: str | Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "plumb_tools.mavlink", *map(str, words)]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _made_up(count: int) -> list[tuple[int, Event]]:
    """A state at every eighth output of a flight straight ahead."""
    events = []
    for i in range(count):
        t_ns = START_NS + i * PERIOD_NS
        if i % 8 == 0:
            events.append((t_ns, state(t_ns, 0.01 * np.eye(15), range_measured_m=9.87)))
        events.append((t_ns, output(t_ns, p=np.array([0.032 * i, 0.0, 10.0]))))
    return events


def test_a_log_arrives_as_it_was_recorded(tmp_path: Path, autopilot: Autopilot) -> None:
    log = write_log(tmp_path / "flight.lcm", _made_up(250))
    with _bridge("--connect", autopilot.connect, "--log", log, "--system", "7") as process:
        sent = autopilot.received("ODOMETRY", at_least=50)
        assert process.wait(timeout=PATIENCE_S) == 0
        assert "50 ODOMETRY" in process.stderr.read()
    assert [one.time_usec for one in sent] == [(START_NS + 5 * i * PERIOD_NS) // 1000 for i in range(50)]
    np.testing.assert_allclose([(one.x, one.z) for one in sent], [(0.16 * i, -10.0) for i in range(50)], rtol=1e-6)
    assert {packet[0] for packet in autopilot.packets} == {MAGIC_V2}
    assert {packet[5] for packet in autopilot.packets} == {7}
    assert {packet[6] for packet in autopilot.packets} == {mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY}
    assert not autopilot.decoder.total_receive_errors


def test_a_live_flight_by_lcm_with_heartbeats_and_time(autopilot: Autopilot) -> None:
    try:
        sender = lcm.LCM(LCM_URL)
    except RuntimeError:
        pytest.skip("no network route to 239.255.76.67: ip route add 224.0.0.0/4 dev lo")
    ended = threading.Event()

    def fly() -> None:
        """States and outputs of now, by the flight clock, until the test has seen enough."""
        while not ended.wait(0.004):
            for event in (state(time.monotonic_ns(), np.eye(15)), output(time.monotonic_ns())):
                sender.publish(*event)

    flight = threading.Thread(target=fly)
    with _bridge("--connect", autopilot.connect, "--lcm", LCM_URL, "--rate", "30") as process:
        try:
            (idle,) = autopilot.received("HEARTBEAT", at_least=1)
            assert (idle.type, idle.autopilot) == (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID)
            assert idle.system_status == mavlink.MAV_STATE_STANDBY
            flight.start()
            assert autopilot.received("ODOMETRY", at_least=10)
            (active,) = autopilot.received("HEARTBEAT", at_least=1)
            assert active.system_status == mavlink.MAV_STATE_ACTIVE

            autopilot.socket.sendto(b"rubbish", autopilot.peer)
            before_ns = time.monotonic_ns()
            autopilot.send(mavlink.MAVLink_timesync_message(0, 123456789))
            (answer,) = autopilot.received("TIMESYNC", at_least=1)
            assert answer.ts1 == 123456789 and before_ns < answer.tc1 < time.monotonic_ns()
            # The stamps are of the clock that the answer tells, so the newest is of now.
            (odometry,) = autopilot.received("ODOMETRY", at_least=1)
            assert abs(time.monotonic_ns() / 1000 - odometry.time_usec) < 1e7
            process.send_signal(signal.SIGTERM)
            assert process.wait(timeout=PATIENCE_S) == 0
            assert "1 TIMESYNC" in process.stderr.read()
        finally:
            ended.set()
            if flight.ident is not None:
                flight.join()


def test_a_serial_line(tmp_path: Path) -> None:
    """A pseudo-terminal; when its other end is closed, the bridge says that it is gone."""
    log = write_log(tmp_path / "flight.lcm", _made_up(2500))
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    decoder = mavlink.MAVLink(None)
    decoder.robust_parsing = True
    seen = 0
    with _bridge("--connect", os.ttyname(theirs), "--log", log) as process:
        while seen < 5:
            messages = decoder.parse_buffer(os.read(ours, 4096)) or []
            seen += sum(message.get_type() == "ODOMETRY" for message in messages)
        os.close(theirs)
        os.close(ours)
        assert process.wait(timeout=PATIENCE_S) == 1
        told = process.stderr.read()
    assert "Traceback" not in told and "--connect /dev/pts/" in told


BAD = [
    (["--connect", "nonsense"], "--connect nonsense: no such device; expected udpout:HOST:PORT"),
    (["--connect", "udpout:127.0.0.1"], "no such device"),
    (["--connect", "udpout:127.0.0.1:99999"], "no such port; expected 1 to 65535"),
    (["--connect", "udpin:192.0.2.77:14550"], "cannot be opened"),
    (["--connect", "udpout:127.0.0.1:9", "--log", "/no/log"], "--log /no/log: No such file"),
    (["--connect", "udpout:127.0.0.1:9", "--log", __file__], "no message on NAV_STATE"),
    (["--connect", "udpout:127.0.0.1:9", "--lcm", "x://"], "--lcm x://: LCM cannot use it; expected a URL"),
    (["--connect", "udpout:127.0.0.1:9", "--fast"], "expected --log FILE"),
    (["--connect", "udpout:127.0.0.1:9", "--range-limits", "9", "2"], "expected the smaller first"),
]


@pytest.mark.parametrize(("words", "expected"), BAD, ids=[row[1][:30] for row in BAD])
def test_bad_arguments_are_named(words: list[str], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert expected in capsys.readouterr().err


def _recorded(folder: Path) -> Path:
    """A simulated flight of a few seconds, flown and recorded."""
    flight = sim_scenes.fly_yard(folder, 3.0)
    log = folder / "flight.lcm"
    subprocess.run([REPLAY, "--asl", flight, "--record", log], check=True, capture_output=True)
    shutil.rmtree(flight)
    return log


def _pairs(log: Path) -> dict[int, tuple[Any, Any]]:
    """Each output of a log by its stamp [us], with the state before it."""
    nav_state, nav_output = types().nav_state_t, types().nav_output_t
    newest, pairs = None, {}
    for event in lcm.EventLog(str(log), "r"):
        if event.channel == "NAV_STATE":
            newest = nav_state.decode(event.data)
        elif event.channel == "NAV_OUTPUT":
            recorded = nav_output.decode(event.data)
            pairs[recorded.time_ns // 1000] = recorded, newest
    return pairs


def _ranges(log: Path) -> list[tuple[int, int]]:
    """Each range with a return, by its stamp [ms] and in cm."""
    decode = types().input_frame_t.decode
    frames = (decode(event.data) for event in lcm.EventLog(str(log), "r") if event.channel == "INPUT_FRAME")
    samples = (sample for frame in frames for sample in frame.range[: frame.range_count] if sample.quality == 0)
    return [(sample.time_ns // 1_000_000 % 2**32, round(100.0 * sample.range_m)) for sample in samples]


def test_a_flight_arrives_with_the_numbers_of_its_log(tmp_path: Path, autopilot: Autopilot) -> None:
    if not REPLAY.is_file():
        pytest.skip("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    log = _recorded(tmp_path)
    with _bridge("--connect", autopilot.connect, "--log", log) as process:
        while process.poll() is None:
            autopilot.received("HEARTBEAT", within_s=0.3)
        autopilot.received("HEARTBEAT", within_s=0.3)
    odometry = autopilot.all_received("ODOMETRY")
    stamps = [one.time_usec for one in odometry]
    assert len(odometry) > 50 and np.all(np.diff(stamps) > 0)
    pairs = _pairs(log)
    span_us = stamps[-1] - stamps[0]
    assert abs(len(odometry) - span_us / 20_000) <= 2  # nothing missing at 50 Hz
    for one in odometry:
        recorded, newest = pairs[one.time_usec]
        mirror = np.array([1.0, -1.0, -1.0])
        np.testing.assert_allclose((one.x, one.y, one.z), mirror * recorded.p_WI_m, rtol=1e-6, atol=1e-5)
        v_I = Rotation.from_quat(recorded.q_WI, scalar_first=True).inv().apply(recorded.v_WI_m_s)
        np.testing.assert_allclose((one.vx, one.vy, one.vz), mirror * v_I, atol=1e-5)
        told = [one.pose_covariance[i] for i in (0, 6, 11)]
        np.testing.assert_allclose(told, [newest.covariance[16 * i] for i in range(3)], rtol=1e-6)
        assert one.reset_counter == newest.reset_count and one.quality in {100, 60, 10}
    distances = [one for one in autopilot.all_received("DISTANCE_SENSOR") if one.signal_quality == 100]
    assert [(one.time_boot_ms, one.current_distance) for one in distances] == _ranges(log)
