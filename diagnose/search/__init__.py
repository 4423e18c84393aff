"""The search for effects.

`descent` fits the gap against the noise of `whiten`; `leave_one_out` predicts each set of effects at places
left out. `evidence` weighs the outcome, `naming` decides when it names an effect, `attribution` picks effects
step by step, `rivals` finds those that the sites cannot distinguish from them.
"""
