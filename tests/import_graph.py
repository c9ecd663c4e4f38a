"""Which file of rtctl and hw imports which, and which folder which: read from the sources, nothing is run.

A name that is imported for annotations only (`if TYPE_CHECKING:`) is no import at run time and is not
counted; one inside a function is. `__main__` files start a program and are imported by nobody: they are left
out.
"""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]


def modules(tops=("rtctl", "hw"), root=ROOT):
    """Name of each module -> its file."""
    found = {}
    for top in tops:
        for path in sorted((root / top).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            if parts[-1] != "__main__":
                found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _nodes(tree):
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.expr):  # imports nothing
            continue
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        yield from _nodes(node)


def _imported(path):
    for node in _nodes(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            for alias in node.names:
                yield f"{node.module}.{alias.name}"
                yield node.module


def file_graph(found):
    """Module -> the modules it imports; a name taken from a module counts for the module."""
    graph = {}
    for name, path in found.items():
        wanted = set(_imported(path)) & found.keys()
        # `from rtctl.host import reload` needs reload, not what else the package's docstring file has.
        inner = {one for one in wanted if not any(other.startswith(one + ".") for other in wanted)}
        graph[name] = inner - {name}
    return graph


def folder_graph(found, graph, root=ROOT):
    """Folder -> the other folders that its files import."""

    def folder(name):
        return ".".join(found[name].relative_to(root).parent.parts)

    between = {folder(name): set() for name in found}
    for name, wanted in graph.items():
        between[folder(name)] |= {folder(one) for one in wanted} - {folder(name)}
    return between


def circles(graph):
    """Groups of nodes that reach each other: first all that nobody enters or leaves go, then what is left is
    few.
    """
    left = {node: set(after) for node, after in graph.items()}
    while True:
        entered = set().union(*left.values())
        kept = {
            node: after & left.keys()
            for node, after in left.items()
            if node in entered and after & left.keys()
        }
        if kept == left:
            break
        left = kept
    reach = {node: _reached(node, left) for node in left}
    groups = {
        frozenset(one for one in after if node in reach[one])
        for node, after in reach.items()
        if node in after
    }
    return sorted(sorted(group) for group in groups)


def _reached(node, graph):
    found, waiting = set(), list(graph[node])
    while waiting:
        one = waiting.pop()
        if one not in found:
            found.add(one)
            waiting += graph[one]
    return found
