"""Pickles and joblib files from strangers: NumPy arrays and builtin containers are read, all else is refused.

A pickle is a program that may call anything it names. Here a name stands for what this module says, or for nothing;
modules are never imported. joblib's own loader would run such programs, so its files are read without it.
"""

from __future__ import annotations

import copyreg
import io
import math
import pickle
import zlib
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import numpy as np

from motiongen.errors import InputError

LIMIT = 32 * 2**30
"""Bytes that a file may hold, unpacked; UESTC's is the largest of those that are read, with several GB."""
RATIO = 200
"""How many times its own size a compressed file may hold. Motion shrinks to a third, zeros to a thousandth."""
ZLIB = b"\x78"
"""What joblib's compressed files begin with, and no pickle."""


class RefusedPickle(InputError):
    """A file that holds more than arrays and plain containers, is damaged or is too large; it names what it is."""


class Inert:
    """Stands in for an object of the file: keeps its state, does nothing."""

    state: Mapping[str, Any] = {}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.state = state


class _JoblibArray(Inert):
    """joblib.numpy_pickle.NumpyArrayWrapper: says of which form the array is whose bytes follow in the stream."""


def _empty_array(*_: Any) -> np.ndarray:
    """What an array is before its state is set. The shape that the file asks for here is always 0."""
    return np.empty(0)


def _check_keys(keys: Iterable[object]) -> None:
    """Keys and members are hashed, and tuples that hold one another a few dozen deep are not, within a lifetime."""
    for key in keys:
        if not isinstance(key, str | bytes | int | float | np.generic | None):
            raise RefusedPickle(f"has a {type(key).__name__} for a key or a member of a set; such files are not opened")


def _set(kind: type, members: Iterable[object] = ()) -> Any:
    members = list(members)
    _check_keys(members)
    return kind(members)


def _ordered(pairs: Iterable[tuple[Any, Any]] = ()) -> OrderedDict[Any, Any]:
    pairs = list(pairs)
    _check_keys(key for key, _ in pairs)
    return OrderedDict(pairs)


def _dtype(name: str, *flags: bool) -> np.dtype:
    """Fields of fields are no motion."""
    if not isinstance(name, str):
        raise RefusedPickle(f"names an array's kind by a {type(name).__name__}; such files are not opened")
    return np.dtype(name, *flags)


_ADMITTED: dict[tuple[str, str], Any] = {
    # Only ever an argument; as a callable it would make arrays of any size.
    ("numpy", "ndarray"): "numpy.ndarray",
    ("numpy", "dtype"): _dtype,
    ("collections", "OrderedDict"): _ordered,
    ("copyreg", "_reconstructor"): copyreg.__dict__["_reconstructor"],
    ("copy_reg", "_reconstructor"): copyreg.__dict__["_reconstructor"],
    ("_codecs", "encode"): lambda text, encoding: text.encode("latin1"),
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _JoblibArray,
}
for _module in ("numpy.core", "numpy._core"):
    _ADMITTED[f"{_module}.multiarray", "_reconstruct"] = _empty_array
    _ADMITTED[f"{_module}.multiarray", "scalar"] = np.float64(0).__reduce__()[0]
    _ADMITTED[f"{_module}.numeric", "_frombuffer"] = np.zeros(1).__reduce_ex__(5)[0]
for _module in ("builtins", "__builtin__"):
    _ADMITTED[_module, "object"] = object
    _ADMITTED |= {(_module, kind.__name__): partial(_set, kind) for kind in (set, frozenset)}
    # How protocol 2 writes the empty ones; with a number they would be of any size.
    _ADMITTED[_module, "bytes"] = lambda: b""


# Python's own unpickler, since the compiled one cannot stop in the middle for joblib's arrays; its parts have no types.
_PythonUnpickler: Any = pickle._Unpickler


