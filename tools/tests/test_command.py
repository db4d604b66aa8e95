"""tools/command: what it sends, and what it says when nobody answers."""

import zlib
from pathlib import Path

import pytest

from plumb_tools import command, parameter_table
from plumb_tools.message_types import types


@pytest.mark.parametrize("sequence", range(8))  # checksums of either sign
def test_a_command_carries_the_checksum_of_all_before_it(sequence: int) -> None:
    sent = command.command(5, sequence, command.CommandId.RESET)
    received = types().command_t.decode(sent)
    assert (received.source, received.sequence, received.id) == (5, sequence, 2)
    assert received.arguments == (0.0, 0.0, 0.0, 0.0)
    assert received.crc & 0xFFFF_FFFF == zlib.crc32(sent[:-4])


def test_a_command_that_does_not_exist_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        command.main(["explode"])
    assert ended.value.code == 2
    assert "explode" in capsys.readouterr().err


def test_a_url_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["ping", "--lcm", "nonsense://x"]) == 2
    assert "nonsense://x" in capsys.readouterr().err


LINES = """\
range.gate_sigma               2          [1.5, 100] 1, at once: Mahalanobis gate of a range
range.max_range                40         [0.1, 10000] m, at once: longer ranges are invalid
modes.max_resets               3          [1, 16] 1, whole, at once: resets that are a failure
imu.gravity                    9.80665    [0.1, 30] m/s^2, never: local gravity
"""


@pytest.fixture(name="program")
def fixture_program(tmp_path: Path) -> Path:
    """Something that lists some parameters."""
    path = tmp_path / "plumb-replay"
    path.write_text(f"#!/bin/sh\ncat <<'END'\n{LINES}END\n")
    path.chmod(0o755)
    return path


def test_a_parameter_is_named_by_its_place_in_the_table(program: Path) -> None:
    rows = parameter_table.read(program)
    number, table, value, unused = command.arguments_to_set("range.max_range", "80", rows)
    assert (number, value, unused) == (1.0, 80.0, 0.0)
    assert table == zlib.crc32(b"range.gate_sigma\0range.max_range\0modes.max_resets\0imu.gravity\0")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("range.gate", "3", ["no parameter 'range.gate'", "did you mean range.gate_sigma"]),
        ("xyz", "3", ["no parameter 'xyz'", "tools/command list"]),
        ("range.max_range", "0", ["range.max_range: '0' refused", "0.1 to 10000 m"]),
        ("range.max_range", "nan", ["'nan' refused", "0.1 to 10000 m"]),
        ("range.gate_sigma", "wide", ["'wide' refused", "1.5 to 100"]),
        ("modes.max_resets", "2.5", ["modes.max_resets: '2.5' refused", "a whole number from 1 to 16"]),
        ("imu.gravity", "9.8", ["imu.gravity does not change in flight"]),
    ],
)
def test_what_would_be_refused_is_not_sent(
    name: str, value: str, said: list[str], program: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(["set", name, value, "--program", str(program)]) == 2
    told = capsys.readouterr().err
    for words in said:
        assert words in told


def test_a_program_that_is_not_built_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["set", "range.gate_sigma", "3", "--program", str(tmp_path / "none")]) == 2
    told = capsys.readouterr().err
    assert str(tmp_path / "none") in told and "cmake --build" in told


def test_the_table_of_the_flight_software_is_read_whole() -> None:
    if not parameter_table.PROGRAM.is_file():
        pytest.skip("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    rows = parameter_table.read()
    assert "modes.max_resets" in {row.name for row in rows if row.whole}
    assert "range.gate_sigma" in {row.name for row in rows if not row.whole}
    assert {row.change for row in rows} == {"at once", "at the next start", "never"}
    for row in rows:
        assert float(row.low) <= float(row.default) <= float(row.high)
