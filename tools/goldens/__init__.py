"""What the outside sees of the program, written down, so that a move can be shown to change nothing.

    python -m tools.goldens write DIR [--quick] [--only NAME ...] [--python PATH] [--model MODEL]
    python -m tools.goldens compare OLD NEW [--bits]

One file a case: exit code, text, JSON, pages as text and tags, files in short, and hashes of exact bytes. It
runs the `palpate` command and `import palpate as pp` of the given interpreter alone, in a folder of its own.
"""
