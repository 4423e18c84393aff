"""The `--json` of every command, key by key. A key carries its unit in its name; null: not known.

A new key of a result's KEYS or `as_json` gets a line here: a test validates what commands write, and takes no
key that is not here. `explore --robot` speaks in lines of its own (docs/howto/robot.md).

The `--json` of what compares, diagnoses and explores; as `palpate.schemas.answers` has the others.
"""

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
    Form,
    Sometimes,
    either,
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


PLAIN = named(either(NUMBER, TEXT, FLAG, many(ANYTHING), {"type": "object"}, {"type": "null"}))
CONTACTS = many(table(t_s=NUMBER, reason=TEXT))
FINDING = table(
    name=TEXT,
    grave=FLAG,
    saw=TEXT,
    sure=TEXT,
    todo=TEXT,
    modulus_error=MAYBE,
    decades=MAYBE,
    stretch_s=MAYBE_INTERVAL,
    channels=TEXTS,
    ways=many(table(says=TEXT, options=PLAIN)),
)
FORCE_ERRORS = dict.fromkeys(
    ("force_error_n", "modulus_error_n", "shape_error_n", "first_touch_error_n"), Sometimes(NUMBER)
)

CHECK = table(
    recording=TEXT, grave=COUNT, findings=many(FINDING), seen=many(table(what=TEXT, value=MAYBE, usual=MAYBE))
)

_PERCENTILES = table(p50=NUMBER, p95=NUMBER, max=NUMBER)
RECONSTRUCT = table(
    method=TEXT,
    young_modulus_pa=NUMBER,
    young_modulus_ci95_pa=many(MAYBE, 2),
    poisson_ratio=NUMBER,
    palpations=COUNT,
    rejected=CONTACTS,
    findings=many(FINDING),
    doubt=TEXT,
    sideways_share=MAYBE,
    other_tips=many(table(radius_m=NUMBER, young_modulus_pa=NUMBER, misfit_ratio=NUMBER)),
    held_out_rmse_n=MAYBE,
    held_out_constant_rmse_n=MAYBE,
    held_out_floor=or_null(TEXT),
    held_out_floor_rmse_n=MAYBE,
    beaten_by=or_null(TEXT),
    noise_n=NUMBER,
    force_delay_s=MAYBE,
    force_delay_sd_s=MAYBE,
    dropped_corrections=TEXTS,
    surface=table(
        method=TEXT, reason=TEXT, volume_m3=NUMBER, least_known_at_m=VECTOR, least_known_sd_m=MAYBE
    ),
    geometry=or_null(PLAIN),
    mesh=table(radius_edge_ratio=_PERCENTILES, surface_distance_m=_PERCENTILES, volume_m3=NUMBER),
    press_modulus_pa=many(MAYBE),
    seconds=named(NUMBER),
    model=Sometimes(or_null(TEXT)),
    dent_law=Sometimes(TEXT),
    by_law=Sometimes(named(table(young_modulus_pa=MAYBE, misfit_n=MAYBE, share=MAYBE))),
    by_depth=Sometimes(many(table(depth_m=NUMBER, young_modulus_pa=MAYBE, consistent=FLAG))),
    between_sites=Sometimes(MAYBE),
    shape_error=Sometimes(MAYBE),
    exact=Sometimes(table(young_modulus_by_table_pa=NUMBER, **SOLVED_PLACES["properties"])),
    not_used=Sometimes(CONTACTS),
)
MODEL = table(
    model=or_null(TEXT),
    young_modulus_pa=NUMBER,
    volume_m3=NUMBER,
    nodes=COUNT,
    tetrahedra=COUNT,
    support_point_m=VECTOR,
    support_normal=VECTOR,
    parts=ANYTHING,
    mended=ANYTHING,
)
IMPORT = table(
    samples=COUNT,
    duration_s=NUMBER,
    sample_rate_hz=NUMBER,
    quasi_static=FLAG,
    columns=named(TEXT),
    notes=TEXTS,
    recording=Sometimes(or_null(TEXT)),
)
EXPORT = table(to=TEXT, path=TEXT, notes=TEXTS)
MATERIAL = table(
    kind=TEXT,
    files=TEXTS,
    curves=COUNT,
    held_out=TEXT,
    young_modulus_pa=MAYBE,
    young_modulus_ci95_pa=ANYTHING,
    law=TEXT,
    relative_error=named(MAYBE),
    verdict=TEXT,
    effects=TEXTS,
    gap_closed=MAYBE,
    gap_closed_ci95=ANYTHING,
    parameters=named(ANYTHING),
    notes=TEXTS,
    unknown=TEXTS,
    predicts=FLAG,
    poisson_ratio=MAYBE,
    poisson_from=TEXT,
    tip=or_null(TEXT),
    at_bound=TEXTS,
    bound_carries_modulus=FLAG,
)
OPEN = table(
    kind=one_of(("recording", "curves", "mesh", "model")),
    understood=named(either(TEXT, TEXTS, NUMBER, FLAG)),
    odds=MAYBE,
    result=either(RECONSTRUCT, MODEL, MATERIAL, CHECK),
)
REPLAY = table(
    renderer=TEXT,
    samples=COUNT,
    contact_samples=COUNT,
    rmse_n=MAYBE,
    force_rms_n=MAYBE,
    relative_rmse=MAYBE,
    peak_force_n=NUMBER,
    unsettled_samples=Sometimes(COUNT),
    **FORCE_ERRORS,
    exact=Sometimes(SOLVED_PLACES),
    noise_n=Sometimes(NUMBER),
)
PRESS = table(
    on_support=FLAG,
    renderer=TEXT,
    normal=VECTOR,
    depth_m=NUMBER,
    force_at_depth_n=VECTOR,
    peak_force_n=NUMBER,
    unsettled_samples=Sometimes(COUNT),
    **FORCE_ERRORS,
    exact=Sometimes(SOLVED),
    difference_n=Sometimes(NUMBER),
    at_s=Sometimes(NUMBER),
    tolerance_n=Sometimes(NUMBER),
    same_path=Sometimes(FLAG),
    passed=Sometimes(FLAG),
)

