"""The text of docs/interface.md."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

from plumb_tools import message_types, parameter_table
from plumb_tools.interface import lcm_types
from plumb_tools.interface.lcm_types import FINGERPRINT_BYTES, Struct
from plumb_tools.message_types import types
from plumb_tools.trajectory import InputError, read_text

ROOT = Path(__file__).resolve().parents[3]
DOCUMENT = ROOT / "docs/interface.md"
EVENTS = ROOT / "fsw/events/event.h"
FAULTS = ROOT / "fsw/events/device_faults.h"
PROGRAMS = ROOT / "build/flight/bin"

_HEAD = """\
# Interfaces

What Plumb says and takes, to the byte: made by `tools/interface` from the sources, so change those. Frames and units are
those of [architecture](architecture.md#frames-and-names). Who sends what when stands [below](#rates) and, of devices, logs
and replays, in [the flight process](executive.md) and [replay](replay.md), what an autopilot gets in [autopilots](autopilots.md), what
devices say in [sensors](sensors.md).

Messages are LCM's, on its network (`lcm:` of a configuration) and in its event logs. A message is the fingerprint of its
type, 8 bytes, and then its fields in their order without gaps, most significant byte first; sizes are in bytes, of a
message with its fingerprint. Quaternions are w x y z. Strings in arrays of bytes end with a zero.
"""

_PARAMETERS_HEAD = """\
## Parameters

In `parameters:` of a configuration or the file of `plumb-replay --params`; those in force are on channel `PARAMS`. A
value out of range is refused. Unit 1 is a plain number; *whole*: a fraction is refused, and from 0 to 1 it is no and yes. *Changes* says when one counts that is
[set in flight](executive.md#parameters-in-flight), by its number and the table's CRC, `0x{crc:08x}`.
"""

#: A table of counters, and its rows: the comment above, which is the text, and the name.
_COUNTERS = re.compile(r"std::array<FaultRow, \d+> (k\w+)\{\{\n(.*?)\n\}\};", re.DOTALL)
_COUNTER = re.compile(r'((?:^ +///.*\n)*)^ +\{"(\w+)"', re.MULTILINE)
_ENUMERATOR = re.compile(r"k(\w+)(?: = (\d+))?,\s*(?:///<\s*(.*))?")


def _table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    def line(cells: Iterable[object]) -> str:
        return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |\n"

    names = list(head)
    return line(names) + "|" + "---|" * len(names) + "\n" + "".join(line(row) for row in rows)


def _size(struct: Struct, among: dict[str, Struct], extra: int) -> str:
    size = lcm_types.size_of(struct, among)
    return "varies" if size is None else str(size + extra)


def _messages() -> Iterator[str]:
    paths = message_types.files()
    files = [lcm_types.read(path) for path in paths]
    among = {struct.name: struct for _, structs in files for struct in structs}
    sent = [(struct.channel, struct) for struct in among.values() if struct.channel]
    yield "## Channels\n\n" + _table(
        ("channel", "type", "size", "what"),
        (
            (f"`{channel}`", f"[`{struct.name}`](#{struct.name})", _size(struct, among, FINGERPRINT_BYTES), struct.what)
            for channel, struct in sorted(sent)
        ),
    )
    for path, (about, structs) in zip(paths, files, strict=True):
        yield f"## Types of {path.name}\n\n{about}\n"
        for struct in structs:
            yield from _type(struct, among)


def _type(struct: Struct, among: dict[str, Struct]) -> Iterator[str]:
    fingerprint = getattr(types(), struct.name)._get_packed_fingerprint().hex()
    if struct.channel:
        size = _size(struct, among, FINGERPRINT_BYTES)
        place = f"Channel `{struct.channel}`, {size}{'' if size == 'varies' else ' bytes'}."
    else:
        place = f"Part of others, {_size(struct, among, 0)} bytes."
    what = f" {struct.what[0].upper()}{struct.what[1:]}" if struct.what else ""
    yield f"### {struct.name}\n\n{place} Fingerprint `{fingerprint}`.{what}\n"
    rows = (
        (f"`{member.name}`", member.type + "".join(f"[{length}]" for length in member.dimensions), member.comment)
        for member in struct.fields
    )
    yield _table(("field", "type", "meaning"), rows)


def _enumerators(text: str, name: str) -> list[tuple[int, str, str]]:
    """Number, name and comment of each enumerator of an enum class."""
    body = re.search(rf"enum class {name} [^{{]*{{(.*?)}};", text, re.DOTALL)
    found, following = [], 0
    for match in _ENUMERATOR.finditer(body[1] if body else ""):
        following = int(match[2]) if match[2] else following
        found.append((following, match[1], match[3] or ""))
        following += 1
    if not found:
        raise InputError(f"{EVENTS}: no enum class {name}; expected it there")
    return found


def device_faults() -> Iterator[tuple[str, int, str, str, str]]:
    """Device, number, name, what it counts and what its value is, of each counter."""
    text = read_text(FAULTS)
    names = re.search(r"kFaultyDeviceNames\{(.*?)\};", text, re.DOTALL)
    tables = re.search(r"kDeviceFaultTables\{(.*?)\};", text, re.DOTALL)
    devices = re.findall(r'"(.*?)"', names[1]) if names else []
    order = re.findall(r"k\w+", tables[1]) if tables else []
    rows = dict(_COUNTERS.findall(text))
    if not rows or set(order) != rows.keys() or len(order) != len(devices):
        raise InputError(f"{FAULTS}: expected the names of the devices and a table of counters for each")
    for number, (device, table) in enumerate(zip(devices, order, strict=True)):
        for counter, (comment, name) in enumerate(_COUNTER.findall(rows[table])):
            words = " ".join(comment.replace("///", "").split())
            if not words:
                raise InputError(f"{FAULTS}: {table}: {name}: expected a comment above it that says what it counts")
            meaning, _, value = words.partition("; value: ")
            yield f"{number} {device}", counter, f"`{name}`", meaning, value


def _events() -> Iterator[str]:
    text = read_text(EVENTS)
    yield "## Events\n\nOn channel `EVENTS`; [executive](executive.md#schedule) says when they are kept back.\n"
    rows = ((number, f"`{name}`", arguments) for number, name, arguments in _enumerators(text, "EventId"))
    yield _table(("id", "event", "arguments, in their order"), rows)
    yield _table(("severity", "", "what"), _enumerators(text, "EventSeverity"))
    yield "Devices and counters of `DeviceFault`, and what their last value is:\n"
    yield _table(("device", "counter", "name", "what it counts", "value"), device_faults())


def _output_of(program: str, *words: str) -> str:
    path = PROGRAMS / program
    try:
        return subprocess.run([path, *words], check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        build = f"cmake --preset flight && cmake --build --preset flight --target {program}"
        raise InputError(f"{path}: does not run: {error}; expected it built: {build}") from None


def _rates() -> Iterator[str]:
    yield "## Rates\n\nWhat `plumb-fsw` sends, and which job of the [schedule](#schedule) does.\n"
    yield _output_of("plumb-fsw", "--telemetry")


def _schedule() -> Iterator[str]:
    yield "## Schedule\n\nA tick is 4 ms; [executive](executive.md#schedule) tells what the columns mean.\n"
    yield _output_of("plumb-fsw", "--schedule")


def _modes() -> Iterator[str]:
    yield "## Modes\n\n[Executive](executive.md#modes-and-health) tells how the tables are read.\n"
    yield _output_of("plumb-fsw", "--modes")


def _parameters() -> Iterator[str]:
    rows = parameter_table.read(PROGRAMS / "plumb-replay")
    yield _PARAMETERS_HEAD.format(crc=parameter_table.checksum(row.name for row in rows))
    yield _table(
        ("number", "parameter", "default", "from", "to", "unit", "changes", "what"),
        (
            (number, f"`{row.name}`", row.default, row.low, row.high, row.unit + (row.whole or ""), row.change, row.what)
            for number, row in enumerate(rows)
        ),
    )


def text() -> str:
    """The whole document; InputError where a source cannot be read."""
    parts = [_HEAD, *_messages(), *_rates(), *_events(), *_schedule(), *_modes(), *_parameters()]
    return "\n".join(part.rstrip("\n") + "\n" for part in parts)
