"""Checks every `_target_` of a configuration against the parameters of what it names."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, get_args, get_origin

from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from motiongen import options as ranges
from motiongen.signatures import Parameter, Signature, TargetError, signature_of
from motiongen.suggestions import did_you_mean

HYDRA_KEYS = {"_target_", "_partial_", "_recursive_", "_convert_", "_args_"}
SIMPLE: dict[str, tuple[type, ...]] = {
    "int": (int,),
    "float": (float, int),
    "bool": (bool,),
    "str": (str,),
    "Path": (str,),
}
SEQUENCES = ("list", "tuple", "Sequence", "Iterable")
MAPPINGS = ("dict", "Mapping")


def problems_in(config: DictConfig, sections: Iterable[str]) -> list[str]:
    """Everything wrong in the named top-level sections, one line each."""
    problems: list[str] = []
    for section in sections:
        if OmegaConf.is_missing(config, section):
            problems.append(f"{section} must be given: {section}=...")
        elif section in config:
            problems += _walk(config, section, section)
    return problems


def _walk(parent: DictConfig | ListConfig, key: Any, path: str) -> Iterator[str]:
    if OmegaConf.is_missing(parent, key):
        yield f"{path} must be given: {path}=..."
        return
    try:
        node = parent[key]
    except (OmegaConfBaseException, ValueError) as error:
        yield f"{path}: {str(error).splitlines()[0]}"
        return
    if isinstance(node, DictConfig):
        if "_target_" in node:
            yield from _check_target(node, path)
        for name in map(str, node):
            yield from _walk(node, name, f"{path}.{name}")
    elif isinstance(node, ListConfig):
        for index in range(len(node)):
            yield from _walk(node, index, f"{path}[{index}]")


def _check_target(node: DictConfig, path: str) -> Iterator[str]:
    target = str(node["_target_"])
    try:
        signature = signature_of(target)
    except TargetError as error:
        yield f"{path}._target_={target}: {error}"
        return
    if signature is None:
        return
    parameters = {parameter.name: parameter for parameter in signature.parameters}
    given = {str(key) for key in node} - HYDRA_KEYS
    short = target.rpartition(".")[2]
    if not signature.takes_any:
        for name in sorted(given - parameters.keys()):
            known = [name for name, parameter in parameters.items() if parameter.keyword_only or not _partial(node)]
            yield (
                f"{path}.{name}: {short} has no option {name!r}{did_you_mean(name, known)}\n"
                f"  options: {', '.join(known) or 'none'}"
            )
    for name in sorted(_required(signature, node) - given):
        yield f"{path}.{name} must be given: {short} needs it"
    for name in sorted(given & parameters.keys()):
        if not OmegaConf.is_missing(node, name) and (expected := _mismatch(node, name, parameters[name])):
            yield f"{path}.{name}={node[name]}: {short} takes {expected}"


def _partial(node: DictConfig) -> bool:
    return bool(node.get("_partial_", False))


def _required(signature: Signature, node: DictConfig) -> set[str]:
    """Parameters without a default. What a partial lacks is supplied by the code that completes it."""
    if "_args_" in node or _partial(node):
        return set()
    return {parameter.name for parameter in signature.parameters if parameter.required}


def _mismatch(node: DictConfig, name: str, parameter: Parameter) -> str | None:
    """What the parameter takes, if the value is not that."""
    if parameter.annotation is None:
        return None
    try:
        value = node[name]
    except (OmegaConfBaseException, ValueError):
        return None  # _walk tells
    alternatives = list(_alternatives(parameter.annotation))
    if any(_accepts(annotation, value) for annotation in alternatives):
        return None
    return " or ".join(_words(annotation) for annotation in alternatives)


def _alternatives(annotation: ast.expr) -> Iterator[ast.expr]:
    """The members of a union; a quoted annotation is read like a plain one."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    if isinstance(annotation, ast.BinOp) and isinstance(annotation.op, ast.BitOr):
        yield from _alternatives(annotation.left)
        yield from _alternatives(annotation.right)
    elif isinstance(annotation, ast.Subscript) and _name(annotation.value) in ("Optional", "Union"):
        members = annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]
        for member in members:
            yield from _alternatives(member)
        if _name(annotation.value) == "Optional":
            yield ast.Constant(None)
    else:
        yield annotation


def _accepts(annotation: ast.expr, value: Any) -> bool:
    """Whether a value from a configuration fits; annotations that say nothing about such values take everything."""
    if isinstance(annotation, ast.Constant):
        return annotation.value is not None or value is None
    name = _name(annotation.value if isinstance(annotation, ast.Subscript) else annotation)
    if name in SIMPLE:
        return isinstance(value, SIMPLE[name]) and (name == "bool" or not isinstance(value, bool))
    if isinstance(annotation, ast.Subscript) and name == "Literal":
        return value in _literals(annotation)
    if name in SEQUENCES:
        members = list(_members(annotation))
        return isinstance(value, ListConfig) and all(any(_accepts(one, item) for one in members) for item in value)
    if name in MAPPINGS:
        return isinstance(value, DictConfig)
    if (limits := _range(name)) is not None:
        kind, interval = limits
        fits = isinstance(value, SIMPLE[kind.__name__]) and not isinstance(value, bool)
        return fits and bool(interval.least <= value <= interval.most)
    return True


def _words(annotation: ast.expr) -> str:
    if isinstance(annotation, ast.Subscript) and _name(annotation.value) == "Literal":
        return ", ".join(repr(literal) for literal in _literals(annotation))
    name = _name(annotation.value if isinstance(annotation, ast.Subscript) else annotation)
    if (limits := _range(name)) is not None:
        kind, interval = limits
        whole = "a whole number" if kind is int else "a number"
        if interval.most == float("inf"):
            return f"{whole} above 0" if 0 < interval.least < 1 else f"{whole} of at least {interval.least:g}"
        return f"{whole} from {interval.least:g} to {interval.most:g}"
    words = {"int": "a whole number", "float": "a number", "bool": "true or false", "str": "text", "Path": "a path"}
    if name in SEQUENCES:
        items = " or ".join(_words(one) for one in _members(annotation))
        return f"a list, each item {items}" if isinstance(annotation, ast.Subscript) else "a list"
    if name in MAPPINGS:
        return "a set of key: value"
    return "null" if isinstance(annotation, ast.Constant) else words.get(name, ast.unparse(annotation))


def _range(name: str) -> tuple[type, ranges.Range] | None:
    """The type and interval of an annotation from motiongen.options."""
    alias = getattr(ranges, name, None)
    if get_origin(alias) is not Annotated:
        return None
    kind, interval = get_args(alias)
    return kind, interval


def _members(annotation: ast.expr) -> Iterator[ast.expr]:
    """What the items of a list may be; anything where its annotation does not say it."""
    inner = annotation.slice if isinstance(annotation, ast.Subscript) else ast.Name("Any")
    yield from _alternatives(inner.elts[0] if isinstance(inner, ast.Tuple) else inner)


def _literals(annotation: ast.Subscript) -> list[Any]:
    members = annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]
    return [member.value for member in members if isinstance(member, ast.Constant)]


def _name(annotation: ast.expr) -> str:
    return annotation.attr if isinstance(annotation, ast.Attribute) else getattr(annotation, "id", "")
