"""The version of what is installed."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("palpate")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0.0.0+source"
