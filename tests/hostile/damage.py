"""Damaged and hostile bytes for readers of files."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable

from hypothesis import strategies as st

NUMBER = re.compile(rb"-?\d+(\.\d+)?(e-?\d+)?")
HOSTILE_NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"0", b"-1", b"-0.0", b"0.5", b"null", b"[]", b"*x"),
    *(b"999999999999999999999", b"9" * 400, b"9" * 5000, b"1_0", b"0x10", "²".encode(), b"1" + b"\0", b'"'),
)

Edit = Callable[[bytes], bytes]
place = st.floats(0, 1, exclude_max=True)


def _cut(at: float) -> Edit:
    return lambda content: content[: int(at * len(content))]


def _flip(at: float, mask: int) -> Edit:
    def edit(content: bytes) -> bytes:
        changed = bytearray(content)
        if changed:
            changed[int(at * len(changed))] ^= mask
        return bytes(changed)

    return edit


def _insert(at: float, more: bytes) -> Edit:
    return lambda content: content[: int(at * len(content))] + more + content[int(at * len(content)) :]


def _repeat(at: float, length: float, times: int) -> Edit:
    def edit(content: bytes) -> bytes:
        start = int(at * len(content))
        part = content[start : start + int(length * 200)]
        return content[:start] + part * times + content[start:]

    return edit


def _replace_number(at: float, number: bytes) -> Edit:
    def edit(content: bytes) -> bytes:
        found = list(NUMBER.finditer(content))
        if not found:
            return content
        match = found[int(at * len(found))]
        return content[: match.start()] + number + content[match.end() :]

    return edit


edits = st.one_of(
    st.builds(_cut, place),
    st.builds(_flip, place, st.integers(1, 255)),
    st.builds(_insert, place, st.binary(min_size=1, max_size=8)),
    st.builds(_repeat, place, place, st.integers(1, 20)),
    st.builds(_replace_number, place, st.sampled_from(HOSTILE_NUMBERS)),
)


def _edited(changes: list[Edit]) -> Edit:
    def edit(content: bytes) -> bytes:
        for change in changes:
            content = change(content)
        return content

    return edit


def _edited_member(at: float, change: Edit) -> Edit:
    """A ZIP file that is right, with something wrong in it."""

    def edit(archive: bytes) -> bytes:
        with zipfile.ZipFile(io.BytesIO(archive)) as file:
            members = {info.filename: file.read(info) for info in file.infolist()}
        name = list(members)[int(at * len(members))]
        members[name] = change(members[name])
        target = io.BytesIO()
        with zipfile.ZipFile(target, "w") as file:
            for member, content in members.items():
                file.writestr(member, content)
        return target.getvalue()

    return edit


def _in_place_of(content: bytes) -> Edit:
    return lambda valid: content


def damages(*, in_zip: bool) -> st.SearchStrategy[Edit]:
    """What makes any bytes of a file, or a few things of it wrong; of ZIP files, also wrong content in right wrapping.

    Descriptions are drawn and not the files: Hypothesis keeps in memory whatever is drawn.
    """
    few = st.lists(edits, min_size=1, max_size=4).map(_edited)
    ways = [st.binary(max_size=300).map(_in_place_of), few]
    if in_zip:
        ways += 2 * [st.builds(_edited_member, place, few)]
    return st.one_of(ways)
