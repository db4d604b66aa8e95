"""What all tests of the tools share."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TOOLS))


@pytest.fixture
def euroc_mh01() -> Path:
    """Folder of the recorded flight; it is large and not part of the repository."""
    root = Path(os.environ.get("PLUMB_DATA") or TOOLS.parent.parent / "shared" / "data")
    folder = root / "euroc_mh01"
    if not folder.is_dir():
        pytest.skip(f"recorded data not found at {folder}; set PLUMB_DATA to the folder that holds euroc_mh01")
    return folder
