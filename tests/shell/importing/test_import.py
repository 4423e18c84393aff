"""Other programs' files: the same exploration in every format comes out the same, and what is missing is
told."""

from __future__ import annotations

import gzip
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

import palpate as pp
from palpate import cli
from palpate.importing.clocks import cross_correlated
from palpate.importing.formats.text import seconds_of
from palpate.mechanics.errors import FileError, OptionError, RecordingError
from palpate.reconstruction.geometry.stated import GeometryOptions, stated_geometry

RATE, TIP = 500.0, 0.004


def exploration(seconds: float = 6.0) -> dict[str, np.ndarray]:
    """Presses of a second each, 5 mm deep, the tip's centre in m, the force on the tool in N."""
    t = np.arange(int(seconds * RATE)) / RATE
    # no two presses alike, so that clocks can be told
    swing = (1 + 0.3 * np.sin(0.8 * t + 1)) * 0.005 * np.sin(2 * np.pi * (t + 0.15 * np.sin(1.3 * t)))
    depth = np.maximum(swing - 0.001, 0)
    place = np.column_stack([0.01 * np.floor(t), np.zeros_like(t), 0.051 + TIP - swing])
    force = np.column_stack([0.02 * depth / 0.005, np.zeros_like(t), 300 * depth])
    return {"t": t, "p": place, "f": force}


@pytest.fixture(scope="module")
def world() -> dict[str, np.ndarray]:
    return exploration()


def check(recording, world, *, atol_m: float = 1e-8, atol_n: float = 1e-6) -> None:
    assert np.allclose(recording.t, world["t"], atol=1e-6)
    assert np.allclose(recording.position, world["p"], atol=atol_m)
    assert np.allclose(recording.force_on_tool, world["f"], atol=atol_n)


def test_units_separator_and_decimal_comma_come_from_the_file(tmp_path, world):
    lines = ["Messung 12;;;", "Kraftsensor: K6D", "Zeit;x;y;z;fx;fy;fz", "ms;mm;mm;mm;mN;mN;mN"]
    lines += [
        ";".join(f"{v:.6f}".replace(".", ",") for v in (1e3 * t, *(1e3 * p), *(1e3 * f)))
        for t, p, f in zip(world["t"], world["p"], world["f"], strict=True)
    ]
    (tmp_path / "log.csv").write_text("\n".join(lines), encoding="latin-1")
    made = pp.import_table(tmp_path / "log.csv", columns={"t": "Zeit"}, tip_radius_m=TIP)
    check(made.recording, world)
    assert "x = x (mm) (guessed, unit stated)" in str(made) and "t = Zeit (ms) (said)" in str(made)


def test_what_was_said_is_told_from_what_was_guessed_and_a_turned_force_is_told(tmp_path, world):
    held = {"t": np.round(world["t"], 6), **dict(zip("xyz", 1e3 * world["p"].T, strict=True))}
    np.savez(tmp_path / "log.npz", **held, fz=-world["f"][:, 2])
    said = {"units": {"position": "mm"}, "columns": {"fz": "#5"}, "force_on": "object"}
    made = pp.import_table(tmp_path / "log.npz", tip_radius_m=TIP, **said)
    for words in (
        "x = x [mm] (guessed, unit said)",
        "t = t [s] (guessed, unit assumed)",
        "fz = fz [N] (said)",
        "on the object, as stated: turned round",
    ):
        assert words in str(made)
    made.save(tmp_path / "mine.csv")
    text = (tmp_path / "mine.toml").read_text()
    assert f"sample_rate_hz = {RATE}" in text and "[sensor]" not in text


@pytest.mark.parametrize("form", ["{}_{}", "{} [{}]", "{}, {}"])
def test_a_unit_may_stand_after_a_name_in_any_of_the_usual_ways(tmp_path, world, form):
    names = [("Time", "ms"), *((a, "mm") for a in "XYZ"), *((f"F{a}", "mN") for a in "xyz")]
    values = np.column_stack([1e3 * world["t"], 1e3 * world["p"], 1e3 * world["f"]])
    head = ";".join(form.format(*each) for each in names)
    np.savetxt(tmp_path / "log.csv", values, "%.6f", ";", header=head, comments="")
    output = tmp_path / "rec.toml"
    words = ["import", str(tmp_path / "log.csv"), "--tip-radius", str(TIP), "-o", str(output)]
    assert cli.main(words) == 0
    check(pp.read_recording(output), world)
    assert cli.main(words) == 0  # what it wrote itself is replaced


