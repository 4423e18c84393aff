"""From which size on an effect is named in these presses: the promise that "none" makes.

Residuals are drawn from the covariance of the comparison, as wide as the places of this recording scatter, an
effect's own change of the force is added, and the rule of `naming` is asked, all by linear algebra about the
fit without effects: what each candidate gains and foretells of places left out follows from inner products. A
first touch that the surface was fitted to takes along what shows by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import Fit, settings_of
from palpate.diagnosis.search.gaps import beside_modulus_n, modulus_share
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.naming import WEIGHTS, most_told
from palpate.diagnosis.search.rivals import of_one_phenomenon
from palpate.mechanics.effects.base import Effect

SEEN = 4.7
"""Standard deviations: 3.1 for 2 % false alarms among twenty effects, 1.6 more to be seen 19 times of 20. For
those who weigh patterns without the rule of naming: explorations, and the force of another simulator."""
DRAWS = 60
NAMED = 0.95
"""Share of the draws in which an effect of its limit is named."""
FORMS = 4
"""Forms of an effect that are tried, about, one draw after another."""
MOVES = 5
"""Steps of a parameter that is moved from where it does nothing."""
SMALLEST, GREATEST, HALVINGS = 0.02, 200.0, 9
"""Sizes between which the limit is sought, of the noise of a force 3-vector, and how often."""
CLOSE = 0.7
"""Of an effect's gain: what gains more may be named in its place."""


def detectable(search: Search, base: JudgedSet, effects: Sequence[Effect], seed: int = 0) -> dict[str, float]:
    """{name: N rms over contact samples, a common factor taken off} from which NAMED of the draws name it.

    Infinite where they do not at any size, as where a fitted surface takes all of it up.
    """
    fitted = search.forward.model.fitted_to(search.forward.touches)
    lost = {e.name for e in effects if fitted and e.hints.by_first_touches}
    asked = [e for e in effects if e.name not in (*base.found.names, *lost)]
    patterns = Patterns(search, base, asked, fitted, seed)
    return dict.fromkeys(lost, np.inf) | {e.name: patterns.limit(i) for i, e in enumerate(asked)}


