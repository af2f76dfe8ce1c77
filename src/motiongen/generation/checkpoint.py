"""Trained generators on disk: weights and what they were made for, readable without executing code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import torch

from motiongen.contracts import GeneratorModule
from motiongen.data.clips import Span
from motiongen.errors import InputError
from motiongen.files import is_file, replacing
from motiongen.weights import read_weights

FORMAT = 1


class CheckpointError(InputError):
    """A file of weights that cannot be read or does not fit; the message names the file and the field."""


def save_generator(path: Path, generator: GeneratorModule, tags: Sequence[str], trained_on: Sequence[Span]) -> None:
    """Write the weights with their tag vocabulary, sizes and the frames they saw; the file is whole or absent."""
    content = {
        "format": FORMAT,
        "tags": list(tags),
        "dimensions": asdict(generator.dimensions),
        "trained_on": list(trained_on),
        "state": {name: value.cpu() for name, value in generator.state_dict().items()},
    }
    with replacing(path) as partial:
        torch.save(content, partial)


def load_generator(path: Path, generator: GeneratorModule, tags: Sequence[str]) -> tuple[Span, ...]:
    """Read weights into a generator of the same composition.

    Returns:
        The frames that the weights were trained on.

    Raises:
        CheckpointError: no such file, not such a file, or made for other tags, sizes or stages.
    """
    if not is_file(path):
        raise CheckpointError(f"{path}: no such file; has the run finished its training?")
    try:
        content = read_weights(path)
    except ValueError as error:
        raise CheckpointError(f"{path}: not a generator's weights ({error})") from error
    if not isinstance(content, dict) or not _is(content.get("format"), int) or content["format"] != FORMAT:
        raise CheckpointError(f"{path}: field 'format' is not {FORMAT}; the file is from another version or program")
    if missing := {"tags", "dimensions", "trained_on", "state"} - content.keys():
        raise CheckpointError(f"{path}: field {min(missing)!r} is missing")
    found, sizes, spans = content["tags"], content["dimensions"], content["trained_on"]
    if not isinstance(found, list) or not all(_is(tag, str) for tag in found):
        raise CheckpointError(f"{path}: field 'tags' is not a list of text")
    if found != list(tags):
        raise CheckpointError(f"{path}: field 'tags' is {found!s:.500}, but the data has {list(tags)}")
    expected = asdict(generator.dimensions)
    if not isinstance(sizes, dict) or not all(_is(name, str) and _is(size, int) for name, size in sizes.items()):
        raise CheckpointError(f"{path}: field 'dimensions' is not a number for each name")
    if sizes != expected:
        raise CheckpointError(f"{path}: field 'dimensions' is {sizes!s:.500}, but this composition has {expected}")
    if not isinstance(spans, list) or not all(_is_span(span) for span in spans):
        raise CheckpointError(f"{path}: field 'trained_on' is not a list of (store, sequence, first frame, end)")
    try:
        generator.load_state_dict(content["state"])
    except Exception as error:
        raise CheckpointError(f"{path}: field 'state' does not fit this composition: {error!s:.500}") from error
    return tuple(spans)


def _is(value: object, kind: type) -> bool:
    return type(value) is kind


def _is_span(value: object) -> bool:
    return isinstance(value, tuple) and [type(part) for part in value] == [str, str, int, int]
