"""The `--json` of what compares, diagnoses and explores; as `palpate.schemas.answers` has the others."""

from __future__ import annotations

from palpate.schemas.forms import (
    ANYTHING,
    COUNT,
    FLAG,
    INTERVAL,
    MAYBE,
    MAYBE_INTERVAL,
    NUMBER,
    SHARE,
    TEXT,
    VECTOR,
    Sometimes,
    many,
    named,
    one_of,
    or_null,
    table,
)

TEXTS = many(TEXT)
PLACE = dict.fromkeys("xyz", NUMBER)
GAP_IN_SHORT = ("verdict", "noise_n", "gap_before_n", "gap_after_n", "gap_closed")
SOLVED = table(
    point_m=VECTOR,
    normal=VECTOR,
    **dict.fromkeys(("depth_m", "law_n", "solved_n"), many(MAYBE)),
    force_error_n=Sometimes(many(MAYBE)),
    dent_law=Sometimes(TEXT),
)
SOLVED_PLACES = table(unsolved_places=COUNT, places=many(SOLVED))

_SAID = {
    "kind": one_of(("none", "effect", "ambiguous", "unknown", "effect+unknown")),
    "effects": TEXTS,
    "candidates": TEXTS,
}
_VERDICT = table(**_SAID, explanations=many(table(effects=TEXTS, probability=SHARE)))
COMPARE_MODELS = table(
    palpations=COUNT,
    rmse_n=named(MAYBE),
    relative_rmse=named(MAYBE),
    normal_rmse_n=named(MAYBE),
    regions=many(
        table(name=TEXT, palpations=COUNT, rmse_n=named(MAYBE), relative_rmse=named(MAYBE), bias=named(MAYBE))
    ),
    wins=named(ANYTHING),
    noise_n=NUMBER,
    constant_rmse_n=NUMBER,
    young_modulus_pa=many(NUMBER),
    folds_with_a_field=COUNT,
)
_SIDE = table(
    recording=TEXT,
    young_modulus_pa=NUMBER,
    young_modulus_ci95_pa=many(MAYBE, 2),
    beside_effects_pa=NUMBER,
    verdict=or_null(table(**_SAID)),
)
COMPARE_RECORDINGS = table(
    before=_SIDE,
    after=_SIDE,
    ratio=NUMBER,
    ratio_ci95=INTERVAL,
    difference_pa=NUMBER,
    difference_ci95_pa=INTERVAL,
    differs=FLAG,
    ratio_beside_effects=MAYBE,
    ratio_beside_effects_ci95=MAYBE_INTERVAL,
    places=many(table(**PLACE, ratio=NUMBER, ratio_ci95=INTERVAL)),
    explained_by=TEXTS,
    shifted=ANYTHING,
    reasons=TEXTS,
)