class Patterns:
    """The forms of all effects as columns beside the modulus, their inner products in each of g groups, and
    draws of what is left without effects.

    columns: (n, 3, 1 + c) N, the modulus first. own: (c,) number of the effect of each column. size: (c,) N
    rms, a common factor taken off. beyond: (c,) log likelihood that a form has at most.
    """

    def __init__(
        self,
        search: Search,
        base: JudgedSet,
        effects: Sequence[Effect],
        fitted: bool,
        seed: int,
    ) -> None:
        self.search, self.effects = search, effects
        self.over = [base.over_of(between_places=e.scope.between_places) for e in effects]
        forward, found, whitener = search.forward, base.found, search.whitener
        counted = forward.touches.counted
        settings = settings_of(forward, found.effects, found.values, found.onset)
        before = np.nan_to_num(forward.predict(settings))
        columns, own, size, forms = [found.jacobian[:, :, 0]], [], [], []
        for number, effect in enumerate(effects):
            for form in forms_of(search, effect):
                settings = settings_of(forward, found.effects, found.values, found.onset)
                effect.act(settings, form, forward)
                change = np.nan_to_num(forward.predict(settings)) - before
                change[~counted] = 0.0
                rms = beside_modulus_n(change[counted], before[counted])
                if rms > 0:
                    columns.append(change)
                    own.append(number)
                    size.append(rms)
                    forms.append(form)
        self.own, self.size = np.array(own, dtype=int), np.array(size)
        shown = np.stack(columns, axis=2)
        # as a score has it: modulus and first touches lie where the plain misfit is least
        level = [modulus_share(change[counted], before[counted]) for change in columns[1:]]
        seen = without_first_touches(search, shown[:, :, 1:] - before[:, :, None] * level, plainly=True)
        left = [beside_modulus_n(change[counted], before[counted]) for change in np.moveaxis(seen, 2, 0)]
        if fitted:
            shown[:, :, 1:] = without_first_touches(search, shown[:, :, 1:])
        shares = np.array(left) / forward.touches.force_rms_n
        told = [most_told(effects[k], form, s) for k, form, s in zip(own, forms, shares, strict=True)]
        self.beyond, self.columns = np.array(told), shown
        drawn = whitener.drawn(DRAWS, np.random.default_rng(seed))
        both = without_shared(search, found, np.concatenate([shown, drawn], axis=2))
        self.white = Products.of(whitener.gram(both), shown.shape[2])
        self.groups = whitener.groups

    def limit(self, number: int) -> float:
        """N rms from which NAMED of the draws name this effect."""
        forms = np.flatnonzero(self.own == number)
        if not len(forms):
            return np.inf
        true = forms[np.arange(DRAWS) % len(forms)]
        noise = self.search.forward.touches.vector_noise_n
        low, high = np.full(DRAWS, np.log(SMALLEST * noise)), np.full(DRAWS, np.log(GREATEST * noise))
        never = ~self.named(number, true, np.exp(high))
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            yes = self.named(number, true, np.exp(middle))
            low, high = np.where(yes, low, middle), np.where(yes, middle, high)
        return float(np.quantile(np.where(never, np.inf, np.exp(high)), NAMED, method="higher"))

    def named(self, number: int, true: np.ndarray, size_n: np.ndarray) -> np.ndarray:
        """(d,) whether each draw names the effect that stands in it by form true (d,), size_n (d,) N."""
        # draws are of the stated widths, and count by those; places that scatter less show what is smaller
        over = self.over[number]
        factor = size_n / self.size[true] / np.sqrt(over)
        white = self.white.with_column(1 + true, factor)
        gains = white.gains()
        mine = self.scored(number, white, gains, over)
        rest = np.array([gains[:, self.own == k].max(axis=1, initial=0.0) for k in range(len(self.effects))])
        near = (rest > CLOSE * rest[number]).any(axis=1)
        named = mine.passes.copy()
        best, most = mine.odds.copy(), np.where(mine.passes, mine.gain, -np.inf)
        others = []
        for k in np.flatnonzero(near).tolist():
            if k != number and not of_one_phenomenon(self.effects[k], [self.effects[number]]):
                other = self.scored(k, white, gains, over)
                others.append(other)
                best = np.where(other.passes, np.maximum(best, other.odds), best)
        doubt = self.search.options.beyond_doubt
        named &= mine.odds > best - doubt
        for other in others:
            named &= ~(other.passes & (other.odds > best - doubt) & (other.gain > most))
        return named

    def scored(self, number: int, white: Products, gains: np.ndarray, over: float = 1.0) -> Linear:
        """The score of an effect's likeliest form in each draw, as `Search.score` has it. over: of a draw's
        own squares, what they stand for."""
        effect, options = self.effects[number], self.search.options
        forms = np.flatnonzero(self.own == number)
        column = 1 + forms[np.argmax(gains[:, forms], axis=1)]
        extra, groups = len(effect.parameters), self.groups
        old, new = white.fitted(None), white.fitted(column)
        each = 0.5 * (old.loss - new.loss)
        predicted = each.sum(axis=1, keepdims=True) - each > extra
        per_group = np.where(predicted, 0.5 * (old.held - new.held), 0.0)
        gain = per_group.sum(axis=1)
        if effect.scope.between_places:
            per_group = each
            gain = each.sum(axis=1) - 0.5 * np.log(groups) * extra
        lump = effect.hints.few_places
        evidence = gain - (np.log(groups) if lump else np.maximum(per_group.max(axis=1), 0.0))
        evidence = np.minimum(evidence, over * new.amplitude**2 * self.beyond[column - 1])
        foretold = (each if lump else np.where(predicted, 0.5 * (old.held - new.held), 0.0)).sum(axis=1)
        odds = WEIGHTS.log_odds(
            evidence, WEIGHTS.border_of(effect.scope, measured=self.search.forward.measured)
        )
        return Linear((foretold > 0) & (expit(odds) > options.sure), odds, gain)


@dataclass(frozen=True)
class Linear:
    """Scores of d draws: whether they name their effect, log odds, gain in log likelihood."""

    passes: np.ndarray
    odds: np.ndarray
    gain: np.ndarray


@dataclass(frozen=True)
class Fitted:
    """(d, g) each: twice the loss of a group, as fitted and held out. amplitude: (d,) of the column, by all
    groups."""

    loss: np.ndarray
    held: np.ndarray
    amplitude: np.ndarray


