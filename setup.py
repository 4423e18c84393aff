"""Which folder of the repository is installed as which package: everything is `palpate` or below it."""

from setuptools import find_packages, setup

FOLDERS = {
    "palpate": "shell",
    "palpate.mechanics": "mechanics",
    "palpate.reconstruction": "reconstruct",
    "palpate.render": "render",
    "palpate.devices": "devices",
    "palpate.scenes": "scenes",
    "palpate.diagnosis": "diagnose",
}

setup(
    package_dir=FOLDERS,
    packages=[
        package
        for name, folder in FOLDERS.items()
        for package in (name, *(f"{name}.{below}" for below in find_packages(folder)))
    ],
)
