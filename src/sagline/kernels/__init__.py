"""Compiled kernels: they take and return floats and arrays in SI units. `__init__.pyi` lists entries.

`from sagline.kernels import inverse_poses` loads the entry from the library of compiled kernels, without the Python
source of the kernels that it calls.
"""

from __future__ import annotations

from sagline.core.surface import public_names


def __getattr__(name: str) -> object:
    """An entry in the stub."""
    module = public_names(__name__).get(name)
    if module is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from sagline.kernels.jit import loaded_entry

    return globals().setdefault(name, loaded_entry(name, module))
