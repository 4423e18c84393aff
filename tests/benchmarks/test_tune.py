"""What the benchmark of tuning counts."""

from benchmarks.tune import _figures


def _case(after_n, **moved):
    shape = {"before_n": 0.04, "tuned_n": after_n, "identified_n": 0.02, "bound_n": 0.002}
    return {
        "simulator": "drake", "planted": {"damping_s": 0.06}, "cpu_s": 60.0, "modulus_moved": 0.0,
        "moved": moved, "modulus_would": 0.1, "modulus_identified": -0.3,
        "shapes": [{"name": name, **shape} for name in ("cylinder", "dome")],
    }  # fmt: skip


def test_a_shape_is_won_where_tuning_leaves_less_than_a_modulus():
    found = _figures([_case(0.01), _case(0.03)])
    by = {figure.what: figure for figure in found}
    won = by["tuned settings beat an identified modulus on unseen shapes, 1 of 2"]
    assert won.value == 50.0 and not won.met
    assert by["drake: unseen shapes, error after over before, median"].value == 0.5


def test_a_planted_setting_is_restored_where_it_ends_near_its_control():
    """Drake's best damping is 4 ms."""
    cases = [_case(0.01, damping_s=[0.06, 0.005]), _case(0.01, damping_s=[0.06, 0.01]), _case(0.01)]
    cases[1]["moved"]["timestep_s"] = [0.003, 0.001]
    what = [figure.what for figure in _figures(cases)]
    assert "what was planted is moved, and no other, 1 of 3" in what
    assert "planted setting restored within a factor of 1.5, 1 of 3" in what
