"""The layout check finds what is laid out otherwise, and can mend it."""

from pathlib import Path

import format_check
import pytest
from sources import ROOT


def test_finds_and_mends(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # clang-format looks for its settings above the file.
    (tmp_path / ".clang-format").write_bytes((ROOT / ".clang-format").read_bytes())
    file = tmp_path / "a.cpp"
    file.write_text("int  f( int a ){return a;}\n")
    assert format_check.main([str(file)]) == 1
    assert f"{file}: not laid out" in capsys.readouterr().out
    assert format_check.main(["--fix", str(file)]) == 0
    assert file.read_text() == "int f(int a) { return a; }\n"
    assert format_check.main([str(file)]) == 0
