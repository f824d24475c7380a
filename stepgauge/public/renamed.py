"""Arguments of public functions under the names that they had in earlier versions."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")


def renamed(**names: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator: earlier names of arguments and those that took their places.

    They work for two minor versions, with a ``DeprecationWarning`` that says the new one, as names of the package do.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        """The same function, which also takes the earlier names."""

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> T:
            """With the new names in place of the earlier ones."""
            given = dict[str, Any](kwargs)
            for old, new in names.items():
                if old in given:
                    if args or new in given:
                        raise TypeError(f"{function.__name__}() got {new} twice, as {old} too")
                    what = f"the argument {old} of {function.__name__} is now {new}"
                    warnings.warn(what, DeprecationWarning, stacklevel=2)
                    given[new] = given.pop(old)
            return cast(Callable[..., T], function)(*args, **given)

        return call

    return decorate
