"""Numbers for `shader_text.Evaluator` that bound rounding errors: linear forms in the heights of a node.

A number is a form, the sum of weights times heights, and a bound of its error in units of 2^-24. The bound has two
factors: of the node's largest height, and of the error at the post. The bound of a rounding is the form's size. It is
convex in the place of the post, as weights are linear in it: so it is largest at a corner of the triangle. Products of
errors are left out; they are below 2^-20 of the rest.
"""

import numpy as np

CORNERS = 9  # of a node and its middles, rows of three; the first one is 0, as heights are relative to it
POST, ONE = CORNERS, CORNERS + 1


class Form:
    """Weights of the node's heights, of the post's height, and of 1; the bound of the error."""

    def __init__(self, weights, error):
        self.weights, self.error = weights, np.array(error, float)

    @property
    def size(self):
        """How large the number may be: factors of the node's largest height, and of the error at the post.

        The post's height is at most the sum of both.
        """
        if self.is_weight:
            return np.array([abs(self.weights[ONE]), 0])
        return np.array([np.abs(self.weights[:ONE]).sum(), abs(self.weights[POST])])

    @property
    def is_weight(self):
        return not self.weights[:ONE].any() and bool(self.weights[ONE])


def unit(i, value=1.0):
    weights = np.zeros(ONE + 1)
    weights[i] = value
    return weights


def weight(value, error=0.0):
    """A number without heights, and its error."""
    return Form(unit(ONE, value), (error, 0))


def corner(row, col):
    """A height of the node relative to the first one, which is rounded once."""
    return Form(unit(3 * row + col, float(row + col > 0)), (row + col > 0, 0))


def post():
    return Form(unit(POST), (1, 1))


class Forms:
    """Operations on forms. `decide` says which comparisons hold, because each triangle has its own bound."""

    precise = False

    def __init__(self, **decide):
        self._decide = {{"east": ">=", "first": "<="}[name]: holds for name, holds in decide.items()}

    def number(self, text):
        return weight(float(text))

    def unary(self, operator, a):
        return Form(-a.weights, a.error)

    def choose(self, condition, yes, no):
        return yes if condition else no

    def binary(self, operator, a, b):
        if operator in self._decide:
            return self._decide[operator]
        if operator == "*":
            if not a.is_weight and a.weights.any():
                a, b = b, a
            factor = a.weights[ONE]
            error = abs(factor) * b.error + a.error[0] * b.size
            return self._rounded(factor * b.weights, error)
        sign = {"+": 1, "-": -1}[operator]
        weights, error = a.weights + sign * b.weights, a.error + b.error
        is_exact = any(not each.weights.any() and not each.error.any() for each in (a, b))  # one of them is 0
        return Form(weights, error) if is_exact else self._rounded(weights, error)

    def _rounded(self, weights, error):
        return Form(weights, error + Form(weights, (0, 0)).size)
