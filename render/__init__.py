"""Rendering: a model and a tip become a force, behind one small interface."""

from render.base import Renderer as Renderer
from render.options import RenderOptions as RenderOptions
from render.registry import create as create
from render.registry import names as names
