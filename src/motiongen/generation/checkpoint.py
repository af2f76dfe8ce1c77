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
        content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:
        # A damaged pickle can raise nearly anything.
        raise CheckpointError(f"{path}: not a generator's weights ({type(error).__name__}: {error})") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CheckpointError(f"{path}: field 'format' is not {FORMAT}; the file is from another version or program")
    if missing := {"tags", "dimensions", "trained_on", "state"} - content.keys():
        raise CheckpointError(f"{path}: field {min(missing)!r} is missing")
    if content["tags"] != list(tags):
        raise CheckpointError(f"{path}: field 'tags' is {content['tags']}, but the data has {list(tags)}")
    if content["dimensions"] != asdict(generator.dimensions):
        raise CheckpointError(
            f"{path}: field 'dimensions' is {content['dimensions']}, but this composition has "
            f"{asdict(generator.dimensions)}"
        )
    try:
        generator.load_state_dict(content["state"])
    except Exception as error:
        raise CheckpointError(f"{path}: field 'state' does not fit this composition: {error}") from error
    return tuple(content["trained_on"])
