"""A story is said once: what a terminal, a page and JSON each print of it, and the words that all share."""

from __future__ import annotations

import ast
import itertools
import re
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.compare.before_after import Changes
from palpate.mechanics.effects.registry import NAMES
from palpate.reconstruction.checks.finding import Checkup
from palpate.reconstruction.checks.registry import looked_at
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.show import check
from palpate.show import story as say
from palpate.show.changes import _moduli
from palpate.show.comparison.figures import press_curves
from palpate.show.diagnosis.story import next_steps
from palpate.show.diagnosis.words import consequence, limits, verdict, where
from palpate.show.page import NO_BREAK, Page, new_figure
from palpate.words import (
    MOST_WORDS,
    ended,
    force_words,
    headline,
    kpa,
    listed,
    mm,
    place_mm,
    sentence,
    spoken,
    sure_kpa,
)

from ...conftest import REPOSITORY
from ...reconstruct.exploration_of_cylinder import explore_cylinder
from ...support.faults import FAULTS

SHOW = REPOSITORY / "shell" / "show"
KINDS = ("none", "effect", "ambiguous", "unknown", "effect+unknown")


def printed(*blocks: say.Told) -> str:
    page = Page("a thing")
    page.tell(blocks)
    return page.html().partition("</h1>")[2].partition("<footer>")[0].replace("\n", "")


def test_a_terminal_prints_lines_and_leaves_pages_alone():
    def ran():
        raise AssertionError("a terminal draws nothing")
        yield

    blocks = [
        say.Title("of the page"),
        say.Headline("it is 5\u00a0% off"),
        say.Sentence("for a page", on=say.PAGE),
        say.Sentence("for both"),
        say.Detail("under it"),
        say.Note("a reason"),
        say.Rows(["  what", "N"], [["  a", 1.5], ["  b", 20]], (-8, 6), on=say.TEXT),
        say.Rows(["what"], ran()),
        say.Picture(ran, "a curve"),
        say.Section("Evidence", ran()),
        say.Next(["feel it: `palpate touch M`"]),
    ]
    told = ["it is 5 % off", "for both", "  under it", "  a reason"]
    assert say.lines_of(blocks) == [*told, "  what       N", "  a        1.5", "  b         20"]
    assert say.steps_of([*blocks, say.Next(ran(), on=say.PAGE)]) == ["feel it: `palpate touch M`"]


def test_a_page_makes_sentences_and_leaves_the_terminals_lines_alone():
    said = printed(
        say.Title("another"),
        say.Headline("silicone: 5 % off"),
        say.Sentence("for a terminal", on=say.TEXT),
        say.Sentence("it differs"),
        say.Detail("k_V is as it is"),
        say.Section("Why?", [say.Note("a reason"), say.Rows(["what"], iter([["a <b>"]]))]),
        say.Section("", [say.Markup("<hr>")]),
    )
    assert said.startswith(
        '<p class="lead">silicone: 5\u00a0% off.</p><p>It differs.</p><p>k_V is as it is</p>'
    )
    assert (
        "<h2>Why?</h2></summary><p>A reason.</p>" in said and "a &lt;b&gt;" in said and said.endswith("<hr>")
    )
    assert "terminal" not in said and "<h2></h2>" not in said


@dataclass(frozen=True)
class Inside:
    length_m: float
    counts: np.ndarray = field(metadata={"json": "counts_us"})


@dataclass(frozen=True)
class Held:
    inside: Inside
    names: tuple[str, ...]


def test_json_is_printed_from_fields():
    held = Held(Inside(float("nan"), np.arange(2)), ("a", "b"))
    keys = ("names", "length_m=inside.length_m", ("n", lambda h: len(h.names)), lambda h: {"more": h.inside})
    assert say.figures_of(held, keys) == {
        "names": ["a", "b"], "length_m": None, "n": 2, "more": {"length_m": None, "counts_us": [0, 1]}
    }  # fmt: skip
    with pytest.raises(AttributeError):
        say.figures_of(held, ("no_such_field",))


