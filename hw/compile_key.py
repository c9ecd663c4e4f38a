"""The key under which compiled code is kept: everything that can change the machine code, and nothing else.

Numba freezes what a function refers to: constants, dtypes and other compiled functions of any module. All of
them reach the function through imports, so the key of a module covers its own source and that of every
project module that it imports, and those import, and so on. Sources are compared as syntax trees without
docstrings: comments, layout and line numbers do not count."""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from pathlib import Path

import llvmlite
import numpy as np

from hw.numba_alone import config as numba_config
from hw.numba_alone import numba
from hw.source_memo import Meaning, SourceMemo, source_memo

PROJECT = ("hw", "rtctl")
"""Packages whose sources count wherever they are installed. Packages of others count by their version."""

_IN_VERSIONS = ("llvmlite", "numba", "numpy")
"""Packages whose version is in every key, by `versions`."""

_HOME = Path(__file__).resolve().parents[1]
_INSTALLED = {"site-packages", "dist-packages"}
_PER_PROCESS = {"CACHE_DIR", "DISABLE_JIT", "NUMBA_NUM_THREADS", "NUMBA_DEFAULT_NUM_THREADS"}


@dataclass(frozen=True, eq=False)
class Source:
    """One module as the key sees it. Every text that was read is one `Source`: compared by identity, for a
    start asks thousands of times."""

    name: str
    """Dotted, from the folder where its top-level package lies."""
    home: Path
    """That folder."""
    meaning: str
    """Hash of its syntax tree without docstrings (hex)."""
    imports: frozenset[str]
    """Dotted names of what it imports anywhere, in functions too; what it imports from a module may be a
    module."""

    @cached_property
    def tops(self) -> frozenset[str]:
        """Top-level packages that it imports, but for the standard library's."""
        return frozenset(name.partition(".")[0] for name in self.imports) - sys.stdlib_module_names


def module_key(file: Path, options: str = "", root: Path | None = None) -> str:
    """Key of the compiled code of the module in `file`, compiled with `options` (hex).

    The memo in the folder `root` is used (`hw.source_memo`); `remember` writes it.

    Raises
    ------
    OSError
        `file`, or a module that it imports, cannot be read."""
    sources = covered(file, source_memo(root))
    told = [f"{versions()} {settings()} {options}"]
    # sorted: found by following imports, in an order that depends on what was known already
    told += sorted(f"{source.name} {source.meaning}" for source in sources)
    tops = frozenset[str]().union(*(source.tops for source in sources))
    told += [f"{top} {_version(top)}" for top in sorted(tops.difference(PROJECT, _IN_VERSIONS))]
    return hashlib.sha256("\n".join(told).encode()).hexdigest()[:20]


def remember(root: Path) -> None:
    """Have the next process know, by the memo in `root`, what this one has parsed."""
    source_memo(root).save()


def versions() -> str:
    """What reads the sources and makes machine code of them."""
    return (
        f"{sys.version} -O{sys.flags.optimize} numba {numba.__version__} llvmlite {llvmlite.__version__} "
        f"numpy {np.__version__}"
    )


@cache
def _version(top: str) -> str:
    """Version of an installed package that is named like its module, else nothing."""
    from importlib import metadata  # which most starts need for nothing else

    try:
        return metadata.version(top)
    except (metadata.PackageNotFoundError, ValueError):
        return ""


def settings() -> str:
    """Every option of Numba (`NUMBA_OPT`, `NUMBA_BOUNDSCHECK`, ...), but for those that differ between
    processes.

    CPU name and features are in Numba's own index."""
    plain = (int, float, str, type(None))
    return _options(tuple(x for x in vars(numba_config).items() if isinstance(x[1], plain)))


@lru_cache
def _options(named: tuple[tuple[str, object], ...]) -> str:
    upper = (x for x in named if x[0].isupper() and not x[0].startswith("_"))  # `_HAVE_YAML` is no option
    return repr(sorted(x for x in upper if x[0] not in _PER_PROCESS))


