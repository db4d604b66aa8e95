"""Flights that are there already: what a flight was made from, and whether a folder holds just that flight, whole."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from plumb_tools import files
from plumb_tools.sim import world
from plumb_tools.sim.digest import digest, sources_digest
from plumb_tools.sim.scene import Scene
from plumb_tools.sim.schema import as_plain
from plumb_tools.trajectory import InputError

#: Written into every flight: what it was made from, the size of every file, and a digest of its tables.
FILE = "simulated.json"
SIZES, TABLES = "sizes", "tables"
_TABLE_SUFFIXES = (".csv", ".yaml")

SOURCES = Path(__file__).resolve().parent
#: These read and refuse scenes and say where things are kept; what a flight looks like is not in them.
_BESIDE_THE_POINT = ("__main__.py", "checks.py", "digest.py", "kept.py", "layer_store.py", "scene_file.py", "schema.py")
_LOGGING = "devices"


@cache
def _simulator_digest(root: Path) -> str:
    return sources_digest([path for path in root.glob("*.py") if path.name not in _BESIDE_THE_POINT])


@cache
def _logging_digest(root: Path) -> str:
    return sources_digest(list((root / _LOGGING).glob("*.py")))


@dataclass(frozen=True)
class Origin:
    """What the bytes of a flight follow from."""

    scene: str  #: digest of the scene with all defaults filled in
    seed: int
    duration_s: float | None  #: None: to the end
    textures: str | None  #: digest of the user's pictures
    simulator: str  #: digest of the programs
    log: str | None  #: digest of the programs that write the log of raw device bytes; None: there is none

    def serves(self, wanted: Origin) -> bool:
        """Whether a flight from here is the wanted one; a log more than wanted does no harm."""
        return self == wanted or (wanted.log is None and Origin(**{**vars(self), "log": None}) == wanted)


def origin(scene: Scene, seed: int, duration_s: float | None, textures: Path | None, with_log: bool) -> Origin:
    """The origin of a flight that is wanted."""
    content = as_plain(scene)
    for text in ("summary", "shows"):  # for people, changes nothing in a flight
        del content["scene"][text]
    pictures = world.find_pictures(textures)
    looked_at = [*sorted(pictures.materials.values()), *pictures.orthophotos]
    looks = [part for file in looked_at for part in (file.name.encode(), file.read_bytes())]
    return Origin(
        scene=digest(json.dumps(content, sort_keys=True).encode()),
        seed=seed,
        duration_s=duration_s,
        textures=digest(*looks) if looks else None,
        simulator=_simulator_digest(SOURCES),
        log=_logging_digest(SOURCES) if with_log else None,
    )


def holds(folder: Path, wanted: Origin) -> bool:
    """Whether a folder holds a flight of this origin, whole."""
    return _is_of(folder, wanted) and _damage(folder) is None


def damage(folder: Path, wanted: Origin) -> str | None:
    """What is not as it was written in a flight of this origin, in a line; None when all is, or it is another flight."""
    return _damage(folder) if _is_of(folder, wanted) else None


def _note(folder: Path) -> dict[str, Any]:
    note = json.loads((folder / FILE).read_text(encoding="utf-8"))
    if not isinstance(note, dict):
        raise TypeError(f"{FILE} holds no keys")
    return note


def _is_of(folder: Path, wanted: Origin) -> bool:
    try:
        made_from = {key: value for key, value in _note(folder).items() if key not in (SIZES, TABLES)}
        return Origin(**made_from).serves(wanted)
    except (OSError, ValueError, TypeError):
        return False


def _tables_digest(folder: Path, names: list[str]) -> str:
    tables = sorted(name for name in names if name.endswith(_TABLE_SUFFIXES))
    return digest(*(part for name in tables for part in (name.encode(), (folder / name).read_bytes())))


def _damage(folder: Path) -> str | None:
    """Files that came later are no matter."""
    note = _note(folder)
    if SIZES not in note:  # from before sizes were noted
        return None
    for name, size in note[SIZES].items():
        file = folder / name
        if not file.is_file():
            return f"{name} is missing"
        if (found := file.stat().st_size) != size:
            return f"{name} has {found} bytes, {size} were written"
    if _tables_digest(folder, list(note[SIZES])) != note.get(TABLES):
        return "a table is not the one that was written"
    return None


def mark(folder: Path, made_from: Origin) -> None:
    """Notes the origin of the flight in a folder, and what is in it: the last thing to be done there."""
    written = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != FILE)
    sizes = {path.relative_to(folder).as_posix(): path.stat().st_size for path in written}
    note = {**vars(made_from), TABLES: _tables_digest(folder, list(sizes)), SIZES: sizes}
    (folder / FILE).write_text(json.dumps(note, indent=1) + "\n", encoding="utf-8")


def remove(flight: Path) -> None:
    """Deletes a flight, its mark first: what an interrupt leaves of it does not look whole."""
    (flight / FILE).unlink(missing_ok=True)
    shutil.rmtree(flight)


def expect_replaceable(target: Path) -> None:
    """Refuses a place for a flight that holds something else or cannot be written to."""
    if target.exists() and not (target.is_dir() and (not any(target.iterdir()) or (target / FILE).exists())):
        raise InputError(f"{target}: exists and is not a simulated flight; --out takes a new or an empty folder")
    files.expect_folder(target, "--out")


@contextmanager
def whole_or_nothing(target: Path) -> Iterator[Path]:
    """A folder to write to that becomes `target` at the end, or goes away when anything goes wrong."""
    partial = target.with_name(target.name + ".partial")
    expect_replaceable(target)
    partial.mkdir(parents=True, exist_ok=True)
    lock = os.open(partial, os.O_RDONLY)
    try:
        _only_one(lock, partial, target)
        _empty(partial)  # what a killed simulation left
        try:
            yield partial
            if target.exists():
                remove(target)
            os.replace(partial, target)
        except BaseException:
            shutil.rmtree(partial, ignore_errors=True)
            raise
    finally:
        os.close(lock)


def _only_one(lock: int, partial: Path, target: Path) -> None:
    """Two simulations into one folder would destroy one another's work."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(f"{target}: another simulation is writing it, in {partial}; wait for it to end") from None


def _empty(folder: Path) -> None:
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
