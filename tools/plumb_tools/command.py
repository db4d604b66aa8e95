"""Sends a command to the flight software over LCM and waits for the answer.

Exit code 0 accepted, 1 refused, 2 no such command or LCM cannot be used, 3 no answer.
"""

from __future__ import annotations

import argparse
import sys
import time
import zlib
from enum import IntEnum
from typing import Any

import lcm

from plumb_tools.arguments import LCM_URL
from plumb_tools.message_types import types


class CommandId(IntEnum):
    """CommandId of fsw/measurement/command.h."""

    PING = 1
    RESET = 2


class Verdict(IntEnum):
    """CommandVerdict of fsw/measurement/command.h."""

    ACCEPTED = 0
    CHECKSUM = 1
    UNKNOWN = 2
    ARGUMENT = 3
    REPEATED = 4


def command(source: int, sequence: int, command_id: int) -> bytes:
    """command_t with its checksum."""
    message = types().command_t()
    message.source, message.sequence, message.id = source, sequence, command_id
    crc = zlib.crc32(message.encode()[:-4])
    message.crc = crc - (1 << 32) if crc >= 1 << 31 else crc
    return bytes(message.encode())


def _sequence() -> int:
    """Another number at each start of this program."""
    return time.time_ns() // 1_000_000 & 0x7FFF_FFFF


def send(url: str, source: int, command_id: int, timeout_s: float) -> Any | None:
    """The command_ack_t, or nothing when none came in time."""
    link = lcm.LCM(url)
    answers: list[Any] = []
    sequence = _sequence()

    def keep(_: str, data: bytes) -> None:
        ack = types().command_ack_t.decode(data)
        if (ack.source, ack.sequence) == (source, sequence):
            answers.append(ack)

    link.subscribe("COMMAND_ACK", keep)
    link.publish("COMMAND", command(source, sequence, command_id))
    end = time.monotonic() + timeout_s
    while not answers and (left_s := end - time.monotonic()) > 0:
        link.handle_timeout(max(1, int(1e3 * left_s)))
    return answers[0] if answers else None


def main(arguments: list[str]) -> int:
    """Sends what the command line names."""
    parser = argparse.ArgumentParser(prog="command", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    names = [command_id.name.lower() for command_id in CommandId]
    parser.add_argument("command", choices=names, help="ping: nothing but an answer; reset: start the filter anew")
    parser.add_argument("--lcm", metavar="URL", default=LCM_URL, help="default: %(default)s")
    parser.add_argument("--source", type=int, default=1, help="who sends it, any number; default: %(default)s")
    parser.add_argument("--timeout", type=float, default=3.0, metavar="S", help="default: %(default)s s")
    options = parser.parse_args(arguments)
    try:
        ack = send(options.lcm, options.source, CommandId[options.command.upper()], options.timeout)
    except (OSError, RuntimeError) as error:
        print(f"command: {options.lcm}: {error}", file=sys.stderr)
        return 2
    if ack is None:
        print("command: no answer; does plumb-fsw fly, with lcm and commands in its configuration?", file=sys.stderr)
        return 3
    verdict = Verdict(ack.verdict)
    refused = "" if verdict == Verdict.ACCEPTED else "refused: "
    print(f"{options.command} {ack.sequence}: {refused}{verdict.name.lower()}, at {ack.time_ns} ns")
    return int(verdict != Verdict.ACCEPTED)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
