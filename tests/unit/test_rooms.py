"""The house: how many rooms it has, how many of them know each other, and that no two of them know each other
in a circle.
"""

import pytest
from import_graph import circles, file_graph, folder_graph, modules

MOST_PACKAGES = 26
MOST_ARROWS = (
    119  # experiments -> check: a controller of positions asks what joint and delays the axis has (0177)
)
"""Today's figures (docs/decisions/0085): whoever adds a room or an arrow raises them with a reason, or does
without."""


@pytest.fixture(scope="module")
def files():
    return modules()


@pytest.fixture(scope="module")
def graph(files):
    return file_graph(files)


@pytest.fixture(scope="module")
def folders(files, graph):
    return folder_graph(files, graph)


def test_there_are_no_more_packages_than_one_can_remember(folders):
    assert len(folders) <= MOST_PACKAGES, sorted(folders)


def test_packages_know_few_others(folders):
    arrows = [f"{one} -> {other}" for one, others in sorted(folders.items()) for other in sorted(others)]
    assert len(arrows) <= MOST_ARROWS, arrows


def test_no_packages_know_each_other_in_a_circle(folders):
    assert circles(folders) == []


def test_no_files_know_each_other_in_a_circle(graph):
    assert not circles(graph)


def test_a_circle_is_found(tmp_path):
    for name, text in {
        "a/__init__": "", "a/one": "from a.b import two\n", "a/b/__init__": "",
        "a/b/two": "def late():\n    import a.one\n",
        "a/b/three": "import typing\nif typing.TYPE_CHECKING:\n    import a.one\n",
    }.items():  # fmt: skip
        (tmp_path / f"{name}.py").parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / f"{name}.py").write_text(text)
    made = modules(("a",), tmp_path)
    graph = file_graph(made)
    assert circles(graph) == [["a.b.two", "a.one"]]
    assert circles(folder_graph(made, graph, tmp_path)) == [["a", "a.b"]]
    assert graph["a.b.three"] == set()
