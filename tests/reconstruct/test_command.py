"""`palpate reconstruct`: a whole model from files, and one clear line with exit code 2 for each kind of bad
input."""

import gzip
import json

import numpy as np
import pytest

from palpate import cli
from palpate.mechanics.model.files import read_model
from palpate.mechanics.recording.recording import write_recording

from .exploration_of_cylinder import explore_cylinder


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A recording on disk: (samples, description)."""
    folder = tmp_path_factory.mktemp("recording")
    samples = write_recording(folder / "cylinder.csv", explore_cylinder()[0])
    return samples, samples.with_suffix(".toml")


def copy(files, folder, *, text=None, toml=None):
    samples = folder / "bad.csv"
    samples.write_text(files[0].read_text() if text is None else text)
    samples.with_suffix(".toml").write_text(files[1].read_text() if toml is None else toml)
    return samples


def refused(recording, folder, capsys, *words) -> str:
    """Run on bad input: exit code 2, one line on stderr, nothing written. Returns the line."""
    output = folder / "MODEL"
    before = sorted(folder.iterdir())
    assert cli.main(["reconstruct", str(recording), "-o", str(output), *words]) == 2
    error = capsys.readouterr().err.strip()
    assert len(error.splitlines()) == 1 and error.startswith("palpate reconstruct:")
    assert sorted(folder.iterdir()) == before
    return error


def changed_row(files, row, column, value) -> str:
    lines = files[0].read_text().splitlines()
    cells = lines[row].split(",")
    cells[column] = value
    lines[row] = ",".join(cells)
    return "\n".join(lines) + "\n"


def test_a_missing_column_is_named(files, tmp_path, capsys):
    text = files[0].read_text().replace("t,x,y,z,fx,fy,fz", "t,x,y,z,fx,fy,force", 1)
    assert "lacks the columns fz" in refused(copy(files, tmp_path, text=text), tmp_path, capsys)


def test_nan_is_found(files, tmp_path, capsys):
    bad = copy(files, tmp_path, text=changed_row(files, 700, 2, "nan"))
    assert "row 700" in refused(bad, tmp_path, capsys)


def test_time_that_goes_back_is_found(files, tmp_path, capsys):
    bad = copy(files, tmp_path, text=changed_row(files, 900, 0, "0.0001"))
    assert "t must increase" in refused(bad, tmp_path, capsys)


def test_a_truncated_archive_is_found(files, tmp_path, capsys):
    samples = tmp_path / "bad.csv.gz"
    whole = gzip.compress(files[0].read_bytes(), compresslevel=1)
    samples.write_bytes(whole[: len(whole) // 2])
    (tmp_path / "bad.toml").write_text(files[1].read_text())
    assert "is truncated" in refused(samples, tmp_path, capsys)


def test_a_missing_description_is_found(files, tmp_path, capsys):
    samples = tmp_path / "bad.csv"
    samples.write_text(files[0].read_text())
    assert "bad.toml" in refused(samples, tmp_path, capsys)


def test_a_missing_phase_is_found(tmp_path, capsys):
    samples = write_recording(tmp_path / "bad.csv", explore_cylinder(without_phase=True)[0])
    assert "boundary" in refused(samples, tmp_path, capsys)


def test_no_contact_is_found(files, tmp_path, capsys):
    table = np.loadtxt(files[0], delimiter=",", skiprows=1)
    table[:, 4:] = 0.012 * np.random.default_rng(0).standard_normal((len(table), 3))
    rows = "\n".join(",".join(f"{v:.6f}" for v in row) for row in table)
    bad = copy(files, tmp_path, text="t,x,y,z,fx,fy,fz\n" + rows + "\n")
    assert "no contact" in refused(bad, tmp_path, capsys)


def test_too_few_presses_are_found(files, tmp_path, capsys):
    short = "\n".join(files[0].read_text().splitlines()[:12500]) + "\n"
    assert "at least 4" in refused(copy(files, tmp_path, text=short), tmp_path, capsys)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--poisson-ratio", "0.5"), "from 0 to 0.4999"),
        (("--contact-threshold", "0"), "greater than 0"),
        (("--cutoff", "-3"), "from 1 to 10000 Hz"),
        (("--mesh-size", "0"), "--mesh-size"),
        (("--method", "paper"), "usable presses"),
        (("--beside", "nowhere"), "no MODEL folder"),
        (("--base-spacing", "0"), "--base-spacing"),
        (("--indentation", "-0.01"), "--indentation"),
        (("--site-size", "0"), "--site-size"),
        (("--law-bias", "2"), "between 0 and 1"),
        (("--bootstraps", "1"), "from 20 to"),
    ],
)
def test_bad_options_say_what_is_allowed(files, tmp_path, capsys, words, part):
    assert part in refused(files[0], tmp_path, capsys, *words)


def test_a_folder_that_is_no_model_is_not_overwritten(files, tmp_path, capsys):
    (tmp_path / "MODEL").mkdir()
    (tmp_path / "MODEL" / "letter.txt").write_text("keep me")
    assert "no MODEL folder" in refused(files[0], tmp_path, capsys)


@pytest.mark.slow
def test_a_recording_becomes_a_model_with_a_report(files, tmp_path, capsys, nothing_to_press):
    output, figures = tmp_path / "MODEL", tmp_path / "out.json"
    words = ["--surface", "hull", "--mesh-size", "0.019", "--json", str(figures)]
    words += ["--report", str(tmp_path / "page")]
    assert cli.main(["reconstruct", str(files[0]), "-o", str(output), *words]) == 0
    model = read_model(output)
    result = json.loads(figures.read_text())
    assert len(model.presses) == result["palpations"] == 12
    assert result["young_modulus_pa"] == pytest.approx(model.material.young_modulus_pa)
    assert (
        model.material.young_modulus_ci95_pa[0]
        < model.material.young_modulus_pa
        < model.material.young_modulus_ci95_pa[1]
    )
    assert model.provenance["recording_sha256"]
    shape = model.about["shape"]
    assert shape["surface"] == "hull" and shape["reason"]
    assert shape["volume_m3"] == pytest.approx(shape["hull_volume_m3"])
    assert 0 < shape["sd_median_m"] <= shape["sd_p95_m"] <= shape["sd_greatest_m"]
    assert model.mesh.volumes.sum() == pytest.approx(shape["volume_m3"], rel=0.01)
    page = (tmp_path / "page.html").read_text()
    # the paper's own rows stand beside ours only where its method was asked for
    assert "28.73" not in page and page.count("data:image/png") >= 7
    assert (tmp_path / "page" / "figure-5.png").stat().st_size > 10000


@pytest.mark.slow
def test_a_models_base_stands_in_for_a_missing_phase(files, tmp_path, capsys):
    first, second = tmp_path / "FIRST", tmp_path / "SECOND"
    coarse = ["--surface", "hull", "--mesh-size", "0.014"]
    assert cli.main(["reconstruct", str(files[0]), "-o", str(first), *coarse]) == 0
    samples = write_recording(tmp_path / "later.csv", explore_cylinder(without_phase=True)[0])
    toml = samples.with_suffix(".toml").read_text()
    samples.with_suffix(".toml").write_text(toml.replace("[object]", '[object]\nmodel = "FIRST"'))
    assert cli.main(["reconstruct", str(samples), "-o", str(second), *coarse]) == 0
    a, b = read_model(first), read_model(second)
    assert np.allclose(a.support.normal, b.support.normal, atol=1e-6)
    for one, other in ((a.material, b.material), (b.material, a.material)):
        low, high = one.young_modulus_ci95_pa
        assert low < other.young_modulus_pa < high  # the same presses: meshes alone move it by some 3 %
