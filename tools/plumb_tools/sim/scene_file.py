"""Reads scene files: strictly, and with everything that is wrong in one message."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from plumb_tools.sim.scene import Scene
from plumb_tools.sim.schema import Faults, read_section
from plumb_tools.trajectory import InputError, read_text

#: The scenes that come with the project.
SCENES = Path(__file__).resolve().parents[2] / "scenes"
#: Where flights go when nothing else is said, shared by all commands.
FLIGHTS = Path(__file__).resolve().parents[3] / "build" / "flights"


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """YAML that refuses a key given twice, and reads 1e-3 as the number it is."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[object, object]:
        """A mapping whose keys are all different."""
        seen = set()
        for key_node, _ in node.value:
            name = self.construct_object(key_node, deep=True)
            if name in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key '{name}' is given twice", key_node.start_mark)
            seen.add(name)
        return dict(super().construct_mapping(node, deep))


# YAML 1.1 wants a dot in a number with an exponent, takes 010 for eight and 1:30 for ninety, which nobody remembers.
_NUMBERS = ("tag:yaml.org,2002:float", "tag:yaml.org,2002:int")
_Loader.yaml_implicit_resolvers = {
    letter: [(tag, pattern) for tag, pattern in resolvers if tag not in _NUMBERS]
    for letter, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"^[-+]?(0|[1-9]\d*)$"), list("-+0123456789"))
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d[\d_]*\.?\d*|\.\d+)([eE][-+]?\d+)?$|^[-+]?\.(inf|Inf|INF)$|^\.(nan|NaN|NAN)$"),
    list("-+0123456789."),
)


class SceneFaults(InputError):
    """What is wrong with a scene file, one line each."""

    def __init__(self, path: Path, faults: Faults) -> None:
        """Collects the faults under the file's name."""
        super().__init__("\n".join(f"{path}: {fault}" for fault in faults.items))


def names() -> list[str]:
    """The scenes that come with the project."""
    return sorted(path.stem for path in SCENES.glob("*.yaml"))


def find(name: str) -> Path:
    """The file of a scene, given by name or by path."""
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        return path
    built_in = SCENES / f"{name}.yaml"
    if not built_in.exists():
        raise InputError(f"{name}: no such scene; expected one of {', '.join(names())}, or a .yaml file")
    return built_in


def flight_folder(path: Path, seed: int) -> Path:
    """Where a flight of a scene file goes when nothing else is said."""
    return FLIGHTS / f"{path.stem}-{seed}"


def read(path: Path) -> Scene:
    """A scene with all defaults filled in; `SceneFaults` names every key that is wrong."""
    try:
        content = yaml.load(read_text(path), _Loader)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:  # the last three: of odd keys and values
        mark = getattr(error, "problem_mark", None)
        where = f"{path}:{mark.line + 1}" if mark is not None else str(path)
        raise InputError(f"{where}: {getattr(error, 'problem', None) or error}; expected YAML") from None
    faults = Faults()
    scene = read_section(Scene, content, "", faults)
    if faults or not isinstance(scene, Scene):
        raise SceneFaults(path, faults)
    return scene
