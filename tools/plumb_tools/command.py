"""Sends a command to the flight software over LCM and waits for the answer.

Exit code 0 accepted, 1 refused, 2 a command that cannot be or LCM cannot be used, 3 no answer.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
import zlib
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any

import lcm

from plumb_tools import parameter_table
from plumb_tools.arguments import LCM_URL, positive_seconds, whole_number
from plumb_tools.message_types import types
from plumb_tools.parameter_table import Parameter
from plumb_tools.trajectory import InputError


class CommandId(IntEnum):
    """CommandId of fsw/measurement/command.h."""

    PING = 1
    RESET = 2
    SET_PARAMETER = 3
    TELL_PARAMETERS = 4


class Verdict(IntEnum):
    """CommandVerdict of fsw/measurement/command.h."""

    ACCEPTED = 0
    CHECKSUM = 1
    UNKNOWN = 2
    ARGUMENT = 3
    REPEATED = 4
    OTHER_TABLE = 5
    OUT_OF_RANGE = 6
    CONFLICT = 7
    FIXED = 8


#: What a verdict does not say by its name.
_WHY = {
    Verdict.OUT_OF_RANGE: "; a number that counts must be a whole one",
    Verdict.OTHER_TABLE: "; what flies has other parameters than --program: take plumb-replay of the same version",
    Verdict.CONFLICT: "; it does not fit the values that others have now: tools/command list",
    Verdict.FIXED: "; it does not change in flight: set it in the configuration",
}


def command(source: int, sequence: int, command_id: int, arguments: Sequence[float] = (0.0, 0.0, 0.0, 0.0)) -> bytes:
    """command_t with its checksum."""
    message = types().command_t()
    message.source, message.sequence, message.id, message.arguments = source, sequence, command_id, arguments
    crc = zlib.crc32(message.encode()[:-4])
    message.crc = crc - (1 << 32) if crc >= 1 << 31 else crc
    return bytes(message.encode())


def arguments_to_set(name: str, value: str, rows: Sequence[Parameter]) -> tuple[float, float, float, float]:
    """Of a SET_PARAMETER; InputError where the table already says that it would be refused."""
    names = [row.name for row in rows]
    if name not in names:
        raise InputError(parameter_table.unknown(name, names))
    row = rows[names.index(name)]
    if row.change == parameter_table.NEVER:
        raise InputError(f"{name} does not change in flight: set it in the configuration")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not float(row.low) <= number <= float(row.high) or (row.whole and not number.is_integer()):
        raise InputError(f"{name}: '{value}' refused; expected {row.range}")
    return (float(names.index(name)), float(parameter_table.checksum(names)), number, 0.0)


def _sequence() -> int:
    """Another number at each start of this program."""
    return time.time_ns() // 1_000_000 & 0x7FFF_FFFF


def send(
    url: str, source: int, command_id: int, timeout_s: float, arguments: Sequence[float] = (0.0, 0.0, 0.0, 0.0)
) -> tuple[Any | None, dict[str, float]]:
    """The command_ack_t, or nothing when none came in time; and the parameters, if they were told before it."""
    link = lcm.LCM(url)
    answers: list[Any] = []
    parameters: dict[str, float] = {}
    sequence = _sequence()

    def keep(_: str, data: bytes) -> None:
        ack = types().command_ack_t.decode(data)
        if (ack.source, ack.sequence) == (source, sequence):
            answers.append(ack)

    def keep_parameters(_: str, data: bytes) -> None:
        told = types().params_t.decode(data)
        for row in told.values[: told.count]:
            parameters[bytes(row.name).split(b"\0")[0].decode()] = row.value

    link.subscribe("COMMAND_ACK", keep)
    link.subscribe("PARAMS", keep_parameters)
    link.publish("COMMAND", command(source, sequence, command_id, arguments))
    end = time.monotonic() + timeout_s
    while not answers and (left_s := end - time.monotonic()) > 0:
        link.handle_timeout(max(1, int(1e3 * left_s)))
    return (answers[0] if answers else None), parameters


def _parse(arguments: list[str]) -> argparse.Namespace:
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--lcm", metavar="URL", default=LCM_URL, help="default: %(default)s")
    source = whole_number(0, 2**31 - 1)
    common.add_argument("--source", type=source, default=1, help="who sends it, any number; default: %(default)s")
    common.add_argument("--timeout", type=positive_seconds, default=3.0, metavar="S", help="default: %(default)s s")
    parser = argparse.ArgumentParser(prog="command", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)

    def add(name: str, what: str) -> argparse.ArgumentParser:
        return commands.add_parser(name, help=what, description=what, parents=[common])

    add("ping", "nothing but an answer")
    add("reset", "start the filter anew")
    to_set = add("set", "change one parameter in flight, until the process ends")
    to_set.add_argument("name")
    to_set.add_argument("value")
    program = "plumb-replay of the version that flies, which knows the parameters; default: %(default)s"
    to_set.add_argument("--program", metavar="FILE", type=Path, default=parameter_table.PROGRAM, help=program)
    add("get", "one parameter as it is in force").add_argument("name")
    add("list", "every parameter as it is in force")
    return parser.parse_args(arguments)


def _say_parameters(wanted: str | None, parameters: dict[str, float]) -> int:
    if wanted is not None and wanted not in parameters:
        print(f"command: {parameter_table.unknown(wanted, parameters)}", file=sys.stderr)
        return 2
    for name, value in parameters.items():
        if wanted in (None, name):
            print(f"{name} {value:.17g}" if value != float(f"{value:g}") else f"{name} {value:g}")
    return 0


def main(arguments: list[str]) -> int:
    """Sends what the command line names."""
    options = _parse(arguments)
    asks = options.command in ("get", "list")
    name = {"set": "SET_PARAMETER", "get": "TELL_PARAMETERS", "list": "TELL_PARAMETERS"}.get(options.command)
    values: Sequence[float] = (0.0, 0.0, 0.0, 0.0)
    try:
        if options.command == "set":
            values = arguments_to_set(options.name, options.value, parameter_table.read(options.program))
        command_id = CommandId[name or options.command.upper()]
        ack, parameters = send(options.lcm, options.source, command_id, options.timeout, values)
    except InputError as error:
        print(f"command: {error}", file=sys.stderr)
        return 2
    except (OSError, RuntimeError) as error:
        print(f"command: {options.lcm}: {error}", file=sys.stderr)
        return 2
    if ack is None or (asks and ack.verdict == Verdict.ACCEPTED and not parameters):
        print("command: no answer; does plumb-fsw fly, with lcm and commands in its configuration?", file=sys.stderr)
        return 3
    verdict = Verdict(ack.verdict)
    if asks and verdict == Verdict.ACCEPTED:
        return _say_parameters(getattr(options, "name", None), parameters)
    refused = "" if verdict == Verdict.ACCEPTED else "refused: "
    words = verdict.name.lower().replace("_", " ")
    print(f"{options.command} {ack.sequence}: {refused}{words}, at {ack.time_ns} ns{_WHY.get(verdict, '')}")
    return int(verdict != Verdict.ACCEPTED)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
