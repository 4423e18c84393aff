"""The `--json` of every command, key by key. A key carries its unit in its name; null: not known.

A new key of a result's KEYS or `as_json` gets a line here: a test validates what commands write, and takes no
key that is not here. `explore --robot` speaks in lines of its own (docs/howto/robot.md).
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
from palpate.schemas.gaps import (
    COMPARE_MODELS,
    COMPARE_RECORDINGS,
    DIAGNOSE,
    DIAGNOSE_SIMULATOR,
    EXPLORE,
    GAP,
    GAP_IN_SHORT,
    SOLVED,
    SOLVED_PLACES,
    TEXTS,
    TUNE,
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
