"""Changes of inputs: bytes, tokens of the formats, trees of YAML and XML, and parts of HDF5 files."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import h5py
import numpy as np
import yaml

from sagline.files.netcdf import seal
from tests.abuse.damage import DAMAGES
from tests.abuse.test_read_bytes import CHANGES, PIECES
from tests.abuse.test_read_numbers import NO_NUMBERS, NUMBER, NUMBERS
from tests.abuse.test_read_structure import NAMES, STRANGE, TREE_CHANGES, _change_element, _stringed, slots
from tests.fuzz.targets import Target

Random = np.random.Generator
SEAL: Final = len("\nsagline sha256 \n") + 64  # bytes of a digest at the end of a file
WORDS: Final = (*NO_NUMBERS, *NUMBERS, *NAMES)
NUMBERS_OF_BYTES: Final = (0, 1, 127, 128, 255, 256, 32767, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1)
VALUES: Final = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 1e-300, -0.0, 2.0**53, 1e20)


def change_of(rng: Random, target: Target, samples: Sequence[bytes], folder: Path) -> bytes:
    """A changed sample of a reader."""
    data = samples[int(rng.integers(len(samples)))]
    for _ in range(int(rng.integers(1, 4))):
        changes = KINDS[target.kind]
        data = changes[int(rng.integers(len(changes)))](rng, data, folder)
        if rng.random() < 0.1:
            data = _spliced(rng, data, samples)
    return data


def _spliced(rng: Random, data: bytes, samples: Sequence[bytes]) -> bytes:
    """The beginning of a file and the end of another one."""
    other = samples[int(rng.integers(len(samples)))]
    return data[: int(rng.integers(len(data) + 1))] + other[int(rng.integers(len(other) + 1)) :]


def _any_bytes(rng: Random, data: bytes, folder: Path) -> bytes:
    """A change of text files."""
    change = CHANGES[int(rng.integers(len(CHANGES)))]
    return change(rng, data or b"x")


def _damaged(rng: Random, data: bytes, folder: Path) -> bytes:
    """A change of binary files."""
    content = bytearray(data.ljust(512, b"\0"))
    DAMAGES[int(rng.integers(len(DAMAGES)))](content, rng)
    return bytes(content)


def _length(rng: Random, data: bytes, folder: Path) -> bytes:
    """Another number of one to eight bytes somewhere."""
    size = int(rng.choice([1, 2, 4, 8]))
    value = int(NUMBERS_OF_BYTES[int(rng.integers(len(NUMBERS_OF_BYTES)))]) % (1 << 8 * size)
    at = int(rng.integers(len(data) + 1))
    number = value.to_bytes(size, "big") if rng.integers(2) else value.to_bytes(size, "little")
    return data[:at] + number + data[at + size :]


def _number(rng: Random, data: bytes, folder: Path) -> bytes:
    """Another number in a text."""
    text = data.decode("utf-8", "surrogateescape")
    places = [found.span() for found in NUMBER.finditer(text)]
    if not places:
        return data
    start, end = places[int(rng.integers(len(places)))]
    word = WORDS[int(rng.integers(len(WORDS)))]
    return (text[:start] + word + text[end:]).encode("utf-8", "surrogatepass" if _lone(word) else "surrogateescape")


def _lone(word: str) -> bool:
    """True if a word cannot be encoded as it is."""
    return any("\ud800" <= letter <= "\udfff" for letter in word)


def _word(rng: Random, data: bytes, folder: Path) -> bytes:
    """A word of the file at another place, or in place of another one."""
    words = list(re.finditer(rb"[A-Za-z_][\w.-]*|[-+\d.]+|[^\w\s]", data))
    if not words:
        return data
    one, other = (words[int(k)] for k in rng.integers(len(words), size=2))
    end = other.end() if rng.integers(2) else other.start()
    return data[: other.start()] + one[0] + data[end:]


def _line(rng: Random, data: bytes, folder: Path) -> bytes:
    """Lines left out, repeated, or in another order."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    k, many = int(rng.integers(len(lines))), int(rng.choice([0, 2, 30, 1000]))
    kind = int(rng.integers(3))
    if kind == 0:
        lines[k : k + 1] = lines[k : k + 1] * min(many, 1 + 100_000 // len(lines[k]))
    elif kind == 1:
        rng.shuffle(lines)
    else:
        lines.insert(int(rng.integers(len(lines) + 1)), lines[k])
    return b"".join(lines)


def _tree(rng: Random, data: bytes, folder: Path) -> bytes:
    """Another tree of YAML or XML; other files get other words."""
    text = data.decode("utf-8", "replace")
    try:
        if text.lstrip().startswith("<"):
            root = ElementTree.fromstring(text)
            _change_element(rng, root, [str(word) for word in (*STRANGE, *NAMES) if isinstance(word, str | int)])
            return ElementTree.tostring(root)
        if ":" in text.partition("\n")[0] or "\n" in text:
            tree = yaml.load(text, yaml.CSafeLoader)
            places = slots(tree)
            change = TREE_CHANGES[int(rng.integers(len(TREE_CHANGES)))]
            change(rng, *places[int(rng.integers(len(places)))], tree)
            text = yaml.dump(_stringed(tree), Dumper=yaml.CSafeDumper, allow_unicode=True)
            return text.encode("utf-8", "surrogatepass")
    except Exception:  # it is damaged already: another change
        pass
    return _word(rng, data, folder)


def _parts(rng: Random, data: bytes, folder: Path) -> bytes:
    """An HDF5 file with other values, types, shapes, names or attributes, and the right digest."""
    file = folder / "changed.h5"
    file.write_bytes(data[:-SEAL])
    seal(file)
    if file.read_bytes() != data:  # damaged already; HDF5 may never return from it
        return data
    try:
        with h5py.File(file, "r+") as content:
            for _ in range(int(rng.integers(1, 4))):
                _change_part(rng, content)
    except Exception:  # the change is not possible
        return data
    seal(file)
    return file.read_bytes()


def _change_part(rng: Random, content: h5py.File) -> None:
    """Change a data set or an attribute."""
    names: list[str] = []
    content.visit(names.append)
    item = content[names[int(rng.integers(len(names)))]] if rng.random() < 0.7 else content
    if rng.random() < 0.4 and len(item.attrs):
        _change_attribute(rng, item)
    elif isinstance(item, h5py.Dataset):
        _change_dataset(rng, content, item)


def _change_attribute(rng: Random, item: Any) -> None:
    """Remove an attribute, or give it another value."""
    key = list(item.attrs)[int(rng.integers(len(item.attrs)))]
    old = item.attrs[key]
    strange: tuple[Any, ...] = (
        *("", "x" * 5000, "nan", 0, -1, 1e300, np.nan, np.int64(2**62), np.zeros(3), np.array([b"a", b"b"])),
        h5py.Empty("f"),
    )
    if isinstance(old, str) and rng.random() < 0.5:
        item.attrs[key] = CHANGES[int(rng.integers(len(CHANGES)))](rng, old.encode() or b"x").decode("utf-8", "replace")
    elif rng.random() < 0.2:
        del item.attrs[key]
    elif rng.random() < 0.2:
        item.attrs.modify(PIECES[0].decode("latin-1").replace("\0", "a"), 1)
    else:
        item.attrs[key] = strange[int(rng.integers(len(strange)))]


def _change_dataset(rng: Random, content: h5py.File, item: h5py.Dataset) -> None:
    """Give a data set other values, another type or shape, or remove it."""
    values = np.asarray(item[()])
    name = item.name
    kind = int(rng.integers(6))
    if kind < 3 and values.size and values.dtype.kind in "fiub":
        flat = values.reshape(-1).copy()
        with np.errstate(all="ignore"):
            for k in rng.integers(flat.size, size=int(rng.choice([1, 3, flat.size]))):
                flat[k] = np.array(VALUES[int(rng.integers(len(VALUES)))]).astype(flat.dtype)
        item[()] = flat.reshape(values.shape)
        return
    attributes = dict(item.attrs)
    del content[name]
    if kind == 3:
        return
    if kind == 4 and values.dtype.kind in "fiub":
        with np.errstate(all="ignore"):
            values = values.astype(rng.choice(["i1", "f4", "f8", "i8", "u2"]))
    else:
        values = values[..., None] if rng.integers(2) else values.reshape(-1)[: max(values.size - 1, 0)]
    made = content.create_dataset(name, data=values)
    for key, value in attributes.items():
        if key not in ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS"):
            made.attrs[key] = value


Change = Callable[[Random, bytes, Path], bytes]
KINDS: Final[dict[str, tuple[Change, ...]]] = {
    "text": (_any_bytes, _any_bytes, _number, _word, _line, _tree, _tree),
    "binary": (_damaged, _damaged, _length, _length, _line, _word),
    "hdf5": (_parts, _parts, _parts, _damaged, _length),
}