def test_matlab_hdf5_parquet_and_numpy_hold_the_same(tmp_path, world):
    h5py, pa = pytest.importorskip("h5py"), pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    names = dict(
        zip(("t", "x", "y", "z", "fx", "fy", "fz"), (world["t"], *world["p"].T, *world["f"].T), strict=True)
    )
    savemat(tmp_path / "a.mat", {"log": {"time": world["t"], "pos": world["p"], "force": world["f"]}})
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["robot/time"], file["robot/position"] = world["t"], world["p"]
        file["robot/force"] = world["f"].T
    pq.write_table(pa.table(names), tmp_path / "c.parquet")
    np.savez(tmp_path / "d.npz", **names)
    columns = {"t": "log.time"}
    columns |= {a: f"log.pos[{k}]" for k, a in enumerate("xyz")} | {
        f"f{a}": f"log.force[{k}]" for k, a in enumerate("xyz")
    }
    check(pp.read_table(tmp_path / "a.mat", columns=columns, tip_radius_m=TIP), world)
    check(pp.read_table(tmp_path / "b.h5", tip_radius_m=TIP), world)
    check(pp.read_table(tmp_path / "c.parquet", tip_radius_m=TIP), world)
    check(pp.read_table(tmp_path / "d.npz", tip_radius_m=TIP), world)


