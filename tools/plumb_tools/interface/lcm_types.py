"""Reads LCM type files with their comments, which lcm-gen does not keep."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from plumb_tools.trajectory import InputError, read_text

#: Bytes of LCM's own types, encoded.
SIZES = {
    "boolean": 1,
    "byte": 1,
    "int8_t": 1,
    "int16_t": 2,
    "int32_t": 4,
    "int64_t": 8,
    "float": 4,
    "double": 8,
}
#: In front of every message.
FINGERPRINT_BYTES = 8

_STRUCT = re.compile(r"struct (\w+) \{")
_FIELD = re.compile(r"(\w+) (\w+)((?:\[\w+\])*);\s*(?://\s*(.*))?")
_COMMENT = re.compile(r"//\s?(.*)")
_CHANNELS = re.compile(r"Channel ([A-Z0-9_]+)(?::\s*|$)")


@dataclass
class Field:
    """One member of a type."""

    type: str
    name: str
    dimensions: tuple[str, ...]  #: numbers, or the member that holds the number
    comment: str


@dataclass
class Struct:
    """One type."""

    name: str
    comment: str
    fields: list[Field] = field(default_factory=list)

    @property
    def channel(self) -> str | None:
        """Where messages of it are sent; none for one that is only part of others."""
        found = _CHANNELS.match(self.comment)
        return found[1] if found else None

    @property
    def what(self) -> str:
        """The comment without the channel."""
        return _CHANNELS.sub("", self.comment, count=1)


def read(path: Path) -> tuple[str, list[Struct]]:
    """What a file says of itself, and its types in their order; InputError names the first line it cannot read."""
    about, structs, comments = "", list[Struct](), list[str]()
    inside: Struct | None = None
    for number, raw in enumerate(read_text(path).splitlines(), start=1):
        line = raw.strip()
        comment, struct, member = _COMMENT.fullmatch(line), _STRUCT.fullmatch(line), _FIELD.fullmatch(line)
        if comment and inside is not None and inside.fields:
            inside.fields[-1].comment += f" {comment[1].strip()}"
        elif comment:
            comments.append(comment[1].strip())
        elif struct:
            inside = Struct(struct[1], " ".join(comments))
            comments.clear()
        elif member and inside is not None:
            dimensions = tuple(re.findall(r"\[(\w+)\]", member[3]))
            inside.fields.append(Field(member[1], member[2], dimensions, member[4] or ""))
        elif line == "}" and inside is not None:
            structs.append(inside)
            inside = None
        elif not line and not structs and comments:
            about = " ".join(comments)
            comments.clear()
        elif line and not line.startswith("package "):
            raise InputError(f"{path}:{number}: {line!r}; expected a struct, a field or a comment")
    return about, structs


def size_of(struct: Struct, among: dict[str, Struct]) -> int | None:
    """Bytes of a type without fingerprint; none where it varies."""
    total = 0
    for member in struct.fields:
        one = SIZES.get(member.type)
        if one is None:
            one = size_of(among[member.type], among)
        if one is None or not all(length.isdigit() for length in member.dimensions):
            return None
        for length in member.dimensions:
            one *= int(length)
        total += one
    return total
