"""Linter of the prose: `make check` reports forbidden words and openings in pages, docstrings, comments and messages.

A line of output has the form `file:line: text -> suggestion`. Code, links and formulas in pages are skipped. A string
literal is a message if it has three words or more. Messages and tables in the tests are data and are skipped.
"""

from __future__ import annotations

import ast
import io
import json
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

ROOT: Final = Path(__file__).parents[1]
PLACES: Final = ("README.md", "CONTRIBUTING.md", "docs", "src", "examples", "benchmarks", "tools", "paper", "tests")
TESTS: Final = ROOT / "tests"
KINDS: Final = (".md", ".py", ".ipynb", ".toml")
OPENINGS: Final = {  # first words of a docstring -> suggestion
    r"What|How|Whether|Where|Which|Who|Whose|Whatever|When|Why": "a noun phrase or an imperative verb",
    r"Told|Given|Found|Taken|Held|Asked|Refused|Shown|Drawn|Carried|Said|Left|Kept": "a noun phrase",
}
WORDS: Final = {  # pattern, without regard to case -> suggestion
    r"shar(e|es|ed|ing) (of )?the load|ways? of sharing|load sharing": "tension distribution (method)",
    r"(the|its|each|whose|their|last|new) pulls?(?= (of|that|at|is|are|falls|rises)\b|[.,;:])": "sag force",
    r"hang(s|ing)?|hung": "sag, catenary, slack, suspended",
    r"dead cables?": "dead length",
    r"(in|of|few|more|last|many) rounds?|rounds? (of|in which)": "iterations",
    r"settled": "converged",
    r"strips? (of|in|are|is)": "bounds",
    r"told|tells?|telling": "given, stated, printed, observed",
    r"hardly (told|tell|tells|known)": "weakly identifiable",
    r"unresisted motions?": "unconstrained motion",
    r"suspicions?": "diagnostics",
    r"deaf|mute": "name what is ignored or stopped",
    r"no answers?": "no solution, no response",
    r"nobody|somebody|whoever|(he|those|one|of) who|who (wants|asks|knows|sees|drags|films|is)": "name the subject",
    r"what it is that|which (of them )?it is that|(all|what) there (is|are)": "a noun phrase",
    r"but for": "except",
    r"nothing but|no [a-z]+ but": "only",
    r"anew": "again",
    r"beforehand": "before, in advance",
    r"at odds": "inconsistent",
    r"whole or not (at all|written)": "atomically",
    r"honest(ly)?": "reliable",
    r"in silence": "silently",
    r"goes? on|went on": "continue",
    r"no more(?! (than|time|work))": "no longer",
    r"mend(s|ed|ing|able)?": "correct",
    r"works? (it |them )?out|worked out": "compute",
    r"in the way": "limiting",
    r"at the foot": "at the bottom",
    r"to and fro": "back and forth",
    r"next to nothing": "almost nothing",
    r"upon|wherein|whence|thereof|whereof|lest|thither|hitherto|therewith": "a plain word",
    r"stands? (for|in|beside|there|here|above|below|between|at|on|behind|with|against)": "is, means, opposes",
    r"knows? (of|nothing)": "contains, neglects",
    r"wants?": "needs, requests",
    r"speaks? of": "describes",
    r"(ones?|us|µs|ns|values?|rows?|samples?) an? (cable|pose|row|sample|count|second|group|direction)": "per",
    r"of which (its|their|one)": "name the subject",
    r"(?<!there )(is|are) no (?!longer|more|other|larger|smaller|greater|less|one)[a-z]+": "is not a",
    r"alike": "equal",
    r"besides": "in addition to",
    r"from where (it|they)": "name the place",
    r"(?<!there )(is|are) none of": "is not one of",
    r"(?:^|(?<=[.;:] ))(?-i:[A-Z])[a-z]+(?:ed|est|wn|ost|eft) (is|are|was|were)": "subject first",
}
INSIDE: Final = {  # as WORDS, for docstrings and comments of modules only
    r"(by|every|of|for|after) so (many|much)": "name the number",
    r"whatever": "independent of",
    r"as of(?= `)": "the same as that of",
    r"at hand": "available",
    r"lets? go": "release",
}
FORBIDDEN: Final = [(re.compile(rf"\b(?:{pattern})\b", re.I | re.M), words) for pattern, words in WORDS.items()]
COMMENTED: Final = [(re.compile(rf"\b(?:{pattern})\b", re.I | re.M), words) for pattern, words in INSIDE.items()]
FIRST: Final = [(re.compile(rf"\s*(?:{pattern})\b"), words) for pattern, words in OPENINGS.items()]
SKIPPED: Final = re.compile(
    r"`[^`]*`|\$\$[^$]*\$\$|\$[^$]*\$|\]\([^)]*\)|<[^>]*>|https?://\S+|^\s*(>>>|\.\.\.) .*$|^ {4,}\w+(?=: )",
    re.MULTILINE,
)
DOCUMENTED: Final = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


