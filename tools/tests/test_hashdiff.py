"""tools/hashdiff: two logs are the same in every bit, or the first that is not is named."""

import math
from collections.abc import Callable
from pathlib import Path

import lcm
import pytest

from plumb_tools import hashdiff
from plumb_tools.message_types import types


def _frame(tick: int, gyro: float = 0.0) -> bytes:
    frame = types().input_frame_t()
    frame.tick = tick
    frame.imu_count = 1
    frame.imu[0].gyro_rad_s = (0.0, gyro, 0.0)
    return frame.encode()


def _state(sequence: int, state_hash: int) -> bytes:
    state = types().nav_state_t()
    state.sequence = sequence
    state.state_hash = state_hash
    return state.encode()


def _event(event_id: int, argument: int) -> bytes:
    event = types().event_t()
    event.id = event_id
    event.arguments = (argument, 0, 0, 0)
    return event.encode()


def _log(path: Path, events: list[tuple[str, bytes]]) -> Path:
    log = lcm.EventLog(str(path), mode="w", overwrite=True)
    for channel, message in events:
        log.write_event(0, channel, message)
    log.close()
    return path


@pytest.fixture(name="sound")
def fixture_sound() -> list[tuple[str, bytes]]:
    """The messages of a short flight."""
    return [
        ("INPUT_FRAME", _frame(0)),
        ("NAV_STATE", _state(5, 77)),
        ("INPUT_FRAME", _frame(1, math.nan)),
        ("EVENTS", _event(1, 3)),
        ("EVENTS", _event(16, 3)),
        ("TIMING", b"what a flight took is of no interest"),
    ]


def test_equal_in_whatever_order_they_were_written(tmp_path: Path, sound: list[tuple[str, bytes]]) -> None:
    one = _log(tmp_path / "one.lcm", sound)
    other = _log(tmp_path / "other.lcm", list(reversed(sound)))
    assert hashdiff.main([str(one), str(other)]) == 0


@pytest.mark.parametrize(
    ("place", "changed", "expected"),
    [
        (0, ("INPUT_FRAME", _frame(0, -0.0)), "tick 0, imu[0].gyro_rad_s[1]: 0.0 and -0.0"),
        (1, ("NAV_STATE", _state(5, 78)), "sequence 5, state_hash: 77 and 78"),
        (4, ("EVENTS", _event(16, 4)), "number 0, arguments[0]: 3 and 4"),
        (2, ("INPUT_FRAME", _frame(9)), "tick 1: only in the first log"),
    ],
)
def test_names_the_first_frame_and_field(
    tmp_path: Path,
    sound: list[tuple[str, bytes]],
    capsys: pytest.CaptureFixture[str],
    place: int,
    changed: tuple[str, bytes],
    expected: str,
) -> None:
    one = _log(tmp_path / "one.lcm", sound)
    sound[place] = changed
    other = _log(tmp_path / "other.lcm", sound)
    assert hashdiff.main([str(one), str(other)]) == 1
    assert expected in capsys.readouterr().out


def test_events_that_tell_of_the_machine_may_differ(tmp_path: Path, sound: list[tuple[str, bytes]]) -> None:
    one = _log(tmp_path / "one.lcm", sound)
    sound[3] = ("EVENTS", _event(1, 4))
    assert hashdiff.main([str(one), str(_log(tmp_path / "other.lcm", sound))]) == 0


def test_a_log_that_is_not_there(tmp_path: Path, sound: list[tuple[str, bytes]]) -> None:
    one = _log(tmp_path / "one.lcm", sound)
    assert hashdiff.main([str(one), str(tmp_path / "none.lcm")]) == 2


@pytest.mark.parametrize("damage", [lambda log: log[:-5], lambda log: log + b"rubbish"])
def test_a_log_that_is_not_whole_is_said_to_be(
    tmp_path: Path, sound: list[tuple[str, bytes]], capsys: pytest.CaptureFixture[str], damage: Callable[[bytes], bytes]
) -> None:
    whole = _log(tmp_path / "whole.lcm", sound)
    hashdiff.main([str(whole), str(whole)])
    assert capsys.readouterr().err == ""
    broken = tmp_path / "broken.lcm"
    broken.write_bytes(damage(whole.read_bytes()))
    hashdiff.main([str(whole), str(broken)])
    assert "broken.lcm: is damaged or cut short" in capsys.readouterr().err


def test_each_of_two_frames_with_one_number_is_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs = [
        _log(tmp_path / name, [("INPUT_FRAME", _frame(7, gyro)), ("INPUT_FRAME", _frame(7, 2.0))])
        for name, gyro in (("one.lcm", 1.0), ("other.lcm", 9.0))
    ]
    assert hashdiff.main([str(log) for log in logs]) == 1
    assert "tick 7, imu[0].gyro_rad_s[1]: 1.0 and 9.0" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("messages", "told"),
    [
        ([], "no message on INPUT_FRAME"),
        ([("NAV_STATE", b"short")], "message 0 on NAV_STATE is none of Plumb's"),
    ],
)
def test_what_is_no_log_of_a_flight_is_not_equal_to_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], messages: list[tuple[str, bytes]], told: str
) -> None:
    log = _log(tmp_path / "none.lcm", messages)
    assert hashdiff.main([str(log), str(log)]) == 2
    assert f"{log}: {told}" in capsys.readouterr().err
