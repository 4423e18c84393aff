"""Tests in a machine: what they say of a material, from files as their makers write them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.specimen.approach import approach_of
from palpate.diagnosis.specimen.bench import MachineCycle, Similarity, bench_of
from palpate.diagnosis.specimen.bench_diagnosis import held_out_rivals
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.errors import ContactError, OptionError, RecordingError
from palpate.reconstruction.machine_curves.relaxation import held_out_relaxation
from palpate.reconstruction.machine_curves.uniaxial import LAWS, Uniaxial, chosen, fit_law, held_out


def compression(folder, stiffening: float, count: int = 3, modulus: float = 60e3) -> list:
    """Cylinders of a Yeoh material between platens, 1 % of scatter between repeats."""
    rng, paths = np.random.default_rng(0), []
    strain = np.linspace(0, 0.5, 300)
    stretch = 1 - strain
    energy = stretch**2 + 2 / stretch - 3
    stress = modulus / 3 * (stretch - stretch**-2) * (1 + 2 * stiffening * energy)
    for k in range(count):
        load = stress * np.pi * 0.025**2 * (1 + 0.01 * rng.standard_normal())
        rows = [f"{i / 10},{-30 * e:.5f},{f:.6f}" for i, (e, f) in enumerate(zip(strain, load, strict=True))]
        paths.append(folder / f"mix_A{k + 1}.csv")
        head = [
            "Cylinder Diameter: 50mm;",
            "Cylinder Height: 30mm;",
            "",
            "Time (s),Compression (mm),Load (N)",
        ]
        paths[-1].write_text("\n".join([*head, *rows]))
    return paths


@pytest.mark.parametrize(("stiffening", "law"), [(0.0, "neo-hookean"), (0.25, "yeoh"), (-0.08, "yeoh")])
def test_a_compression_names_the_law_that_predicts_other_curves(tmp_path, stiffening, law):
    made = pp.material(*compression(tmp_path, stiffening), progress=False)
    assert made.law == law and made.kind == "compression" and made.curves == 3
    assert made.young_modulus_pa == pytest.approx(60e3, rel=0.03)
    assert made.error[law] < 0.02 < made.error["linear"]
    if law == "yeoh":
        assert made.parameters["c20_over_c10"] == pytest.approx(stiffening, abs=0.03)
        assert made.effects == ("finite_strain", "strain_stiffening")
    assert "Poisson's ratio" in made.unknown


def test_a_law_that_softens_is_told_from_one_curve():
    stretch = 1 + np.linspace(0, 0.45, 120)
    stress = 2 * 8e3 * (stretch - stretch**-2) * (1 - 0.1 * (stretch**2 + 2 / stretch - 3))
    stress *= 1 + 0.005 * np.random.default_rng(0).standard_normal(len(stress))
    errors = held_out([Uniaxial(stretch, stress, "one")])
    assert errors["yeoh"][0] < 0.006 < errors["neo-hookean"][0]
    assert chosen(errors) == "yeoh"
    assert fit_law([Uniaxial(stretch, stress, "one")], LAWS[2]).young_modulus_pa == pytest.approx(
        48e3, rel=0.01
    )


def indentations(count: int, radius: float, modulus: float, seed: int = 0) -> list[MachineCycle]:
    """Approach and retract of a sphere on a deep sample, at any scale."""
    rng, curves = np.random.default_rng(seed), []
    for k in range(count):
        t = np.linspace(0, 4, 800)
        deep = radius * (rng.uniform(0.25, 0.4) * np.sin(np.pi * t / 4) - 0.05)
        force = np.asarray(dent_law("sphere").force(np.maximum(deep, 0), modulus, 0.49, radius))
        noise = 0.003 * force.max() * rng.standard_normal(len(t))
        curves.append(MachineCycle(t, deep + 3e-5 * k, force + noise + 0.2 * force.max(), f"curve {k}"))
    return curves


@pytest.mark.parametrize(("radius", "modulus"), [(5e-3, 2e4), (10e-6, 300.0)])
def test_indentations_of_any_scale_give_modulus_and_first_touch(radius, modulus):
    bench = bench_of(indentations(6, radius, modulus), Tip("sphere", radius))
    assert bench.used.all() and bench.model.presses.sites == 1
    assert bench.modulus_pa == pytest.approx(np.full(6, modulus), rel=0.06)
    assert bench.onset_m == pytest.approx(3e-5 * np.arange(6), abs=0.02 * radius)
    approach = approach_of(bench)
    assert approach.hysteresis == pytest.approx(0.0, abs=0.03)
    assert approach.error[approach.law] < 0.03
    touches = touches_of(bench.model.presses.net)
    assert touches.sites == 6
    found = held_out_rivals(touches)
    size = np.sqrt((touches.push[touches.counted] ** 2).mean())
    error = {n: np.sqrt(((f - touches.push)[touches.counted] ** 2).mean()) / size for n, f in found.items()}
    assert error["regression"] < error["hunt-crossley"] < error["kelvin-voigt"] < 0.4


def test_what_is_found_is_turned_back_into_the_machines_units():
    back = Similarity(length=100.0, force=1e4, time=0.5).back(
        {"tip_radius_m": 0.005, "tau_s": 1.0, "pull_off_n": 1.0, "stiffness_n_per_m": 100.0, "mu": 0.3}
    )
    assert back == pytest.approx(
        {"tip_radius_m": 5e-5, "tau_s": 2.0, "pull_off_n": 1e-4, "stiffness_n_per_m": 1.0, "mu": 0.3}
    )


def test_a_relaxation_is_predicted_where_it_was_left_out():
    t = np.geomspace(0.01, 100, 200)
    errors, fit = held_out_relaxation(t, 3e4 * (0.3 + 0.4 * np.exp(-t / 0.5) + 0.3 * np.exp(-t / 20)))
    assert errors["prony-2"] < 0.04 < errors["spring"] and errors["spectrum"] < 0.07
    assert sorted(fit.tau_s) == pytest.approx([0.5, 20], rel=0.2)


def test_what_is_no_test_or_two_kinds_is_one_line(tmp_path, capsys):
    files = compression(tmp_path, 0.0, 1)
    (tmp_path / "hold.csv").write_text(
        "Time,Relaxation Modulus\n" + "\n".join(f"{i},{9 - i}" for i in range(9))
    )
    for given, options, error, words in (
        ([*files, tmp_path / "hold.csv"], {}, RecordingError, "files of one kind"),
        ([tmp_path / "gone.csv"], {}, RecordingError, "cannot be read"),
        (files, {"kind": "bending"}, OptionError, "allowed are auto, indentation"),
        ([], {}, OptionError, "name at least one"),
    ):
        with pytest.raises(error, match=words) as refused:
            pp.material(*given, progress=False, **options)
        assert len(str(refused.value).splitlines()) == 1
    t = np.arange(50) / 10
    np.savetxt(
        tmp_path / "up.csv",
        np.column_stack([t, 0.1 * t, -t]),
        delimiter=",",
        header="time,travel,load",
        comments="",
    )
    with pytest.raises(RecordingError, match="--tip-radius"):
        pp.material(tmp_path / "up.csv", progress=False)
    with pytest.raises(OptionError, match="give metres"):
        pp.material(tmp_path / "up.csv", tip_radius_m=5, progress=False)
    with pytest.raises(RecordingError, match="--units force=mN or --units force=N"):
        pp.material(tmp_path / "up.csv", tip_radius_m=0.005, progress=False)
    with pytest.raises(ContactError, match="92 of its radii.*signs"):
        pp.material(tmp_path / "up.csv", tip_radius_m=0.005, units={"position": "m"}, progress=False)
    assert cli.main(["material", *map(str, files), "--json", str(tmp_path / "out.json")]) == 0
    held = json.loads((tmp_path / "out.json").read_text())
    assert held["kind"] == "compression" and held["relative_error"]["neo-hookean"] < 0.02
    assert "held-out" in capsys.readouterr().out


def test_measured_data_are_read_by_their_own_headers(measured_data):
    chiaro = pp.material(
        measured_data / "chiaro_sphere_1khz" / "fmt-chiaro-txt_AEBP1_Indentation_002.txt", progress=False
    )
    assert chiaro.young_modulus_pa == pytest.approx(117.0, rel=0.1) and chiaro.effects == ()
    pulled = pp.material(measured_data / "srmd_tensile" / "Dragon Skin 10 MEDIUM.csv", progress=False)
    assert pulled.kind == "tension" and pulled.error[pulled.law] < 0.03
    fish = pp.material(
        measured_data / "fishmuscle_relaxation" / "stressrelaxation_fishmuscle_data.csv", progress=False
    )
    assert fish.effects == ("viscoelasticity",) and fish.error[fish.law] < 0.1 < fish.error["spring"]
