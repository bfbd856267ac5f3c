"""A cache that does not see one parameter of its function: the bug of a stale key."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any


class Unseen:
    """A value that is equal to any other."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Unseen)

    def __hash__(self) -> int:
        return 0


def blind(name: str, decorator: Callable[..., Any]) -> Callable[..., Any]:
    """The decorator of a cache, blind for the parameter ``name``."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(function)

        @decorator
        def kept(*given: Any, **named: Any) -> Any:
            bound = signature.bind(*given, **named)
            bound.arguments[name] = bound.arguments[name].value
            return function(*bound.args, **bound.kwargs)

        @functools.wraps(function)
        def wrapper(*given: Any, **named: Any) -> Any:
            bound = signature.bind(*given, **named)
            bound.apply_defaults()
            bound.arguments[name] = Unseen(bound.arguments[name])
            return kept(*bound.args, **bound.kwargs)

        vars(wrapper).update(cache_clear=kept.cache_clear, cache_info=kept.cache_info)
        return wrapper

    return decorate
