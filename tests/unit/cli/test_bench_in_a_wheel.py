"""`rtctl bench` where the benchmarks are not: in an installed package."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from rtctl.cli import bench
from rtctl.errors import ConfigError


def test_an_installed_package_says_where_its_benchmarks_are(monkeypatch, tmp_path):
    monkeypatch.setattr(bench, "BENCHMARKS", tmp_path / "tests" / "bench")
    with pytest.raises(
        ConfigError, match="are in a checkout of rtctl, not in an installed package; run `make bench`"
    ):
        CliRunner().invoke(bench.command, ["safety", "--quick"], catch_exceptions=False)


def test_the_benchmarks_of_a_checkout_are_found():
    assert (bench.BENCHMARKS / "row.py").is_file()
    assert Path(bench.__file__).parents[2] in bench.BENCHMARKS.parents
