"""What the virtual flight computer lacks is a failure where it was asked for, and a reason to skip anywhere else."""

from __future__ import annotations

import pytest

import arm64_programs
from arm64_programs import skip_unless_built, skip_unless_whole

FAILED, SKIPPED = pytest.fail.Exception, pytest.skip.Exception


@pytest.mark.parametrize("asked, outcome", [("true", FAILED), ("false", SKIPPED), (None, SKIPPED)])
def test_only_where_it_was_asked_for_a_missing_program_is_a_failure(
    monkeypatch: pytest.MonkeyPatch, asked: str | None, outcome: type[BaseException]
) -> None:
    monkeypatch.setattr(arm64_programs, "HOST", arm64_programs.ROOT / "no-such-build")
    for name in ("PLUMB_TARGET", "PLUMB_ARM64"):
        monkeypatch.setenv(name, asked) if asked is not None else monkeypatch.delenv(name, raising=False)
    with pytest.raises(outcome, match="left out" if asked == "false" else "no-such-program"):
        skip_unless_built("no-such-program")
    with pytest.raises(outcome, match="no-such-build"):
        skip_unless_whole()


def test_a_missing_emulator_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLUMB_TARGET", "true")
    monkeypatch.setenv("PATH", "/nonexistent")
    with pytest.raises(FAILED, match="qemu-aarch64 of the package qemu-user"):
        skip_unless_built()
