"""The search for effects.

The gap is fitted in `descent`, from where `starts` says, against the noise that `whiten` knows; each set of
effects is predicted on places left out (`leave_one_out`). `evidence` weighs what that says, `naming` decides
when it names an effect, `attribution` picks effects step by step, `rivals` says what the sites cannot tell
from them.
"""
