"""What `task=prepare` said of a data set, kept so that it can say it again without reading anything. Nothing heavy is
imported: loading torch takes longer than all of it.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from omegaconf import DictConfig, OmegaConf

from motiongen.documents import DocumentError, read_json
from motiongen.files import is_file, replacing
from motiongen.studies.identity import code_digest


@dataclass(frozen=True)
class Receipt:
    """Of one configuration of data, read by this code."""

    path: Path
    source: str
    """Digest of what the files that the configuration names are called, how large they are, and when they changed"""

    @classmethod
    def of(cls, config: DictConfig) -> Self:
        """That of `config.data`, with the files as they are now."""
        settings = OmegaConf.to_container(config.data, resolve=True)
        said = json.dumps([settings, os.getcwd(), code_digest()], sort_keys=True, default=str)
        name = f"{hashlib.sha256(said.encode()).hexdigest()}.json"
        places = [Path(text).expanduser() for text in _texts(settings)]
        cache = Path(config.cache).expanduser()
        return cls(cache / "prepared" / name, _listing(place for place in places if place != cache))

    def report(self) -> list[str] | None:
        """What was said, if neither the data's files nor the store have been touched since."""
        try:
            content = read_json(self.path)
        except DocumentError:
            return None
        match content:
            case {"source": self.source, "folder": str(folder), "store": str(store), "report": [*lines]}:
                if _listing([Path(folder)]) == store and all(isinstance(line, str) for line in lines):
                    return lines
        return None

    def keep(self, folder: Path, report: Sequence[str]) -> None:
        """Keep what was said of the store in this folder."""
        content = {"source": self.source, "folder": str(folder), "store": _listing([folder]), "report": list(report)}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(self.path) as partial:
            partial.write_text(json.dumps(content), encoding="utf-8")


def _texts(node: Any) -> Iterator[str]:
    """All texts in a configuration; those that name a file or a folder are among them."""
    if isinstance(node, str):
        yield node
    elif isinstance(node, dict | list):
        for value in node.values() if isinstance(node, dict) else node:
            yield from _texts(value)


def _listing(places: Iterable[Path]) -> str:
    """Digest of the names, sizes and times of files, and of those below folders."""
    digest = hashlib.sha256()
    for place in places:
        for path in [place] if is_file(place) else sorted(place.rglob("*")) if place.is_dir() else ():
            known = path.stat(follow_symlinks=False)
            digest.update(f"{path}\0{known.st_size}\0{known.st_mtime_ns}\0".encode(errors="surrogateescape"))
    return digest.hexdigest()
