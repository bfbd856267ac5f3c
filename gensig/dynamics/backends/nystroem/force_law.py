"""Forces between bodies beside springs and meshes, as code of the core.

A law of its own is a subclass of ``ForceLaw`` and an entry of ``FORCE_LAWS`` in
``gensig.dynamics.backends.nystroem.method``, and an ``Element`` that names it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from gensig.arrays import Array
from gensig.dynamics.equations import Element


class ForceLaw(ABC):
    """Forces of the elements of one kind."""

    rows: ClassVar[Any]  # type of a named tuple: arrays of all elements, for all lanes

    @abstractmethod
    def pack(
        self, elements: Sequence[Sequence[Any]], rests: Array, precision: str
    ) -> Any:
        """Arrays of elements as ``rows``.

        Parameters
        ----------
        elements : of every lane, of the same bodies
        rests : (lane, dof)    from which the states of the lanes are counted
        """

    @abstractmethod
    def push(self, group: Any, elements: Any, q: int, v: int, machine: Any) -> None:
        """Write code that adds forces to the rows ``ON`` of the machine.

        ``elements`` are ``rows``, the state is in the blocks ``q`` and ``v``.
        """


def of_law(elements: Sequence[Element], law: str) -> list[Element]:
    """Elements of one law, in their order."""
    return [element for element in elements if element.law == law]
