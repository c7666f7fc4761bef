"""Numbers for `shader_text.Evaluator` that become a Gappa script: bounds of rounding errors, proved by a program.

Each number is a pair: what a GPU computes in float32, and the exact value of the same expression. Gappa
(Daumas & Melquiond 2010, "Certification of bounds on expressions involving rounded operators") bounds their difference
for all operands in given intervals.
"""

import itertools
import subprocess
from fractions import Fraction
from typing import NamedTuple

import numpy as np

FUSED = ("", "left", "right")  # which product of a sum a compiler fuses; of two it fuses one
UNIT = 2.0**-24  # largest relative error of one rounding to nearest


class Number(NamedTuple):
    """What a GPU has, and the exact value: names or constants in Gappa's language."""

    held: str
    exact: str
    product: str = ""  # not rounded yet: a compiler may fuse it with a sum


class Gappa:
    """Definitions of a script, in the order of the operations.

    Parameters
    ----------
    mode
        Rounding: "ne" to the nearest float, "zr" towards zero.
    fused
        Which operand of a sum is fused with it if it is a product: one of `FUSED`. Only products that are not
        `precise`.
    quotient
        Largest relative error of a quotient; 0: quotients are rounded like other results.
    """

    def __init__(self, mode="ne", fused="", quotient=0.0):
        self.lines = [f"@rnd = float<ieee_32, {mode}>;"]
        self.fused = fused
        self.quotient = quotient
        self.precise = False
        self.given = []
        self.means = []  # exact sums of two products
        self._products = set()
        self._count = itertools.count()

    def define(self, expression):
        name = f"v{next(self._count)}"
        self.lines.append(f"{name} = {expression};")
        return name

    def float_(self, low, high):
        """A float between two bounds, which the GPU holds as it is."""
        name = self.define(f"rnd(in{len(self.lines)})")
        self.given.append(f"{name} in [{constant(low)},{constant(high)}]")
        return Number(name, name)

    def grid(self, low, high, exponent):
        """A multiple of 2^exponent between two bounds."""
        name = self.define(f"fixed<{exponent}, ne>(in{len(self.lines)})")
        self.given.append(f"{name} in [{constant(low)},{constant(high)}]")
        return Number(name, name)

    def real(self, low, high):
        """A real number between two bounds; the GPU has the nearest float."""
        name = f"in{len(self.lines)}"
        self.given.append(f"{name} in [{constant(low)},{constant(high)}]")
        return Number(self.define(f"rnd({name})"), name)

    def close(self, low, high, relative):
        """A real number between two bounds; the GPU has a float with at most this relative error."""
        exact, held = f"in{len(self.lines)}", self.define(f"rnd(near{len(self.lines)})")
        self.given.append(f"{exact} in [{constant(low)},{constant(high)}]")
        self.given.append(f"{held} -/ {exact} in [{constant(-relative)},{constant(relative)}]")
        return Number(held, exact)

    def whole(self):
        return self.number("0")

    def number(self, text):
        value = constant(np.float32(text.rstrip("u")))
        return Number(value, value)

    def binary(self, operator, a, b):
        exact = self.define(f"{a.exact} {operator} {b.exact}")
        if operator == "*":
            self._products.add(exact)
        if operator == "+" and {a.exact, b.exact} <= self._products:
            self.means.append(exact)
        if operator == "/" and self.quotient:
            of_held = self.define(f"{self.rounded(a)} / {self.rounded(b)}")
            held = self.define(f"rnd(quotient{exact})")
            self.given.append(f"{held} -/ {of_held} in [{constant(-self.quotient)},{constant(self.quotient)}]")
            return Number(held, exact)
        if operator == "*" and not self.precise:
            text = f"{self.rounded(a)} * {self.rounded(b)}"
            return Number("", exact, text)
        if operator in "+-" and self.fused and (a.product or b.product):
            left = a.product if a.product and (self.fused == "left" or not b.product) else ""
            a_text, b_text = (left, self.rounded(b)) if left else (self.rounded(a), b.product)
        else:
            a_text, b_text = self.rounded(a), self.rounded(b)
        return Number(self.define(f"rnd({a_text} {operator} {b_text})"), exact)

    def unary(self, operator, a):
        assert operator == "-"
        if a.exact[0].isdigit():
            return Number(f"-{a.held}", f"-{a.exact}")
        return Number(self.define(f"-{self.rounded(a)}"), self.define(f"-{a.exact}"))

    def call(self, name, arguments):
        if name == "abs":
            (a,) = arguments
            return Number(self.define(f"|{self.rounded(a)}|"), self.define(f"|{a.exact}|"))
        if name == "exp2" and arguments[0].exact.lstrip("-").isdigit():
            return Number(*[constant(2.0 ** int(arguments[0].exact))] * 2)
        raise NotImplementedError(name)

    def rounded(self, a):
        return a.held or self.define(f"rnd({a.product})")

    def proves(self, goal, *facts, split=""):
        """Whether Gappa proves a goal from the intervals and from other facts."""
        given = " /\\ ".join([*self.given, *facts])
        text = "\n".join([*self.lines, f"{{ {given} -> {goal} }}", split])
        done = subprocess.run(["gappa"], input=text, capture_output=True, text=True, timeout=60)
        assert "yntax" not in done.stderr, f"{done.stderr}\n{text}"
        return done.returncode == 0


def constant(value):
    """A number in Gappa's language: an integer times a power of two."""
    ratio = Fraction(float(value))
    shift = ratio.denominator.bit_length() - 1
    return f"{ratio.numerator}b-{shift}" if shift else str(ratio.numerator)


class Roundings:
    """Numbers for the evaluator that count: the most roundings that any product in a sum of products passes.

    With k of them, the computed sum is off by at most k 2^-24 times the sum of the absolute values of the products
    (Jeannerod & Rump 2013, "Improved error bounds for inner products in floating-point arithmetic"). This holds for
    operands of any size. A number is its count, or WHOLE for an integer; exact operations are to be given as `known`
    functions.
    """

    WHOLE = None
    precise = False

    def number(self, text):
        return 0

    def whole(self):
        return self.WHOLE

    def binary(self, operator, a, b):
        if a is None and b is None:
            return None
        a, b = a or 0, b or 0
        return a + b + 1 if operator in "*/" else max(a, b) + 1

    def unary(self, operator, a):
        return a
