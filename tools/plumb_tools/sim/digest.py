"""Digests of what things are made from."""

from __future__ import annotations

import ast
import hashlib
from pathlib import Path


def digest(*parts: bytes) -> str:
    """One digest of several parts."""
    whole = hashlib.sha256()
    for part in parts:
        whole.update(hashlib.sha256(part).digest())
    return whole.hexdigest()[:16]


def sources_digest(files: list[Path]) -> str:
    """Digest of programs without their comments and layout."""
    return digest(*(ast.dump(ast.parse(file.read_bytes())).encode() for file in sorted(files)))
