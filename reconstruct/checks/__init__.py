"""The check-up of a recording: what may be wrong with it, before its modulus is believed.

One file a kind of check, each a pure function of what it looks at; `registry` lists them. A finding stands
only where its statistic leaves little doubt (`base.SURE_P`, `base.SURE_ODDS`), and is grave by what it does
to the modulus, not by its kind.
"""
