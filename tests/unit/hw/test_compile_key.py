"""The key of compiled code changes with everything that can change machine code, and with nothing else."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config as numba_config

from hw import compile_key
from hw.compile_key import covered, module_key

ROOT = Path(__file__).resolve().parents[3]

LAW = '''"""A law."""
import plant.gains as g
from plant.records import STATE
from hw.jit import compiled


@compiled
def law(x):
    """Force for a position."""
    if x > g.LIMIT:  # too far
        return g.LIMIT
    return g.softened(x)
'''
FILES = {
    "__init__.py": '"""A plant."""\n',
    "law.py": LAW,
    "gains.py": (
        "from . import deep\n"
        "from hw.jit import compiler\n"
        "compiled = compiler(nogil=False)\n"
        "LIMIT = 2.0\n"
        '"""Largest force, N."""\n'
        "@compiled\n"
        "def softened(x):\n"
        "    if x < 0.0:\n"
        "        return deep.SHARE * x\n"
        "    return x\n"
    ),
    "deep/__init__.py": "from .share import SHARE\n",
    "deep/share.py": "SHARE = 0.5\n",
    "records.py": 'import numpy as np\nSTATE = np.dtype([("x", "<f8")])\n',
    "driver.py": "PORT = 1\n",
    "late.py": "K = 1\n",
}


@pytest.fixture
def plant(tmp_path):
    for name, text in FILES.items():
        path = tmp_path / "plant" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "plant"


def key(plant):
    compile_key._read.cache_clear()  # two edits within one tick of the file system's clock
    return module_key(plant / "law.py")


def edited(plant, name, old, new):
    """Whether the key of the law changes with this edit."""
    before = key(plant)
    path = plant / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return key(plant) != before


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("gains.py", "LIMIT = 2.0", "LIMIT = 2.5"),
        ("gains.py", "LIMIT = 2.0", "LIMIT = 2"),
        ("gains.py", "x < 0.0", "x <= 0.0"),
        ("gains.py", "nogil=False", "nogil=True"),
        ("gains.py", "@compiled\n", "@compiler()\n"),
        ("deep/share.py", "0.5", "-0.5"),
        ("deep/__init__.py", "from .share import SHARE", "SHARE = 0.25"),
        ("records.py", "<f8", "<f4"),
        ("__init__.py", '"""A plant."""', "import plant.late"),
        ("law.py", "x > g.LIMIT", "x >= g.LIMIT"),
        ("law.py", "def law(x)", "def law(x, y=1.0)"),
        ("law.py", "    return g.softened(x)", "    from plant.late import K\n    return g.softened(x) + K"),
    ],
)
def test_what_changes_machine_code_changes_the_key(plant, name, old, new):
    assert edited(plant, name, old, new)


def test_what_is_imported_inside_a_function_counts(plant):
    assert edited(plant, "law.py", "    if x", "    from plant import late\n    if x")
    assert edited(plant, "late.py", "K = 1", "K = 2")


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("law.py", "  # too far", ""),
        ("law.py", "x > g.LIMIT:", "(\n        x\n        > g.LIMIT\n    ):"),
        ("law.py", '    """Force for a position."""\n', ""),
        ("law.py", "Force for a position.", "Force (N) for a position."),
        ("law.py", '"""A law."""', '# a comment\n\n\n"""Another law."""'),
        ("gains.py", "Largest force, N.", "Largest force in newtons."),
        ("gains.py", "LIMIT = 2.0", "LIMIT = 2.00"),
        ("driver.py", "1", "2"),
        ("late.py", "1", "2"),
    ],
)
def test_comments_docstrings_layout_and_what_no_compiled_code_imports_do_not(plant, name, old, new):
    assert not edited(plant, name, old, new)


def test_what_python_has_found_in_another_folder_counts(plant, tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "beside_the_plant.py").write_text("K = 1\n")
    monkeypatch.syspath_prepend(tmp_path / "elsewhere")
    import beside_the_plant

    assert edited(plant, "law.py", "import plant.gains", "import beside_the_plant\nimport plant.gains")
    before = key(plant)
    Path(beside_the_plant.__file__).write_text("K = 2\n")
    assert key(plant) != before


def test_docstrings_count_where_a_module_reads_them(plant):
    assert edited(plant, "gains.py", "LIMIT = 2.0", "LIMIT = float(len(__doc__ or 'xx'))")
    assert edited(plant, "gains.py", "Largest force", "The largest force")


def test_a_test_beside_it_and_the_place_of_the_package_do_not_count(plant, tmp_path):
    before = key(plant)
    (plant / "test_law.py").write_text("import plant.law\n")
    assert key(plant) == before
    (tmp_path / "elsewhere").mkdir()
    assert key(plant.rename(tmp_path / "elsewhere" / "plant")) == before


@pytest.mark.parametrize(
    ("option", "value"), [("OPT", 0), ("BOUNDSCHECK", 1), ("SLP_VECTORIZE", 1), ("CPU_NAME", "generic")]
)
def test_options_of_numba_count(plant, monkeypatch, option, value):
    before = key(plant)
    monkeypatch.setattr(numba_config, option, value)
    assert key(plant) != before


@pytest.mark.parametrize("package", ["numba", "llvmlite", "numpy"])
def test_versions_count(plant, monkeypatch, package):
    before = key(plant)
    monkeypatch.setattr(f"{package}.__version__", "0.0")
    assert key(plant) != before


def test_the_law_does_not_depend_on_devices_or_on_the_host():
    names = {source.name for source in covered(ROOT / "rtctl/control/law.py")}
    assert {"rtctl.control.records", "rtctl.control.gate", "hw.jit", "hw.compile_key"} <= names
    assert not [name for name in names if name.startswith(("hw.serial", "hw.can", "hw.simul", "rtctl.host"))]


LISTENER = '''
"""Import every module that compiles something, and tell who imported whom and what compiled code names."""
import builtins, dis, importlib, json, pathlib, sys, types

arrows, plain = set(), builtins.__import__


def listening(name, globals=None, locals=None, fromlist=(), level=0):
    module = plain(name, globals, locals, fromlist, level)
    importer = (globals or {}).get("__name__", "")
    whole = importlib.util.resolve_name("." * level + name, globals["__package__"]) if level else name
    parts = whole.split(".")
    got = [".".join(parts[:n]) for n in range(1, len(parts) + 1)]
    got += [f"{whole}.{x}" for x in fromlist or () if f"{whole}.{x}" in sys.modules]
    arrows.update((importer, x) for x in got)
    return module


import importlib.util
builtins.__import__ = listening
from numba.core.dispatcher import Dispatcher
root = pathlib.Path(sys.argv[1])
every = [f for top in ("hw", "rtctl") for f in sorted((root / top).rglob("*.py"))]
files = [f for f in every if "\\n@compiled" in f.read_text()]
names = [".".join(f.relative_to(root).with_suffix("").parts) for f in files]
refers = {}


def globals_of(code):
    yield from (i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME"))
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from globals_of(constant)


for name in names:
    module = importlib.import_module(name)
    for made in vars(module).values():
        if not isinstance(made, Dispatcher) or made.__module__ != name:
            continue
        for x in globals_of(made.py_func.__code__):
            value = made.py_func.__globals__.get(x)
            module = isinstance(value, types.ModuleType)
            home = value.__name__ if module else getattr(value, "__module__", None)
            refers.setdefault(name, set()).add(home or type(value).__module__)
print(json.dumps([names, sorted(arrows), {k: sorted(v) for k, v in refers.items()}]))
'''


@pytest.fixture(scope="module")
def heard():
    env = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "0"}
    command = [sys.executable, "-c", LISTENER, str(ROOT)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=250, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def ours(names):
    return {name for name in names if name.partition(".")[0] in compile_key.PROJECT}


def test_all_that_python_imports_for_compiled_code_is_covered(heard):
    """Python itself is the judge here: it tells who imported whom while the modules ran."""
    modules, arrows, _ = heard
    assert len(modules) > 50
    of = {}
    for importer, imported in arrows:
        of.setdefault(importer, set()).add(imported)
    for module in modules:
        reached, to_do = set(), [module]
        while to_do:
            name = to_do.pop()
            if name not in reached:
                reached.add(name)
                to_do += ours(of.get(name, ()))
        names = {source.name for source in covered(ROOT / f"{module.replace('.', '/')}.py")}
        assert len(reached) > 3
        assert reached <= names, module


def test_all_that_compiled_functions_refer_to_is_covered(heard):
    refers = heard[2]
    assert len(refers) > 50
    for module, homes in refers.items():
        names = {source.name for source in covered(ROOT / f"{module.replace('.', '/')}.py")}
        assert ours(homes) <= names, module
        others = {home.partition(".")[0] for home in homes} - set(compile_key.PROJECT)
        assert others <= {"builtins", "math", "numpy", "numba", "typing"}, module


PROGRAM = """
import os
from plant.law import law
from hw.jit import compiled

if os.environ["SIDE"] == "left":
    @compiled
    def side(x):
        return -2.0 * x
else:
    @compiled
    def side(x):
        return 3.0 * x

told = [law(-1.0), law(9.0), side(1.0)]
hits = sum(sum(f.stats.cache_hits.values()) for f in (law, side))
print(*told, hits)
"""


@pytest.mark.compiled
def test_what_is_kept_is_used_until_its_meaning_changes(plant, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)

    def run(side="left"):
        env = {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "RTCTL_CACHE_DIR": str(tmp_path / "cache"),
            "SIDE": side,
        }
        command = [sys.executable, str(program)]
        done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=250, check=False)
        assert not done.stderr
        return [float(word) for word in done.stdout.split()]

    assert run() == [-0.5, 2.0, -2.0, 0]
    assert not edited(plant, "law.py", "import plant", "# moved\n\n\nimport plant")
    assert run() == [-0.5, 2.0, -2.0, 2]
    assert run("right") == [-0.5, 2.0, 3.0, 1]  # of one name, in one file
    assert edited(plant, "deep/share.py", "0.5", "0.75")
    assert run() == [-0.75, 2.0, -2.0, 0]
