"""The verdict.

`answer` decides what is named and whether something is left over, `held_out` how far the gap shrinks and that
no name makes it grow, `where` the axes that the gap follows, `next_touch` what to touch next. `conclusion`
puts them together, with how sure and how wide by judged cases; `result` is what comes out.
"""