def test_topics_of_a_ros_bag_have_clocks_of_their_own(tmp_path, world):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    bare = kinds["std_msgs/msg/Header"]

    def header(t: float):
        whole = int(t)
        return bare(
            stamp=kinds["builtin_interfaces/msg/Time"](sec=whole, nanosec=int(round((t - whole) * 1e9))),
            frame_id="",
        )

    vector, point = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Point"]
    with rosbags.Writer(tmp_path / "bag", version=9) as writer:
        poses = writer.add_connection("/tcp", "geometry_msgs/msg/PoseStamped", typestore=store)
        pushes = writer.add_connection("/ft", "geometry_msgs/msg/WrenchStamped", typestore=store)
        for k, t in enumerate(world["t"]):
            turn = kinds["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
            pose = kinds["geometry_msgs/msg/Pose"](position=point(*world["p"][k]), orientation=turn)
            message = kinds["geometry_msgs/msg/PoseStamped"](header=header(100 + t), pose=pose)
            writer.write(poses, int(1e9 * t), store.serialize_cdr(message, poses.msgtype))
            if k % 2 == 0:
                wrench = kinds["geometry_msgs/msg/Wrench"](
                    force=vector(*world["f"][k]), torque=vector(0.0, 0.0, 0.0)
                )
                message = kinds["geometry_msgs/msg/WrenchStamped"](header=header(100 + t), wrench=wrench)
                writer.write(pushes, int(1e9 * t), store.serialize_cdr(message, pushes.msgtype))
    made = pp.import_table(tmp_path / "bag", tip_radius_m=TIP)
    count = len(made.recording.t)
    cut = {"t": world["t"][:count], "p": world["p"][:count], "f": world["f"][:count]}
    # every other force is interpolated
    check(made.recording, cut, atol_m=1e-6, atol_n=0.02)
    assert np.allclose(made.recording.quaternion, [1, 0, 0, 0])
    assert any("resampled to 500" in note for note in made.understood.notes)


def test_mcap_messages_in_json(tmp_path, world):
    mcap = pytest.importorskip("mcap.writer")
    with (tmp_path / "log.mcap").open("wb") as file:
        writer = mcap.Writer(file)
        writer.start()
        schema = writer.register_schema(name="probe", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(topic="probe", message_encoding="json", schema_id=schema)
        for t, p, f in zip(world["t"], world["p"], world["f"], strict=True):
            content = {"pos": dict(zip("xyz", p, strict=True)), "force": dict(zip("xyz", f, strict=True))}
            stamp = int(round(1e9 * t))
            writer.add_message(channel, log_time=stamp, publish_time=stamp, data=json.dumps(content).encode())
        writer.finish()
    check(pp.read_table(tmp_path / "log.mcap", tip_radius_m=TIP), world)


def test_clocks_that_share_no_time_are_joined_by_cross_correlation(tmp_path, world):
    table = np.column_stack([world["t"] + 1.6e9, world["p"]])
    np.savetxt(tmp_path / "robot.csv", table, delimiter=",", header="time,x,y,z", comments="", fmt="%.9f")
    table = np.column_stack([world["t"] + 0.35, world["f"]])
    np.savetxt(tmp_path / "sensor.csv", table, delimiter=",", header="time,fx,fy,fz", comments="", fmt="%.9f")
    made = pp.import_table(tmp_path / "robot.csv", tmp_path / "sensor.csv", tip_radius_m=TIP)
    recording = made.recording
    expected = 300 * np.maximum(0.05 + TIP - recording.position[:, 2], 0)
    assert np.abs(recording.force_on_tool[:, 2] - expected).max() < 0.1 * expected.max()
    lag, sure = cross_correlated(world["t"], world["p"], world["t"] + 0.137, world["f"])
    assert lag == pytest.approx(-0.137, abs=0.01) and sure > 0.5


def test_sensor_frame_flange_weight_and_tare_are_undone(tmp_path, world):
    spin = Rotation.from_rotvec(
        np.column_stack([0.2 * np.sin(world["t"]), 0.3 * np.cos(world["t"]), world["t"]])
    )
    arm, weight = np.array([0.0, 0.02, 0.15]), np.array([0, 0, -0.2 * 9.80665])
    mounted = Rotation.from_euler("z", 30, degrees=True)
    told = mounted.inv().apply(spin.inv().apply(world["f"] + weight))
    columns = np.column_stack(
        [world["t"], world["p"] - spin.apply(arm), told, spin.as_quat()[:, [3, 0, 1, 2]]]
    )
    header = "t x y z fx fy fz qw qx qy qz".replace(" ", "\t")
    np.savetxt(tmp_path / "log.tsv", columns, delimiter="\t", header=header, comments="", fmt="%.12g")
    rotation = mounted.as_matrix().tolist()
    (tmp_path / "map.toml").write_text(
        f"[tool]\ntip_radius_m = {TIP}\nmass_kg = 0.2\nflange_to_tip_m = [0, 0.02, 0.15]\n"
        f'[sensor]\nframe = "tool"\nrotation = {rotation}\n[tare]\nstart_s = 0.6\nend_s = 0.8\n'
    )
    made = pp.read_table(tmp_path / "log.tsv", mapping=tmp_path / "map.toml")
    check(made, world, atol_m=1e-7, atol_n=1e-5)


def test_rows_without_a_time_are_points(tmp_path, world):
    table = np.column_stack([1e3 * world["p"][::100], world["f"][::100]])
    np.savetxt(tmp_path / "raster.txt", table, header="x_mm y_mm z_mm fx_n fy_n fz_n", comments="# ")
    out = tmp_path / "raster.csv.gz"
    words = [
        "import",
        str(tmp_path / "raster.txt"),
        "-o",
        str(out),
        "--tip-radius",
        str(TIP),
        "--slab",
        "0.02",
    ]
    assert cli.main(words) == 0
    back = pp.read_recording(out)
    assert (
        back.description["recording"]["quasi_static"] is True and back.description["object"]["slab_m"] == 0.02
    )
    assert np.allclose(back.position, world["p"][::100], atol=1e-8)
    assert (tmp_path / "raster.png").stat().st_size > 10_000


def test_tiny_scales_keep_their_digits(tmp_path):
    t = np.arange(400) / 100
    load = 0.05 * np.sin(t) ** 2
    np.savetxt(
        tmp_path / "afm.txt",
        np.column_stack([t, load, 5000 * np.sin(t) ** 2]),
        header="Time (s)\tLoad (uN)\tIndentation (nm)",
        delimiter="\t",
        comments="",
    )
    out = tmp_path / "afm.csv.gz"
    pp.import_table(tmp_path / "afm.txt", tip_radius_m=3e-6).save(out)
    held = np.loadtxt(out, delimiter=",", skiprows=1)
    assert np.allclose(held[:, 6], 1e-6 * load, atol=1e-15)
    assert np.allclose(held[:, 3], -5e-6 * np.sin(t) ** 2, atol=1e-14)


@pytest.mark.parametrize(
    ("content", "said", "words"),
    [
        ("a,b,c\n1,2,3\n2,3,4\n", {"tip_radius_m": TIP}, "--column x=NAME .*there are a, b, c"),
        ("t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n", {}, "--tip-radius"),
        (
            "t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n",
            {"tip_radius_m": TIP, "columns": {"fx": "load"}},
            "'load' is not there",
        ),
        (
            "t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n",
            {"tip_radius_m": TIP, "units": {"force": "mm"}},
            "no unit of force",
        ),
        ("t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n", {"tip_radius_m": TIP, "force_on": "me"}, "tool, object"),
        ("hello\nworld\n", {"tip_radius_m": TIP}, "is it a table"),
        (
            "t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n",
            {"tip_radius_m": TIP, "frame": "tool"},
            "needs the orientation",
        ),
    ],
)
def test_what_is_missing_is_one_line(tmp_path, content, said, words):
    (tmp_path / "log.csv").write_text(content)
    with pytest.raises((RecordingError, OptionError), match=words) as refused:
        pp.read_table(tmp_path / "log.csv", **said)
    assert len(str(refused.value).splitlines()) == 1


MAPPINGS = {
    "a table that is a number": ("columns = 3", "it must be a table"),
    "a table that nobody knows": ("[nothing]\na = 1", "nothing is no key"),
    "a key that nobody knows": ('[columns]\nq = "a"', "q is no key"),
    "a unit that is a number": ("[units]\nforce = 3", "it must be a text"),
    "a tip that is a text": ('[tool]\ntip_radius_m = "a"', "tip_radius_m = 'a'"),
    "a tip of nan": ("[tool]\ntip_radius_m = nan", "tip_radius_m = nan"),
    "a negative mass": ("[tool]\nmass_kg = -1", "from 0 to 5 kg"),
    "an arm of two": ("[tool]\nflange_to_tip_m = [1, 2]", "a list of 3 numbers"),
    "a frame of a list": ("[sensor]\nframe = [1]", "one of device, tool"),
    "a rotation of words": ('[sensor]\nrotation = "a"', "3 x 3 rotation"),
    "a ragged rotation": ("[sensor]\nrotation = [[1], [1, 2]]", "3 x 3 rotation"),
    "a rate of a text": ('[clock]\nrate_hz = "a"', "rate_hz = 'a'"),
    "a rate of 0": ("[clock]\nrate_hz = 0", "from 0.001 to"),
    "a clock of nan": ("[clock]\noffset_s = nan", "seconds or auto"),
    "a tare of a text": ('[tare]\nstart_s = "x"\nend_s = 1', "start_s = 'x'"),
    "a tare without an end": ("[tare]\nstart_s = 0", "end_s is missing"),
    "a slab of a list": ("[object]\nslab_m = [1]", r"slab_m = \[1\]"),
    "a path to a model": ('[object]\nmodel = "../../etc"', "model is no key"),
}


@pytest.mark.parametrize("name", MAPPINGS)
def test_hostile_mappings_are_refused_in_one_line(tmp_path, name):
    content, words = MAPPINGS[name]
    rows = "\n".join(f"{k},0,0,{k},0,0,1" for k in range(200))
    (tmp_path / "log.csv").write_text(f"t,x_m,y_m,z_m,fx,fy,fz\n{rows}\n")
    (tmp_path / "map.toml").write_text(content)
    given = {} if "tip" in name else {"tip_radius_m": TIP}
    with pytest.raises(RecordingError, match=words) as refused:
        pp.read_table(tmp_path / "log.csv", mapping=tmp_path / "map.toml", **given)
    assert len(str(refused.value).splitlines()) == 1


def test_one_thing_said_twice_is_refused(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n")
    words = ("--units", "force=N,force=mN", "--dry-run")
    assert cli.main(["import", str(tmp_path / "a.csv"), *words]) == 2
    assert "says 'force' twice" in capsys.readouterr().err


@pytest.mark.parametrize("words", [("--tool-mass", "-1"), ("--rate", "1e12"), ("--tip-radius", "5")])
def test_impossible_numbers_are_refused(tmp_path, capsys, words):
    (tmp_path / "log.csv").write_text("t,x,y,z,fz\n1,2,3,4,5\n2,2,3,4,5\n")
    assert cli.main(["import", str(tmp_path / "log.csv"), "--dry-run", *words]) == 2
    said = capsys.readouterr().err
    assert "it must be a number from" in said and ("it is 0.005" in said) == ("--tip-radius" in words)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a limit that only Linux has")
@pytest.mark.parametrize("name", ["log.csv.gz", "log.npz"])
def test_a_small_file_that_unpacks_to_gigabytes_is_refused(tmp_path, monkeypatch, name):
    most = 16 << 20
    monkeypatch.setattr("palpate.mechanics.disk.reading._MOST_MEMORY", most)
    if name.endswith("gz"):
        (tmp_path / name).write_bytes(gzip.compress(bytes(4 * most), 1))
    else:
        np.savez_compressed(tmp_path / name, t=np.zeros(most // 2))
    with pytest.raises(RecordingError, match="takes more than .* of memory to read") as refused:
        pp.read_table(tmp_path / name, tip_radius_m=TIP)
    assert len(str(refused.value).splitlines()) == 1
    assert np.zeros(4 * most).size, "the limit ends with the file"


def test_a_picture_replaces_no_photograph_and_is_whole_or_not_there(tmp_path, world):
    rows = np.column_stack([world["t"], world["p"], world["f"]])[::50]
    np.savetxt(tmp_path / "log.csv", rows, "%.6g", ",", header="t,x,y,z,fx,fy,fz", comments="")
    result = pp.import_table(tmp_path / "log.csv", tip_radius_m=TIP)
    photo = tmp_path / "rec.png"
    photo.write_bytes(b"\x89PNG of a cat")
    with pytest.raises(FileError, match="is no picture of palpate import"):
        result.draw(photo)
    assert photo.read_bytes() == b"\x89PNG of a cat"
    words = ["import", str(tmp_path / "log.csv"), "--tip-radius", "0.005", "--dry-run", "--picture"]
    assert (
        cli.main([*words, str(tmp_path / "log.csv")]) == 2 and "t,x,y" in (tmp_path / "log.csv").read_text()
    )
    drawn = result.draw(tmp_path / "drawn.png").read_bytes()
    assert drawn.endswith(b"IEND\xaeB`\x82") and result.draw(tmp_path / "drawn.png").stat().st_size > 1000


def test_a_missing_library_is_named_with_what_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    (tmp_path / "log.h5").write_bytes(b"x")
    with pytest.raises(RecordingError, match=r"needs h5py, .*pip install 'h5py>="):
        pp.read_table(tmp_path / "log.h5", tip_radius_m=TIP)


def test_a_sign_that_is_wrong_is_warned_of(tmp_path, world):
    table = np.column_stack([world["t"], world["p"] * [1, 1, -1], world["f"]])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="t,x,y,z,fx,fy,fz", comments="")
    assert "WARNING: the force grows" in str(pp.import_table(tmp_path / "log.csv", tip_radius_m=TIP))


def test_instruments_of_others_are_understood(measured_data):
    file = measured_data / "chiaro_sphere_1khz" / "fmt-chiaro-txt_AEBP1_Indentation_002.txt"
    made = pp.import_table(file, tip_radius_m=27.5e-6, columns={"z": "-Piezo (nm)", "fz": "Load (uN)"})
    assert len(made.recording.t) == 13827 and made.recording.sample_rate_hz == pytest.approx(1000, rel=0.01)
    meat = pp.import_table(
        measured_data / "meat_indentation_relaxation/csv/230331_FF1_1A.csv", tip_radius_m=0.005
    )
    assert meat.recording.force_on_tool[:, 2].max() == pytest.approx(1.062, abs=1e-3)
    assert 0.003 < np.ptp(meat.recording.position[:, 2]) < 0.006


def test_dates_gaps_and_empty_rows_do_not_hide_the_header(tmp_path, world):
    rows = []
    for k, (t, p, f) in enumerate(zip(world["t"], world["p"], world["f"], strict=True)):
        cells = [f"22.11.2026 13:05:{6 + t:09.6f}", *(f"{1e3 * v:.6f}" for v in p), *(f"{v:.6f}" for v in f)]
        if k == 3:
            cells = ["", "n/a", *[""] * 5]
        rows.append(";".join(cells).replace(".", ",").replace("22,11,2026", "22.11.2026"))
    header = "Zeit;Weg X [mm];Weg Y [mm];Weg Z [mm];Kraft X [N];Kraft Y [N];Kraft Z [N]"
    (tmp_path / "log.txt").write_text("\n".join([header, ";;;;;;", *rows]), encoding="utf-16")
    made = pp.import_table(tmp_path / "log.txt", tip_radius_m=TIP)
    kept = np.arange(len(world["t"])) != 3
    check(made.recording, {key: value[kept] for key, value in world.items()})


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("1970-01-01T00:01:02.5", 62.5),
        ("1970-01-01 01:00:00+01:00", 0.0),
        ("02.01.1970 00:00:01,25", 86401.25),
        ("13:05:01.25", 47101.25),
        ("yesterday", np.nan),
    ],
)
def test_a_date_is_seconds(text, seconds):
    assert seconds_of(text) == pytest.approx(seconds, nan_ok=True)


def _comma(number):
    return f'"{number:,.5f}"'


def _fortran(number):
    return f"{number:.9E}".replace("E", "D")


@pytest.mark.parametrize(
    ("head", "separator", "write", "remark"),
    [
        (["t [us],x [um],y [um],z [um],fx [mN],fy [mN],fz [mN]"], ",", _comma, ""),
        (["# t [us] x [um] y [um] z [um] fx [mN] fy [mN] fz [mN]"], None, _fortran, "# the press begins"),
        (["Time,Position,,,Force,,", "us,X (um),Y (um),Z (um),X (mN),Y (mN),Z (mN)"], ",", repr, "% turned"),
        (["Time (us);X (um);Y (um);Z (um);X (mN);Y (mN);Z (mN)"], ";", repr, ""),
    ],
)
def test_numbers_headers_and_remarks_as_others_write_them(tmp_path, world, head, separator, write, remark):
    rows = np.column_stack([1e6 * world["t"], 1e6 * world["p"], 1e3 * world["f"]])
    lines = [(separator or "  ").join(write(float(v)) for v in row) for row in rows]
    lines.insert(70, remark)
    if separator is None:
        head = [head[0].replace(" [", "_").replace("]", "")]
    (tmp_path / "log.csv").write_text("\n".join([*head, *lines]))
    check(pp.read_table(tmp_path / "log.csv", tip_radius_m=TIP), world, atol_n=1e-5)


def test_a_flange_and_its_orientation_in_any_order_are_known_by_name(tmp_path, world):
    turn = Rotation.from_euler("xyz", np.column_stack([0.3 * np.sin(world["t"] + k) for k in range(3)]))
    arm = np.array([0.01, -0.02, 0.12])
    np.savez(
        tmp_path / "log.npz", stamp=world["t"], flange_position=world["p"] - turn.apply(arm),
        flange_orientation_xyzw=turn.as_quat(), force=turn.inv().apply(world["f"]),
    )  # fmt: skip
    made = pp.read_table(tmp_path / "log.npz", tip_radius_m=TIP, frame="tool", flange_to_tip_m=arm.tolist())
    check(made, world)


def test_a_unit_that_nobody_said_is_doubted(tmp_path, world):
    held = {"t": world["t"], "x": 1e6 * world["p"][:, 0], "y": world["p"][:, 1], "z": world["p"][:, 2]}
    np.savez(tmp_path / "far.npz", **held, fz=world["f"][:, 2])
    with pytest.raises(RecordingError, match=r"5e\+04 m wide.* is it um\? say --units position=um"):
        pp.read_table(tmp_path / "far.npz", tip_radius_m=TIP)
    np.savez(tmp_path / "hard.npz", t=world["t"], z=world["p"][:, 2], fz=1e3 * world["f"][:, 2])
    made = pp.import_table(tmp_path / "hard.npz", tip_radius_m=TIP)
    assert "say --units force=mN" in str(made)
    said = pp.import_table(tmp_path / "hard.npz", tip_radius_m=TIP, units={"force": "mN"})
    assert "WARNING" not in str(said)


def test_a_log_without_a_tracing_is_led_to_the_geometry_it_needs(tmp_path, world, capsys):
    """Its check-up would refuse it for want of a foot."""
    rows = np.column_stack([world["t"], world["p"], world["f"]])
    np.savetxt(
        tmp_path / "log.csv",
        rows,
        header="t [s],x [m],y [m],z [m],fx [N],fy [N],fz [N]",
        delimiter=",",
        comments="",
    )
    words = ["import", str(tmp_path / "log.csv"), "--tip-radius", str(TIP), "-o", str(tmp_path / "rec.csv")]
    assert cli.main([*words, "--picture", "none"]) == 0
    told = capsys.readouterr().out.partition("written:")[2]
    assert all(flag in told for flag in ("--shape", "--slab", "--half-space")) and "palpate check" not in told
    for known in (["--half-space"], ["--shape", "part.stl", "--unit", "mm", "--up=+x"]):
        assert cli.main([*words, "--picture", "none", *known]) == 0
        assert "palpate check" in capsys.readouterr().out
    said = stated_geometry(pp.read_recording(tmp_path / "rec.csv"), GeometryOptions())
    assert Path(said.shape).resolve() == Path("part.stl").resolve(), "as it was named from here"
    assert (said.unit, said.up) == ("mm", "+x")


def test_rows_slower_than_a_recording_are_put_on_a_clock_that_can_be_read(tmp_path, world):
    rows = np.column_stack([world["p"], world["f"]])[::25]
    header = "x [m],y [m],z [m],fx [N],fy [N],fz [N]"
    np.savetxt(tmp_path / "log.csv", rows, header=header, delimiter=",", comments="")
    made = pp.import_table(tmp_path / "log.csv", tip_radius_m=TIP, rate_hz=20.0, force_on="tool")
    made.save(tmp_path / "rec.csv")
    again = pp.read_recording(tmp_path / "rec.csv")
    assert again.duration_s == pytest.approx(world["t"][-1], abs=0.05)
    assert again.description["recording"]["read_rate_hz"] == pytest.approx(20.0)


def test_a_rate_ten_times_too_high_is_asked_about(tmp_path, shared_recordings):
    """Rows without a time, of a hand sampled at 1 kHz: at 10 kHz it would press within hundredths of a
    second; at half the rate it is merely slow."""
    hand = pp.read_recording(shared_recordings / "silicone-1-cylinder.csv.gz")
    rows = np.column_stack([hand.position, hand.force_on_tool])
    header = "x [m],y [m],z [m],fx [N],fy [N],fz [N]"
    np.savetxt(tmp_path / "log.csv", rows, header=header, delimiter=",", comments="", fmt="%.7g")

    def doubts(stated_hz: float) -> list[str]:
        made = pp.import_table(
            tmp_path / "log.csv", tip_radius_m=hand.tip_radius_m, rate_hz=stated_hz, force_on="tool"
        )
        return [note for note in made.understood.notes if "--rate" in note]

    assert doubts(1000.0) == [] and doubts(500.0) == []
    (asked,) = doubts(10000.0)
    assert "from first touch to the peak" in asked


def test_commas_that_both_part_and_point_are_asked_about(tmp_path, world):
    """It offered fourteen columns, #1 to #14."""
    rows = [",".join(f"{v:.4f}".replace(".", ",") for v in row) for row in
            np.column_stack([world["t"], 1e3 * world["p"], world["f"]])]  # fmt: skip
    (tmp_path / "log.csv").write_text("\n".join(["t [s],x [mm],y [mm],z [mm],fx [N],fy [N],fz [N]", *rows]))
    with pytest.raises(RecordingError, match="decimal commas.*';'"):
        pp.import_table(tmp_path / "log.csv", tip_radius_m=TIP)


def test_free_air_alone_is_said_to_be_that(tmp_path, world):
    """It asked whose force it was, and only who had said so was told that nothing was touched."""
    air = 0.01 * np.random.default_rng(0).standard_normal(world["f"].shape)
    held = dict(zip(["x", "y", "z", "fx", "fy", "fz"], np.column_stack([world["p"], air]).T, strict=True))
    np.savez(tmp_path / "air.npz", t=world["t"], **held)
    with pytest.raises(RecordingError, match="no contact"):
        pp.import_table(tmp_path / "air.npz", tip_radius_m=TIP)
