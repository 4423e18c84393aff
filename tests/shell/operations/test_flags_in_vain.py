"""What is said is taken or refused: never a flag that nothing reads, nor one that was read as another."""

from __future__ import annotations

import pytest

from palpate import cli


@pytest.mark.parametrize(
    ("words", "flag", "meant"),
    [
        ("press demo --tip cone", "--tip", "--tip-radius"),
        ("press demo --dep=0.003", "--dep", "--depth"),
        ("reconstruct REC --mesh 0.01 -o MODEL", "--mesh", "--mesh-size"),
    ],
)
def test_the_beginning_of_a_flag_is_no_flag(words, flag, meant, capsys):
    """--tip cone was answered of --tip-radius, that 'cone' is no number."""
    assert cli.main(words.split()) == 2
    assert f"'{flag}' is not an option; did you mean {meant}?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "flag", "takes"),
    [
        ("--device mouse --rate 300", "--rate", "--robot"),
        ("--device mouse --effect adhesion=1", "--effect", "--phantom"),
        ("--device mouse --depth-error 0.1", "--depth-error", "--phantom"),
        ("--device mouse --tip-radius 0.004", "--tip-radius", "--phantom or --robot"),
        ("--robot --unit mm", "--unit", "--phantom or --device"),
        ("--robot --scene nodule", "--scene", "--device"),
        ("--phantom dome --seconds 3", "--seconds", "--device"),
        ("--phantom dome --poisson-ratio 0.3", "--poisson-ratio", "--robot"),
    ],
)
def test_what_another_kind_of_exploration_takes_is_refused(words, flag, takes, tmp_path, capsys):
    written = tmp_path / "mine.csv.gz"
    assert cli.main(["explore", *words.split(), "-o", str(written)]) == 2
    assert f"{flag} goes with {takes}, not with {words.split()[0]}" in capsys.readouterr().err
    assert not written.exists()


def test_a_files_unit_reaches_the_window_that_explores_it(tmp_path, monkeypatch):
    told = {}

    def touched(scene, **given):
        told.update(given, scene=scene)
        raise KeyboardInterrupt

    monkeypatch.setattr("palpate.operations.touch.touch", touched)
    monkeypatch.setattr("palpate.show.scenery.no_screen", lambda: "")
    words = "explore --device mouse --scene part.stl --unit mm -o"
    cli.main([*words.split(), str(tmp_path / "mine.csv.gz")])
    assert (told["scene"], told["unit"], told["device"]) == ("part.stl", "mm", "mouse")
