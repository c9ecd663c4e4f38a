"""The contract of a backend as tests that any package can run on its own: a pytest plug-in
(docs/backends.md).

>>> from rtctl.backend_contract import Case, Contract, Device, Received
>>> pytest_plugins = ("rtctl.backend_contract.plugin",)"""

import pytest

from rtctl.backend_contract.subject import Case, Device, Received, nominal_rig

pytest.register_assert_rewrite("rtctl.backend_contract.checks", "rtctl.backend_contract.units")

from rtctl.backend_contract.checks import Contract  # noqa: E402 - rewritten as it is imported

__all__ = ["Case", "Contract", "Device", "Received", "nominal_rig"]
