"""Frames of a notebook's cells."""

from __future__ import annotations

import base64
import gzip
import html
import re


def page_in(text: str) -> str:
    """The page that a frame unpacks."""
    frame = html.unescape(re.search('srcdoc="(.*?)" title', text, re.DOTALL)[1])
    packed = re.search('octet-stream">(.*?)</script>', frame, re.DOTALL)[1]
    return gzip.decompress(base64.b64decode(packed)).decode()