def test_lists_names_and_quantities_read_as_one_says_them():
    assert [listed("abc"[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert spoken(["time_delay", "force_bias"], "or") == "time delay or force bias"
    assert [sentence(t) for t in ("it is", "Is it?", "")] == ["It is.", "Is it?", "."]
    assert (mm(0.0123), kpa(28.8e3), force_words(0.05), force_words(1.2)) == (
        "12.3 mm", "28.80 kPa", "50 mN", "1.20 N"
    )  # fmt: skip
    assert sure_kpa((27e3, 30e3), ".1f") == "95 % sure: 27.0 to 30.0 kPa"
    assert place_mm((0.01, -0.002, 0.08)) == "(10, -2, 80) mm"


def texts(node: ast.AST) -> list[str]:
    """What an expression may say, a name or number as X."""
    match node:
        case ast.Constant(value=str(value)):
            return [value]
        case ast.JoinedStr(values=parts):
            return ["".join(texts(part)[0] for part in parts)]
        case ast.BinOp(op=ast.Add(), left=left, right=right):
            return [a + b for a in texts(left) for b in texts(right)]
        case ast.IfExp(body=body, orelse=other):
            return [*texts(body), *texts(other)]
        case ast.Call(func=ast.Name(id="sentence" | "begun"), args=[said]):
            return texts(said)
    return ["X"]


def test_headlines_are_short_and_name_no_flag():
    """Of every story that has a page: what stands in a headline, and what the functions that make one return
    (`lead`, `verdict`): as a page cuts it, it has few words and no flag."""
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in SHOW.rglob("*.py")]
    made = {}
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and node.name != "story":
                made.setdefault(node.name, []).append(node)
    met, said = set(), []
    for tree in trees:
        for node in ast.walk(tree):
            if not (isinstance(node, ast.Call) and ast.unparse(node.func) == "say.Headline"):
                continue
            if any(ast.unparse(each.value) == "say.TEXT" for each in node.keywords):
                continue
            said += texts(node.args[0])
            for call in (c for c in ast.walk(node.args[0]) if isinstance(c, ast.Call)):
                for function in made.get(ast.unparse(call.func), ()):
                    met.add(function.name)
                    returned = (r.value for r in ast.walk(function) if isinstance(r, ast.Return))
                    said += [text for value in returned if value is not None for text in texts(value)]
    assert {"lead", "_lead", "verdict"} <= met and len(said) > 40
    for text in said:
        first, _ = headline(text)
        assert len(first.split()) <= MOST_WORDS and not re.search(r"(?<!\w)--\w", first), text


@pytest.mark.parametrize("kind", KINDS)
def test_a_verdict_of_the_longest_names_fits_a_headline(kind):
    """As many effects and rivals as there may be; of a model that has some of them already."""
    names = sorted(NAMES, key=lambda name: -name.count("_"))
    for found, rivals, has, share in itertools.product(range(4), range(4), range(4), (0.3, 0.9)):
        effects = tuple(names[:found])
        model = SimpleNamespace(
            material=SimpleNamespace(dent_law=""), effects=dict.fromkeys(effects[: min(has, found)])
        )
        entries = [SimpleNamespace(name=name, probability=share) for name in effects]
        candidates = tuple(names[found : found + rivals])
        said = verdict(
            SimpleNamespace(kind=kind, effects=effects, candidates=candidates, entries=entries, model=model)
        )
        assert len(headline(said)[0].split()) <= MOST_WORDS, said


def test_nothing_new_is_missing_is_not_said_where_something_may_be():
    """It was the headline, and below it: but these touches cannot rule out skin layer."""
    model = SimpleNamespace(material=SimpleNamespace(dent_law=""), effects={"finite_strain": {}})
    said = verdict(
        SimpleNamespace(
            kind="ambiguous", effects=("finite_strain",), candidates=("skin_layer",), entries=(), model=model
        )
    )
    assert headline(said) == (said, "") and "finite strain" in said and "skin layer" in said
    assert "othing" not in said


def test_what_a_model_has_already_is_named_before_it_is_called_them():
    """ "The force is read later than the position. Without them …": of two, one was told."""
    model = SimpleNamespace(material=SimpleNamespace(dent_law=""), effects={"finite_strain": {}})
    names = ("time_delay", "finite_strain")
    result = SimpleNamespace(
        kind="effect",
        effects=names,
        entries=(),
        model=model,
        gap_before_n=0.137,
        gap_after_n=0.022,
        noise_n=0.02,
    )
    assert "Without time delay and finite strain a simulated" in consequence(result, 1.0)


def test_a_grave_finding_is_named_by_the_headline_of_its_page():
    """ "2 findings, 2 grave" stood there, and what was wrong below."""
    rng = np.random.default_rng(0)
    wrong = FAULTS["position in inches"].change(explore_cylinder()[0], rng)
    found = Checkup(wrong, *looked_at(wrong))
    (on_page,) = [b for b in check.story(found) if isinstance(b, say.Headline) and b.on == say.PAGE]
    assert "look like inches" in on_page.text and "as it is" in on_page.text


@pytest.mark.parametrize("kind", ["unknown", "effect+unknown", "ambiguous"])
def test_a_step_names_what_the_next_touch_separates_and_no_candidates_where_there_are_none(kind):
    """ "To decide between the candidates" stood where nothing that is known explained the gap."""
    touch = SimpleNamespace(separates=("tool_compliance", "surface_offset"))
    unknown = "unknown" in kind
    (said,) = [
        step
        for step in next_steps(
            SimpleNamespace(
                recording=SimpleNamespace(path=None),
                model=SimpleNamespace(path=None, about={}, mesh=SimpleNamespace(points=np.eye(3))),
                effects=(),
                entries=(),
                candidates=() if unknown else touch.separates,
                unsettled=True,
                next_touch=touch,
            )
        )
        if "next touch" in step
    ]
    assert "tool compliance from surface offset" in said and "candidates" not in said


LONG = (
    "Hunt-crossley, a 1D model, errs by 5.9 mN on places that were held out and this model by 15 mN "
    "(--field auto may help); 40 presses became a model of 20 kPa",
    "of 10018 forces, 3 were skipped since the machine was busy, and 999 of 1000 came within 311 us, all of "
    "them within 12918 us",
    "It is off by 40 mN. Above all: a contact that is stiffer than it was stated, of 0.34 N/mm; then: a body "
    "that is softer than was given",
)


@pytest.mark.parametrize("text", LONG)
def test_a_headline_has_at_most_twenty_words_and_no_flag_and_the_page_says_the_rest(text):
    first, rest = headline(text)
    assert len(first.split()) <= MOST_WORDS and "--" not in first and rest
    kept = set(re.findall(r"\w+", text.lower()))
    assert kept == set(re.findall(r"\w+", f"{first} {rest}".lower())), "nothing is lost"
    said = printed(say.Headline(text)).replace(NO_BREAK, " ")
    assert ended(first) in re.findall(r'<p class="lead">(.*?)</p>', re.sub(r"<(?!/?p)[^>]*>", "", said))


def test_what_follows_a_headline_is_no_bracket():
    """ "(95 % sure: -5 to +6 %)." stood by itself."""
    text = (
        "no difference that these recordings can show: the second modulus is that of the first "
        "(95 % sure: -5 to +6 %)"
    )
    assert headline(text)[1] == "95 % sure: -5 to +6 %."


def test_a_chapter_is_folded_its_parts_are_headings_in_it_and_one_without_words_is_none():
    said = printed(
        say.Section("What for?", [say.Section("First", [say.Detail("words")])]),
        say.Section("Nothing?", [say.Section("Nothing", iter([]))]),
        say.Section("At once?", [say.Detail("seen")], unfolded=True),
    )
    assert re.findall(r'<details class="chapter" id="([\w-]+)"( open)?>', said) == [
        ("chapter-1", ""), ("chapter-2", " open")
    ]  # fmt: skip
    assert "<h3>First</h3><p>words</p></details>" in said and "Nothing" not in said
    assert re.findall(r'href="#(chapter-\d)">([^<]*)<', said) == [
        ("chapter-1", "What for?"), ("chapter-2", "At once?")
    ]  # fmt: skip


@pytest.mark.parametrize("kind", ["none", "effect"])
def test_the_largest_difference_is_never_said_smaller_than_a_typical_one(kind):
    """At held-out places it may be: "typically 23 mN off … the largest difference is 21 mN" stood there."""
    axis = SimpleNamespace(axis="space", share=0.4, p=0.01)
    of_places = SimpleNamespace(leading=axis, worst=((0.01, 0.0, 0.05, 0.021),))
    for typical_n, is_said in ((0.023, False), (0.012, True)):
        result = SimpleNamespace(where=of_places, forward=None, kind=kind, gap_before_n=typical_n)
        assert ("21 mN" in where(result)[2]) == is_said


def test_a_press_of_the_comparison_shows_what_is_off_sideways():
    """The error is of the whole force; the curve beside it showed only what goes into the surface."""
    presses = explore(explore_cylinder()[0]).presses
    aside = 0.3 * presses.frame[presses.press][:, 1]
    predicted = {name: presses.force + aside for name in ("fem", "kelvin-voigt", "hunt-crossley")}
    ax = new_figure(4, 3).subplots()
    press_curves(ax, SimpleNamespace(presses=presses, predicted=predicted), 0)
    measured, fem = (line.get_ydata() for line in ax.lines[1:4:2])
    assert np.abs(fem - measured).max() > 0.1


@pytest.mark.parametrize(("share", "called_likely"), [(0.33, False), (0.8, True)])
def test_what_has_a_third_of_the_odds_is_not_called_most_likely(share, called_likely):
    """ "Most likely a compliant base" was the headline of 33 %."""
    entries = [
        SimpleNamespace(name=n, probability=p) for n, p in (("compliant_base", share), ("inclusion", 0.2))
    ]
    said = verdict(
        SimpleNamespace(
            kind="ambiguous",
            effects=("compliant_base",),
            candidates=("inclusion",),
            entries=entries,
            model=None,
        )
    )
    assert ("most likely" in said) == called_likely
    assert "compliant base" in said and "inclusion" in said


def test_a_first_screen_tells_few_limits_and_a_terminal_all():
    """Nineteen stood on it, in a card as high as a laptop's screen."""
    entries = [SimpleNamespace(name=f"effect_{k}", detectable_n=1e-3 * (k + 1)) for k in range(19)]
    result = SimpleNamespace(entries=entries)
    assert limits(result).count(" from ") == 19
    few = limits(result, 3)
    assert few.count(" from ") == 4 and "15 others" in few and "effect 18 from 19 mN" in few
    assert limits(SimpleNamespace(entries=entries[:4]), 3).count(" from ") == 4


def test_a_small_difference_has_its_unit_at_both_ends_of_its_interval():
    """ "Difference -4.3 Pa (95 % sure: -1.63 to +1.62)": its ends were kilopascals."""
    material = SimpleNamespace(young_modulus_ci95_pa=(27e3, 30e3))
    side = SimpleNamespace(
        recording=SimpleNamespace(name="one"),
        modulus_pa=28e3,
        model=SimpleNamespace(material=material),
        diagnosis=None,
    )
    result = SimpleNamespace(
        before=side, after=side, difference_pa=-4.3, difference_ci95_pa=(-1630.0, 1620.0)
    )
    *_, last = _moduli(result)
    ratio = SimpleNamespace(ratio=0.9998, ratio_ci95=(0.95, 1.06), differs=False, explained_by=())
    assert "that of the first (" in Changes.summary.fget(ratio), "0 % lower stood there"
    assert "-4.3 Pa" in last.text and "-1.63 kPa to +1.62 kPa" in last.text
