"""Guidance in the window: ticks become segments where the tip has left; the ghost stands where it is told."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.explore.explorer import Suggestion
from palpate.diagnosis.explore.segments import Segment
from palpate.servo.layout import ROW
from palpate.window import guide as module
from palpate.window.guide import Guide

RATE = 1000.0


class FakeServo:
    """Ticks that a test lays down."""

    tip_radius_m = 0.005
    options = SimpleNamespace(rate_hz=RATE, period_ns=1_000_000)

    height_m = 0.05

    def __init__(self):
        self.rows = np.zeros(0, dtype=ROW)
        self.arrays = SimpleNamespace(ring_head=[0])

    def history(self, since):
        return self.rows[since:], len(self.rows)

    def goes(self, seconds, force_n):
        """So long in the air (0 N) or touching."""
        new = np.zeros(int(seconds * RATE), dtype=ROW)
        new["tick"] = len(self.rows) + np.arange(len(new))
        new["tip"], new["quaternion"] = [0.0, 0.0, self.height_m], [1.0, 0, 0, 0]
        new["rendered"] = [0.0, 0.0, force_n]
        self.rows = np.concatenate([self.rows, new])


class FakeExplorer:
    """Keeps what it was given."""

    def __init__(self):
        self.segments, self.saved, self.tracings = [], 0, 1

    def suggest(self):
        if len(self.segments) < self.tracings:
            return Suggestion("trace", "nothing is known")
        point, normal = np.array([0.0, 0.0, 0.03]), np.array([0.0, 0.0, 1.0])
        return Suggestion("press", "here least is known", point, normal, 0.004)

    state = SimpleNamespace(surface="", made=0, trouble="")
    estimate = SimpleNamespace(exploration=None)

    def bring_up_to_date(self):
        pass

    def save(self, path):
        self.saved += 1


@pytest.fixture
def guided(monkeypatch, tmp_path):
    tracing = SimpleNamespace(done=False, share=0.5, add=lambda *_: None)
    monkeypatch.setattr(module, "BaseTracing", lambda model: tracing)
    worker = SimpleNamespace(run=lambda words, job: job())
    servo, explorer = FakeServo(), FakeExplorer()
    model = SimpleNamespace(support=SimpleNamespace(height=lambda tips: tips[:, 2]))
    return Guide(explorer, servo, model, worker, tmp_path / "rec.csv.gz"), servo, explorer, tracing


def _frames(guide, servo, *stretches):
    for seconds, force in stretches:
        for _ in range(round(seconds / 0.05)):
            servo.goes(0.05, force)
            guide.follow()


def test_lifting_off_while_tracing_ends_nothing_and_a_brush_is_no_press(guided):
    guide, servo, explorer, tracing = guided
    assert guide.ghost is None and "slide around the foot (50 % traced)" in guide.lines()[0]
    _frames(guide, servo, (0.3, 0.0), (0.5, 0.7), (0.6, 0.0), (0.5, 0.7))
    assert explorer.segments == []
    tracing.done = True
    _frames(guide, servo, (0.4, 0.0))
    assert [s.kind for s in explorer.segments] == ["trace"] and explorer.saved == 1
    _frames(guide, servo, (0.2, 0.0), (0.5, 1.0), (0.4, 0.0))
    assert [s.kind for s in explorer.segments] == ["trace", "press"]
    # nothing between the segments is lost; what came after the last one waits
    trace, press = explorer.segments
    assert len(servo.rows) - 150 <= len(trace.t) + len(press.t) <= len(servo.rows)
    assert press.t[0] == pytest.approx(trace.t[-1] + 1 / RATE)


def test_a_touch_that_is_not_at_the_foot_is_said_not_to_count(guided):
    """A press before the foot was traced was dropped without a word."""
    guide, servo, explorer, tracing = guided
    _frames(guide, servo, (0.3, 0.0), (0.5, 0.7), (0.6, 0.0))
    assert "does not count" not in guide.lines()[0]
    _frames(guide, servo, (0.5, 0.7), (0.6, 0.0))
    assert "does not count" in guide.lines()[0]
    tracing.share = 0.6
    _frames(guide, servo, (0.5, 0.7), (0.6, 0.0))
    assert "does not count" not in guide.lines()[0]


def test_a_session_that_is_closed_while_the_foot_is_traced_keeps_what_was_traced(guided):
    guide, servo, explorer, tracing = guided
    _frames(guide, servo, (0.3, 0.0), (0.5, 0.7))
    guide.keep_tracing()
    assert explorer.segments == [], "it was nowhere at the foot"
    tracing.share = 0.76
    _frames(guide, servo, (0.5, 0.7))
    guide.keep_tracing()
    assert [s.kind for s in explorer.segments] == ["trace"] and explorer.saved == 1


def test_what_was_traced_before_counts_where_a_session_goes_on(guided):
    guide, servo, explorer, tracing = guided
    seen = []
    tracing.add = lambda tips, numbers: seen.append(len(tips))
    t = np.arange(600) / RATE
    explorer.segments.append(Segment("trace", t, np.zeros((600, 3)), np.zeros((600, 3))))
    explorer.tracings = 2
    Guide(explorer, servo, guide._model, guide._worker, guide._path)
    assert seen == [600]


def test_what_follows_a_tracing_that_was_not_understood_goes_on_with_it(guided):
    guide, servo, explorer, tracing = guided
    explorer.tracings = 2
    tracing.done = True
    _frames(guide, servo, *[(0.2, 0.0), (0.5, 0.7), (0.4, 0.0)] * 3)
    assert [s.kind for s in explorer.segments] == ["trace", "trace", "press"]


def test_a_press_that_was_asked_for_on_the_bare_support_is_none_of_the_object(guided):
    guide, servo, explorer, tracing = guided
    tracing.done = True
    _frames(guide, servo, (0.2, 0.0), (0.5, 0.7), (0.4, 0.0))
    explorer.suggest = lambda: Suggestion("rigid", "a yielding tool and a soft object both stand")
    a_press = (0.2, 0.0), (0.5, 2.0), (0.4, 0.0)
    _frames(guide, servo, *a_press * 2)
    assert guide.lines()[0] == "press the bare support"
    servo.height_m = 0.005
    _frames(guide, servo, *a_press)
    # what was done counts: the second was on the object all the same
    assert [s.kind for s in explorer.segments] == ["trace", "press", "press", "rigid"]


def test_what_completes_an_exploration_is_waved_and_traced_as_it_is_asked_for(guided):
    """Three seconds in the air are waving; the second tracing begins anew, and ends when it is whole."""
    guide, servo, explorer, tracing = guided
    tracing.done = True
    _frames(guide, servo, (0.2, 0.0), (0.5, 0.7), (0.4, 0.0))
    wanted = ["free", "retrace", "stop"]
    explorer.suggest = lambda: Suggestion(wanted.pop(0), "why")
    _frames(guide, servo, (0.2, 0.0), (0.5, 2.0), (0.4, 0.0))
    assert guide.suggestion.kind == "free"
    _frames(guide, servo, (2.8, 0.0))
    assert len(explorer.segments) == 2
    tracing.done = False
    _frames(guide, servo, (0.4, 0.0))
    assert guide.suggestion.kind == "retrace" and "once more (50 % traced)" in guide.lines()[0]
    _frames(guide, servo, (0.5, 0.7), (0.6, 0.0))
    assert [s.kind for s in explorer.segments] == ["trace", "press", "free"]
    tracing.done = True
    _frames(guide, servo, (0.5, 0.7), (0.6, 0.0))
    assert [s.kind for s in explorer.segments] == ["trace", "press", "free", "retrace"]
    assert guide.suggestion.kind == "stop"


def test_what_a_sliding_tip_met_is_not_told_as_presses_that_failed(guided):
    """ "no shape yet: 0 of 22 contacts are usable presses" stood there before the first press."""
    guide, *_ = guided
    trouble = "0 of 22 contacts are usable presses (lasts only 6 ms: 22)"
    guide.state = SimpleNamespace(surface="", made=0, trouble=trouble)
    assert guide.lines()[1] == "0 of the 4 presses that show a shape"
    guide.state.made = 5
    assert guide.lines()[1] == "no shape yet: 0 of 22 contacts are usable presses"


def test_while_the_next_touch_is_thought_of_nothing_of_before_is_asked_for(guided):
    """For half a minute after the whole foot was traced, its red part was missing."""
    guide, servo, _, tracing = guided
    waiting = []
    guide._worker = SimpleNamespace(run=lambda words, job: waiting.append(job))
    tracing.done = True
    a_touch = (0.2, 0.0), (0.5, 0.7), (0.4, 0.0)
    _frames(guide, servo, *a_touch)
    assert len(waiting) == 1 and guide.lines()[0].startswith("wait")
    waiting.pop()()
    assert guide.ghost is not None and guide.lines()[0].startswith("press")
    _frames(guide, servo, *a_touch)
    assert guide.ghost is None
    waiting.pop()()
    assert guide.ghost is not None


def test_the_ghost_stands_a_tips_radius_above_the_place(guided):
    guide, servo, explorer, tracing = guided
    tracing.done = True
    _frames(guide, servo, (0.2, 0.0), (0.5, 0.7), (0.4, 0.0))
    np.testing.assert_allclose(guide.ghost.centre, [0, 0, 0.035])
    np.testing.assert_allclose(guide.ghost.into, [0, 0, -1])
    assert guide.ghost.depth_m == 0.004 and "press at the green ghost, 4 mm deep" in guide.lines()[0]
