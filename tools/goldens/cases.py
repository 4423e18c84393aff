"""The cases: command lines on the embedded recording, shipped scenes, and what stands for other people's
files (`inside.inputs`). They run in a folder of their own; beside it lie `inputs`, `model`, and `bare`, which
is the model without what was computed from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

COMMANDS = (
    "demo check reconstruct model open import export material replay press compare diagnose calibrate touch "
    "devices explore simulate bench batch completion"
).split()
REC = "silicone-1-cylinder"


@dataclass(frozen=True)
class Case:
    """lines: command lines, `palpate` left out, run one after another. quick: of the quick set; light: of it
    too, computing next to nothing. together: in one process, which is quicker. near: as in
    `difference.Tolerance`: it is not the same twice (meshes differ from run to run; a loop goes by the
    clock). without: keys that are left out of what is written, as they are another each time. inside: what it
    asks of `inside` instead of running commands."""

    name: str
    lines: tuple[str, ...] = ()
    quick: bool = False
    light: bool = False
    together: bool = False
    near: Mapping[str, float] = field(default_factory=dict)
    without: tuple[str, ...] = ()
    inside: tuple[str, ...] = ()


MESHED = {"young_modulus_pa": 0.01, "poisson_ratio": 1e-6, "palpations": 1e-6, "presses": 1e-6}
"""Of what is meshed anew each time: the contract says 1 % of the modulus."""
TIMED = {"tip_radius_m": 1e-6}
"""Of a loop by the clock: no force that it reached."""
ERRORS = (
    "",
    "prss demo",
    "press",
    "press demo",
    "press demo --at 0,0",
    "press demo --at 0,0,zero",
    "press demo --at 0,0,0.08 --depth -1",
    "press demo --at 0,0,0.08 --deepth 0.004",
    "press demo --at 0,0,0.08 --renderer femm",
    "press demo --at 0,0,0.08 --friction=-1",
    "press nowhere --at 0,0,0.08",
    "press demo --at 0,0,0.08 --expect ../inputs/nothing.csv",
    "replay demo nobody.csv",
    "replay demo ../inputs/nothing.csv",
    "check ../inputs/broken.toml",
    "reconstruct silicone-1-cylinder",
    "reconstruct silicone-1-cylinder -o out --poisson-ratio 0.5",
    "reconstruct silicone-1-cylinder -o out --mesh-size nan",
    "model ../inputs/nothing.csv -o out",
    "export demo --to stl -o x.obj",
    "export demo --to blender -o x.obj",
    "diagnose silicone-1-cylinder --model demo --simulated ../inputs/nothing.csv",
    "diagnose silicone-1-cylinder --model demo --simulated ../inputs/still.csv --stated mass=1",
    "diagnose silicone-1-cylinder --model demo --without telekinesis",
    "compare silicone-1-cylinder --folds 1",
    "calibrate silicone-1-cylinder",
    "simulate teapot -o x.csv.gz",
    "simulate cylinder -o x.csv.gz --effect telekinesis=1",
    "touch demo --headless --device gloves",
    "touch demo --headless --seconds 0",
    "explore -o x.csv.gz",
    "material ../inputs/nothing.csv --tip-radius 0.005",
    "import ../inputs/nothing.csv -o x.csv.gz --tip-radius 0.005",
    "open ../inputs/nothing.csv",
    "devices gloves",
    "batch nowhere -o out",
    "completion tcsh",
    "bench",
    "bench contacts",
    "demo --seconds -1",
)


def _exports() -> tuple[Case, ...]:
    ends = {"mujoco": "xml", "sofa": "scn", "abaqus": "inp", "gmsh": "msh", "usd": "usda", "newton": "py",
            "drake": "py", "stl": "stl"}  # fmt: skip
    return (
        Case("export", tuple(
            f"export ../model --to {name} -o {name}.{end} --json {name}.json" for name, end in ends.items()
        ), quick=True, together=True),
        Case("export-page", ("export ../model --to page -o page.html --json page.json",)),
        Case("export-scene", ("export nodule --to gmsh -o nodule.msh",
                              "export nodule --to stl --unit mm -o nodule.stl")),
    )  # fmt: skip


CASES: tuple[Case, ...] = (
    Case("help", ("--version", "--help", *(f"{c} {f}" for c in COMMANDS for f in ("--help", "--help-all"))),
         light=True, together=True),
    Case("errors", ERRORS, light=True, together=True),
    Case("signatures", inside=("signatures",), light=True),
    Case("completion", tuple(f"completion {s}" for s in ("bash", "zsh", "fish"))),
    Case("ticks", inside=("ticks", "../model"), quick=True),
    Case("devices", ("devices --json devices.json",)),
    Case("check", (f"check {REC} --json check.json --report check.html",), quick=True),
    Case("check-wrong", ("check ../inputs/mixed.csv --json mixed.json",
                         "check ../inputs/short.csv --json short.json"), quick=True, together=True),
    Case("check-full", (f"check {REC} --full --json check.json",), near=MESHED),
    Case("press", ("press ../model --at 0,0,0.08 --depth 0.004 -o top.csv --json top.json",
                   "press ../model --at 0.03,0.02,0.04 --direction=-3,-2,0 --depth 0.003 --friction 0.2 "
                   "--expect top.csv --json side.json",
                   "press demo --at 0,0,0.08 --depth 0.004 --expect top.csv --json -"),
         quick=True, together=True),
    Case("press-1d", tuple(
        f"press ../model --at 0,0,0.08 --renderer {name} -o {name}.csv --json {name}.json"
        for name in ("kelvin-voigt", "hunt-crossley", "hunt-crossley-undamped", "hunt-crossley-kh")
    ), quick=True, together=True),
    Case("press-laws", tuple(
        f"press ../model --at 0,0,0.08 --json {k}.json {words}" for k, words in enumerate((
            "--dent-law linear", "--dent-law hertz", "--dent-law sphere", "--friction inf", "--no-effects",
            "--tip-radius 0.003", "--depth 0.008 --speed 0.05", "--direction 0.3,0,-1 --hold 0.2"))
    ), together=True),
    Case("press-support", ("press nodule --at 0.014,0.012,0.05 -o nodule.csv --json nodule.json",
                           "press ../model --at 0.2,0,0 --json support.json",
                           "press nodule --at 0.2,0,0 --json scene.json")),
    Case("computed-anew", ("press ../bare --at 0,0,0.08 --json press.json",
                           f"diagnose {REC} --model ../bare --fast --json fast.json")),
    Case("press-exact", ("press ../model --at 0,0,0.08 --exact --json exact.json",)),
    Case("press-surface", ("press ../inputs/box.stl --at 0.03,0.025,0.04 --json box.json",),
         near={"peak_force_n": 0.03}),
    Case("press-scenes", tuple(
        f"press {name} --at 0,0,0.2 --json {name}.json" for name in ("silicone-1", "silicone-2", "silicone-3",
                                                                     "bean", "demo", "your-recording")
    ), near={"peak_force_n": 0.03}),
    Case("replay", (f"replay ../model {REC} -o fem.csv --json fem.json",), quick=True),
    Case("replay-all", (*(
        f"replay ../model {REC} --renderer {name} -o {name}.csv --json {name}.json"
        for name in ("kelvin-voigt", "hunt-crossley", "hunt-crossley-undamped", "hunt-crossley-kh")
    ), f"replay ../model {REC} --friction 0.2 --dent-law linear -o slides.csv --json slides.json",
        f"replay nodule {REC} -o nodule.csv --json nodule.json"), together=True),
    Case("import", ("import ../inputs/robot.csv --tip-radius 0.005 --dry-run --json dry.json",
                    "import ../inputs/robot.csv --tip-radius 0.005 -o rec.csv.gz --name robot --half-space"),
         quick=True, together=True),
    Case("material", ("material ../inputs/curve0.csv ../inputs/curve1.csv ../inputs/curve2.csv "
                      "../inputs/curve3.csv ../inputs/curve4.csv ../inputs/curve5.csv ../inputs/curve6.csv "
                      "--tip-radius 0.005 --json material.json --report material.html",)),
    Case("material-few", ("material ../inputs/curve0.csv ../inputs/curve2.csv --tip-radius 0.005 "
                          "--json few.json",), quick=True),
    Case("open-curves", ("open ../inputs/curve0.csv ../inputs/curve1.csv --tip-radius 0.005 "
                         "--json open.json --report open.html",), quick=True),
    Case("open-asks", ("open ../inputs/curve0.csv", "open ../inputs/robot.csv",
                       "open ../model --json model.json --report none"), quick=True, together=True),
    Case("open-recording", (f"open {REC} -o out --json open.json --report none",), near=MESHED),
    Case("open-surface", ("open ../inputs/box.stl --modulus 20000 --unit m -o out --json open.json "
                          "--report none",), near=MESHED),
    Case("calibrate", ("calibrate ../inputs/plate.csv --rigid -o tool.toml --json plate.json",), quick=True),
    Case("calibrate-object", (f"calibrate {REC} --modulus 29000 --json object.json",), near=MESHED),
    Case("diagnose", (f"diagnose {REC} --model ../model --fast --apply better --corrected rec.csv.gz "
                      "--json fast.json --report fast.html",)),
    Case("diagnose-quick", (f"diagnose {REC} --model ../model --fast --json fast.json",), quick=True),
    Case("diagnose-full", (f"diagnose {REC} --model ../model --json full.json --report full.html",)),
    Case("simulated", (f"diagnose {REC} --model ../model --simulated ../inputs/forces.csv --fast "
                       "--stated modulus=30000 --json fast.json",), quick=True),
    Case("simulated-full", (f"diagnose {REC} --model ../model --simulated ../inputs/forces.csv "
                            "--json full.json --report full.html",)),
    Case("compare", (f"compare {REC} --model ../model --json compare.json --report compare.html",)),
    Case("compare-two", (f"compare {REC} {REC} --no-diagnosis --json two.json",), near=MESHED),
    Case("reconstruct", (f"reconstruct {REC} -o out --json out.json --report out.html",), near=MESHED),
    Case("reconstruct-paper", (f"reconstruct {REC} -o out --method paper --json out.json",),
         near={"young_modulus_pa": 0.05}),
    Case("model-of-file", ("model ../inputs/box.stl --modulus 20000 -o out --json out.json",), near=MESHED),
    Case("simulate", ("simulate cylinder --protocol brief -o rec.csv.gz --seed 3 --effect time_delay=1 "
                      "--no-sizes --workers 1 --json rec.json",)),
    Case("explore", ("explore --phantom cylinder --most 6 -o rec.csv.gz --json rec.json",), near=MESHED,
         without=("update_s",)),
    Case("touch", ("touch demo --headless --seconds 1 --seed 3 --record rec.csv.gz --json touch.json",),
         near=TIMED, without=("stdout", "reasons")),
    Case("batch", (f"batch {REC} -o out --do reconstruct --no-reports --workers 1 --json batch.json",),
         near=MESHED),
    Case("demo", ("demo -o out --no-window --seconds 1 --json demo.json",), near=TIMED,
         without=("stdout", "reasons")),
    *_exports(),
)  # fmt: skip
"""All of them, in the order in which they run."""