_TIMES = named(NUMBER)
SERVO = table(
    ticks=COUNT,
    seconds=NUMBER,
    rate_hz=NUMBER,
    missed_ticks=COUNT,
    late_ticks=COUNT,
    compute_us=_TIMES,
    lateness_us=_TIMES,
    peak_rendered_n=NUMBER,
    peak_force_n=NUMBER,
    contact_share=NUMBER,
    energy_given_back_j=NUMBER,
    energy_damped_j=NUMBER,
    reasons=named(COUNT),
    words=TEXTS,
    cpu_s=MAYBE,
    wall_s=MAYBE,
    unsettled_ticks=COUNT,
)
TOUCH = table(
    scene=TEXT,
    device=TEXT,
    servo=SERVO,
    table=table(solved_share=SHARE, whole=FLAG, error_n=Sometimes(MAYBE), error_depth_m=Sometimes(MAYBE)),
)
CONFORMANCE = table(path=TEXT, version=TEXT, size_bytes=COUNT, cases=TEXTS)
DEMO = table(
    young_modulus_pa=NUMBER,
    young_modulus_ci95_pa=many(MAYBE, 2),
    replay_rmse_n=NUMBER,
    servo=SERVO,
    seconds=named(NUMBER),
    diagnosis=or_null(table(**{key: GAP[key] for key in GAP_IN_SHORT})),
    report=Sometimes(TEXT),
)
DEVICES = table(
    devices=many(
        table(
            name=TEXT,
            title=TEXT,
            present=FLAG,
            where=TEXT,
            why_not=TEXT,
            remedy=TEXT,
            control=one_of(("position", "rate")),
            sensed_axes=TEXTS,
            actuated_axes=TEXTS,
            max_force_n=NUMBER,
            max_stiffness_n_per_m=NUMBER,
            max_damping_n_s_per_m=NUMBER,
            workspace_radius_m=NUMBER,
            rate_hz=NUMBER,
            buttons=COUNT,
            conditions=TEXTS,
            simulated=FLAG,
            measured_hz=MAYBE,
            measured_jitter_s=MAYBE,
        )
    )
)
SIMULATE = table(
    recording=or_null(TEXT),
    samples=COUNT,
    duration_s=NUMBER,
    palpations=COUNT,
    truth=Sometimes(named(ANYTHING)),
    sealed=Sometimes(FLAG),
)
_ROW = table(
    recording=TEXT,
    status=one_of(("done", "failed", "waiting")),
    reason=TEXT,
    young_modulus_pa=MAYBE,
    young_modulus_lo_pa=MAYBE,
    young_modulus_hi_pa=MAYBE,
    verdict=or_null(TEXT),
    effects=or_null(TEXT),
    gap_before_n=MAYBE,
    gap_after_n=MAYBE,
    seconds=NUMBER,
)
BATCH = table(
    folder=TEXT,
    recordings=many(_ROW),
    objects=many(
        table(
            object=TEXT,
            count=COUNT,
            young_modulus_pa=NUMBER,
            spread=NUMBER,
            spread_ci95=INTERVAL,
            expected=NUMBER,
        )
    ),
)

ANSWERS: dict[str, Form] = {
    "demo": DEMO,
    "check": CHECK,
    "reconstruct": RECONSTRUCT,
    "model": MODEL,
    "open": OPEN,
    "import": IMPORT,
    "export": EXPORT,
    "material": MATERIAL,
    "replay": REPLAY,
    "press": PRESS,
    "compare": either(COMPARE_MODELS, COMPARE_RECORDINGS),
    "diagnose": either(DIAGNOSE, DIAGNOSE_SIMULATOR),
    "touch": TOUCH,
    "devices": DEVICES,
    "explore": EXPLORE,
    "simulate": SIMULATE,
    "bench": named(ANYTHING),
    "conformance": CONFORMANCE,
    "tune": TUNE,
    "batch": BATCH,
}
"""By command; `calibrate` gives what TOOL.toml holds (`palpate.schemas.schema`)."""
