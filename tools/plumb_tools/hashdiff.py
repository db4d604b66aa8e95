"""Where two logs of one flight part: the first frame and field that differ in a bit.

What is compared is what the flight software computes and what it computes it from: INPUT_FRAME by tick, NAV_STATE by
image, NAV_OUTPUT by time, and of EVENTS, by number, those that do not tell of the machine's speed. There is no
tolerance. Exit code 0 equal, 1 different, 2 no such log, or not one of a flight.
"""

from __future__ import annotations

import argparse
import struct
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import lcm

from plumb_tools.message_types import types

#: Channel, type, and the field that says which frame it is; none: their order does.
_COMPARED = (
    ("INPUT_FRAME", "input_frame_t", "tick"),
    ("NAV_STATE", "nav_state_t", "sequence"),
    ("NAV_OUTPUT", "nav_output_t", "time_ns"),
    ("EVENTS", "event_t", None),
)

#: From here on an event is a function of the input frames; see EventId in fsw/events/event.h.
_FIRST_REPLAYED_EVENT = 16


def bits(value: object) -> object:
    """What two values agree in only if they agree in every bit: a NaN is itself, and -0 is not 0."""
    return struct.pack(">d", value) if isinstance(value, float) else value


def differing_fields(a: Any, b: Any, name: str = "") -> Iterator[tuple[str, object, object]]:
    """Every field in which two messages of a type, or parts of them, differ, in the order of the type."""
    if hasattr(a, "__slots__"):
        for field in a.__slots__:
            yield from differing_fields(getattr(a, field), getattr(b, field), f"{name}.{field}" if name else field)
    elif isinstance(a, (list, tuple)):
        for index, (one, other) in enumerate(zip(a, b, strict=True)):
            yield from differing_fields(one, other, f"{name}[{index}]")
    elif bits(a) != bits(b):
        yield name, a, b


_RECORD_HEADER_BYTES = 28  # of an LCM event log: sync word, number, time, and the two lengths

#: A frame's number, and how many with the same number came before it in the log.
Frame = tuple[int, int]


def frames(log: Path) -> dict[str, dict[Frame, bytes]]:
    """The messages of each compared channel, by frame. Raises ValueError for what is not the log of a flight."""
    found: dict[str, dict[Frame, bytes]] = {channel: {} for channel, _, _ in _COMPARED}
    seen: Counter[tuple[str, int]] = Counter()
    decoders = {channel: (getattr(types(), name), key) for channel, name, key in _COMPARED}
    with log.open("rb"):  # LCM would end the program with a message of its own
        pass
    read_bytes = 0
    for event in lcm.EventLog(str(log), "r"):
        read_bytes += _RECORD_HEADER_BYTES + len(event.channel) + len(event.data)
        if event.channel not in decoders:
            continue
        decoder, key = decoders[event.channel]
        try:
            message = decoder.decode(event.data)
        except (ValueError, struct.error) as error:
            raise ValueError(f"{log}: message {event.eventnum} on {event.channel} is none of Plumb's: {error}") from error
        if key is None and message.id < _FIRST_REPLAYED_EVENT:
            continue
        number = len(found[event.channel]) if key is None else getattr(message, key)
        found[event.channel][number, seen[event.channel, number]] = event.data
        seen[event.channel, number] += 1
    if lost := log.stat().st_size - read_bytes:
        print(f"hashdiff: {log}: is damaged or cut short: {lost} bytes of it are no record", file=sys.stderr)
    if not found["INPUT_FRAME"]:
        raise ValueError(f"{log}: no message on INPUT_FRAME, expected a log of plumb-fsw or plumb-replay --record")
    return found


def first_difference(a: dict[Frame, bytes], b: dict[Frame, bytes], message_type: Any) -> str | None:
    """What the first frame says in which the two differ; nothing when they are equal."""
    for frame in sorted(a.keys() | b.keys()):
        number, repetition = frame
        name = f"{number} for the {repetition + 1}. time" if repetition else str(number)
        if frame not in a or frame not in b:
            return f"{name}: only in the {'second' if frame in b else 'first'} log"
        if a[frame] == b[frame]:
            continue
        for field, one, other in differing_fields(message_type.decode(a[frame]), message_type.decode(b[frame])):
            return f"{name}, {field}: {one!r} and {other!r}"
    return None


def main(arguments: list[str]) -> int:
    """Compares the logs named on the command line."""
    parser = argparse.ArgumentParser(prog="hashdiff", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("logs", metavar="LOG", nargs=2, type=Path, help="LCM event log of plumb-fsw or plumb-replay")
    options = parser.parse_args(arguments)
    try:
        one, other = (frames(log) for log in options.logs)
    except (OSError, ValueError) as error:
        print(f"hashdiff: {error}", file=sys.stderr)
        return 2
    different = False
    for channel, name, key in _COMPARED:
        difference = first_difference(one[channel], other[channel], getattr(types(), name))
        found = f"first difference at {key or 'number'} {difference}" if difference else f"{len(one[channel])} equal"
        print(f"{channel}: {found}")
        different |= difference is not None
    return int(different)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
