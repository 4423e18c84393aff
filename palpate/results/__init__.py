"""What the door gives back: the rooms' own frozen types, which here print themselves, plot and show.

One module a result. Each class *is* what its room made (a `palpate.results.model.Model` is a
`mechanics.model.Model` and goes wherever one goes), and only this folder knows plotting.
"""
