"""Reads the parameters of a `_target_` from its source: options are checked before anything heavy is imported."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cache

from motiongen.discovery import module_path
from motiongen.suggestions import did_you_mean

MOST_HOPS = 12
"""Re-exports and base classes that are followed before a target is left unchecked."""


class TargetError(ValueError):
    """A `_target_` that names nothing."""


@dataclass(frozen=True)
class Parameter:
    name: str
    annotation: ast.expr | None
    required: bool
    keyword_only: bool


@dataclass(frozen=True)
class Signature:
    parameters: tuple[Parameter, ...]
    takes_any: bool
    """Whether it has **kwargs, so that every name is accepted."""


def signature_of(target: str) -> Signature | None:
    """The parameters of the class or function that `target` names; None where its source does not tell.

    Raises:
        TargetError: the module does not exist, or has no such name.
    """
    module, name = _split(target)
    return _find(module, name, MOST_HOPS)


def summary_of(target: str) -> str:
    """The first line of the docstring of the class or function that `target` names; empty where its source has none.

    Raises:
        TargetError: the module does not exist.
    """
    module, name = _split(target)
    tree = _source(module)
    for node in tree.body if tree else []:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return (ast.get_docstring(node) or "").partition("\n")[0]
    return ""


def _split(target: str) -> tuple[str, str]:
    """The longest prefix of `target` that is a module, and the name in it."""
    parts = target.split(".")
    for length in range(len(parts) - 1, 0, -1):
        module = ".".join(parts[:length])
        if module_path(module) is not None:
            rest = parts[length:]
            if len(rest) > 1 and _source(module) is not None and rest[0] not in _names(module):
                raise TargetError(f"{module} has no module {rest[0]!r}{did_you_mean(rest[0], _submodules(module))}")
            _refuse_hidden(parts[:length])
            return module, ".".join(rest)
    raise TargetError(f"there is no module {parts[0]!r}; is the package that offers it installed?")


def _refuse_hidden(module: list[str]) -> None:
    """Raises TargetError where a package takes a name from its module of the same name: the name hides the module."""
    for length in range(1, len(module)):
        package, name = ".".join(module[:length]), module[length]
        tree = _source(package)
        if tree is not None and _imported(package, tree, name) == (f"{package}.{name}", name):
            raise TargetError(
                f"{package} imports {name!r} from its module, which hides the module; use {package}.{name}"
            )


def _find(module: str, name: str, hops: int) -> Signature | None:
    tree = _source(module)
    if tree is None or hops == 0 or "." in name:
        return None
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return _signature(node.args, bound=False)
        if isinstance(node, ast.ClassDef) and node.name == name:
            return _constructor(module, node, hops)
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if any(isinstance(target, ast.Name) and target.id == name for target in targets):
                return None
    if (origin := _imported(module, tree, name)) is not None:
        return _find(*origin, hops - 1)
    if _is_dynamic(tree):
        return None
    raise TargetError(f"{module} has no {name!r}{did_you_mean(name, _names(module))}")


def _constructor(module: str, node: ast.ClassDef, hops: int) -> Signature | None:
    for statement in node.body:
        if isinstance(statement, ast.FunctionDef) and statement.name in ("__init__", "__new__"):
            return _signature(statement.args, bound=True)
    if any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list):
        return _fields(node) if not node.bases else None
    for base in node.bases:
        if isinstance(base, ast.Name):
            try:
                found = _find(module, base.id, hops - 1)
            except TargetError:
                return None  # a builtin, such as Exception or dict
            if found is not None:
                return found
    return None if node.bases else Signature((), takes_any=False)


def _fields(node: ast.ClassDef) -> Signature:
    fields = [s for s in node.body if isinstance(s, ast.AnnAssign) and "ClassVar" not in ast.unparse(s.annotation)]
    return Signature(
        tuple(
            Parameter(field.target.id, field.annotation, required=field.value is None, keyword_only=False)
            for field in fields
            if isinstance(field.target, ast.Name)
        ),
        takes_any=False,
    )


def _signature(arguments: ast.arguments, *, bound: bool) -> Signature:
    positional = [*arguments.posonlyargs, *arguments.args]
    without_default = len(positional) - len(arguments.defaults)
    parameters = [
        Parameter(argument.arg, argument.annotation, required=index < without_default, keyword_only=False)
        for index, argument in enumerate(positional)
    ][bound:]
    parameters += [
        Parameter(argument.arg, argument.annotation, required=default is None, keyword_only=True)
        for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
    ]
    return Signature(tuple(parameters), takes_any=arguments.kwarg is not None)


def _imported(module: str, tree: ast.Module, name: str) -> tuple[str, str] | None:
    """Where `name` comes from, if the module takes it from another by `from x import name`."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom):
            continue
        for alias in node.names:
            if (alias.asname or alias.name) == name:
                package = module.split(".") if _is_package(module) else module.split(".")[:-1]
                base = package[: len(package) - node.level + 1] if node.level else []
                return ".".join([*base, *(node.module or "").split(".")]).strip("."), alias.name
    return None


def _is_dynamic(tree: ast.Module) -> bool:
    """Whether names may appear that the source does not show."""
    return any(
        (isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names))
        or (isinstance(node, ast.FunctionDef) and node.name == "__getattr__")
        for node in ast.walk(tree)
    )


def _is_package(module: str) -> bool:
    path = module_path(module)
    return path is not None and path.is_dir()


@cache
def _source(module: str) -> ast.Module | None:
    """The parsed module; None if it is not written in Python.

    Raises:
        TargetError: the file has a syntax error.
    """
    path = module_path(module)
    if path is not None and path.is_dir():
        path /= "__init__.py"
    if path is None or path.suffix != ".py" or not path.is_file():
        return None
    try:
        return ast.parse(path.read_text(encoding="utf-8"))
    except SyntaxError as error:
        raise TargetError(f"{path}, line {error.lineno}: {error.msg}") from error
    except (ValueError, RecursionError, MemoryError) as error:  # MemoryError: what is nested too deep for the parser
        raise TargetError(f"{path}: {error}") from error


def _names(module: str) -> set[str]:
    """What a module's source defines or imports by name."""
    tree = _source(module)
    names: set[str] = set()
    for node in tree.body if tree else []:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.ImportFrom):
            names.update(alias.asname or alias.name for alias in node.names)
    return names


def _submodules(module: str) -> set[str]:
    folder = module_path(module)
    return {path.stem for path in folder.iterdir()} if folder is not None and folder.is_dir() else set()
