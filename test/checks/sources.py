"""The C++ sources of the repository, for the checks."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CPP_FOLDERS = ("config", "drivers", "fsw", "hal", "process", "test", "tools")
CPP_SUFFIXES = (".h", ".inl", ".cpp")


def cpp_files(root: Path, folders: tuple[str, ...] = CPP_FOLDERS) -> list[Path]:
    """Every C++ file below the folders, relative to root, in a fixed order."""
    found = []
    for folder in folders:
        found += [path.relative_to(root) for path in (root / folder).rglob("*") if path.suffix in CPP_SUFFIXES]
    return sorted(found)


# One alternative per thing that may hold any text: comments, raw strings, strings, characters. A digit separator
# (1'000) is matched first, so that it does not open a character.
_TOKEN = re.compile(
    r"""(?P<number>\b\d[\d'a-fA-FxX.]*)
      | (?P<comment>//[^\n]*|/\*.*?\*/)
      | (?P<raw>R"(?P<tag>[^()\\\s]*)\(.*?\)(?P=tag)")
      | (?P<text>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')""",
    re.DOTALL | re.VERBOSE,
)


def without_comments_and_text(source: str) -> str:
    """The code alone, with every line still on its line."""

    def blank(match: re.Match) -> str:
        if match.group("number"):
            return match.group(0)
        return "\n" * match.group(0).count("\n") or " "

    return _TOKEN.sub(blank, source)
