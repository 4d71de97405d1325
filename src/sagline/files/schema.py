"""A file's mapping against its schema; the first mistake becomes one message that names the key."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from sagline.core.errors import FileError, nearest

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails


class Entry(BaseModel):
    """A mapping in a file: the listed keys and no others, values of the type they are written in."""

    model_config = ConfigDict(extra="forbid", strict=True)


Schema = TypeVar("Schema", bound=Entry)


def validated(data: Mapping[Any, Any], schema: type[Schema], origin: Path | str) -> Schema:
    """The mapping as its schema has it.

    Args:
        data: What the file says.
        schema: What it may say.
        origin: The file, for the message.

    Returns:
        The entry, every key known and of its type.

    Raises:
        FileError: If a key is unknown, missing, or holds the wrong kind of value.
    """
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        mistakes = error.errors(include_url=False)
    # a misspelt key explains the missing one beside it, so it is told first
    first = next((mistake for mistake in mistakes if mistake["type"] == "extra_forbidden"), mistakes[0])
    key, found, allowed, next_step = _explained(first, schema)
    refused = FileError(origin, f"{key} is {found}{allowed and f'; allowed: {allowed}'}", next_step, item=key)
    refused.value, refused.allowed = found, allowed
    raise refused


def _explained(mistake: ErrorDetails, schema: type[Entry]) -> tuple[str, str, str, str]:
    """The key, its value, what is allowed and the next step."""
    where = mistake["loc"]
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in where).removeprefix(".")
    found = reprlib.repr(mistake["input"])
    match mistake["type"]:
        case "missing":
            return key, "missing", "", f"Add the key {key}."
        case "extra_forbidden":
            known = list(_at(schema, where[:-1]).model_fields)
            near = nearest(str(where[-1]), known)
            next_step = f"Did you mean {near}?" if near else "Remove it."
            return key, "an unknown key", ", ".join(known), next_step
        case "model_type":
            known = list(_at(schema, where).model_fields)
            return key, found, f"keys {', '.join(known)}", "Give it as keys."
        case "string_type":
            return key, found, "text", f'Put it in quotes: {key}: "..."'
        case _:
            wanted = mistake["msg"].removeprefix("Input should be ")
            return key, found, wanted, f"Correct {key}."


def _at(schema: type[Entry], where: tuple[int | str, ...]) -> type[Entry]:
    """The schema of a mapping inside the file; list indices on the way do not matter."""
    for part in (part for part in where if isinstance(part, str)):
        kind = schema.model_fields[part].annotation
        schema = next(k for k in (kind, *get_args(kind)) if isinstance(k, type) and issubclass(k, Entry))
    return schema
