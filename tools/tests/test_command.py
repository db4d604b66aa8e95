"""tools/command: what it sends, and what it says when nobody answers."""

import zlib

import pytest

from plumb_tools import command
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
