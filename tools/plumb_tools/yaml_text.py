"""YAML that people write: strict where YAML is lax, and with the line in a message."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from plumb_tools.trajectory import InputError, read_text


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

#: OpenCV begins its files with a directive that is not quite YAML's.
_OPENCV_DIRECTIVE = re.compile(r"\A%YAML:")


def read_yaml(path: Path) -> object:
    """What a file holds; InputError with the line of what is no YAML or given twice."""
    text = _OPENCV_DIRECTIVE.sub("# ", read_text(path))
    try:
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:  # the last three: of odd keys and values
        mark = getattr(error, "problem_mark", None)
        where = f"{path}:{mark.line + 1}" if mark is not None else str(path)
        raise InputError(f"{where}: {getattr(error, 'problem', None) or error}; expected YAML") from None
