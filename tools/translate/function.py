"""One function for one set of argument types: its definition in C."""

from __future__ import annotations

import ast
import re
from collections import Counter

from tools.translate.scope import FAIL, SHORT, WORD, identifier
from tools.translate.statements import Statements
from tools.translate.types import NONE, ArrayType, TupleType

NAMED = re.compile(r"( *)[\w ]+ (t_\d+) = (.*);")
HOW = {"formula": "SL_FORMULA ", "glue": "SL_INLINE "}


class FunctionTranslation(Statements):
    """One function for one set of argument types."""

    name: str = ""

    def text(self) -> str:
        """The function in C, with its source location and the first line of its docstring."""
        doc = (ast.get_docstring(self.node) or "").partition("\n")[0].replace("*/", "* /")
        lines = [*self._declarations(), *_without_unused(self._with_returns())]
        used = set(WORD.findall("\n".join(lines)))
        unused = [name for name, type_ in self.parameters.items() if type_ != NONE and identifier(name) not in used]
        ignored = [f"    (void){identifier(name)};" for name in unused]
        comment = f"/* {self.function.__module__}.{self.function.__name__}: {doc} */"
        return "\n".join([comment, f"{self._head()} {{", *ignored, *lines, "}", ""])

    def _head(self) -> str:
        """Return type, name and parameters."""
        kind = getattr(self.node.decorator_list[0], "id", "") if self.node.decorator_list else ""
        types = self.parameters.items()
        parameters = [f"{self.program.c_type(type_)} {identifier(name)}" for name, type_ in types if type_ != NONE]
        parameters += ["int *sl_code"] if self.fallible else []
        returned = "void" if self.result == NONE else self.program.c_type(self.result)
        return f"static {HOW.get(kind, '')}{returned} {self.name}({', '.join(parameters) or 'void'})"

    def _declarations(self) -> list[str]:
        """Declarations of the variables that live longer than one block."""
        kept = [name for name in self.above if self.types[name] != NONE]
        return [
            f"    {self.program.c_type(self.types[name])} {identifier(name)} = {self.zero(self.types[name])};"
            for name in kept
        ]

    def _with_returns(self) -> list[str]:
        """All lines, with the returns after failed calls and checks, whose types are known now."""
        if self.result == NONE:
            leave = "return;"
        elif isinstance(self.result, TupleType | ArrayType):
            leave = f"return ({self.program.c_type(self.result)}){{0}};"
        else:
            leave = f"return {self.zero(self.result)};"
        short = f"{{ *sl_code = SAGLINE_SHORT_MEMORY; {leave} }}"
        return [line.replace(FAIL, leave).replace(SHORT, short) for line in self.lines]


def _without_unused(lines: list[str]) -> list[str]:
    """Lines without names for values that are never used."""
    counts = Counter(WORD.findall("\n".join(lines)))
    found = []
    for line in lines:
        named = NAMED.fullmatch(line)
        found.append(f"{named[1]}(void){named[3]};" if named and counts[named[2]] == 1 else line)
    return found
