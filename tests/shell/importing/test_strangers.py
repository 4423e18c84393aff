"""Tables as people write them: words beside numbers, a testing machine's names, tests side by side, no time,
a header's own constants."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest

import palpate as pp
from palpate.cli import main
from palpate.importing.headers import header_of
from palpate.importing.mapping import Said, find_columns
from palpate.importing.meaning import Unclear
from palpate.importing.tables import Table, read_tables
from palpate.importing.tip_form import ask_of_presses
from palpate.mechanics.contact.tip import Tip
from palpate.reconstruction.geometry.stated import GeometryOptions

RADIUS, MODULUS = 0.005, 2e4
G = 9.80665e-3


def rows() -> np.ndarray:
    """(n, 3) s, mm, N of a press by a punch after half a millimetre of air."""
    tip = Tip("punch", RADIUS)
    dent = np.concatenate([np.linspace(-0.5e-3, 2.5e-3, 61), np.linspace(2.4e-3, -0.5e-3, 58)])
    force = tip.force(tip.laws[0], dent, MODULUS, 0.49)
    force += 2e-4 * np.random.default_rng(1).standard_normal(len(dent))
    return np.column_stack([np.arange(len(dent)) / 10, 1e3 * (dent + 0.5e-3), force])


def text(cells: list[list[str]], separator: str = ",") -> str:
    return "\n".join(separator.join(row) for row in cells) + "\n"


def of_numbers(values: np.ndarray) -> list[list[str]]:
    return [[f"{v:.6g}" for v in row] for row in values]


def modulus(path, **said) -> float:
    return pp.material(path, tip="punch", tip_radius_m=RADIUS, progress=False, **said).young_modulus_pa


BLUEHILL = [
    ["Results Table 1"], ["", "Compressive stress (kPa)", "Modulus (kPa)"], ["1", "4.21", "20.1"], [],
    ["Raw Data"], ['"Time"', '"Compressive extension"', '"Compressive load"'], ['"(s)"', '"(mm)"', '"(N)"'],
]  # fmt: skip


@pytest.mark.parametrize(
    "head", [[["Time (s)", "Distance (mm)", "Force (N)"]], BLUEHILL, [["Time", "Pd", "Fn"], ["s", "mm", "N"]]]
)
def test_a_testing_machines_names_need_no_flag(tmp_path, head):
    path = tmp_path / "a.csv"
    path.write_text(text(head + of_numbers(rows())))
    assert modulus(path) == pytest.approx(MODULUS, rel=0.02)
    assert pp.open(path, tip="punch", tip_radius_m=RADIUS, progress=False).kind == "curves"
    with pytest.raises(Unclear, match="--tip punch"):
        pp.open(path, tip_radius_m=RADIUS, progress=False)


@pytest.mark.parametrize(
    "names",
    [["t (s)", "Piezo displacement (mm)", "Sensor B (N)"], ["t (s)", "Fahrweg [mm]", "Sensor [N]"]],
)
def test_the_one_length_and_the_one_force_need_no_known_name(tmp_path, names):
    path = tmp_path / "a.csv"
    path.write_text(text([names, *of_numbers(rows())]))
    assert modulus(path) == pytest.approx(MODULUS, rel=0.02)
    assert pp.open(path, tip="punch", tip_radius_m=RADIUS, progress=False).kind == "curves"


@pytest.mark.parametrize("beside", [1, 2])
def test_how_far_a_stated_spring_bends_is_a_force(tmp_path, beside):
    values = rows() / [1, 1, 0.05]  # a spring of 50 N/m, in mm
    names, path = ["Time (s)", "Piezo (mm)", "Deflection (mm)"] * beside, tmp_path / "a.csv"
    table = text([names, *of_numbers(np.hstack([values] * beside))])
    path.write_text(table)
    said = {"columns": {"depth": "#2", "load": "#3"}}
    with pytest.raises(pp.PalpateError, match=r"'Spring constant \(N/m\): K' above"):
        modulus(path, **said)
    path.write_text("Spring constant (N/m): 50\n" + table)
    assert modulus(path, **said) == pytest.approx(MODULUS, rel=0.02)


def test_a_machines_curve_without_a_known_name_is_told_how_to_name_it(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(text([["Time (s)", "A", "B"], *of_numbers(rows())]))
    with pytest.raises(pp.PalpateError, match="--column depth=NAME"):
        pp.open(path, tip="punch", tip_radius_m=RADIUS, progress=False)
    with pytest.raises(pp.PalpateError, match="--column load=NAME"):
        modulus(path, columns={"depth": "A"})
    named = {"columns": {"depth": "A", "load": "B"}, "units": {"position": "mm", "force": "N"}}
    assert modulus(path, **named) == pytest.approx(MODULUS, rel=0.02)


@pytest.mark.parametrize(
    ("name", "held", "cure"),
    [
        ("part.step", b"ISO-10303-21;", "csv, its shape as stl"),
        ("curve.jpk-force", b"PK", "Export its numbers as csv"),
        ("old.xls", b"\xd0\xcf\x11\xe0", "write it anew, as csv"),
        ("old.bag", b"#ROSBAG V1.2\n", "write it anew, as csv"),
        ("cut.msh", b"foo", "write it anew, as stl"),
    ],
)
def test_a_kind_that_is_not_read_is_told_as_what_to_export_it(tmp_path, name, held, cure):
    (tmp_path / name).write_bytes(held)
    with pytest.raises(pp.PalpateError, match=f"'.*{name}'.*{cure}"):
        pp.open(tmp_path / name, unit="mm", young_modulus_pa=5e3, progress=False)


@pytest.mark.parametrize("grouped", [False, True])
def test_tests_side_by_side_are_all_read(tmp_path, grouped):
    one = rows()[:, [2, 1, 0]] / [G, 1, 1]
    table = of_numbers(np.hstack([one, one * [1.2, 1, 1], one * [0.8, 1, 1]]))
    for row in table[-9:]:
        row[3:6] = ["", "", ""]  # the second test is shorter
    groups = [["Test 1", "", "", "Test 2", "", "", "Test 3", "", ""]] if grouped else []
    path = tmp_path / "ta.txt"
    path.write_text(text([*groups, ["Force", "Distance", "Time"] * 3, ["g", "mm", "sec"] * 3, *table], "\t"))
    made = pp.material(path, tip="punch", tip_radius_m=RADIUS, progress=False)
    assert made.curves == 3 and made.young_modulus_pa == pytest.approx(MODULUS, rel=0.03)
    low, high = made.young_modulus_ci95_pa
    assert high / low > 1.3


def test_rows_without_a_time_are_depth_and_load(tmp_path):
    path = tmp_path / "afm.csv"
    path.write_text(text([["Distance (mm)", "Force (N)"], *of_numbers(rows()[:, 1:])]))
    assert modulus(path) == pytest.approx(MODULUS, rel=0.02)


@pytest.mark.parametrize("column", ["approach push hold", "True False", "A-12 B_7", "sample"])
@pytest.mark.parametrize("at", [0, 2, 3])
def test_a_column_of_words_stands_beside_numbers(tmp_path, column, at):
    words = column.split()
    table = of_numbers(rows())
    for k, row in enumerate(table):
        row.insert(at, words[k * len(words) // len(table)])
    names = ["Time (s)", "Distance (mm)", "Force (N)"]
    names.insert(at, "phase")
    path = tmp_path / "a.csv"
    path.write_text(text([["operator", "5", "x"], names, *table]))
    (read,) = read_tables(path)
    assert read.rows == len(table) and set(read.columns) == set(names) - {"phase"}
    assert modulus(path) == pytest.approx(MODULUS, rel=0.02)


@pytest.mark.parametrize(
    "names",
    [
        "stamp tcp_pose_0 tcp_pose_1 tcp_pose_2 ft_force_x ft_force_y ft_force_z",
        "timestamp ee_x ee_y ee_z ee_fx ee_fy ee_fz",
        "time ee_pose_x ee_pose_y ee_pose_z ft_wrench_x ft_wrench_y ft_wrench_z",
        "t O_T_EE_12 O_T_EE_13 O_T_EE_14 O_F_ext_hat_K_0 O_F_ext_hat_K_1 O_F_ext_hat_K_2",
        "t O_T_EE[12] O_T_EE[13] O_T_EE[14] f_x f_y f_z",
        "ts arm.tcp.x arm.tcp.y arm.tcp.z ft.wrench.force.x ft.wrench.force.y ft.wrench.force.z",
    ],
)
def test_robots_names_are_recognised_beside_what_they_are_not(names):
    others = "O_T_EE_0 tcp_pose_3 ft_torque_x tcp_speed_0 target_tcp_pose_0".split()
    values = {name: np.arange(9.0) for name in (*names.split(), *others)}
    found = find_columns([Table("log", values)], Said())
    wanted = names.split()
    assert [found[role].name for role in ("t", "x", "y", "z", "fx", "fy", "fz")] == wanted


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("Poisson's ratio(nu)=\t0.30 ", {"poisson_ratio": 0.3}),
        ("nu: 0,45", {"poisson_ratio": 0.45}),
        ("Poisson ratio 0.5", {"poisson_ratio": 0.4999}),
        ("Frequency nu: 12 Hz\nPoisson points: 40", {}),
        ("   EHz=\t500.00 \tkPa", {"modulus_pa": 5e5}),
        ("Young's modulus [kPa]: 12", {"modulus_pa": 12e3}),
        ("Load cell: 50 N\nE: 12", {}),
        ("Cantilever spring constant (N/m)\t0.27", {"spring_n_per_m": 0.27}),
        ("k: 46 mN/m", {"spring_n_per_m": 0.046}),
        ("k: 46\nSpring constant: 3", {}),
        ("Probe: flat-ended cylinder, diameter 10 mm", {"form": "punch"}),
        ("Indenter geometry: conical\nHalf angle: 35", {"form": "cone", "half_angle_deg": 35.0}),
        ("Tip shape = four-sided pyramid", {"form": "pyramid"}),
        ("Probe: spherical, radius 2 mm", {"form": "sphere"}),
        ("Sample: cylinder of gel, 20 mm", {}),
    ],
)
def test_a_headers_constants_are_read(tmp_path, words, said):
    path = tmp_path / "a.txt"
    path.write_text(f"Operator: x\n{words}\nt;z;f\n1;2;3\n")
    held = header_of(path)
    for name in ("poisson_ratio", "modulus_pa", "form", "half_angle_deg", "spring_n_per_m"):
        wanted = said.get(name)
        assert getattr(held, name) == (pytest.approx(wanted) if isinstance(wanted, float) else wanted), name


def test_a_headers_constants_are_used_and_shown(tmp_path):
    path = tmp_path / "a.txt"
    head = "Probe: flat punch\nTip radius: 5 mm\nPoisson's ratio: 0.3\nEHz= 24.0 kPa\n"
    path.write_text(head + text([["Time (s)", "Distance (mm)", "Force (N)"], *of_numbers(rows())]))
    made = pp.material(path, progress=False)
    assert made.tip == Tip("punch", RADIUS) and made.poisson_ratio == 0.3
    assert made.young_modulus_pa == pytest.approx(MODULUS * (1 - 0.3**2) / (1 - 0.49**2), rel=0.02)
    assert "2.4e+04 Pa" in "\n".join(made.notes)
    assert pp.material(path, poisson_ratio=0.49, progress=False).young_modulus_pa == pytest.approx(
        MODULUS, rel=0.02
    )


LOGGED = {
    "sphere": Tip("sphere", 0.004),
    "punch": Tip("punch", 0.004),
    "cone": Tip("cone", half_angle_deg=45.0),
}


def log(path, form: str, head: str = ""):
    """Five presses of 3 mm into a half-space of 12 kPa, read at 20 Hz."""
    place, within = np.divmod(np.arange(0, 5 * 2.1, 0.05), 2.1)
    height = 2e-3 - 5e-3 * np.clip(1 - np.abs(within - 1.0), 0, 1)
    tip, force = LOGGED[form], 5e-4 * np.random.default_rng(2).standard_normal((len(place), 3))
    force[:, 2] += tip.force(tip.laws[0], -height, 12e3, 0.49)
    t = 0.05 * np.arange(len(place))
    table = np.column_stack([t, 0.012 * place, 0 * t, height + 0.004, force])
    path.write_text(head + text([["t", "x", "y", "z", "fx", "fy", "fz"], *of_numbers(table)]))
    return path


@pytest.mark.parametrize("form", ["punch", pytest.param("cone", marks=pytest.mark.slow)])
def test_a_log_whose_presses_are_no_spheres_is_asked_for_its_tip(tmp_path, form):
    path = log(tmp_path / "log.csv", form)
    read = pp.read_table(path, tip_radius_m=0.004)
    assert read.tip_assumed
    saved = pp.import_table(path, tip_radius_m=0.004).save(tmp_path / "kept.csv")
    with pytest.raises(Unclear, match=f"--tip {form}"):
        pp.reconstruct(saved, half_space=True, progress=False)
    with pytest.raises(pp.PalpateError, match=f"palpate material .* --tip {form}"):
        pp.reconstruct(read, half_space=True, tip=form, progress=False)
    size = {"tip_radius_m": 0.004} if form == "punch" else {"tip_angle_deg": 45.0}
    columns, units = {"t": "t", "depth": "-z", "load": "fz"}, {"position": "m"}
    if form == "cone":
        units["force"] = "N"  # its stiffness alone does not tell newtons from millinewtons
    cured = pp.material(path, tip=form, columns=columns, units=units, progress=False, **size)
    assert cured.young_modulus_pa == pytest.approx(12e3, rel=0.03)


def test_a_log_of_a_sphere_is_not_asked_and_one_that_is_stated_neither(tmp_path):
    flat = GeometryOptions(half_space=True)
    ask_of_presses(pp.read_table(log(tmp_path / "log.csv", "sphere"), tip_radius_m=0.004), flat)
    stated = pp.read_table(log(tmp_path / "punch.csv", "punch"), tip_radius_m=0.004, tip="sphere")
    assert not stated.tip_assumed
    ask_of_presses(stated, flat)


def test_what_a_logs_own_text_says_of_the_tip_counts(tmp_path):
    round_tip = "# probe: spherical, radius 4 mm\n# Poisson's ratio: 0.45\n"
    found = pp.import_table(log(tmp_path / "log.csv", "sphere", round_tip))
    read = found.recording
    assert (read.tip_radius_m, read.poisson_ratio, read.tip_assumed) == (0.004, 0.45, False)
    kept = pp.read_recording(found.save(tmp_path / "kept.csv"))
    assert (kept.tip_radius_m, kept.poisson_ratio, kept.tip_assumed) == (0.004, 0.45, False)
    with pytest.raises(pp.PalpateError, match="palpate material .* --tip punch"):
        pp.import_table(log(tmp_path / "log.csv", "punch", "# probe: flat punch, radius 4 mm\n"))


def test_a_recording_is_pressed_by_a_sphere_alone(tmp_path):
    t = np.arange(100) / 10
    table = np.column_stack([t, 0 * t, 0 * t, np.sin(t) / 100, 0 * t, 0 * t, np.cos(t)])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="t,x,y,z,fx,fy,fz", comments="")
    with pytest.raises(pp.PalpateError, match="--tip is punch"):
        pp.open(tmp_path / "log.csv", tip="punch", tip_radius_m=RADIUS, progress=False)


@pytest.mark.parametrize("form", ["punch", "cone"])
def test_a_recording_by_another_tip_names_the_command_that_knows_all_it_states(tmp_path, capsys, form):
    path = log(tmp_path / "rec.csv", form)
    angle = "tip_angle_deg = 45.0\n" * (form == "cone")
    path.with_suffix(".toml").write_text(
        '[recording]\nforce_on = "tool"\n[tool]\ntip_radius_m = 0.004\n'
        f'tip = "{form}"\n{angle}[object]\npoisson_ratio = 0.3\n'
    )
    with pytest.raises(pp.PalpateError) as refused:
        pp.open(path, half_space=True, progress=False)
    command = str(refused.value).partition("palpate ")[2]
    assert main([*shlex.split(command), "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    low, high = found["young_modulus_ci95_pa"]
    assert low <= 12e3 * (1 - 0.3**2) / (1 - 0.49**2) <= high and found["poisson_ratio"] == 0.3
