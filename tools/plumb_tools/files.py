"""Files that are written: whole or not at all, and refused at the start where they could not be written at the end."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from plumb_tools.trajectory import InputError


def told(error: InputError | OSError) -> str:
    """What an error says, the file first and without the number that the system gives it."""
    if isinstance(error, OSError) and error.filename is not None and error.strerror is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A file to write to that becomes `path` at the end, or goes away when anything goes wrong."""
    if path.exists() and not path.is_file():  # a device or a pipe cannot be replaced, and holds no half of anything
        yield path
        return
    # The suffix stays what it is, because libraries tell the kind of a picture by it.
    unfinished = path.with_name(f".part-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield unfinished
        unfinished.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            unfinished.unlink()


def write_text(path: Path, text: str) -> None:
    """Writes a text file that is there as a whole or not at all."""
    with whole(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def expect_file(path: Path, option: str) -> None:
    """Refuses the file of an option when it could not be written; folders on the way to it are made later."""
    if path.is_dir():
        raise InputError(f"{option} {path}: is a folder; expected the name of a file")
    if not path.exists() or path.is_file():
        _expect_room(path.absolute().parent, f"{option} {path}", "a file")


def expect_folder(path: Path, option: str) -> None:
    """Refuses the folder of an option when nothing could be written into it; it is made later."""
    _expect_room(path.absolute(), f"{option} {path}", "a folder")


def _expect_room(folder: Path, given: str, what: str) -> None:
    there = next(place for place in (folder, *folder.parents) if place.exists())
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        reason = error.strerror if there.is_dir() else "is not a folder"
        raise InputError(f"{given}: cannot be written, {there}: {reason}; expected {what} in a place to write to") from None
