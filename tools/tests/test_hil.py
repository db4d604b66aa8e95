"""plumb-hil on this machine: a pseudo-terminal gets a recording's bytes in the order of time, and bad input is named."""

from __future__ import annotations

import os
import subprocess
import tty
from pathlib import Path

import lcm
import pytest

from devices_flight import made_up_flight, write_images
from plumb_tools.message_types import types
from plumb_tools.sim.devices.log import write_log

PLAYER = Path(__file__).resolve().parents[2] / "build/flight/bin/plumb-hil"
SECONDS = 1.0


@pytest.fixture(autouse=True)
def _built() -> None:
    if not PLAYER.is_file():
        pytest.skip("plumb-hil is not built: cmake --preset flight && cmake --build --preset flight")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recording")
    made = made_up_flight(SECONDS)
    made.images = write_images(folder, SECONDS)
    write_log(made, folder / "flight.lcm", "can")
    return folder / "flight.lcm"


def _serial_bytes(log: Path) -> bytes:
    """In the order of time."""
    events = [event for event in lcm.EventLog(str(log)) if event.channel == "RAW_STIM300"]
    events.sort(key=lambda event: event.timestamp)
    reads = [types().raw_bytes_t.decode(event.data) for event in events]
    return b"".join(bytes(read.bytes[: read.size]) for read in reads)


def _play(log: Path, work: Path, *more: str) -> tuple[bytes, str]:
    """What came out of the line, and what the player said."""
    link = work / "imu"
    command = [PLAYER, log, "--pty", link, "--delay", "0.3", *more]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as player:
        assert player.stdout is not None
        said = player.stdout.readline()  # it is said when the line is there
        line = os.open(link, os.O_RDONLY | os.O_NOCTTY)
        tty.setraw(line)
        received = b""
        try:
            while part := os.read(line, 4096):
                received += part
        except OSError:  # hung up
            pass
        os.close(line)
        said += player.stdout.read()
        assert player.wait() == 0
    assert not link.is_symlink()
    return received, said


def test_a_line_gets_the_bytes_of_the_recording(log: Path, tmp_path: Path) -> None:
    received, said = _play(log, tmp_path, "--rate", "4")
    assert received == _serial_bytes(log)
    assert "dropped 0, not understood 0" in said
    assert "CAMERA       20 messages are not played" in said


def test_what_stands_in_another_order_is_played_in_that_of_time(log: Path, tmp_path: Path) -> None:
    """The queues to a log are emptied one after the other."""
    events = list(lcm.EventLog(str(log)))
    mixed = lcm.EventLog(str(tmp_path / "mixed.lcm"), "w")
    for first in range(0, len(events), 50):
        for event in reversed(events[first : first + 50]):
            mixed.write_event(event.timestamp, event.channel, event.data)
    mixed.close()
    received, _ = _play(tmp_path / "mixed.lcm", tmp_path, "--rate", "4")
    assert sorted(received) == sorted(_serial_bytes(log))
    samples = slice(-28 * 200, None)  # no two of these arrive in the same microsecond
    assert received[samples] == _serial_bytes(log)[samples]


def test_registers_hold_what_was_read_of_them_last(tmp_path: Path) -> None:
    """In a file of the size of the kernel's memory; no controller that can be a device is here."""
    log, memory = tmp_path / "flight.lcm", tmp_path / "slave-eeprom"
    made = made_up_flight(SECONDS)
    write_log(made, log, "lidar_lite")
    memory.write_bytes(bytes(256))
    run = subprocess.run([PLAYER, log, "--i2c", memory, "--rate", "20"], check=True, capture_output=True, text=True)
    assert "dropped 0, not understood 0" in run.stdout
    content = memory.read_bytes()
    assert len(content) == 256
    assert abs(int.from_bytes(content[0x8F:0x91], "big") / 100.0 - made.range_m[-1]) <= 0.005001


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "no interface is given; expected --serial, --pty, --can, --i2c or --video"),
        (["--can", "none0"], "--can none0: "),
        (["--video", "/dev/null"], "--video /dev/null: takes no grey images of 64 x 48"),
        (["--i2c", "none"], "--i2c none: No such file"),
        (["--serial", "/dev/null"], "--serial /dev/null: "),
        (["--pty", "/proc/imu"], "--pty /proc/imu: the link cannot be made"),
        (["--pty", "imu", "--rate", "0"], "--rate: '0' refused; expected a number from 0.01 to 100"),
        (["--baud", "9600"], "--baud requires --serial"),
    ],
)
def test_what_cannot_be_played_is_named(log: Path, tmp_path: Path, options: list[str], message: str) -> None:
    run = subprocess.run([PLAYER, log, *options], check=False, capture_output=True, text=True, cwd=tmp_path)
    assert run.returncode == 2, run.stderr
    assert run.stderr.startswith(f"plumb-hil: {message}")


def test_a_log_that_is_none_is_named(log: Path, tmp_path: Path) -> None:
    whole = log.read_bytes()
    bad = {
        "missing.lcm": (None, "cannot be opened"),
        "damaged.lcm": (b"x" + whole[1:], "is damaged after byte"),
        "empty.lcm": (b"", "has no CALIBRATION"),
    }
    for name, (content, message) in bad.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        run = subprocess.run([PLAYER, name, "--pty", "imu"], check=False, capture_output=True, text=True, cwd=tmp_path)
        assert run.returncode == 2
        assert run.stderr.startswith(f"plumb-hil: {name}: {message}"), run.stderr


def test_a_log_that_is_cut_short_is_played_up_to_there(log: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.lcm").write_bytes(log.read_bytes()[:-10])
    command = [PLAYER, "cut.lcm", "--pty", "imu"]
    run = subprocess.run(command, check=False, capture_output=True, text=True, cwd=tmp_path)
    assert run.returncode == 0
    assert "cut.lcm: is cut short after byte" in run.stderr
