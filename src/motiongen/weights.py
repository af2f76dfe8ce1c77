"""Weights of unknown origin: files that `torch.save` wrote."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import torch


def read_weights(path: Path) -> Any:
    """Tensors, numbers, text and containers of them, on the CPU; nothing that the file names is run.

    `torch.save` compresses nothing. Files that do, that share bytes between their entries or are in one of torch's
    older forms could ask for any amount of memory, and are refused.

    Raises:
        ValueError: not such a file, or damaged; the message is one line.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
            raise ValueError("an entry is compressed")
        if sum(entry.file_size for entry in entries) > path.stat().st_size:
            raise ValueError("the entries are larger than the file")
        return torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:
        # A damaged pickle can raise nearly anything.
        raise ValueError(f"{type(error).__name__}: {' '.join(str(error).split()):.500}") from error
