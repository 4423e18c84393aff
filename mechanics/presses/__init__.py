"""The one table of presses: what it holds, how it is cut from a recording or made, its files."""
