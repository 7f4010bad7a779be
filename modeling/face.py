"""A package's public names, each loaded when it is first asked for (PEP 562)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazily(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package whose names live in modules below it.

    Parameters
    ----------
    package : str
        Its name.
    homes : mapping of module name to public names, separated by spaces
        Module names are relative to the package; without names the module itself is public.
    """
    if not package.startswith("tactileq"):  # as in earlier versions; all would be there twice
        raise ImportError(f"expected the package tactileq.{package}, got {package}; import that.")
    places = {
        name: module
        for module, names in homes.items()
        for name in names.split() or [module.rpartition(".")[2]]
    }

    def find(name: str) -> Any:
        """The public object of this name; AttributeError where there is none."""
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = import_module(f"{package}.{places[name]}")
        found = getattr(module, name) if name in homes[places[name]].split() else module
        setattr(sys.modules[package], name, found)  # so that it is looked for once
        return found

    return find, lambda: sorted(places), list(places)
