"""Data of other instruments: synthetic files of each format, and the measured ones where they lie beside."""

import csv

import numpy as np
import pytest

from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.errors import ContactError, RecordingError
from palpate.reconstruction.machine_curves.indentation import read_chiaro
from palpate.reconstruction.machine_curves.relaxation import fit_relaxation
from palpate.reconstruction.machine_curves.uniaxial import read_compression

from .machine_moduli import fit_approach, small_strain_modulus


@pytest.fixture
def measured(shared_recordings):
    folder = shared_recordings.parent / "realdata"
    if not folder.is_dir():
        pytest.skip("the measured data are not beside the checkout")
    return folder


def chiaro_file(folder, modulus=120.0, offset=0.002):
    t = np.arange(0, 3, 0.001)
    piezo = 1e4 * np.minimum(t, 3 - t)
    cantilever = np.zeros_like(t)
    force = np.zeros_like(t)
    for _ in range(30):
        travel = (piezo - cantilever) * 1e-9
        force = np.asarray(dent_law("hertz").force(np.maximum(travel - 3e-6, 0), modulus, 0.4999, 27.5e-6))
        cantilever = 0.5 * cantilever + 0.5 * force / 0.019 * 1e9
    load = force * 1e6 + offset + 1e-5 * np.random.default_rng(0).standard_normal(len(t))
    rows = [
        f"{a:.6f}\t{b:.6f}\t0.0\t{c:.4f}\t{d:.4f}\t0.0"
        for a, b, c, d in zip(t, load, cantilever, piezo, strict=True)
    ]
    head = ["k (N/m)\t0.019", "Tip radius (um)\t27.5", "E[v=0.500] (Pa)\t120.0", "Max load (\xb5N)\t0.05", ""]
    head += ["Time (s)\tLoad (uN)\tIndentation (nm)\tCantilever (nm)\tPiezo (nm)\tAuxiliary"]
    path = folder / "chiaro.txt"
    path.write_text("\n".join(head + rows), encoding="latin-1")
    return path


def test_an_indentation_gives_modulus_and_contact_point(tmp_path):
    data = read_chiaro(chiaro_file(tmp_path))
    fit = fit_approach(data)
    assert data.tip_radius_m == pytest.approx(27.5e-6)
    assert fit.modulus_pa == pytest.approx(120.0, rel=0.02)
    assert fit.onset_m == pytest.approx(3e-6, abs=5e-8)


def test_an_indentation_without_contact_or_columns_is_refused(tmp_path):
    with pytest.raises(ContactError, match="no contact"):
        fit_approach(read_chiaro(chiaro_file(tmp_path, modulus=1e-9)))
    (tmp_path / "other.txt").write_text("a;b\n1;2\n")
    with pytest.raises(RecordingError, match="no Chiaro text export"):
        read_chiaro(tmp_path / "other.txt")


def compression_file(folder, header="Time (s),Compression (mm),Load (N)"):
    squeeze = np.linspace(0, 10, 400)
    load = 50e3 * squeeze / 30 * np.pi * 0.025**2
    rows = [f"{i / 10},{-u:.5f},{-f:.6f}" for i, (u, f) in enumerate(zip(squeeze, load, strict=True))]
    path = folder / "test.csv"
    path.write_text("\n".join(["Cylinder Diameter: 50mm;", "Cylinder Height: 30mm;", "", header, *rows]))
    return path


def test_a_compression_gives_its_small_strain_modulus(tmp_path):
    test = read_compression(compression_file(tmp_path))
    assert small_strain_modulus(test) == pytest.approx(50e3, rel=1e-3)
    with pytest.raises(RecordingError, match="fewer than 3 samples"):
        small_strain_modulus(test, low=0.9, high=0.95)
    with pytest.raises(RecordingError, match="Load"):
        read_compression(compression_file(tmp_path, header="Time (s),Compression (mm),Torque"))


def test_a_relaxation_is_recovered_and_flagged():
    t = np.linspace(0, 10, 300)
    fit = fit_relaxation(t, 2.0 * (0.5 + 0.3 * np.exp(-t / 0.3) + 0.2 * np.exp(-t / 4)))
    assert fit.g == pytest.approx((0.3, 0.2), abs=0.02)
    assert fit.tau_s == pytest.approx((0.3, 4.0), rel=0.15)
    assert fit.rms < 2e-3
    assert not fit.kelvin_voigt_can
    still = fit_relaxation(t, 2.0 + 0.02 * np.random.default_rng(0).standard_normal(300))
    assert still.kelvin_voigt_can
    with pytest.raises(RecordingError, match="needs 8 samples"):
        fit_relaxation(t[:5], np.ones(5))


def test_the_measured_indentation_agrees_with_the_makers_fit(measured):
    data = read_chiaro(next((measured / "chiaro_sphere_1khz").glob("fmt-*.txt")))
    fit = fit_approach(data)
    assert fit.modulus_pa == pytest.approx(data.stated_modulus_pa, rel=0.03)
    assert fit.r_squared > 0.99


def test_measured_compressions_agree_with_the_published_moduli(measured):
    folder = measured / "tissue_phantom_compression"
    ratios = []
    with open(folder / "published_E.csv", newline="") as file:
        for row in csv.DictReader(file):
            tests = [read_compression(f) for f in sorted((folder / row["phantom"]).glob("*.csv"))]
            mean = np.mean([small_strain_modulus(t) for t in tests])
            ratios.append(mean / 1e3 / float(row["E_mean_kPa"]))
    assert len(ratios) == 19
    assert np.median(ratios) == pytest.approx(1.0, abs=0.03)
    assert np.mean(np.abs(np.array(ratios) - 1) < 0.05) > 0.9


def test_measured_tissue_relaxes_and_is_flagged(measured):
    data = np.loadtxt(next((measured / "fishmuscle_relaxation").glob("*.csv")), skiprows=1)
    assert not fit_relaxation(data[:, 0], data[:, 1]).kelvin_voigt_can
