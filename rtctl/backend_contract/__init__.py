"""The contract of a backend as tests that any package can run on its own: a pytest plug-in (docs/backends.md).

>>> from rtctl.backend_contract import Case, Contract, Device, Received
>>> pytest_plugins = ("rtctl.backend_contract.plugin",)
"""

import pytest

pytest.register_assert_rewrite("rtctl.backend_contract.checks")

from rtctl.backend_contract.checks import Contract as Contract  # noqa: E402 - rewritten as it is imported
from rtctl.backend_contract.subject import Case as Case  # noqa: E402
from rtctl.backend_contract.subject import Device as Device  # noqa: E402
from rtctl.backend_contract.subject import Received as Received  # noqa: E402
from rtctl.backend_contract.subject import nominal_rig as nominal_rig  # noqa: E402
