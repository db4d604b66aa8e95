"""Texture layers are made once, and again when what is on disk is not whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from plumb_tools.sim import layer_store

LAYER = np.random.default_rng(0).integers(0, 256, (64, 64), dtype=np.uint8)


class _Maker:
    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> layer_store.Layer:
        self.calls += 1
        return LAYER


def test_a_layer_is_made_once_and_read_back_exactly(tmp_path: Path) -> None:
    make = _Maker()
    folder = tmp_path / "textures"
    for _ in range(2):
        assert np.array_equal(layer_store.kept("sand", make, folder), LAYER)
    assert make.calls == 1
    assert len(list(folder.iterdir())) == 1


def test_a_broken_file_and_one_of_other_programs_are_replaced(tmp_path: Path) -> None:
    make = _Maker()
    layer_store.kept("sand", make, tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:100])
    (tmp_path / "sand-0123456789abcdef.png").write_bytes(b"")
    assert np.array_equal(layer_store.kept("sand", make, tmp_path), LAYER)
    assert make.calls == 2
    assert list(tmp_path.iterdir()) == [file]


def test_a_folder_that_cannot_be_written_does_no_harm(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    assert np.array_equal(layer_store.kept("sand", _Maker(), tmp_path / "file" / "textures"), LAYER)