class Text(NamedTuple):
    """A piece of prose with the number of its first line."""

    line: int
    text: str
    docstring: bool = False
    comment: bool = False


def page(text: str) -> Iterator[Text]:
    """Paragraphs of a Markdown page, without blocks of code and formulas."""
    fenced, start, lines = False, 1, list[str]()
    for number, line in enumerate([*text.splitlines(), ""], 1):
        fence = line.lstrip().startswith(("```", "$$"))
        if fenced or fence or not line.strip():
            if lines:
                yield Text(start, "\n".join(lines))
            start, lines = number + 1, []
            fenced ^= fence and line.strip().count("$$") != 2
        else:
            lines.append(line)


def python(source: str) -> Iterator[Text]:
    """Docstrings, messages and comments of a module."""
    tree = ast.parse(source)
    first = [node.body[0] for node in ast.walk(tree) if isinstance(node, DOCUMENTED) and node.body]
    docstrings = {id(each.value) for each in first if isinstance(each, ast.Expr)}
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in inner:
            parts = node.values if isinstance(node, ast.JoinedStr) else [node]
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "`x`" for part in parts)
            is_text = isinstance(node, ast.JoinedStr) or isinstance(node.value, str)
            if is_text and (id(node) in docstrings or len(re.findall(r"(?<!\S)[A-Za-z]{2,}(?![\w=(/])", text)) >= 3):
                yield Text(node.lineno, text, id(node) in docstrings)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Text(token.start[0], token.string, comment=True)


def prose(file: Path) -> Iterator[Text]:
    """Pieces of prose of a page, a notebook or a module."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        return page("\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown"))
    if TESTS in file.parents:
        return (each for each in python(text) if each.docstring or each.comment)
    return python(text) if file.suffix == ".py" else page(text)


def faults(text: Text) -> Iterator[tuple[int, str, str]]:
    """Line, words and suggestion of each forbidden opening and word of a text."""
    read = SKIPPED.sub(lambda found: "`" + "\n" * found[0].count("\n"), text.text)
    found = [(match, words) for pattern, words in FIRST if text.docstring and (match := pattern.match(read))]
    forbidden = FORBIDDEN + COMMENTED if text.docstring or text.comment else FORBIDDEN
    found += [(match, words) for pattern, words in forbidden for match in pattern.finditer(read)]
    for match, words in found:
        yield text.line + read.count("\n", 0, match.start()), match[0].strip(), words


def files() -> Iterator[Path]:
    """Pages, notebooks and modules of the project; of the tests the modules only."""
    for place in PLACES:
        found = sorted((ROOT / place).rglob("*")) if (ROOT / place).is_dir() else [ROOT / place]
        kinds = KINDS if place != "tests" else (".py",)
        yield from (file for file in found if file.suffix in kinds and file != Path(__file__))


def main() -> int:
    """Print all faults."""
    found = [(file, *fault) for file in files() for text in prose(file) for fault in faults(text)]
    for file, line, words, suggestion in found:
        print(f"{file.relative_to(ROOT)}:{line}: {words} -> {suggestion}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
