"""The package for 64-bit ARM in the virtual flight computer: it flies live with emulated devices that are pulled and put
back and, by tools/test --arm64, flies a log again and flies by what plumb-hil plays. What is brought back is judged here.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lcm
import numpy as np
import pytest
import yaml

import sim_scenes
from arm64_programs import EMULATOR, HOST, ROOT, expect_same_results, skip_unless_built, skip_unless_whole, whole
from plumb_tools.budget.__main__ import BUDGETS, read_budgets, verdict
from plumb_tools.budget.figures import said_at_the_end
from plumb_tools.message_types import types

SENSORS = ("imu", "camera", "range")  #: as SensorId in fsw/modes/sensor_health.h counts them
SILENT = 0
MODE_CHANGED, HEALTH_CHANGED = 16, 17
FAILED = 4  #: NavMode
MOST_SIGMAS = 3.0
DEVICE = {"imu0": {"device": "/tmp/imu"}, "cam0": {"device": "/dev/video9"}, "range0": {"can": "vcan0"}}


class Log:
    """The messages of an LCM event log by channel, in order."""

    def __init__(self, path: Path) -> None:
        self._events: dict[str, list[lcm.Event]] = {}
        for event in lcm.EventLog(str(path)):
            self._events.setdefault(event.channel, []).append(event)

    def messages(self, channel: str, type_name: str) -> list[Any]:
        return [getattr(types(), type_name).decode(event.data) for event in self._events[channel]]

    def stamps_ns(self, channel: str) -> list[int]:
        return [event.timestamp * 1000 for event in self._events[channel]]

    def serial_bytes(self) -> bytes:
        return b"".join(bytes(read.bytes[: read.size]) for read in self.messages("RAW_STIM300", "raw_bytes_t"))


@dataclass
class Flown:
    """What came back from the machine, and what replays with the package's programs in the emulator of one process."""

    out: Path
    replay: tuple[str, ...]


