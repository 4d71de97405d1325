"""YAML files of limited size with plain values; each mapping has a schema, for example poses."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Container, Hashable, Mapping
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, TypeVar, get_args

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from sagline.core.arrays import FARTHEST, Array, checked
from sagline.core.errors import FileError, InvalidValueError, did_you_mean
from sagline.files.quantity import QUATERNION_TOLERANCE, in_si, plain_number
from sagline.files.reading import error_at_line
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

YAML_LIMIT: Final = 1.0  # largest size of a file [MB], sufficient for thousands of waypoints or cables
_DEEPEST: Final = 20  # largest number of nesting levels
_MOST: Final = 25_000  # largest number of values; reading them takes a second
_TAG: Final = "tag:yaml.org,2002:"
_WORDS: Final = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), f"{_TAG}null"),
    **dict.fromkeys(("true", "True", "TRUE", "false", "False", "FALSE"), f"{_TAG}bool"),
    "<<": f"{_TAG}merge",
}


class YamlEntry(BaseModel):
    """Base class of the schemas: only declared keys are allowed, and types are not converted."""

    # a quantity is declared with its unit: `mass: Annotated[Any, "kg"]`

    model_config = ConfigDict(extra="forbid", strict=True)

    @classmethod
    def units(cls) -> dict[str, str]:
        """Units of the quantities of the schema, by key."""
        return {key: str(field.metadata[0]) for key, field in cls.model_fields.items() if field.metadata}

    def si(self, key: str, within: str = "") -> Any:
        """Quantity of `key` in SI units. In messages, `within` precedes the key."""
        return in_si(getattr(self, key), type(self).model_fields[key].metadata[0], within + key)

    def given(self, within: str = "") -> dict[str, Any]:
        """Quantities of all keys in the file, in SI units."""
        return {key: self.si(key, within) for key in self.units() if key in self.model_fields_set}


_UNITS_STEP: Final = "Check its unit: numbers are meters, millimeters are written as 1500 mm."


class _Euler(YamlEntry):
    alpha: Any = 0.0
    beta: Any = 0.0
    gamma: Any = 0.0


class PoseEntry(YamlEntry):
    """Schema of a pose in a file."""

    position: Any
    euler: _Euler | None = None
    quaternion: Any = None

    def pose(self, item: str) -> Pose:
        """The pose. InvalidValueError if it is invalid or too far away for any machine."""
        position = _si_numbers(self.position, 3, "m", f"{item}.position")
        if (far := float(np.abs(position).max())) > FARTHEST:
            raise InvalidValueError(f"{item}.position", f"{far:g} m away", f"up to {FARTHEST:g} m", _UNITS_STEP)
        if self.quaternion is None:
            euler = self.euler or _Euler()
            angles = [in_si(angle, "rad", f"{item}.euler.{name}") for name, angle in euler]
            return Pose.from_euler(position, *_si_numbers(angles, 3, "rad", f"{item}.euler"))
        if self.euler is not None:
            value, step = "given with euler and quaternion", "Leave one of them out."
            raise InvalidValueError(item, value, "one of the two, or none", step)
        quaternion = _si_numbers(self.quaternion, 4, "", f"{item}.quaternion")
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1.0) > QUATERNION_TOLERANCE:
            wrong, allowed = f"the length of {item}.quaternion", f"1 to {QUATERNION_TOLERANCE:g}"
            raise InvalidValueError(wrong, f"{length:.6g}", allowed, f"Correct {item}.")
        return Pose.from_quaternion(position, quaternion / length)


def _si_numbers(value: Any, count: int, unit: str, item: str) -> Array:
    """Convert `value` from a file to `count` numbers in SI, shape (count,)."""
    numbers = checked(in_si(value, unit, item), item, unit)
    if numbers.shape != (count,):
        raise InvalidValueError(item, f"of shape {numbers.shape}", f"a list of {count} numbers", f"Correct {item}.")
    return numbers


def schema_of(keys: Mapping[str, Any], required: Container[str] = ()) -> Any:
    """Create the schema of a mapping. `keys`: for each key, the unit of a quantity, or another type of value."""
    kinds = {name: Annotated[Any, what] if isinstance(what, str) else what for name, what in keys.items()}
    found: dict[str, Any] = {name: (kind, ... if name in required else None) for name, kind in kinds.items()}
    return create_model("_Keys", __base__=YamlEntry, **found)


Schema = TypeVar("Schema", bound=YamlEntry)


def validate(data: Mapping[Any, Any], schema: type[Schema], origin: Path | str) -> Schema:
    """Check a mapping against a schema; raise FileError for an unknown or missing key, or a wrong type."""
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        mistakes = error.errors(include_url=False)
    # misspelt keys are reported first, because each of them is also reported as a missing key
    first = next((mistake for mistake in mistakes if mistake["type"] == "extra_forbidden"), mistakes[0])
    key, found, allowed, next_step = _explain(first, schema)
    refused = FileError(origin, f"{key} is {found}{allowed and f'; allowed: {allowed}'}", next_step, item=key)
    refused.value, refused.allowed = found, allowed
    raise refused


def _explain(mistake: ErrorDetails, schema: type[YamlEntry]) -> tuple[str, str, str, str]:
    """Key, value, allowed values and next step of a schema error."""
    where = mistake["loc"]
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in where).removeprefix(".")
    found = reprlib.repr(mistake["input"])
    match mistake["type"]:
        case "missing":
            return key, "missing", "", f"Add the key {key}."
        case "extra_forbidden":
            known = list(_at(schema, where[:-1]).model_fields)
            return key, "an unknown key", ", ".join(known), did_you_mean(str(where[-1]), known, "Remove it.")
        case "model_type":
            known = list(_at(schema, where).model_fields)
            return key, found, f"keys {', '.join(known)}", "Give a mapping with keys."
        case "dict_type":
            return key, found, "a mapping with keys", f"Correct {key}."
        case "string_type":
            return key, found, "text", f'Put it in quotes: {key}: "..."'
        case _:
            wanted = mistake["msg"].removeprefix("Input should be ")
            return key, found, wanted, f"Correct {key}."


def _at(schema: type[YamlEntry], where: tuple[int | str, ...]) -> type[YamlEntry]:
    """Schema of the mapping at the path `where` of the file. Indices and free keys in the path have no effect."""
    for part in (part for part in where if isinstance(part, str) and part in schema.model_fields):
        kind = schema.model_fields[part].annotation
        schema = next(k for k in (kind, *get_args(kind)) if isinstance(k, type) and issubclass(k, YamlEntry))
    return schema


def parse_mapping(text: str, origin: Path | str) -> dict[Any, Any]:
    """Read the top-level mapping of a YAML text; duplicate keys are refused."""
    # Only plain decimal numbers, true, false and null are converted. Everything else remains text: yes is not true,
    # 1:30 is not 90, and there are no dates and no tags. Aliases are allowed if their expansion is not too large.
    try:
        data = yaml.load(text, Loader=_PlainLoader)
    except yaml.MarkedYAMLError as error:
        raise error_at_line(origin, *_cause(error, text)) from None
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:  # the last two: \UFFFFFFFF
        reason = f"is not YAML in the form that sagline reads ({_reason(error, text)})"
        raise error_at_line(origin, reason, "Check that this is the file you mean.") from None
    if data is None:
        raise FileError(origin, "is empty", "Write it again; it may have been cut off.")
    if not isinstance(data, dict):
        raise FileError(origin, "has no keys at its top level", "Check that this is the file you mean.")
    return data


def dump_mapping(data: Mapping[str, Any]) -> str:
    """Write a mapping as YAML that `parse_mapping` restores. Texts that look like numbers are in quotes."""
    return yaml.dump(
        dict(data), Dumper=_PlainDumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120
    )


def _cause(error: yaml.MarkedYAMLError, text: str) -> tuple[str, str]:
    """Reason why a text is not YAML, and the next step. The reason contains the message of PyYAML if it is clear."""
    mark, problem = error.problem_mark or error.context_mark, str(error.problem or error.context)
    index, place = (len(text), "") if mark is None else (mark.index, f"line {mark.line + 1}: ")
    if isinstance(error, yaml.scanner.ScannerError | yaml.parser.ParserError):
        line = text.splitlines()[mark.line] if mark is not None and mark.line < len(text.splitlines()) else ""
        if "\t" in line[: len(line) - len(line.lstrip())] or text[index : index + 1] == "\t":
            return f"is not YAML ({place}a tab is used instead of blanks)", "Indent with blanks, not with tabs."
        if not text[index:].strip():
            return f"is not complete YAML ({place}{problem})", "Correct its end; it may have been cut off."
        return f"is not YAML ({place}{problem})", "Correct this line, or the indentation and the quotes before it."
    if tag := re.search(r"constructor for the tag '(?:tag:yaml\.org,2002:)?(.*)'", problem):
        return f"{place}the tag {tag[1]} precedes a value; tags are not allowed", "Write the value without it."
    if "unhashable" in problem:
        return f"{place}a key is a list or a mapping; allowed: a word", "Give a word as the key."
    if "another document" in problem:
        return f"{place}a second document begins, at ---; allowed: one", "Keep one of them."
    step = "Remove one of the two." if "given twice" in problem else "Correct this line."
    return f"{place}{problem.removeprefix('found ')}", step


def _reason(error: Exception, text: str) -> str:
    if isinstance(error, yaml.reader.ReaderError):
        line = text.count("\n", 0, error.position) + 1
        return f"line {line} contains the character {chr(int(error.character))!r}"
    return str(error).splitlines()[0]


class _PlainLoader(yaml.SafeLoader):
    """Reader of texts, plain numbers, null, lists and mappings. Keys are unique; levels and values are limited."""

    yaml_constructors: ClassVar[dict[Any, Any]] = {}

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._level = self._composed = 0

    def get_single_node(self) -> yaml.Node | None:
        node: yaml.Node | None = super().get_single_node()
        if node is not None:
            _extent(node, {})
        return node

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        self._composed += 1
        if self._level == _DEEPEST or self._composed > _MOST:
            raise _too_much(self.peek_event().start_mark)  # type: ignore[no-untyped-call]
        self._level += 1
        node: yaml.Node | None = super().compose_node(parent, index)
        self._level -= 1
        return node

    def resolve(self, kind: type[yaml.Node], value: str | None, implicit: Any) -> str:
        return _tag_of(kind, value, implicit)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        # duplicate keys are refused here, because PyYAML silently keeps only the last; PyYAML itself refuses a wrong
        # !!map
        keys = [key for key, _ in node.value] if node.id == "mapping" else []
        seen = set()
        for key in (key for key in keys if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.MarkedYAMLError(problem=f"key {key.value} is given twice", problem_mark=key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def construct_number(self, node: yaml.ScalarNode) -> object:
        text = self.construct_scalar(node)
        number = plain_number(text)
        if number is None:  # the code that uses the text reports the error later
            return text
        return int(text) if text.lstrip("+-").isdecimal() else number


class _PlainDumper(yaml.SafeDumper):
    """Writer with quotes around every text that `_PlainLoader` or PyYAML would not read as a text."""

    def resolve(self, kind: type[yaml.Node], value: str | None, implicit: Any) -> str:
        ours = _tag_of(kind, value, implicit)
        return ours if ours != f"{_TAG}str" else str(super().resolve(kind, value, implicit))  # type: ignore[no-untyped-call]


def _tag_of(kind: type[yaml.Node], value: str | None, implicit: Any) -> str:
    """Choose the tag of a value without an explicit tag."""
    if kind is yaml.ScalarNode and value is not None and implicit[0]:  # the value has neither quotes nor a tag
        if value in _WORDS:
            return _WORDS[value]
        if plain_number(value) is None:
            return f"{_TAG}str"
        return f"{_TAG}{'int' if value.lstrip('+-').isdecimal() else 'float'}"
    return f"{_TAG}seq" if kind is yaml.SequenceNode else f"{_TAG}map" if kind is yaml.MappingNode else f"{_TAG}str"


def _extent(node: yaml.Node, known: dict[int, tuple[int, int] | None]) -> tuple[int, int]:
    """Numbers of values and of levels of a node after its aliases are expanded. `known`: cache of these numbers."""
    if id(node) in known:
        found = known[id(node)]
        if found is None:
            raise yaml.YAMLError(f"line {node.start_mark.line + 1}: an alias of itself")
        return found
    known[id(node)] = None
    inside = node.value if isinstance(node, yaml.CollectionNode) else []
    children = chain.from_iterable(inside) if isinstance(node, yaml.MappingNode) else inside
    extents = [_extent(child, known) for child in children]
    values, levels = 1 + sum(values for values, _ in extents), 1 + max((levels for _, levels in extents), default=0)
    if values > _MOST or levels > _DEEPEST:
        raise _too_much(node.start_mark)
    known[id(node)] = values, levels
    return values, levels


def _too_much(mark: yaml.Mark) -> yaml.YAMLError:
    return yaml.YAMLError(f"line {mark.line + 1}: more than {_DEEPEST} levels or {_MOST} values, aliases written out")


for _kind in ("null", "bool", "str", "seq", "map"):
    _PlainLoader.add_constructor(f"{_TAG}{_kind}", getattr(yaml.SafeLoader, f"construct_yaml_{_kind}"))
for _kind in ("int", "float"):
    _PlainLoader.add_constructor(f"{_TAG}{_kind}", _PlainLoader.construct_number)
_PlainLoader.add_constructor(None, yaml.SafeLoader.construct_undefined)  # type: ignore[type-var]
