"""Rules for the tests (parts of errors, public names), for docstrings and for the language."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.mutants.__main__ import mutants
from tests.tiers import extended
from tools import prose, size

TESTS = Path(__file__).parent
LETTERS = re.compile(r"[A-Za-z]{2}")
SENTENCES = 25  # largest number of literal sentences outside the snapshots
FOREIGN = 65  # largest number of imports of inner modules of another folder
# Folders whose tests inspect all modules, and modules that any test may import: core, kernels, the command line.
OF_ALL_MODULES = {"kernels", "translate", "abuse", "fuzz", "docs", "mutants", "conftest.py"}
OPEN = re.compile(r"sagline\.((core|kernels)\b|cli\.main$)")


@cache
def trees() -> dict[Path, ast.Module]:
    return {file: ast.parse(file.read_text(encoding="utf-8")) for file in sorted(TESTS.rglob("*.py"))}


def is_sentence(node: ast.AST) -> bool:
    """True if a literal has three words or more, like the messages of sagline."""
    if isinstance(node, ast.JoinedStr):
        text = "".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
    else:
        text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
    return sum(1 for word in text.split(" ") if LETTERS.search(word)) >= 3


def sentences(tree: ast.Module) -> Iterator[int]:
    """Lines with compared sentences: in an assertion, or as `match` of `pytest.raises`."""
    for node in ast.walk(tree):
        looked_at = node.test if isinstance(node, ast.Assert) else None
        if isinstance(node, ast.keyword) and node.arg == "match":
            looked_at = node.value
        if looked_at is not None:
            inside = {
                id(part) for each in ast.walk(looked_at) if isinstance(each, ast.JoinedStr) for part in each.values
            }
            yield from (
                each.lineno
                for each in ast.walk(looked_at)
                if isinstance(each, ast.Constant | ast.JoinedStr) and id(each) not in inside and is_sentence(each)
            )


@extended
def test_few_tests_compare_a_literal_sentence() -> None:
    found = [f"{file.relative_to(TESTS)}:{line}" for file, tree in trees().items() for line in sentences(tree)]
    assert len(found) <= SENTENCES, f"{len(found)} sentences; compare parts of an error, or a snapshot: {found}"


def foreign_modules(file: Path, tree: ast.Module) -> Iterator[str]:
    """Inner modules of another folder of the source that a test imports."""
    parts = file.relative_to(TESTS).parts
    folder = parts[0] if len(parts) > 1 else ""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names = node.module.split(".")
            if names[0] == "sagline" and len(names) > 2 and names[1] != folder and not OPEN.match(node.module):
                yield f"{file.relative_to(TESTS)}:{node.lineno} {node.module}"


@extended
def test_few_tests_import_inner_modules_of_another_folder() -> None:
    found = [
        line
        for file, tree in trees().items()
        if file.relative_to(TESTS).parts[0] not in OF_ALL_MODULES
        for line in foreign_modules(file, tree)
    ]
    assert len(found) <= FOREIGN, f"{len(found)} imports; use public names, or the folder's own modules: {found}"


def test_names_and_numbers_with_units_are_no_sentences() -> None:
    code = """
assert "mass is not positive" in text
assert error.item == "cable 3: linear_density"
assert f"{value} of the poses cannot be reached" in text
with pytest.raises(ValueError, match="the pose is singular"): pass
assert value == "25 N"
"""
    assert sorted(sentences(ast.parse(code))) == [2, 4, 5]


def test_the_linter_of_the_prose_finds_forbidden_words_and_openings() -> None:
    code = '''
def stop():
    """What stops the servers, and lets go of who is connected."""
    # all is settled: `told` in code counts for nothing
    raise ValueError(f"the dead cable of {name} hangs\\nbeforehand")
'''
    found = [(line, words) for text in prose.python(code) for line, words, _ in prose.faults(text)]
    first = [(3, "What"), (3, "lets go"), (3, "of who"), (4, "settled")]
    assert sorted(found) == [*first, (5, "dead cable"), (5, "hangs"), (6, "beforehand")]
    text = "Smallest is the first; `told` and $told$ are skipped.\n\n```sh\ntold\n```\n\nAll is\nanew."
    assert [each[:2] for part in prose.page(text) for each in prose.faults(part)] == [(1, "Smallest is"), (8, "anew")]


@extended
def test_the_project_is_in_plain_english() -> None:
    assert [
        (file.name, *fault) for file in prose.files() for text in prose.prose(file) for fault in prose.faults(text)
    ] == []


@extended
def test_public_functions_have_their_sections() -> None:
    assert size.without_args() == []
    assert size.without_examples() == []


def test_every_listed_mistake_replaces_one_place_of_the_source() -> None:
    assert len(list(mutants())) > 100  # an entry that does not is an error of the list
