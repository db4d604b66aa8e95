"""Files are written whole or not at all, and messages name them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from plumb_tools import files
from plumb_tools.trajectory import InputError


def test_a_file_is_replaced_only_when_the_new_one_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "page.md"
    files.write_text(target, "first")
    with pytest.raises(KeyboardInterrupt), files.whole(target) as unfinished:
        assert unfinished.suffix == ".md"
        unfinished.write_text("half")
        raise KeyboardInterrupt
    assert target.read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["page.md"]
    with target.open() as reading:
        files.write_text(target, "second")
        assert reading.read() == "first"  # another file took the place, so that no reader sees a half
    assert target.read_text() == "second"


def test_a_device_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    files.expect_file(pipe, "--json")
    files.write_text(pipe, "all of it")
    assert os.read(reader, 100) == b"all of it" and pipe.is_fifo()
    os.close(reader)


def test_what_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--json .*file/a.json: cannot be written, .*file: is not a folder; expected"):
        files.expect_file(tmp_path / "file/a.json", "--json")
    with pytest.raises(InputError, match="--json .*: is a folder; expected the name of a file"):
        files.expect_file(tmp_path, "--json")
    with pytest.raises(InputError, match="--work .*file: cannot be written"):
        files.expect_folder(tmp_path / "file", "--work")
    with pytest.raises(InputError, match="file/a.json: cannot be written: "):
        files.write_text(tmp_path / "file/a.json", "x")
    files.expect_file(tmp_path / "new/folder/a.json", "--json")
    assert not (tmp_path / "new").exists()


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc, where even root can write nothing")
def test_a_place_that_takes_no_files_is_told_with_the_reason() -> None:
    with pytest.raises(InputError, match="--json /proc/x.json: cannot be written, /proc: No such file or directory"):
        files.expect_file(Path("/proc/x.json"), "--json")


def test_errors_of_the_system_are_told_without_their_number() -> None:
    with pytest.raises(OSError) as caught:
        Path("/nowhere/at/all").read_text()
    assert files.told(caught.value) == "/nowhere/at/all: No such file or directory"
    assert files.told(InputError("a.csv: empty")) == "a.csv: empty"
