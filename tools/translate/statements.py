"""Statements in C, and the passes over the body of a function until the types do not change."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from tools.translate.calls import Calls
from tools.translate.expressions import ARITHMETIC, BITS
from tools.translate.names import as_load, names_in, own_loops, stored_in
from tools.translate.scope import WORD, NoTypeYetError, Value, identifier
from tools.translate.types import NONE, ArrayType, Scalar, TupleType, words

PASSES: Final = 20
INSTEAD: Final[dict[type[ast.stmt], str]] = {
    ast.FunctionDef: "Define functions at the top of a module.",
    ast.ClassDef: "Define NamedTuples at the top of a module.",
    ast.Try: "Return a status.",
    ast.Raise: "Return a status.",
    ast.Assert: "Test it in Python, before the entry is called.",
    ast.With: "Open what you need in Python.",
    ast.Delete: "Let variables be.",
    ast.Import: "Import at the top of the module.",
    ast.ImportFrom: "Import at the top of the module.",
    ast.Global: "Pass it as an argument.",
    ast.Nonlocal: "Pass it as an argument.",
    ast.Match: "Use if and elif.",
}


class Statements(Calls):
    """Statements of one function."""

    def infer(self) -> None:
        """Repeat the passes until types, read names and the kind of the function do not change."""
        body = self.node.body
        for _ in range(PASSES):
            before = (dict(self.types), self.returned, self.unread, self.fallible)
            self.begin_pass()
            self.block(body)
            self.unread = self.locals - self.read
            if before == (self.types, self.returned, self.unread, self.fallible):
                break
        if self.complete is not None:
            self.refuse(
                self.complete, "a variable is read that has no type", "Assign it a first value before the loop."
            )

    def block(self, body: Sequence[ast.stmt]) -> bool:
        """Translate statements; True if the last one leaves the block, so that nothing after it is reached."""
        with self._names_of(body):
            return any(self._step(statement) for statement in body)

    @contextmanager
    def _names_of(self, nodes: Sequence[ast.AST]) -> Iterator[None]:
        """Names that occur only in these nodes, so that the following lines may declare them."""
        inner = names_in(nodes)
        self.blocks.append(frozenset(name for name, count in inner.items() if count == self.mentions[name]))
        try:
            yield
        finally:
            self.blocks.pop()

    def inner_block(self, body: Sequence[ast.stmt]) -> bool:
        """A block of one more level of indentation."""
        self.depth += 1
        left = self.block(body)
        self.depth -= 1
        return left

    def _step(self, statement: ast.stmt) -> bool:
        """Translate a statement unless a variable in it has no type yet."""
        count, depth = len(self.lines), self.depth
        try:
            return self.statement(statement)
        except NoTypeYetError:
            del self.lines[count:]
            self.depth = depth
            self.complete = self.complete or statement
            return False

    def statement(self, node: ast.stmt) -> bool:
        """Translate a statement; True if it leaves the block."""
        match node:
            case ast.Expr():
                self._call_alone(node)
            case ast.Assign():
                self._assign(node)
            case ast.AnnAssign(value=ast.expr() as value):
                self.store(node.target, self.expression(value), node)
            case ast.AugAssign():
                self._update(node)
            case ast.If():
                return self._if(node)
            case ast.For():
                self._for(node)
            case ast.While():
                self._while(node)
            case ast.Return():
                self._return(node)
                return True
            case ast.Break() | ast.Continue():
                self.emit("break;" if isinstance(node, ast.Break) else "continue;")
                return True
            case ast.Pass():
                pass
            case _:
                self.refuse(node, type(node).__name__, INSTEAD.get(type(node), "Use assignments, if, for and while."))
        return False

    # ---- assignments

    def _call_alone(self, node: ast.Expr) -> None:
        """A call whose result is not used, or a docstring."""
        if isinstance(node.value, ast.Constant):
            return
        if not isinstance(node.value, ast.Call):
            self.refuse(node, f"{ast.unparse(node)} has no effect", "Delete it.")
        value = self.expression(node.value)
        if value.text:
            self.emit(f"{value.text};" if value.writes else f"(void){value.text};")
            self.written += value.writes

    def _assign(self, node: ast.Assign) -> None:
        """An assignment to one target or several."""
        value = self.expression(node.value)
        if len(node.targets) > 1 and not value.is_known:
            value = self.hold(value)
        for target in node.targets:
            self.store(target, value, node)

    def store(self, target: ast.expr, value: Value, node: ast.AST) -> None:
        """Assign a value to a name, an element, all elements of a view, or the names of a tuple."""
        match target:
            case ast.Name():
                self._store_name(target.id, value, node)
            case ast.Tuple() | ast.List():
                self._store_tuple(target.elts, value, node)
            case ast.Subscript():
                if value.writes:
                    value = self.hold(value)
                self._store_element(target, value, node)
            case _:
                self.refuse(node, f"an assignment to {ast.unparse(target)}", "Assign names, elements and tuples.")

    def _store_name(self, name: str, value: Value, node: ast.AST) -> None:
        """Assign a variable; declare it here if it occurs only in this block."""
        if name in self.unread:
            if value.writes:
                self.emit(f"(void){value.text};")
                self.written += 1
            return
        type_ = self.types[name] = self.joined(node, self.types.get(name), value.type, f"the variable {name}")
        if type_ == NONE:
            return
        given = self.converted(value, type_, node)
        if given == identifier(name):  # a part of a tuple that keeps its value
            return
        text = f"{identifier(name)} = {given};"
        self.written += value.writes
        if name not in self.declared:
            self.declared.add(name)
            if name in self.blocks[-1]:
                text = f"{self.program.c_type(type_)} {text}"
            else:
                self.above[name] = None
        self.emit(text)

    def _store_tuple(self, targets: list[ast.expr], value: Value, node: ast.AST) -> None:
        """Assign the items of a tuple; items that an earlier target changes get a name first."""
        items = self.parts(value, node)
        if len(items) != len(targets):
            self.refuse(node, f"{len(items)} values for {len(targets)} targets", "Give as many.")
        changed: set[str] = set()
        elements, held = False, []
        for target, item in zip(targets, items, strict=True):
            clash = (elements and item.reads) or not changed.isdisjoint(WORD.findall(item.text))
            held.append(self._copied(item) if (clash or item.writes) and not item.is_known else item)
            changed |= {identifier(name) for name in stored_in([target])}
            elements = elements or not isinstance(target, ast.Name)
        for target, item in zip(targets, held, strict=True):
            self.store(target, item, node)

    def _copied(self, value: Value) -> Value:
        """The value with a new name, even if it is a variable."""
        name = self.temporary()
        self.emit(f"{self.program.c_type(value.type)} {name} = {value.text};")
        self.written += value.writes
        return Value(name, value.type)

    def _store_element(self, target: ast.Subscript, value: Value, node: ast.AST) -> None:
        """Assign an element, or a number to all elements of a view."""
        place = self.subscript(target)
        self._check_writable(target, node)
        if isinstance(place.type, Scalar):
            self.emit(f"{place.text} = {self._for_element(value, place.type, node)};")
            return
        if not isinstance(place.type, ArrayType) or not isinstance(value.type, Scalar):
            found = f"{words(value.type)} assigned to {words(place.type)}"
            self.refuse(node, found, "Assign element by element in a loop.")
        held, number, rank = self.hold(place).text, self.hold(value).text, place.type.rank
        indices = [f"k_{axis}" for axis in range(rank)]
        for axis, index in enumerate(indices):
            self.emit(f"{'    ' * axis}for (int64_t {index} = 0; {index} < {held}.n{axis}; {index}++)")
        macro = "VIEW" if place.type.strided else "AT"
        self.emit(f"{'    ' * rank}{macro}{rank}({', '.join([held, *indices])}) = {number};")

    def _for_element(self, value: Value, type_: Scalar, node: ast.AST) -> str:
        """A number as an element of an array; smaller types accept it only with int or float."""
        if isinstance(value.type, Scalar) and value.type > type_:
            found = f"{words(value.type)} assigned to an element of {words(type_)}"
            self.refuse(node, found, "Convert it with int, or make the array larger.")
        return self.converted(value, type_, node)

    def _check_writable(self, target: ast.Subscript, node: ast.AST) -> None:
        """Refuse to write a constant array."""
        with self.aside():
            array = self.expression(target.value)
        if isinstance(array.type, TupleType):
            self.refuse(node, f"an item of a tuple, {ast.unparse(target)}, is assigned", "Make a new tuple.")
        if isinstance(array.type, ArrayType) and array.type.constant:
            self.refuse(node, f"{ast.unparse(target.value)} is a constant array", "Write to arrays that are arguments.")

    def _update(self, node: ast.AugAssign) -> None:
        """Assignments such as x += y: the operator of C if types allow it, else an operation and an assignment."""
        load = as_load(node.target)
        place, value = self.operands([load, node.value])
        if (
            value.writes
            and isinstance(load, ast.Subscript)
            and any(isinstance(each, ast.Subscript) for each in ast.walk(load.slice))
        ):
            self.refuse(
                node, "an index that is read from an array, before a call that may change it", "Name the index."
            )
        found = self.binary(place, node.op, value, node)
        symbol = ARITHMETIC[type(node.op)][0] if type(node.op) in ARITHMETIC else BITS.get(type(node.op), "")
        symbol = "/" if isinstance(node.op, ast.Div) and place.type is Scalar.FLOAT else symbol
        if symbol and found.type == place.type and place.type in (Scalar.INT, Scalar.FLOAT) and not value.writes:
            if isinstance(node.target, ast.Subscript):
                self._check_writable(node.target, node)
            right = self.widened(value, Scalar(place.type)).text
            self.emit(f"{place.text} {symbol}= {right};")
            self.written += value.writes
            return
        self.store(node.target, found, node)

    # ---- control

    def _return(self, node: ast.Return) -> None:
        """Return a value with the type of the annotation."""
        value = self.expression(node.value) if node.value is not None else Value("", NONE)
        type_ = self.annotated(self.node.returns, value.type)
        self.returned = self.joined(node, self.returned, type_, "the returned value")
        if self.returned == NONE:
            if value.text:
                self.emit(f"{value.text};")
            self.emit("return;")
        else:
            self.emit(f"return {self.converted(value, self.returned, node)};")

    def _if(self, node: ast.If, start: str = "if") -> bool:
        """A condition; parts that are known to be false are omitted."""
        test = self.truth(self.expression(node.test), node.test)
        if test.is_known:
            return self.block(node.body if test.known else node.orelse)
        self.emit(f"{start} ({test.text}) {{")
        self.written += test.writes
        left = self.inner_block(node.body)
        if node.orelse:
            other = node.orelse[0]
            self.emit("} else {")
            place = len(self.lines)
            left = self.inner_block(node.orelse) and left
            indent = "    " * self.depth
            if len(node.orelse) == 1 and isinstance(other, ast.If) and self._is_one_if(place):
                self.lines[place - 1 :] = [line[4:] for line in self.lines[place:]]
                self.lines[place - 1] = f"{indent}}} else {self.lines[place - 1].strip()}"
                return left
        self.emit("}")
        return left and bool(node.orelse)

    def _is_one_if(self, place: int) -> bool:
        """True if the lines from a position on are a single `if` with its closing brace."""
        inner = "    " * (self.depth + 1)
        heads = [line for line in self.lines[place:] if line.startswith(inner) and not line[len(inner)].isspace()]
        return (
            bool(heads) and heads[0].startswith(f"{inner}if (") and all(line[len(inner)] == "}" for line in heads[1:])
        )

    def _while(self, node: ast.While) -> None:
        """A loop with a condition."""
        if node.orelse:
            self.refuse(node, "while with else", "Set a flag.")
        with self.aside(deeper=1) as lines:
            test = self.truth(self.expression(node.test), node.test)
        self.emit(f"while ({test.text}) {{" if not lines else "for (;;) {")
        if lines:
            self.lines += [*lines, "    " * (self.depth + 1) + f"if (!({test.text})) break;"]
        self.inner_block(node.body)
        self.emit("}")

    def _for(self, node: ast.For) -> None:
        """A loop over range, an array of one axis, or explicit constants."""
        if node.orelse:
            self.refuse(node, "for with else", "Set a flag.")
        if isinstance(node.iter, ast.Call) and self.static(node.iter.func) is range and not node.iter.keywords:
            self._for_range(node, node.iter)
            return
        iterated = self.expression(node.iter)
        index = self.temporary()
        if isinstance(iterated.type, ArrayType) and iterated.type.rank == 1:
            held = self._copied(iterated).text
            macro = "VIEW1" if iterated.type.strided else "AT1"
            self.emit(f"for (int64_t {index} = 0; {index} < {held}.n0; {index}++) {{")
            item = Value(f"{macro}({held}, {index})", iterated.type.element.scalar)
        else:
            item = self._constants(iterated, index, node)
        self._turn(node, item)

    def _constants(self, iterated: Value, index: str, node: ast.For) -> Value:
        """The head of a loop over constants, and the item of an iteration."""
        items = iterated.items or ()
        types = {item.type for item in items}
        if len(types) != 1 or not all(item.is_known for item in items) or items[0].type == NONE:
            self.refuse(
                node, f"a loop over {words(iterated.type)}", "Loop over range, an array, or constants of one type."
            )
        table = self.temporary()
        texts = ", ".join(item.text for item in items)
        self.emit(f"static const {self.program.c_type(items[0].type)} {table}[] = {{{texts}}};")
        self.emit(f"for (int64_t {index} = 0; {index} < {len(items)}; {index}++) {{")
        return Value(f"{table}[{index}]", items[0].type)

    def _for_range(self, node: ast.For, call: ast.Call) -> None:
        """A loop over range: bounds are computed once, and the step is constant."""
        bounds = self.operands(call.args)
        if not 1 <= len(bounds) <= 3 or any(bound.type is not Scalar.INT for bound in bounds):
            self.refuse(node, "range of other things than integers", "Give one to three integers.")
        start = bounds[0] if len(bounds) > 1 else self.constant(0, node)
        end = bounds[1] if len(bounds) > 1 else bounds[0]
        step = bounds[2].known if len(bounds) == 3 and bounds[2].is_known else 1 if len(bounds) < 3 else 0
        if step == 0:
            self.refuse(node, "range with a step that is not constant", "Use a while loop.")
        changed = {identifier(name) for name in stored_in(node.body)}
        if end.reads or end.writes or "(" in end.text or not changed.isdisjoint(WORD.findall(end.text)):
            end = self._copied(end)
        name = node.target.id if isinstance(node.target, ast.Name) and node in own_loops(self.node) else ""
        index = identifier(name) if name else self.temporary()
        sign = "<" if step > 0 else ">"
        next_ = f"{index}++" if step == 1 else f"{index}--" if step == -1 else f"{index} += {step}"
        if ast.unparse(call.func) == "independent":
            self.emit("SL_INDEPENDENT")
        self.emit(f"for (int64_t {index} = {start.text}; {index} {sign} {end.within(10)}; {next_}) {{")
        if name:
            self.types[name] = Scalar.INT
            self.declared.add(name)
        self._turn(node, None if name else Value(index, Scalar.INT))

    def _turn(self, node: ast.For, item: Value | None) -> None:
        """The body of a loop, after the assignment of the iteration's item."""
        self.depth += 1
        with self._names_of([node]):
            if item is not None:
                self.store(node.target, item, node)
            self.block(node.body)
        self.depth -= 1
        self.emit("}")
