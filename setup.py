"""The folders of the repository are installed as `palpate` and packages below it, as pyproject.toml says."""

import tomllib
from pathlib import Path

from setuptools import find_packages, setup

with open(Path(__file__).parent / "pyproject.toml", "rb") as file:
    rooms = tomllib.load(file)["tool"]["palpate"]["rooms"]

setup(
    package_dir={package: folder for folder, package in rooms.items()},
    packages=[
        package
        for folder, room in rooms.items()
        for package in (room, *(f"{room}.{below}" for below in find_packages(folder)))
    ],
)
