"""Elements and views of arrays, and items of tuples.

An element is written with a macro, AT2(array, i, j), which tests its indices if the C is compiled with -DSL_CHECK.
Bounds of slices are clamped as in Python. An index counts from the end only if it is a negative constant.
"""

from __future__ import annotations

import ast

from tools.translate.expressions import Expressions
from tools.translate.scope import Value
from tools.translate.types import ArrayType, Scalar, TupleType, words


class Indexing(Expressions):
    """Subscripts of one function."""

    def subscript(self, node: ast.Subscript) -> Value:
        """An element or a view of an array, or an item of a tuple."""
        nodes = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        plain = [each for each in nodes if not isinstance(each, ast.Slice)]
        base, *indices = self.operands([node.value, *plain])
        if isinstance(base.type, TupleType):
            return self._item(base, indices[0] if len(nodes) == 1 == len(plain) else None, node)
        if not isinstance(base.type, ArrayType):
            self.refuse(node, f"an index of {words(base.type)}", "Index arrays and tuples.")
        if len(nodes) > base.type.rank:
            self.refuse(node, f"{len(nodes)} indices of an {words(base.type)}", "Give as many as it has axes.")
        held = self.hold(base)
        numbers = iter(indices)
        places = [
            each if isinstance(each, ast.Slice) else self._index(next(numbers), held, k, each)
            for k, each in enumerate(nodes)
        ]
        texts = [place for place in places if isinstance(place, str)]
        if len(texts) == base.type.rank:
            macro = "VIEW" if base.type.strided else "AT"
            text = f"{macro}{len(texts)}({', '.join([held.text, *texts])})"
            return Value(text, base.type.element.scalar, reads=True)
        return self._view(held, base.type, places, node)

    def _item(self, base: Value, index: Value | None, node: ast.Subscript) -> Value:
        """An item of a tuple."""
        assert isinstance(base.type, TupleType)
        first = base.type.types[0] if base.type.types else None
        if index is None or index.type is not Scalar.INT:
            self.refuse(node, f"a slice or index of {words(base.type)}", "Use one integer.")
        if not index.is_known and isinstance(first, Scalar) and set(base.type.types) == {first}:
            texts = ", ".join(item.text for item in self.parts(base, node))
            place = f"[SL_INDEX({index.text}, {len(base.type.types)})]"
            text = f"((const {self.program.c_type(first)}[]){{{texts}}}){place}"
            return Value(text, first, reads=base.reads or index.reads, writes=base.writes or index.writes)
        if not index.is_known:
            self.refuse(node, f"an index of {words(base.type)} that is not constant", "Use a constant, or an array.")
        if not -len(base.type.types) <= index.known < len(base.type.types):
            self.refuse(node, f"item {index.known} of {len(base.type.types)}", "Use an item of the tuple.")
        item: int = index.known % len(base.type.types)
        if base.items is not None and not base.writes:
            return base.items[item]
        return self.field(self.hold(base), base.type.fields[item], base.type.types[item])

    def _index(self, value: Value, held: Value, axis: int, node: ast.AST) -> str:
        """An index of an axis; a negative constant counts from the end."""
        if value.type is not Scalar.INT:
            self.refuse(node, f"{words(value.type)} as an index", "Use an integer.")
        if value.is_known and value.known < 0:
            return f"{held.text}.n{axis} - {-value.known}"
        if value.text.startswith("-"):
            self.refuse(node, f"the negative index {ast.unparse(node)}", "Count from the start: array.shape[0] - k.")
        return value.text

    def _view(self, held: Value, type_: ArrayType, places: list[str | ast.Slice], node: ast.AST) -> Value:
        """A view: a pointer to its first element, its sizes, and strides unless it is contiguous."""
        offsets: list[str] = []
        sizes: list[str] = []
        strides: list[str] = []
        contiguous = not type_.strided
        padded = [*places, *[ast.Slice()] * (type_.rank - len(places))]
        for axis, place in enumerate(padded):
            size, stride = f"{held.text}.n{axis}", self.stride(held.text, type_, axis)
            if isinstance(place, str):
                contiguous = contiguous and not sizes
                offsets.append(self._scaled(f"SL_INDEX({place}, {size})", stride))
                continue
            start, count = self._bounds(place, size, node)
            contiguous = contiguous and not (sizes and (place.lower is not None or place.upper is not None))
            if start:
                offsets.append(self._scaled(start, stride))
            sizes.append(count)
            strides.append(stride or "1")
        view = ArrayType(type_.element, len(sizes), not contiguous, type_.constant)
        pointer = " + ".join([f"{held.text}.p", *offsets])
        values = [pointer, *sizes, *([] if contiguous else strides)]
        return Value(f"(({self.program.c_type(view)}){{{', '.join(values)}}})", view)

    @staticmethod
    def _scaled(index: str, stride: str) -> str:
        """An index times a stride."""
        return f"{index} * {stride}" if stride else index

    def _bounds(self, place: ast.Slice, size: str, node: ast.AST) -> tuple[str, str]:
        """First index of a slice, "" for 0, and the number of its elements."""
        if place.step is not None:
            self.refuse(node, "a slice with a step", "Loop over range(start, end, step).")
        at_start = isinstance(place.lower, ast.Constant) and place.lower.value == 0
        lower = "" if at_start else self._bound(place.lower, size, node)
        upper = self._bound(place.upper, size, node)
        if not lower:
            return "", upper or size
        start = self.hold(Value(lower, Scalar.INT)).text
        return start, f"sl_count({start}, {upper or size})"

    def _bound(self, node: ast.expr | None, size: str, slice_: ast.AST) -> str:
        """A bound of a slice, clamped to 0 and the size; "" if there is none."""
        if node is None:
            return ""
        value = self.expression(node)
        if value.type is not Scalar.INT:
            self.refuse(slice_, f"{words(value.type)} as a bound of a slice", "Use an integer.")
        return f"sl_bound({value.text}, {size})"
