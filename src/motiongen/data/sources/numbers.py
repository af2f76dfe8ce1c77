"""Tables of numbers in text: what `np.loadtxt` reads, bit for bit and several times faster.

Eight characters are one integer of 64 bits, and a few operations on it give the number that they spell (D. Lemire,
"Quickly parsing eight digits", 2018); here they are done on an array of all words.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

DIGITS = 8
"""Characters that are read at once; words with more of them before or after the point are left to `np.loadtxt`."""
EVERY = int.from_bytes(b"\x01" * DIGITS)
"""Times a byte: that byte in all places."""
FIRST = np.array([2 ** (8 * count) - 1 for count in range(DIGITS + 1)], np.uint64)
"""By count: a mask of the first characters, which are the lowest bytes."""
LARGEST = 10**7
"""Below it, a number with eight decimals is an integer below 2^53 over a power of ten."""
POWERS = 10.0 ** np.arange(23)
"""All that float64 holds exactly: dividing an integer by one of them rounds once, as reading the decimals should."""

Places = NDArray[np.int64]
Mask = NDArray[np.bool_]


def read_numbers(lines: Sequence[str]) -> NDArray[np.float64]:
    """Lines of numbers with blanks between them to an array (lines, columns).

    Raises:
        ValueError: no lines, lines of different lengths, or a word that is no number.
    """
    margin = " " * DIGITS
    data = "\n".join([margin, *lines, margin]).encode()
    text = np.frombuffer(data, np.uint8)
    blanks = np.flatnonzero(text <= ord(" "))
    kinds = text[blanks]
    if not data.isascii() or not ((kinds == ord(" ")) | (kinds == ord("\n")) | (kinds == ord("\t"))).all():
        return np.loadtxt(lines, ndmin=2, comments=None)
    starts, ends = blanks[:-1] + 1, blanks[1:]
    is_word = starts < ends
    starts, ends = starts[is_word], ends[is_word]
    counts = np.diff(np.searchsorted(ends, blanks[kinds == ord("\n")], side="right"))
    if not len(counts) or not counts[0] or (counts != counts[0]).any():
        raise ValueError("lines of different lengths")
    values, is_plain = _plain_numbers(text, starts, ends)
    if not is_plain.all():
        words = data.split()
        values[~is_plain] = np.loadtxt([words[place] for place in np.flatnonzero(~is_plain)], ndmin=1, comments=None)
    return values.reshape(len(counts), -1)


def _plain_numbers(text: NDArray[np.uint8], starts: Places, ends: Places) -> tuple[NDArray[np.float64], Mask]:
    """The values of words such as -12, 0.5 and 3.2e-06, and which words are of this form."""
    is_negative = text[starts] == ord("-")
    points = _points(text, starts, ends)
    ends, powers, is_plain = _without_exponents(text, ends)
    points = np.minimum(points, ends)
    before, after = points - starts - is_negative, np.maximum(ends - points - 1, 0)
    is_plain &= (before + after > 0) & (before <= DIGITS) & (after <= DIGITS)
    before, after = np.minimum(before, DIGITS), np.minimum(after, DIGITS)
    eights = np.ndarray(len(text) - DIGITS + 1, "<u8", text, strides=(1,))
    whole, is_whole = _eight_digits(eights[points - DIGITS], ~FIRST[DIGITS - before])
    part, is_part = _eight_digits(eights[points + 1], FIRST[after])
    is_plain &= is_whole & is_part & (whole < LARGEST)
    sign = 1.0 - 2.0 * is_negative
    return sign * (whole * np.uint64(10**DIGITS) + part) / POWERS[powers], is_plain


def _without_exponents(text: NDArray[np.uint8], ends: Places) -> tuple[Places, Places, Mask]:
    """Where words end before e-05, the power of ten that their eight decimals are over, and whether that is all."""
    powers, is_plain = np.full(len(ends), DIGITS), np.ones(len(ends), bool)
    found = np.flatnonzero(text == ord("e"))
    if not len(found):
        return ends, powers, is_plain
    words = np.searchsorted(ends, found)
    tens, ones = (text[found + place].astype(np.int64) - ord("0") for place in (2, 3))
    power = powers[words] + 10 * tens + ones
    is_exponent = (text[found + 1] == ord("-")) & (tens >= 0) & (tens <= 9) & (ones >= 0) & (ones <= 9)
    is_plain[words] = is_exponent & (ends[words] == found + 4) & (power < len(POWERS))
    powers[words] = power.clip(0, len(POWERS) - 1)
    ends = ends.copy()
    ends[words] = found
    return ends, powers, is_plain


def _points(text: NDArray[np.uint8], starts: Places, ends: Places) -> Places:
    """Where the decimal point of every word is, or its end."""
    found = np.flatnonzero(text == ord("."))
    if len(found) == len(ends) and ((starts <= found) & (found < ends)).all():
        return found
    points = ends.copy()
    points[np.searchsorted(ends, found)] = found
    return points


def _eight_digits(characters: NDArray[np.uint64], mask: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], Mask]:
    """What eight digits say, the lowest byte first, those outside the mask zero, and whether all inside are digits."""
    digits = (characters ^ np.uint64(ord("0") * EVERY)) & mask
    is_number = ((digits + np.uint64(0x76 * EVERY)) | digits) & np.uint64(0x80 * EVERY) == 0
    for base, bits, lanes in ((10, 8, 0x00FF00FF00FF00FF), (100, 16, 0x0000FFFF0000FFFF), (10000, 32, 0xFFFFFFFF)):
        digits = (digits * np.uint64(base) + (digits >> np.uint64(bits))) & np.uint64(lanes)
    return digits, is_number
