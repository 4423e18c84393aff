"""The modulus of a recording does not depend on the mesh."""

from __future__ import annotations

import argparse

import pytest

from ..support import modulus_mesh


@pytest.mark.release
def test_the_modulus_is_that_of_a_finer_mesh():
    parser = argparse.ArgumentParser()
    modulus_mesh.add_arguments(parser)
    (found,) = modulus_mesh.run(parser.parse_args(["--mesh-size", "0.010", "0.007"])).values()
    assert len(found["young_modulus_pa"]) == 2
    assert found["change"] < 0.03
