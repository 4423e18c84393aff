"""What a scene's file says about its object's renderer."""

from __future__ import annotations

from dataclasses import replace

from render.options import RenderOptions
from scenes.scene import Scene


def with_friction(options: RenderOptions, scene: Scene) -> RenderOptions:
    """The renderers' options with the scene file's friction, where they have none of their own."""
    return options if options.friction is not None else replace(options, friction=scene.friction)