@dataclass(frozen=True)
class Products:
    """Inner products in g groups: of columns with columns (g, c, c), of d draws with columns (d, g, c), of
    each draw with itself (d, g). Column 0 is the modulus."""

    columns: np.ndarray
    mixed: np.ndarray
    squares: np.ndarray

    @classmethod
    def of(cls, gram: np.ndarray, columns: int) -> Products:
        """Cut out of (g, c + d, c + d)."""
        own = np.einsum("gdd->dg", gram[:, columns:, columns:])
        return cls(gram[:, :columns, :columns], gram[:, columns:, :columns].transpose(1, 0, 2), own.copy())

    def with_column(self, column: np.ndarray, factor: np.ndarray) -> Products:
        """Each draw with a column (d,) in it, times factor (d,)."""
        there, f = self.columns[:, column, :].transpose(1, 0, 2), factor[:, None]
        _, itself, with_draw = self._of(column)
        squares = self.squares + 2 * f * with_draw + f**2 * itself
        return Products(self.columns, self.mixed + f[:, :, None] * there, squares)

    def gains(self) -> np.ndarray:
        """(d, c - 1) half the squares that each column takes off, beside the modulus."""
        a, x = self.columns.sum(axis=0), self.mixed.sum(axis=1)
        left = x[:, 1:] - x[:, :1] * a[0, 1:] / a[0, 0]
        return 0.5 * left**2 / np.maximum(np.diag(a)[1:] - a[0, 1:] ** 2 / a[0, 0], _LEAST * np.diag(a)[1:])

    def fitted(self, column: np.ndarray | None) -> Fitted:
        """The modulus and a column (d,), or the modulus alone, fitted to all groups and to all but one."""
        mm, (md, dd, rd) = self.columns[:, 0, 0], self._of(column)
        rm, found = self.mixed[:, :, 0], []
        for others in (False, True):
            mm_, rm_, rd_, md_, dd_ = (_summed(x, others) for x in (mm[None], rm, rd, md, dd))
            amplitude = np.zeros_like(rm)
            if column is not None:
                # of all groups, as a column that one alone holds is nothing in the others
                least = np.maximum(_LEAST * dd.sum(axis=1, keepdims=True), 1e-300)
                amplitude += (rd_ - md_ * rm_ / mm_) / np.maximum(dd_ - md_**2 / mm_, least)
            found.append((self._left((rm_ - amplitude * md_) / mm_, amplitude, column), amplitude[:, 0]))
        (loss, by_all), (held, _) = found
        return Fitted(loss, held, by_all)

    def _left(self, level: np.ndarray, amplitude: np.ndarray, column: np.ndarray | None) -> np.ndarray:
        mm, (md, dd, rd) = self.columns[:, 0, 0], self._of(column)
        modulus = level * (level * mm - 2 * self.mixed[:, :, 0])
        return self.squares + modulus + amplitude * (amplitude * dd + 2 * level * md - 2 * rd)

    def _of(self, column: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(d, g) products of each draw's column with the modulus, itself and the draw; of None nothing."""
        if column is None:
            nothing = np.zeros_like(self.squares)
            return nothing, nothing, nothing
        with_draw = self.mixed[np.arange(len(column)), :, column]
        return self.columns[:, 0, column].T, self.columns[:, column, column].T, with_draw


_LEAST = 1e-9
"""Share of a column's squares that is left beside the modulus, at least: what is no more is its image."""


def _summed(x: np.ndarray, others: bool) -> np.ndarray:
    """(d, g) of x (d, g): each group's sum over all groups, or over the others."""
    total = x.sum(axis=1, keepdims=True)
    return total - x if others else np.broadcast_to(total, x.shape)


def without_shared(search: Search, found: Fit, changes: np.ndarray) -> np.ndarray:
    """(n, 3, c) N, changes less what the errors that all presses share take up, as likely as they are."""
    sd = search.whitener.shared_sd
    if not sd.any():
        return changes
    columns = found.jacobian[:, :, len(found.values) - len(sd) :] * sd
    k = len(sd)
    gram = search.whitener.gram(np.concatenate([columns, changes], axis=2)).sum(axis=0)
    left: np.ndarray = changes - columns @ np.linalg.solve(gram[:k, :k] + np.eye(k), gram[:k, k:])
    return left


def without_first_touches(search: Search, changes: np.ndarray, *, plainly: bool = False) -> np.ndarray:
    """(n, 3, c) N, changes less what first touches take up that are free: the likeliest by the covariance, so
    that no change becomes plainer by it; plainly, those of the plain misfit, as wide as they are."""
    t, whitener = search.forward.touches, search.whitener
    column = np.where(t.counted[:, None], whitener.onset_column, 0.0)
    rank = np.zeros(len(t), dtype=int)  # of a press among those of its site
    for site in range(t.sites):
        own = np.flatnonzero(t.site == site)
        rank[own] = np.arange(len(own))
    of_rank = rank[t.press][:, None] == np.arange(rank.max() + 1)
    each = column[:, :, None] * of_rank[:, None, :]
    both = np.concatenate([each, changes], axis=2)
    k = each.shape[2]
    if plainly:
        gram = whitener.raw_gram(both) / whitener.variance
        gram[t.site, rank, rank] += 1 / whitener.onset_sd**2
    else:
        gram = whitener.gram(both)
    taken = np.linalg.pinv(gram[:, :k, :k], hermitian=True) @ gram[:, :k, k:]
    moved: np.ndarray = np.einsum("nrk,nkc->nrc", each, taken[t.site[t.press]])
    return changes - moved


def forms_of(search: Search, effect: Effect) -> list[np.ndarray]:
    """Values (k,) at which an effect is there: some of its starts, or a move of each parameter where it
    starts from nothing."""
    starts = search.starts.get(effect.name) or effect.starts()
    there = [s for s in starts if not np.allclose(s, effect.ideal)]
    if not there:
        return [effect.ideal + move for move in np.diag([MOVES * p.step for p in effect.parameters])]
    return there[:: max(1, len(there) // FORMS)]