def _configuration(flight: Path) -> dict[str, Any]:
    """For who flies by what is played of a simulated flight: the keys of its sensor.yaml files are those of plumb-fsw."""
    log = Log(flight / "flight.lcmlog")
    middles = [image.time_ns for image in log.messages("CAMERA", "image_t")]
    sections = {}
    for name, sensor in (("imu", "imu0"), ("camera", "cam0"), ("range", "range0")):
        content = yaml.safe_load((flight / f"mav0/{sensor}/sensor.yaml").read_text(encoding="utf-8"))
        for key in ("sensor_type", "comment", *(["rate_hz"] if name == "range" else [])):
            del content[key]
        sections[name] = {**content, **DEVICE[sensor]}
    sections["camera"]["readout_ms"] = float(np.mean(np.subtract(log.stamps_ns("CAMERA"), middles))) * 1e-6
    return {"log": "hil.lcm", "lcm": "udpm://239.255.76.67:7667?ttl=0", **sections}


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    skip_unless_built("plumb-fsw", "plumb-replay")
    work = tmp_path_factory.mktemp("target")
    out = work / "out"
    out.mkdir()
    packed = subprocess.run([ROOT / "tools/package", "arm64-exact"], check=True, stdout=subprocess.PIPE, text=True)
    package = ROOT / packed.stdout.splitlines()[-1]
    program = ROOT / "build/package" / package.name.removesuffix(".tar.gz") / "bin/plumb-replay"
    replay = (*EMULATOR, str(program))
    if whole():
        _record(work, out, replay)
    shutil.copy(ROOT / "test/target/package_run.sh", out)
    target = [ROOT / "tools/target", "--package", package, "--out", out, "sh", "package_run.sh"]
    run = subprocess.run(target, check=False, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    return Flown(out, replay)


def _record(work: Path, out: Path, replay: tuple[str, ...]) -> None:
    """What is to be flown again and played there."""
    flight = sim_scenes.fly_yard(work, 8.0, with_log=True)
    recording = ["--asl", flight, "--record", out / "small.lcm", "--out", out / "small"]
    subprocess.run([*replay, *recording], check=True, capture_output=True)
    shutil.copy(flight / "flight.lcmlog", out / "played.lcm")
    (out / "hil.yaml").write_text(yaml.safe_dump(_configuration(flight)), encoding="utf-8")


@pytest.fixture
def played(flown: Flown) -> Flown:
    """For what only tools/test --arm64 does."""
    skip_unless_whole()
    return flown


def test_every_program_of_the_package_runs(flown: Flown) -> None:
    status = (flown.out / "status.txt").read_text().splitlines()
    helped = {Path(line.split()[0]).name for line in status if "--help" in line}
    assert helped == {"plumb-decode", "plumb-fsw", "plumb-hil", "plumb-replay", "plumb-stim300-setup"}
    assert [line for line in status if not line.endswith(": 0")] == []
    dry_run = (flown.out / "dry-run.txt").read_text()
    assert "can be flown" in dry_run
    assert "key 'range.can': can0 stays off the bus once it is bus-off (restart-ms 0); expected" in dry_run
    assert "restart-ms" not in (flown.out / "can.txt").read_text(), "vcan0 has no controller"


def test_a_log_is_flown_to_the_same_bits_as_in_an_emulated_process(played: Flown) -> None:
    assert ", all equal" in (played.out / "again.txt").read_text()
    expect_same_results(played.out / "small", played.out / "again")


def _expect_equal_replay(log: Path, again: Path, *replay: str) -> None:
    command = [*replay, "--log", log, "--record", again]
    run = subprocess.run(command, check=True, capture_output=True, text=True)
    assert ", all equal" in run.stdout
    subprocess.run([ROOT / "tools/hashdiff", log, again], check=True, capture_output=True)


@pytest.mark.parametrize("log, how", [("flight.lcm", "frames"), ("flight.lcm", "raw"), ("can.lcm", "raw")])
def test_the_log_of_a_flight_there_replays_bit_by_bit(flown: Flown, tmp_path: Path, log: str, how: str) -> None:
    """From the input frames and from the devices' bytes, in the emulator of one process."""
    _expect_equal_replay(flown.out / log, tmp_path / log, *flown.replay, *(["--raw"] if how == "raw" else []))


@pytest.mark.parametrize("log", ["flight.lcm", "can.lcm", "hil.lcm"])
def test_the_log_of_a_flight_there_replays_bit_by_bit_on_another_processor(
    played: Flown, tmp_path: Path, log: str
) -> None:
    _expect_equal_replay(played.out / log, tmp_path / log, str(HOST / "plumb-replay"), "--raw")


def test_the_log_of_a_flight_by_what_is_played_replays_bit_by_bit(played: Flown, tmp_path: Path) -> None:
    _expect_equal_replay(played.out / "hil.lcm", tmp_path / "again.lcm", *played.replay)


def test_memory_stacks_and_page_faults_of_a_flight_there_are_within_budget(flown: Flown) -> None:
    _expect_within_budget(flown.out / "flight.txt")


def test_memory_stacks_and_page_faults_of_a_played_flight_are_within_budget(played: Flown) -> None:
    _expect_within_budget(played.out / "hil-flight.txt")


def _expect_within_budget(said: Path) -> None:
    """With telemetry and commands over LCM, and every sensor that the vehicle may have."""
    figures = {figure.key: figure for figure in said_at_the_end(said.read_text())}
    threads = {f"thread.{name}" for name in ("imu", "tick", "camera", "range", "nav", "log", "command")}
    assert figures.keys() == {"memory.flight", "faults.flight"} | threads
    budgets = read_budgets(BUDGETS)
    assert [told for key, figure in figures.items() if (told := verdict(figure, budgets[key])) == "over budget"] == []


def _silences(log: Log) -> dict[str, tuple[int, int]]:
    """When each sensor fell silent, and when it was heard again [ns], by what EVENTS tell."""
    found: dict[str, tuple[int, int]] = {}
    began: dict[str, int] = {}
    for event in log.messages("EVENTS", "event_t"):
        if event.id != HEALTH_CHANGED:
            continue
        sensor, before, now = event.arguments[:3]
        if now == SILENT:
            began[SENSORS[sensor]] = event.time_ns
        elif before == SILENT and SENSORS[sensor] in began:
            found[SENSORS[sensor]] = (began[SENSORS[sensor]], event.time_ns)
    return found


def test_each_device_that_is_pulled_is_missed_and_heard_again(flown: Flown) -> None:
    assert _silences(Log(flown.out / "flight.lcm")).keys() == set(SENSORS)
    assert _silences(Log(flown.out / "can.lcm")).keys() == {"range"}


def test_an_adapter_that_went_with_its_device_is_told(flown: Flown) -> None:
    faults = re.search("faults of the LIDAR-Lite: .*", (flown.out / "flight.txt").read_text())
    assert faults is not None and "gone 1 (last: No such file or directory)" in faults[0]


@pytest.mark.parametrize("name, sensor", [("flight.lcm", "camera"), ("flight.lcm", "range"), ("can.lcm", "range")])
def test_the_state_goes_on_without_camera_or_range(flown: Flown, name: str, sensor: str) -> None:
    log = Log(flown.out / name)
    begin, end = _silences(log)[sensor]
    states = [state for state in log.messages("NAV_OUTPUT", "nav_output_t") if begin <= state.time_ns < end]
    frames = [frame for frame in log.messages("INPUT_FRAME", "input_frame_t") if begin <= frame.time_ns < end]
    assert len(states) >= 0.9 * len(frames) > 0
    assert all(state.valid for state in states)
    assert len({state.reset_count for state in states}) == 1


def test_without_an_imu_it_says_so_and_comes_back(flown: Flown) -> None:
    log = Log(flown.out / "flight.lcm")
    begin, end = _silences(log)["imu"]
    modes = [event for event in log.messages("EVENTS", "event_t") if event.id == MODE_CHANGED]
    assert any(event.arguments[1] == FAILED and event.time_ns < end for event in modes)
    # Without a state to act on there is still one for each tick, marked as not valid (docs/executive.md).
    outputs = log.messages("NAV_OUTPUT", "nav_output_t")
    silent = [state for state in outputs if begin < state.time_ns < end]
    frames = [frame for frame in log.messages("INPUT_FRAME", "input_frame_t") if begin < frame.time_ns < end]
    assert len(silent) >= 0.9 * len(frames) > 0
    assert all(not state.valid and state.mode == FAILED and state.reliable_for_s == 0.0 for state in silent)
    states = [state for state in outputs if state.time_ns > end]
    assert states[-1].valid and states[-1].mode != FAILED


def _missed_images(played: Flown) -> int:
    """How many were played before the camera was heard."""
    sent, received = (Log(played.out / name).stamps_ns("CAMERA") for name in ("played.lcm", "hil.lcm"))
    return len(sent) - len(received)


def test_what_is_played_arrives_byte_for_byte(played: Flown) -> None:
    sent, received = Log(played.out / "played.lcm"), Log(played.out / "hil.lcm")
    assert received.serial_bytes() == sent.serial_bytes()
    images, received_images = (log.messages("CAMERA", "image_t") for log in (sent, received))
    missed = _missed_images(played)
    assert missed < 20, "a camera that is silent is asked again every 0.1 s"
    assert [image.pixels for image in received_images] == [image.pixels for image in images[missed:]]
    frames, received_frames = (
        [(frame.id, bytes(frame.bytes[: frame.size])) for frame in log.messages("RAW_CAN", "can_frame_t")]
        for log in (sent, received)
    )
    measurements = {identifier for identifier, _ in received_frames}  # others are not for a range finder's driver
    assert received_frames == [frame for frame in frames if frame[0] in measurements]
    assert len(received_frames) > 0.9 * len(frames)
    report = (played.out / "hil.txt").read_text()
    assert report.count("dropped 0, not understood 0, lag mean") == 3, report


def test_who_flies_by_what_is_played_finds_what_a_replay_finds(played: Flown) -> None:
    """Stamps differ by what the machine makes of them, so that states are not the same bits, but the same flight.

    The world begins where a filter starts, which is at another image where the first ones were missed.
    """
    replayed, live = (
        {
            state.sequence + missed: state
            for state in Log(played.out / name).messages("NAV_STATE", "nav_state_t")
            if state.valid
        }
        for name, missed in (("small.lcm", 0), ("hil.lcm", _missed_images(played)))
    )
    both = sorted(replayed.keys() & live.keys())
    assert len(both) > 0.8 * len(replayed)
    start = np.array(replayed[both[0]].p_WI_m) - np.array(live[both[0]].p_WI_m)
    for image in both:
        a, b = replayed[image], live[image]
        variance = sum(np.diag(np.reshape(state.covariance, (15, 15)))[:6] for state in (a, b))
        difference = np.array([*a.p_WI_m, *a.v_WI_m_s]) - np.array([*b.p_WI_m, *b.v_WI_m_s])
        difference[:3] -= start
        assert np.all(np.abs(difference) <= MOST_SIGMAS * np.sqrt(variance)), f"image {image}: {difference}"
