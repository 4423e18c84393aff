"""The shell: command line, servo process, window, reports."""

from importlib.metadata import PackageNotFoundError, version

import mechanics as mechanics  # it says where compiled kernels are kept, before the first is decorated

try:
    __version__ = version("palpate")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0.0.0+source"