AXES = ("depth", "rate", "phase", "direction", "space", "order", "repeat", "free_air")
_WHERE = table(
    axes=many(table(axis=one_of(AXES), share=MAYBE, p=MAYBE)),
    worst=many(table(**PLACE, rmse_n=MAYBE)),
    bins=named(many(MAYBE)),
)
_EFFECT = table(
    name=TEXT,
    domain=one_of(("object", "contact", "boundary", "instrument", "numerics", "parameters")),
    probability=SHARE,
    gap_after_n=MAYBE,
    gap_closed=MAYBE,
    gap_closed_ci95=MAYBE_INTERVAL,
    parameters=named(ANYTHING),
    parameters_ci95=named(ANYTHING),
    odds=MAYBE,
    detectable_n=MAYBE,
    size_n=MAYBE,
)
_NEXT = table(
    **PLACE,
    direction=VECTOR,
    depth_m=NUMBER,
    speed_m_per_s=NUMBER,
    hold_s=NUMBER,
    separates=TEXTS,
    why=TEXT,
    difference_n=MAYBE,
    sigmas=MAYBE,
    kind=one_of(("press", "rigid", "retrace")),
)
GAP = {
    "noise_n": NUMBER,
    "gap_before_n": NUMBER,
    "gap_after_n": NUMBER,
    "gap_closed": MAYBE,
    "gap_closed_ci95": MAYBE_INTERVAL,
    "verdict": _VERDICT,
    "where": _WHERE,
    "effects": many(_EFFECT),
    "young_modulus_pa": NUMBER,
    "next_touch": or_null(_NEXT),
    "truth": Sometimes(table(effects=TEXTS, verdict=one_of(("right", "partly right", "wrong")))),
}
DIAGNOSE = table(
    **GAP,
    errors_n=named(MAYBE),
    held_out=named(table(gap_before_n=MAYBE, gap_after_n=MAYBE)),
    constant_rmse_n=MAYBE,
    at_bound=TEXTS,
    reasons=TEXTS,
    confusable=many(table(pair=many(TEXT, 2), cosine=MAYBE)),
    seconds=named(NUMBER),
    left_out=TEXTS,
    exact=Sometimes(SOLVED_PLACES),
)
_OWN = table(effects=TEXTS, candidates=TEXTS, off_n=NUMBER)
_MADE_UP = table(effects=many(TEXT, 2), alone_n=many(NUMBER, 2), together_n=NUMBER)
_PART = table(gap_n=MAYBE, share=MAYBE, effects=TEXTS)
DIAGNOSE_SIMULATOR = table(
    **GAP,
    simulator=table(
        name=TEXT,
        version=TEXT,
        stated=table(young_modulus_pa=NUMBER, poisson_ratio=NUMBER, friction=MAYBE, tip_radius_m=NUMBER),
        given=TEXTS,
        frame=TEXT,
        unit=TEXT,
    ),
    parts=table(reality=_PART, parameters=_PART, numerics=_PART),
    own=or_null(_OWN),
    made_up=many(_MADE_UP),
    unexplained=MAYBE,
    unexplained_n=MAYBE,
    unexplained_of=table(noise=MAYBE, first_touches=MAYBE),
    advice=TEXTS,
    notes=TEXTS,
    reasons=TEXTS,
    gap_after_measured_n=MAYBE,
    gap_without_numerics_n=MAYBE,
    mended=or_null(table(settings=TEXT, gap_n=MAYBE, effects=TEXTS)),
    ideal=DIAGNOSE,
)

_STATE = {
    "presses": COUNT,
    "made": COUNT,
    "seconds": NUMBER,
    "young_modulus_pa": MAYBE,
    "young_modulus_ci95_pa": many(MAYBE, 2),
    "surface_error_m": MAYBE,
    "surface": TEXT,
    "goals": named(table(now=MAYBE, goal=NUMBER, met=FLAG)),
    "done": FLAG,
    "causes": or_null(
        table(standing=TEXTS, probability=ANYTHING, ratio=ANYTHING, least_n=ANYTHING, misfit=ANYTHING)
    ),
    "update_s": named(NUMBER),
    "trouble": TEXT,
}
_MOVED = table(name=TEXT, before=MAYBE, after=MAYBE, term=TEXT)
_UNSEEN = table(
    name=TEXT,
    **dict.fromkeys(("gap_before_n", "gap_after_n", "apart_n"), MAYBE),
    **dict.fromkeys(("bound_n", "force_n"), NUMBER),
)
_PRICED = table(ms_per_step=NUMBER, s_per_s=NUMBER, gap_n=NUMBER, moved=named(MAYBE))
TUNE = table(
    simulator=table(name=TEXT, version=TEXT),
    settings=named(MAYBE),
    began=named(MAYBE),
    moved=many(_MOVED),
    **dict.fromkeys(("gap_before_n", "gap_after_n"), MAYBE),
    **dict.fromkeys(("fitted_before_n", "fitted_after_n"), NUMBER),
    **dict.fromkeys(("noise_n", "target_n", "least_n"), NUMBER),
    law_n=MAYBE,
    unseen_shapes=many(_UNSEEN),
    **dict.fromkeys(("ms_per_step_before", "ms_per_step", "s_per_s", "seconds"), NUMBER),
    front=many(_PRICED),
    modulus_would=table(factor=NUMBER, gap_after_n=NUMBER),
    modulus_moved=NUMBER,
    trials=COUNT,
    time_is_up=FLAG,
    worse=TEXTS,
    undone=TEXTS,
    interrupted=FLAG,
    effects=TEXTS,
    notes=TEXTS,
)
_SUGGESTED = table(
    kind=TEXT,
    why=TEXT,
    point=Sometimes(VECTOR),
    normal=Sometimes(VECTOR),
    depth_m=Sometimes(NUMBER),
    speed_m_per_s=Sometimes(NUMBER),
    hold_s=Sometimes(NUMBER),
    clearance_m=Sometimes(NUMBER),
    seconds=Sometimes(NUMBER),
)
EXPLORE = table(
    recording=TEXT,
    steps=many(table(suggest=_SUGGESTED, state=table(**_STATE))),
    **_STATE,
    truth=Sometimes(named(ANYTHING)),
)
