"""Statements of sources: most nodes of a tree are expressions, which make a walk over a thousand files
long.
"""

import ast


def statements(tree):
    """All of them, within each other; what a statement has that is neither (arguments, names imported) is
    among them.
    """
    for node in ast.iter_child_nodes(tree):
        if not isinstance(node, ast.expr):
            yield node
            yield from statements(node)
