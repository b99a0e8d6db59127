"""The public names of the packages, as `help` shows them."""

import subprocess
import sys

import pytest

import analysis
import shiplog


@pytest.mark.parametrize("name", analysis.__all__)
def test_every_public_name_of_analysis_is_imported_on_its_first_use(name: str) -> None:
    assert getattr(analysis, name).__name__ == name
    assert name in (analysis.__doc__ or "") or name[0].isupper()


@pytest.mark.parametrize("name", shiplog.__all__)
def test_every_public_name_of_shiplog_is_there(name: str) -> None:
    assert hasattr(shiplog, name)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'analyze'"):
        _ = analysis.analyze


@pytest.mark.parametrize("package", ["analysis", "shiplog"])
def test_importing_a_package_imports_no_heavy_library(package: str) -> None:
    code = (
        f"import {package}, sys\n"
        "print([m for m in ('numba', 'rerun', 'pandas', 'control', 'scipy.signal', 'scipy.stats')"
        " if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
