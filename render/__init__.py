"""Rendering: a model and a tip become a force, behind one small interface.

What is named here is loaded when it is used (PEP 562), so that options cost no renderer.
"""

import importlib
from typing import TYPE_CHECKING

from palpate import (
    mechanics as mechanics,  # it says where compiled kernels are kept, before the first is decorated
)

if TYPE_CHECKING:
    from palpate.render.base import Renderer as Renderer
    from palpate.render.options import RenderOptions as RenderOptions
    from palpate.render.registry import create as create
    from palpate.render.registry import names as names

_HOME = {
    "Renderer": "palpate.render.base",
    "RenderOptions": "palpate.render.options",
    "create": "palpate.render.registry",
    "names": "palpate.render.registry",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'palpate.render' has no attribute '{name}'; it has {', '.join(_HOME)}")
    return getattr(importlib.import_module(_HOME[name]), name)