class PlainUnpickler(_PythonUnpickler):
    """Reads a stream that was written by pickle or, uncompressed, by joblib.

    Strings of Python 2 are taken for latin1.

    Raises:
        RefusedPickle: from `load`, at the first name that is not admitted. Damaged streams raise nearly anything.
    """

    dispatch: ClassVar[dict[int, Any]] = dict(_PythonUnpickler.dispatch)

    def __init__(self, file: BinaryIO) -> None:
        super().__init__(file, encoding="latin1")
        self._stream = file

    def stand_in(self, module: str, name: str) -> type[Inert] | None:
        """A class for objects that a kind of file holds besides arrays; for subclasses to say."""
        return None

    def find_class(self, module: str, name: str) -> Any:
        found = _ADMITTED.get((module, name)) or self.stand_in(module, name)
        if found is None:
            raise RefusedPickle(f"holds a {module}.{name}, which is not an array; such files are not opened")
        return found

    def load_build(self) -> None:
        target, state = self.stack[-2:]
        if isinstance(target, np.dtype):
            _check_dtype(target, state)
        elif not isinstance(target, np.ndarray | Inert):
            raise RefusedPickle(f"sets the state of a {type(target).__name__}; such files are not opened")
        super().load_build()
        if isinstance(target, _JoblibArray):
            self.stack[-1] = self._array(target.state)

    def load_setitem(self) -> None:
        _check_keys(self.stack[-2:-1])
        super().load_setitem()

    # What follows a mark lies by itself on the stack.
    def load_setitems(self) -> None:
        _check_keys(self.stack[::2])
        super().load_setitems()

    def load_dict(self) -> None:
        _check_keys(self.stack[::2])
        super().load_dict()

    def load_additems(self) -> None:
        _check_keys(self.stack)
        super().load_additems()

    def load_frozenset(self) -> None:
        _check_keys(self.stack)
        super().load_frozenset()

    dispatch |= {
        pickle.BUILD[0]: load_build,
        pickle.SETITEM[0]: load_setitem,
        pickle.SETITEMS[0]: load_setitems,
        pickle.DICT[0]: load_dict,
        pickle.ADDITEMS[0]: load_additems,
        pickle.FROZENSET[0]: load_frozenset,
    }

    def _array(self, form: Mapping[str, Any]) -> np.ndarray:
        """The array that follows in the stream, behind a count of fill bytes in files of joblib 1.2 and later."""
        dtype, shape = form["dtype"], tuple(int(size) for size in form["shape"])
        if not isinstance(dtype, np.dtype) or dtype.hasobject:
            raise RefusedPickle(f"holds an array of {dtype}, not of numbers; such files are not opened")
        if form.get("numpy_array_alignment_bytes") is not None:
            self._stream.read(self._stream.read(1)[0])
        data = self._stream.read(_checked_size(math.prod(shape) * dtype.itemsize))
        return np.frombuffer(data, dtype).reshape(shape, order=form["order"]).copy()


def read_pickle(path: Path) -> Any:
    """What a pickle or a joblib file holds, plain or compressed by zlib: arrays, containers, strings and numbers.

    Raises:
        RefusedPickle: the file holds anything else, is damaged or larger than LIMIT; the message names it.
    """
    try:
        _checked_size(path.stat().st_size)
        with path.open("rb") as file:
            packed = file.read(1) == ZLIB
            file.seek(0)
            return PlainUnpickler(_unpacked(file) if packed else file).load()
    except RefusedPickle as error:
        raise RefusedPickle(f"{path}: {error}") from error
    except Exception as error:
        # A damaged pickle can raise nearly anything.
        raise RefusedPickle(f"{path}: not a readable pickle: {type(error).__name__}: {error}") from error


def _unpacked(file: BinaryIO) -> BinaryIO:
    packed, content = zlib.decompressobj(), file.read()
    most = min(LIMIT, RATIO * len(content))
    content = packed.decompress(content, most + 1)
    if len(content) > most:
        raise RefusedPickle(f"asks for more than {most} bytes")
    if not packed.eof:
        raise EOFError("the compressed file is cut")
    return io.BytesIO(content)


def _checked_size(size: int) -> int:
    if not 0 <= size <= LIMIT:
        raise RefusedPickle(f"asks for {size} bytes, more than {LIMIT}")
    return size


def _check_dtype(dtype: np.dtype, state: Any) -> None:
    """A forged state could pass numbers off as pointers: only the byte order may differ from what the name says."""
    match state:
        case (3, str(), None, None, None, int(size), int(), int(flags)):
            if size in (-1, dtype.itemsize) and flags == dtype.flags:
                return
    raise RefusedPickle(f"holds an array of {dtype} in a form that is not plain; such files are not opened")