def covered(file: Path, memo: SourceMemo | None = None) -> set[Source]:
    """The module in `file` and every project module that it reaches through imports."""
    memo = memo or source_memo(None)
    found: dict[str, Source] = {}
    # a list and no recursion: modules may import each other in a circle
    to_do = [str(file.resolve())]
    while to_do:
        path = to_do.pop()
        if path not in found:
            found[path] = source = _source(path, memo)
            to_do += _imported(source)
    return set(found.values())


def _source(path: str, memo: SourceMemo) -> Source:
    """The module in `path` as it is on the disk now."""
    status = _path(path).stat()
    return _read(path, memo, status.st_mtime_ns, status.st_size, status.st_ino)


@cache
def _path(file: str) -> Path:
    """A start looks at a hundred files two thousand times, and making a `Path` takes longer than looking."""
    return Path(file)


@lru_cache(maxsize=4096)
def _read(file: str, memo: SourceMemo, *_stamp: int) -> Source:
    path = Path(file)
    data = path.read_bytes()
    home, name = _place(path)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    key = f"{package} {hashlib.sha256(data).hexdigest()}"
    if (meaning := memo.get(key)) is None:
        memo.note(key, meaning := _parsed(data, package))
    return Source(name, home, meaning[0], frozenset(meaning[1]))


def _parsed(data: bytes, package: str) -> Meaning:
    """What the text of a module of `package` means."""
    try:
        tree = ast.parse(data)
    except (SyntaxError, ValueError):  # nobody can import it, so what it imports does not matter
        return hashlib.sha256(data).hexdigest(), ()
    nodes = list(ast.walk(tree))
    imports = set(_imports(nodes, package.split(".") if package else []))
    if b"__doc__" not in data:  # else the module may make something of its docstrings
        _drop_texts(nodes)
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest(), tuple(sorted(imports))


def _place(path: Path) -> tuple[Path, str]:
    """The folder where the top-level package of a file lies, and the dotted name of the file from there."""
    home = _home(path.parent)
    parts = path.relative_to(home).with_suffix("").parts
    return home, ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def _home(folder: Path) -> Path:
    return _home(folder.parent) if (folder / "__init__.py").is_file() else folder


def _drop_texts(nodes: list[ast.AST]) -> None:
    """Take strings that stand alone out of the tree: they do nothing."""
    for node in nodes:
        body = getattr(node, "body", None)
        if isinstance(body, list):
            body[:] = [statement for statement in body if not _is_text(statement)]


def _is_text(statement: ast.stmt) -> bool:
    """A docstring, of an attribute too."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def _imports(nodes: list[ast.AST], package: list[str]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            module = ".".join([*above, *([node.module] if node.module else [])])
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


@lru_cache(maxsize=4096)
def _imported(source: Source) -> tuple[str, ...]:
    """Sources that run when `source` does its imports, packages above them included, as far as they are the
    project's."""
    own = source.name.partition(".")[0]
    homes = {top: _homes(top, source.home, own=top == own) for top in source.tops}
    places = [(home, name) for name in source.imports for home in homes.get(name.partition(".")[0], ())]
    return tuple(sorted({path for home, name in places for path in _below(str(home), name)}))


def _homes(top: str, beside: Path, *, own: bool) -> set[Path]:
    """Folders where a top-level package may lie: beside its importer, beside this one, or where Python has
    found it.

    Installed packages of others have none: they count by their version, unless the importer is of the package
    itself (`own`)."""
    homes = {beside}
    if loaded := getattr(sys.modules.get(top), "__file__", None):
        homes.add(_home_of_file(loaded))
    if top in PROJECT:
        return homes | {_HOME}
    return {home for home in homes if own or not _INSTALLED & set(home.parts)}


@cache
def _home_of_file(file: str) -> Path:
    return _home(Path(file).resolve().parent)


@cache
def _below(place: str, name: str) -> tuple[str, ...]:
    """The packages and the module that `name` stands for below `place`, as far as they are there."""
    above, _, _ = name.rpartition(".")
    packages = _below(place, above) if above else ()
    path = "/".join([place, *name.split(".")])
    files = f"{path}/__init__.py", f"{path}.py"
    return packages + tuple([file for file in files if Path(file).is_file()][:1])
