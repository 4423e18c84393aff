"""A recording becomes a model: contacts, base, surface, tetrahedra, modulus, 1D models of every press.

REC is a recording's .csv, .csv.gz or .toml. MODEL is a folder: model.toml, mesh.vtu (ParaView opens it),
palpations.csv. Lengths in m, forces in N, moduli in Pa.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mechanics.errors import ModelError, OptionError
from mechanics.model import write_model
from mechanics.recording import read_recording
from palpate.arguments import add_json, add_options, add_seed, emit_json, options_from, progress_bar, say

SUMMARY = "a recording becomes a model"


def _steps() -> dict[str, type]:
    from reconstruct.boundary import BoundaryOptions
    from reconstruct.contacts import ContactOptions
    from reconstruct.filtering import FilterOptions
    from reconstruct.modulus import ModulusOptions

    return {
        "filter": FilterOptions,
        "boundary": BoundaryOptions,
        "contact": ContactOptions,
        "modulus": ModulusOptions,
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, -o MODEL, the options of every step, --json, --seed."""
    from reconstruct.pipeline import ReconstructOptions

    parser.add_argument("recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    parser.add_argument("-o", "--output", metavar="MODEL", required=True, help="folder of the model to write")
    add_options(parser, ReconstructOptions, skip=("seed",))
    for kind in _steps().values():
        add_options(parser, kind)
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Reconstruct and write the model."""
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully

    output = Path(arguments.output)
    if (
        output.exists()
        and not (output / "model.toml").exists()
        and (output.is_file() or any(output.iterdir()))
    ):
        raise ModelError(f"'{output}' exists and is no MODEL folder: name another output")
    steps = {name: options_from(arguments, kind) for name, kind in _steps().items()}
    options = options_from(arguments, ReconstructOptions, seed=arguments.seed, **steps)
    if not options.mesh_size_m > 0:
        raise OptionError(f"--mesh-size is {options.mesh_size_m} m; it must be greater than 0")
    recording = read_recording(arguments.recording)
    with progress_bar("reconstruct") as progress:
        result = reconstruct_fully(recording, options, progress)
    write_model(output, result.model)
    model, fit = result.model, result.modulus
    low, high = model.young_modulus_ci95_pa
    contacts = result.exploration.contacts
    say(
        arguments,
        f"{recording.name}: {len(contacts)} palpations, {len(result.exploration.rejected)} contacts not used",
        *(f"  at {t:.2f} s: {reason}" for t, reason in result.exploration.rejected),
        f"Young's modulus {model.young_modulus_pa / 1e3:.2f} kPa, 95 % interval {low / 1e3:.2f} to {high / 1e3:.2f} kPa",
        f"  {fit.reason}; misfit of a press {float((fit.press.rms_n**2).mean() ** 0.5):.3f} N",
        f"mesh: {len(model.mesh.points)} nodes, {len(model.mesh.tetrahedra)} tetrahedra, l = {model.mesh_size_m * 1e3:g} mm",
        f"written to {output}",
    )
    emit_json(
        {
            "model": output,
            "young_modulus_pa": model.young_modulus_pa,
            "young_modulus_ci95_pa": model.young_modulus_ci95_pa,
            "palpations": len(contacts),
            "rejected": [{"t_s": t, "reason": reason} for t, reason in result.exploration.rejected],
            "noise_n": result.exploration.noise_n,
            "law": fit.press.law,
            "by_law": {k: {"young_modulus_pa": e, "misfit_n": m} for k, (e, m) in fit.by_law.items()},
            "by_depth": [{"depth_m": d, "young_modulus_pa": e} for d, e in fit.by_depth],
            "seconds": result.seconds,
        },
        arguments.json,
    )
    return 0
