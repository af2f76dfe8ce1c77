"""Documents in the right wrapping, JSON, YAML, NPZ or a pickle, with something wrong in their structure."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.hostile.damage import place

Change = Callable[[Any], Any]
"""From a document to another one."""
Container = dict[Any, Any] | list[Any]

VALUES = (
    *(None, True, 0, 1, -1, 3, 2**31, 2**63, 10**30, 10**400, 0.5, -0.0, 1e7, 1e308, -1e308, 5e-324),
    *(math.inf, -math.inf, math.nan, "", "a", "walk", "nan", "\0", "\ud800", "a\nb", "../../x", "a" * 2000, "${x}"),
    *([], {}, [[]], {"": None}, [None] * 3, [0.5] * 3, list(range(300))),
)
ARRAYS = (
    *(np.zeros(0), np.zeros(3), np.zeros((5, 3)), np.zeros((2, 2, 2)), np.zeros((3, 0)), np.arange(6)),
    *(np.full((5, 3), np.nan), np.full((5, 66), 1e308), np.full((5, 66), -np.inf, np.float16), np.float32(2.5)),
    *(np.array("x"), np.array(b"\xff"), np.array([None], object), np.zeros(2, complex), np.zeros((5, 3), bool)),
    *(np.zeros(2, "M8[s]"), np.zeros(2, [("a", "f8")]), np.zeros((5, 66), np.uint8), np.array(10**18)),
)


def _places(content: Any) -> Iterator[tuple[Container, Any]]:
    """Every container with a key of it, the outermost first."""
    if isinstance(content, dict | list):
        for key in list(content) if isinstance(content, dict) else range(len(content)):
            yield content, key
            yield from _places(content[key])


def _changed(at: float, do: Callable[[Container, Any], None]) -> Change:
    def change(content: Any) -> Any:
        holder = [copy.deepcopy(content)]
        found = list(_places(holder))
        do(*found[int(at * len(found))])
        return holder[0] if holder else None

    return change


def _put(value: Any) -> Callable[[Container, Any], None]:
    return lambda container, key: container.__setitem__(key, copy.deepcopy(value))


def _delete(container: Container, key: Any) -> None:
    del container[key]


def _rename(name: str) -> Callable[[Container, Any], None]:
    def rename(container: Container, key: Any) -> None:
        value = container.pop(key)
        container.update({name: value}) if isinstance(container, dict) else container.append(value)

    return rename


def _swap(at: float) -> Callable[[Container, Any], None]:
    def swap(container: Container, key: Any) -> None:
        keys = list(container) if isinstance(container, dict) else list(range(len(container)))
        other = keys[int(at * len(keys))]
        container[key], container[other] = container[other], container[key]

    return swap


def _repeat(times: int) -> Callable[[Container, Any], None]:
    def repeat(container: Container, key: Any) -> None:
        value = container[key]
        container[key] = value * times if isinstance(value, list | str) else [value] * times

    return repeat


def _nest(depth: int, in_dict: bool) -> Callable[[Container, Any], None]:
    def nest(container: Container, key: Any) -> None:
        for _ in range(depth):
            container[key] = {"a": container[key]} if in_dict else [container[key]]

    return nest


MOST_DIMENSIONS = 30


def as_array(value: Any) -> np.ndarray:
    """One of Python objects, where it is no other that NumPy can write."""
    with suppress(ValueError):
        array = np.asarray(value)
        if array.ndim <= MOST_DIMENSIONS:
            return array
    whole = np.empty((), object)
    whole[()] = value
    return whole


def _reshape(form: Callable[[Any], Any]) -> Callable[[Container, Any], None]:
    """Of arrays; what is none becomes one, and what has no such form stays."""

    def reshape(container: Container, key: Any) -> None:
        with suppress(ValueError, TypeError, IndexError, RuntimeError, OverflowError):
            container[key] = form(as_array(container[key]))

    return reshape


FORMS = (
    *(np.ravel, np.transpose, np.atleast_3d, lambda array: array[..., :1], lambda array: array[:0]),
    *(lambda array: array.astype(np.float16), lambda array: array.astype(str), lambda array: array.astype(object)),
    *(lambda array: np.concatenate([array, array]), lambda array: np.frombuffer(array.tobytes(), np.uint8)),
)


def _few(changes: list[Change]) -> Change:
    def change(content: Any) -> Any:
        for one in changes:
            content = one(content)
        return content

    return change


def changes(*, with_arrays: bool) -> st.SearchStrategy[Change]:
    """One or a few things wrong in the structure of a document, which has arrays where its wrapping admits them."""
    values = st.sampled_from(VALUES + ARRAYS if with_arrays else VALUES)
    ways = [
        values.map(_put),
        st.just(_delete),
        st.sampled_from(["", "x", "name", "a" * 300]).map(_rename),
        place.map(_swap),
        st.sampled_from([0, 2, 20]).map(_repeat),
        st.builds(_nest, st.sampled_from([1, 40]), st.booleans()),
    ]
    if with_arrays:
        ways += [st.sampled_from(FORMS).map(_reshape)]
    one = st.builds(_changed, place, st.one_of(ways))
    return st.one_of(one, st.lists(one, min_size=2, max_size=3).map(_few))
