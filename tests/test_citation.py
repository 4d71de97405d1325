"""CITATION.cff follows the Citation File Format 1.2.0 and agrees with the package."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field

ROOT = Path(__file__).parents[1]
Text = Annotated[str, Field(min_length=1)]


class Part(BaseModel):
    """A part of the file without other keys (definitions of the same names in schema.json of the format)."""

    model_config = ConfigDict(extra="forbid", strict=True, alias_generator=lambda name: name.replace("_", "-"))


class Entity(Part):
    name: Text


class Person(Part):
    family_names: Text
    given_names: Text


class Reference(Part):
    type: Literal["article"]
    title: Text
    authors: Annotated[list[Entity | Person], Field(min_length=1)]
    journal: Text
    year: int
    volume: int
    issue: Text
    start: Text
    doi: Annotated[str, Field(pattern=r"^10\.\d{4,9}(\.\d+)?/[A-Za-z0-9:/_;\-\.\(\)\[\]\\]+$")]


class Citation(Part):
    cff_version: Literal["1.2.0"]
    type: Literal["software", "dataset"]
    title: Text
    message: Text
    abstract: Text
    authors: Annotated[list[Entity | Person], Field(min_length=1)]
    version: Text
    license: Literal["MIT"]
    keywords: Annotated[list[Text], Field(min_length=1)]
    references: list[Reference]


def test_the_citation_is_valid_and_agrees_with_the_package() -> None:
    found = Citation.model_validate(yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8")))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert (found.version, found.license) == (project["version"], project["license"])
    assert [author.model_dump() for author in found.authors] == project["authors"]
    assert len(found.keywords) == len(set(found.keywords))
    assert found.references[0].doi in (ROOT / "docs" / "bibliography.md").read_text(encoding="utf-8")
