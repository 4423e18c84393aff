"""Rendering: a model and a tip become a force, behind one small interface."""

import mechanics as mechanics  # it says where compiled kernels are kept, before the first is decorated
from render.base import Renderer as Renderer
from render.options import RenderOptions as RenderOptions
from render.registry import create as create
from render.registry import names as names
