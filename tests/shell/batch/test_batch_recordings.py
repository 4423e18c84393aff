"""A batch over recordings: which are found, their names, rows, resuming, the page. The physics of a step is
replaced by numbers of the test; test_batch_engines does the real thing."""

from __future__ import annotations

import csv
import json
import math
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from palpate.batching import plan as run
from palpate.batching import steps
from palpate.batching.plan import BatchChoice, find, tasks_of
from palpate.batching.summary import COLUMNS, Row, agreement

from .test_batch_driver import Here


def recording(path: Path, modulus: float = 20e3, name: str | None = "bean", **more: float) -> Path:
    """A recording's two files; the steps below read the modulus that it states."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("t,x,y,z,fx,fy,fz\n0,0,0,0,0,0,0\n")
    stated = "\n".join(f"{key} = {value}" for key, value in {"e": modulus, **more}.items())
    named = f'[object]\nname = "{name}"\n' if name else ""
    path.with_suffix(".toml").write_text(f"{stated}\n{named}")
    return path


@pytest.fixture
def quick(monkeypatch):
    """Steps that read their answer from the recording, in this process; which ran."""
    did: list[tuple[str, str]] = []

    def step(name):
        def step_run(*, sha256, options, seed, reports, recording, shape, folder):
            import tomllib

            assert steps.content_of(recording, shape) == dict(sha256)
            place, about = Path(folder), tomllib.loads(Path(recording).with_suffix(".toml").read_text())
            if about["e"] < 0:
                raise pp.ContactError("it holds no\npresses")
            if about.get("unforeseen") == name:
                raise ZeroDivisionError("surprise")
            did.append((place.name, name))
            (place / "model").mkdir(parents=True, exist_ok=True)
            for file in (f"{name}.json", f"{name}.html", "thumbnail.png", "model/model.toml"):
                (place / file).write_text(f"{about['e']}")
            e = about["e"]
            return {
                "reconstruct": {
                    "object": about.get("object", {}).get("name"), "presses": 24,
                    "young_modulus_pa": e, "young_modulus_ci95_pa": [0.9 * e, 1.1 * e],
                    "doubt": about.get("doubt", ""),
                },
                "compare": {
                    "rmse_n": {"fem": 0.1, "kelvin-voigt": 0.3, "hunt-crossley": 0.17, "fem-homogeneous": 0.1}
                },
                "diagnose": {
                    "kind": "effect", "effects": ["viscoelasticity", "time_delay"], "candidates": [],
                    "gap_before_n": 0.2, "gap_after_n": 0.05,
                },
            }[name]  # fmt: skip

        return step_run

    for name in steps.STEPS:
        monkeypatch.setattr(steps, name, step(name))
    monkeypatch.setattr("palpate.parallel.run.engine", lambda *given: nullcontext(Here(2)))
    return did


def test_recordings_are_found_in_folders_and_by_pattern_and_named_by_what_tells_them_apart(tmp_path):
    for name in ("day1/bean", "day2/bean", "day2/left/bowl", "day2/left/bean.2"):
        recording(tmp_path / "in" / f"{name}.csv")
    (tmp_path / "in" / "forces.csv").write_text("t,fx,fy,fz\n")  # nobody describes it: it is no recording
    out = tmp_path / "in" / "out"
    recording(out / "old" / "made.csv")  # what an output holds is not looked at
    one_root = {f.name for f in find([tmp_path / "in"], out)}
    assert one_root == {"day1-bean", "day2-bean", "day2-left-bowl", "day2-left-bean.2"}
    two_roots = find([tmp_path / "in/day1", tmp_path / "in/day2", tmp_path / "in/day2/bean.toml"], out)
    assert [f.name for f in two_roots] == ["day1-bean", "day2-bean", "left-bean.2", "left-bowl"]
    assert [f.name for f in find([tmp_path / "in" / "*" / "bean.csv"], out)] == ["day1-bean", "day2-bean"]
    assert [f.name for f in find([str(tmp_path / "in/**/bowl*")], out)] == ["day2-left-bowl"]
    with pytest.raises(pp.OptionError, match="leads to no recording"):
        find([tmp_path / "in" / "day3*"], out)


def test_links_keep_their_own_names(tmp_path):
    recording(tmp_path / "store" / "8f3a.csv")
    (tmp_path / "in").mkdir()
    for ending in (".csv", ".toml"):
        (tmp_path / "in" / f"bean{ending}").symlink_to(tmp_path / "store" / f"8f3a{ending}")
    assert [f.name for f in find([tmp_path / "in"], tmp_path / "out")] == ["bean"]


def test_names_that_only_dashes_tell_apart_stay_two(tmp_path):
    recording(tmp_path / "a-b" / "c.csv")
    recording(tmp_path / "a" / "b-c.csv")
    assert len({f.name for f in find([tmp_path], tmp_path / "out")}) == 2


def test_a_key_is_of_bytes_options_and_seed_and_not_of_places(tmp_path):
    def keys(path, choice=None, out="out"):
        (found,) = find([path], tmp_path / out)
        return [task.key for task in tasks_of(found, choice or BatchChoice(), tmp_path / out)]

    first = keys(recording(tmp_path / "a" / "bean.csv"))
    assert first == keys(recording(tmp_path / "b" / "bean.csv"), out="elsewhere")
    assert len(set(first)) == 3
    assert not set(first) & set(keys(recording(tmp_path / "c" / "bean.csv", 21e3)))
    fast = keys(tmp_path / "a" / "bean.csv", BatchChoice(options={"diagnose": {"fast": True}}))
    assert [a == b for a, b in zip(first, fast, strict=True)] == [True, True, False]
    assert not set(first) & set(keys(tmp_path / "a" / "bean.csv", BatchChoice(seed=1)))
    shapes = []
    for name, text in (("1.stl", "solid"), ("2.stl", "solid"), ("3.stl", "other")):
        (tmp_path / name).write_text(text)
        choice = BatchChoice(options={"reconstruct": {"shape": str(tmp_path / name)}})
        shapes.append(keys(tmp_path / "a" / "bean.csv", choice))
    assert shapes[0] == shapes[1] != first and not set(shapes[1]) & set(shapes[2])


def test_one_bad_recording_stops_no_other_and_has_its_reason(tmp_path, quick, capsys):
    recording(tmp_path / "in" / "good.csv")
    recording(tmp_path / "in" / "empty.csv", -1.0)
    recording(tmp_path / "in" / "odd.csv").with_suffix(".toml").write_text('e = 1.0\nunforeseen = "diagnose"')
    recording(tmp_path / "in" / "torn.csv").with_suffix(".toml").write_text("e = ")
    lone = tmp_path / "in" / "lone.csv"
    lone.write_text("t,x\n")
    out = tmp_path / "out"
    assert cli.main(["batch", str(tmp_path / "in"), str(lone), "-o", str(out)]) == 0
    captured = capsys.readouterr()
    assert captured.err.strip() == f"palpate batch: 4 of 5 recordings failed: see {out / 'summary.csv'}"
    rows = {row["recording"]: row for row in csv.DictReader((out / "summary.csv").open())}
    assert tuple(rows["good"]) == COLUMNS
    assert rows["good"]["status"] == "done"
    assert rows["good"]["young_modulus_lo_pa"] == "18000.0"
    assert rows["good"]["effects"] == "viscoelasticity;time_delay"
    assert rows["empty"]["reason"] == "reconstruct: it holds no presses"
    assert rows["odd"]["reason"] == "diagnose: ZeroDivisionError: surprise"
    assert rows["odd"]["young_modulus_pa"] == "1.0" and rows["odd"]["status"] == "failed"
    assert "no valid TOML" in rows["torn"]["reason"]
    assert "does not exist" in rows["lone"]["reason"]
    assert "surprise" in (out / "odd" / "error.txt").read_text()


def test_contract_of_the_columns():
    modulus = "young_modulus_pa young_modulus_lo_pa young_modulus_hi_pa"
    words = f"recording status reason {modulus} verdict effects gap_before_n gap_after_n seconds"
    assert list(COLUMNS) == words.split()


def test_it_goes_on_where_it_stopped_and_does_again_what_changed(tmp_path, quick):
    for name in ("a", "b"):
        recording(tmp_path / "in" / f"{name}.csv")
    options = {"out": tmp_path / "out", "progress": False}
    pp.batch(tmp_path / "in", do="diagnose", **options)  # which needs a model
    assert sorted(quick) == [(n, s) for n in "ab" for s in ("diagnose", "reconstruct")]
    quick.clear()
    recording(tmp_path / "in" / "b.csv", 30e3)
    recording(tmp_path / "in" / "c.csv")
    again = pp.batch([tmp_path / "in"], **options)
    assert sorted(quick) == [("a", "compare"), *((n, s) for n in "bc" for s in sorted(steps.STEPS))]
    assert (again.tasks, again.reused) == (9, 2)
    assert [row.young_modulus_pa for row in again] == [20e3, 30e3, 20e3]
    quick.clear()
    (tmp_path / "out" / "a" / "diagnose.json").unlink()
    pp.batch(tmp_path / "in", **options)
    assert quick == [("a", "diagnose")]


def test_the_result_prints_draws_and_is_a_table(tmp_path, quick):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "forgotten.csv").write_text("t,x,y,z,fx,fy,fz\n")
    for k, e in enumerate((20e3, 21e3, 19e3, 40e3)):
        recording(tmp_path / "in" / f"{k}.csv", e, name=None if k == 3 else "bean")
    result = pp.batch(tmp_path / "in", tmp_path / "out", do=("reconstruct", "diagnose"), progress=False)
    words = str(result)
    assert "4 of 4" in words and "bean: 3" in words and "forgotten.csv" in words
    assert result.table["young_modulus_pa"] == [20e3, 21e3, 19e3, 40e3]
    assert set(result.table) == set(COLUMNS) and len(result) == 4
    assert "<img" in result._repr_html_()
    alone = pp.batch(tmp_path / "in" / "3.csv", tmp_path / "one", progress=False)
    assert "kPa" in alone.plot().get_xlabel()
    assert {r["recording"] for r in result.as_json()["recordings"]} == set("0123")


def test_the_page_links_every_report_and_escapes_what_people_name_things(tmp_path, quick):
    recording(tmp_path / "in" / "löß & <b>.csv", name="a <i>bean</i>")
    recording(tmp_path / "in" / "2.csv", name="a <i>bean</i>")
    pp.batch(tmp_path / "in", tmp_path / "out", progress=False)
    page = (tmp_path / "out" / "index.html").read_text()
    assert "<i>bean" not in page and "löß & <b>" not in page
    for file in ("thumbnail.png", "reconstruct.html", "compare.html", "diagnose.html"):
        assert f"l%C3%B6%C3%9F%20%26%20%3Cb%3E/{file}" in page
    assert "http" not in page  # nothing is fetched
    # the FEM of one modulus is no 1D model
    assert 'data-name="of best 1D [mN]" data-by="0.17"' in page
    # four errors stood in a row by two definitions, of which one was told
    assert "gap " not in page.partition("<tbody>")[0] and "of the simplest simulation" in page


def test_parquet_has_the_same_columns(tmp_path, quick):
    parquet = pytest.importorskip("pyarrow.parquet")
    recording(tmp_path / "in" / "a.csv")
    recording(tmp_path / "in" / "b.csv", -1.0)
    pp.batch(tmp_path / "in", tmp_path / "out", progress=False)
    table = parquet.read_table(tmp_path / "out" / "summary.parquet")
    assert tuple(table.column_names) == COLUMNS
    assert table["young_modulus_pa"].to_pylist() == [20e3, None]
    assert str(table.schema.field("gap_after_n").type) == "double"


def test_a_model_that_is_not_to_be_believed_ends_with_1_and_says_why(tmp_path, quick, capsys):
    recording(tmp_path / "in" / "good.csv")
    why = "another object's shape"
    recording(tmp_path / "in" / "odd.csv").with_suffix(".toml").write_text(f'e = 1.0\ndoubt = "{why}"')
    out = tmp_path / "out"
    assert cli.main(["batch", str(tmp_path / "in"), "-o", str(out)]) == 1
    rows = {row["recording"]: row for row in csv.DictReader((out / "summary.csv").open())}
    assert rows["odd"]["status"] == "done" and rows["odd"]["reason"] == f"not reliable: {why}"
    assert rows["good"]["reason"] == "" and why in capsys.readouterr().out


def test_an_interruption_leaves_a_summary_that_says_what_waits(tmp_path, quick, monkeypatch):
    for name in "abc":
        recording(tmp_path / "in" / f"{name}.csv")

    def stop_at_b(self, job, order):
        if Path(job["record"]).parents[1].name == "b":
            raise KeyboardInterrupt
        return submit(self, job, order)

    submit = Here.submit
    monkeypatch.setattr(Here, "submit", stop_at_b)
    monkeypatch.setattr("palpate.parallel.run.engine", lambda *given: nullcontext(Here(1)))
    assert cli.main(["batch", str(tmp_path / "in"), "-o", str(tmp_path / "out")]) == 130
    rows = list(csv.DictReader((tmp_path / "out" / "summary.csv").open()))
    assert [row["status"] for row in rows] == ["done", "waiting", "waiting"]


@pytest.mark.parametrize(
    "words, said",
    [
        (["--do", "judge"], "allowed are reconstruct, compare, diagnose"),
        (["--set", "diagnose.quick=true"], "pp.diagnose has no option 'quick'"),
        (["--set", "diagnose.seed=1"], "give --seed"),
        (["--set", "fast=true"], "must be STEP.OPTION=VALUE"),
        (["--set", "judge.fast=true"], "options of 'judge'"),
        (["--workers", "0"], "allowed are 1 and more"),
        (["--memory", "-1"], "greater than 0"),
        (["--scheduler", "tcp://127.0.0.1:1", "--workers", "2"], "give --scheduler, or --workers"),
    ],
)
def test_bad_arguments_are_told_in_a_line(tmp_path, words, said, capsys):
    recording(tmp_path / "a.csv")
    assert cli.main(["batch", str(tmp_path), "-o", str(tmp_path / "out"), *words]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out" / "summary.csv").exists()


def test_values_of_options_are_read_as_toml_and_else_as_words(tmp_path, quick, monkeypatch):
    seen = {}
    whole = run.batch

    def watched(sources, out, choice, **more):
        seen.update(choice=choice)
        return whole(sources, out, choice, **more)

    monkeypatch.setattr("palpate.batching.plan.find", lambda *given: [])
    monkeypatch.setattr(run, "batch", watched)
    given = ["diagnose.fast=true", "diagnose.without=adhesion", "reconstruct.mesh_size_m=0.008"]
    cli.main(["batch", ".", "-o", str(tmp_path / "o"), *(w for v in given for w in ("--set", v))])
    assert seen["choice"].options == {
        "diagnose": {"fast": True, "without": "adhesion"},
        "reconstruct": {"mesh_size_m": 0.008},
    }


def test_agreement_of_explorations_meets_its_own_statistics():
    random = np.random.default_rng(0)
    spread, own = 0.06, 0.03
    rows = []
    for k in range(400):
        e = 20e3 * math.exp(random.normal(0, spread))
        rows.append(Row(str(k), "done", "", e, e * math.exp(-1.96 * own), e * math.exp(1.96 * own)))
    found = agreement("bean", rows)
    assert found.young_modulus_pa == pytest.approx(20e3, rel=0.01)
    assert found.spread == pytest.approx(spread, rel=0.1)
    assert found.expected == pytest.approx(own, rel=1e-3)
    covered = 0
    for k in range(0, 400, 4):
        low, high = agreement("bean", rows[k : k + 4]).spread_ci95
        covered += low <= spread <= high
    assert 88 <= covered <= 100


def test_steps_hand_every_option_to_the_doors_own_functions(tmp_path, monkeypatch):
    """A step is the door's function and its report: no second way."""
    path = recording(tmp_path / "a.csv")
    called = []

    def listening(name):
        def call(*given, **options):
            called.append((name, given[1:], options))
            return SimpleNamespace(
                report=lambda path: called.append(Path(path).name),
                as_json=lambda: {"verdict": {}, "noise_n": 0, "gap_before_n": 0, "gap_after_n": 0,
                                 "gap_closed": None},
                rmse_n={}, relative_rmse={},
            )  # fmt: skip

        return call

    for name in ("compare", "diagnose"):
        monkeypatch.setattr(f"palpate.operations.{name}.{name}", listening(name))
    monkeypatch.setattr("palpate.batching.steps.read_recording", lambda path: path)
    # what the stand-ins answer follows no schema
    monkeypatch.setattr("palpate.batching.steps.labelled", lambda step, figures: figures)
    given = {
        "sha256": steps.content_of(path),
        "seed": 3,
        "recording": str(path),
        "folder": str(tmp_path),
        "shape": "",
    }
    steps.compare(options={"folds": 4}, reports=False, **given)
    steps.diagnose(options={"fast": True}, reports=True, **given)
    model = (tmp_path / "model",)
    assert called == [
        ("compare", model, {"seed": 3, "progress": False, "folds": 4}),
        ("diagnose", model, {"seed": 3, "progress": False, "fast": True}),
        "diagnose.html",
    ]
    assert json.loads((tmp_path / "diagnose.json").read_text())["gap_closed"] is None
    path.write_text("t,x,y,z,fx,fy,fz\n1,0,0,0,0,0,0\n")
    with pytest.raises(pp.RecordingError, match="changed after the batch began"):
        steps.compare(options={}, reports=False, **given)
