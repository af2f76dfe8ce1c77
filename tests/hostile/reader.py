"""Readers, and what holds of each of them whatever it reads."""

from __future__ import annotations

import io
import json
import os
import pickle
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
import yaml
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from motiongen.errors import InputError
from tests.hostile.damage import damages
from tests.hostile.structures import as_array, changes

EXAMPLES = int(os.environ.get("MOTIONGEN_FUZZ_EXAMPLES", "60"))
"""How many files every reader gets."""
often = settings(
    max_examples=EXAMPLES,
    deadline=None,
    database=None,
    derandomize=EXAMPLES == 60,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)
LONGEST = 2000
"""Characters of a message, however much there is to say."""


@dataclass(frozen=True)
class Form:
    """How a document becomes a file."""

    write: Callable[[Any], bytes]
    has_arrays: bool = False


def as_npz(content: dict[str, Any]) -> bytes:
    """What is no array becomes one of Python objects."""
    target = io.BytesIO()
    np.savez(target, **{name: as_array(value) for name, value in content.items()} if isinstance(content, dict) else {})
    return target.getvalue()


def as_weights(content: Any) -> bytes:
    target = io.BytesIO()
    torch.save(content, target)
    return target.getvalue()


JSON = Form(lambda content: json.dumps(content).encode())
YAML = Form(lambda content: yaml.safe_dump(content, allow_unicode=False).encode())
NPZ = Form(as_npz, has_arrays=True)
PICKLE = Form(lambda content: pickle.dumps(content, protocol=2), has_arrays=True)
WEIGHTS = Form(as_weights, has_arrays=True)


@dataclass(frozen=True)
class Reader:
    """Something that reads a file of this name, and whether what it delivers is right."""

    file: str
    """The file's place in the folder that is read"""
    content: Callable[[], Any]
    """The valid file, as bytes, or as a document where it has a form"""
    read: Callable[[Path], Any]
    is_right: Callable[[Any], bool]
    form: Form | None = None
    around: Callable[[Path], object] | None = None
    """Makes the other files of the folder"""
    also: tuple[str, ...] = ()
    """Other files to name, which contradict this one where it is damaged"""

    def valid(self) -> bytes:
        return self.form.write(self.content()) if self.form else self.content()

    @cache  # noqa: B019 - readers live as long as the tests
    def damaged(self) -> st.SearchStrategy[Callable[[], bytes]]:
        """Files that are damaged, made when they are called for: whatever is drawn is kept in memory."""
        valid = self.valid()
        ways = [damages(in_zip=valid.startswith(b"PK")).map(lambda damage: lambda: damage(valid))]
        if form := self.form:
            structures = changes(with_arrays=form.has_arrays)
            ways += [structures.map(lambda change: lambda: form.write(change(self.content())))]
        return st.one_of(ways)

    def prepare(self, folder: Path) -> Path:
        """The file's place, with the other files around it."""
        if self.around is not None and not any(folder.iterdir()):
            self.around(folder)
        (folder / self.file).parent.mkdir(parents=True, exist_ok=True)
        return folder / self.file

    def check(self, content: bytes, folder: Path) -> str:
        """That it delivers what is right or names what is wrong, runs nothing, and leaves nothing behind.

        Returns the message, empty where the file is right.
        """
        path = self.prepare(folder)
        path.write_bytes(content)
        before = sorted(folder.rglob("*"))
        with watched() as executed:
            found, complaint = outcome(self.read, path)
        assert not executed
        if complaint:
            assert any(name in complaint for name in (path.name, *self.also)), f"the file is not named: {complaint}"
            assert len(complaint) < LONGEST
        else:
            assert self.is_right(found)
        assert sorted(folder.rglob("*")) == before
        return complaint


def outcome(read: Callable[[Path], Any], path: Path) -> tuple[Any, str]:
    """What is delivered, or what the promised error says."""
    try:
        return read(path), ""
    except InputError as error:
        return None, str(error) or "nothing"


def kind(complaint: str, folder: Path) -> str:
    """The first line of a message without what differs from file to file: folders, values and numbers."""
    line = complaint.replace(str(folder), "").partition("\n")[0].encode("ascii", "backslashreplace").decode()
    return re.sub(r"-?\d[\d.e+-]*", "#", re.sub(r"'[^']*'|\"[^\"]*\"", "'...'", line))[:120] or "right"


def as_file(write: Callable[[Path], object], name: str) -> Callable[[], bytes]:
    """The bytes of a file of this name that `write` writes into a folder, made when they are asked for."""

    @cache
    def content() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder) / name)
            return (Path(folder) / name).read_bytes()

    return content


EXECUTION = ("os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "subprocess.Popen", "pickle.find_class")
"""Events that Python tells of whoever runs something, or lets a pickle say what to call"""
_told: list[list[str]] = []


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if _told and event in EXECUTION:
        _told[-1].append(f"{event}: {arguments}")


sys.addaudithook(_hear)


@contextmanager
def watched() -> Iterator[list[str]]:
    """What is executed meanwhile."""
    _told.append([])
    try:
        yield _told[-1]
    finally:
        _told.pop()
