"""docs/interface.md tells what its sources tell, and the sizes in it are those of LCM's own encoder."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from plumb_tools import message_types
from plumb_tools.interface import document, lcm_types
from plumb_tools.interface.__main__ import main
from plumb_tools.message_types import types
from plumb_tools.trajectory import InputError

STRUCTS = {s.name: s for path in message_types.files() for s in lcm_types.read(path)[1]}
VARIABLE = {"image_t", "config_t"}


@pytest.fixture(name="_built")
def fixture_built() -> None:
    for program in ("plumb-fsw", "plumb-replay"):
        if not (document.PROGRAMS / program).is_file():
            pytest.skip(f"{program} is not built: cmake --preset flight && cmake --build --preset flight")


@pytest.mark.usefixtures("_built")
def test_the_document_is_of_its_sources(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["--check"])
    told = capsys.readouterr()
    assert code == 0, f"run tools/interface\n{told.out}{told.err}"


@pytest.mark.usefixtures("_built")
def test_what_is_sent_is_of_the_type_of_its_channel() -> None:
    table = subprocess.run([document.PROGRAMS / "plumb-fsw", "--telemetry"], check=True, capture_output=True, text=True)
    rows = [[cell.strip(" `") for cell in line.split("|")[1:3]] for line in table.stdout.splitlines()[2:]]
    assert len(rows) > 0
    assert [(channel, STRUCTS[name].channel) for channel, name in rows] == [(channel, channel) for channel, _ in rows]


@pytest.mark.usefixtures("_built")
def test_what_counters_count_is_no_text_of_the_flight_program() -> None:
    program = (document.PROGRAMS / "plumb-fsw").read_bytes()
    rows = list(document.device_faults())
    assert len({(device, counter) for device, counter, *_ in rows}) == len(rows) > 0
    for _, _, name, meaning, value in rows:
        assert name.strip("`").encode() in program
        assert [text for text in (meaning, value) if len(text) > 20 and text.encode() in program] == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("    /// transfers that failed; value: the system's reason (errno)\n", "", "kLidarLiteFaults: not_acknowledged: "),
        ("    kStim300Faults, kCameraFaults,", "    kStim300Faults,", "a table of counters for each"),
    ],
)
def test_a_counter_without_a_text_is_named(
    old: str, new: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = document.FAULTS.read_text()
    assert old in text
    file = tmp_path / "faults.h"
    file.write_text(text.replace(old, new))
    monkeypatch.setattr(document, "FAULTS", file)
    with pytest.raises(InputError, match=message):
        list(document.device_faults())


@pytest.mark.parametrize("name", sorted(STRUCTS))
def test_sizes_are_those_of_the_encoder(name: str) -> None:
    size = lcm_types.size_of(STRUCTS[name], STRUCTS)
    assert (size is None) == (name in VARIABLE)
    if size is not None:  # a message of that size is read to its end
        made = getattr(types(), name)
        message = made._get_packed_fingerprint().ljust(lcm_types.FINGERPRINT_BYTES + size, b"\0")
        assert made.decode(message).encode() == message


@pytest.mark.parametrize("name", sorted(STRUCTS))
def test_every_field_is_there_in_its_order(name: str) -> None:
    made = getattr(types(), name)
    fields = [(field.type, field.name) for field in STRUCTS[name].fields]
    kinds = (kind.removeprefix("plumb.") for kind in made.__typenames__)
    assert fields == list(zip(kinds, made.__slots__, strict=True))


def test_comments_go_with_what_they_stand_at(tmp_path: Path) -> None:
    path = tmp_path / "made.lcm"
    path.write_text(
        "package plumb;\n\n// Of the whole file,\n// in two lines.\n\n// Channel ONE: said of it\n// in two lines.\n"
        "struct one_t {\n  int8_t a[2][3];  // 0 none,\n              // 1 some\n  double b;\n}\n\n"
        "struct two_t {\n  one_t of;\n}\n"
    )
    about, (one, two) = lcm_types.read(path)
    assert about == "Of the whole file, in two lines."
    assert (one.channel, one.what) == ("ONE", "said of it in two lines.")
    assert [(field.name, field.comment) for field in one.fields] == [("a", "0 none, 1 some"), ("b", "")]
    assert (two.channel, two.comment) == (None, "")
    assert lcm_types.size_of(two, {"one_t": one}) == 2 * 3 + 8


def test_a_line_that_is_no_type_is_named(tmp_path: Path) -> None:
    path = tmp_path / "made.lcm"
    path.write_text("package plumb;\nstruct one_t {\n  const int32_t A = 1;\n}\n")
    with pytest.raises(InputError, match=r"made\.lcm:3: 'const int32_t A = 1;'; expected a struct"):
        lcm_types.read(path)


@pytest.mark.usefixtures("_built")
def test_what_has_changed_is_shown_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table of modes stands for all of it."""
    monkeypatch.setattr(document, "DOCUMENT", tmp_path / "interface.md")
    assert main(["--check"]) == 2 and "no such file" in capsys.readouterr().err
    assert main([]) == 0 and main(["--check"]) == 0
    text = document.DOCUMENT.read_text()
    assert text.count("\n| inertial | a state and image old |") == 1
    document.DOCUMENT.write_text(text.replace("\n| inertial |", "\n| hover |"))
    capsys.readouterr()
    assert main(["--check"]) == 1
    told = capsys.readouterr()
    assert "-| hover | a state" in told.out and "+| inertial | a state" in told.out and "run tools/interface" in told.err


def test_programs_that_are_not_built_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(document, "PROGRAMS", tmp_path)
    assert main([]) == 2
    assert "plumb-fsw: does not run" in capsys.readouterr().err
