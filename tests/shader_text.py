"""Read functions of our GLSL and evaluate them over any kind of number: floats, z3's words, Gappa's expressions.

The proofs of `test_proofs` are about the text of the shaders, so they fail when it changes for the worse. This knows
the part of GLSL that they need: declarations, assignments, `if` and `return`, no loops. A vector is a list of numbers.
"""

import re

from terrain_gl.gpu import shaders

_TOKEN = re.compile(r"\s*(0x[0-9a-fA-F]+u?|\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+|\d+u?|\w+|<<|>>|<=|>=|==|!=|&&|\|\||.)")
_LEVELS = ("||", "&&", "|", "^", "&", "== !=", "< > <= >=", "<< >>", "+ -", "* / %")  # from loose to tight
_DECLARED = re.compile(r"(?:const )?(precise )?(float|int|uint|bool|[iub]?vec[234]) (\w+ = .*)", re.DOTALL)


class Parser:
    """A tree of tuples from an expression: (operation, parts...)."""

    def __init__(self, text):
        self.tokens = [token for token in _TOKEN.findall(text) if token.strip()]

    def take(self, *wanted):
        if self.tokens and (not wanted or self.tokens[0] in wanted):
            return self.tokens.pop(0)
        return None

    def expression(self):
        condition = self.binary(0)
        if not self.take("?"):
            return condition
        yes = self.expression()
        assert self.take(":")
        return "choose", condition, yes, self.expression()

    def binary(self, level):
        if level == len(_LEVELS):
            return self.unary()
        left = self.binary(level + 1)
        while operator := self.take(*_LEVELS[level].split()):
            left = ("binary", operator, left, self.binary(level + 1))
        return left

    def unary(self):
        if operator := self.take("-", "~", "!", "+"):
            return "unary", operator, self.unary()
        return self.postfix()

    def postfix(self):
        if self.take("("):
            found = self.expression()
            assert self.take(")")
        elif re.match(r"[\d]", token := self.take()):
            found = "number", token
        else:
            found = "name", token
        while mark := self.take(".", "(", "["):
            if mark == ".":
                found = "field", found, self.take()
            elif mark == "[":
                found = "index", found, self.expression()
                assert self.take("]")
            else:
                found = "call", found[1], self.arguments()
        return found

    def arguments(self):
        found = []
        while not self.take(")"):
            found.append(self.expression())
            self.take(",")
        return found


def parse(text):
    """The tree of an expression."""
    parser = Parser(text)
    found = parser.expression()
    assert not parser.tokens, f"{text}: {parser.tokens} is left"
    return found


def source(path, changes=()):
    """Text of a shader with its includes, and with (old, new) `changes`."""
    text = shaders.source(path)
    for old, new in changes:
        assert old in text, f"{path} no longer has {old}"
        text = text.replace(old, new)
    return text


def macros(text):
    """Numbers that the text defines, by name."""
    return dict(re.findall(r"#define (\w+) +([\d.]+(?:e-?\d+)?)\s*$", text, re.MULTILINE))


def body(text, name):
    """Names of a function's parameters, and its statements."""
    head = re.search(rf"\b\w+ {name}\(([^)]*)\) {{", text)
    assert head, f"there is no function {name}"
    depth, end = 1, head.end()
    while depth:
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        end += 1
    names = [part.split()[-1] for part in head[1].split(",") if part.strip()]
    return names, [part.strip() for part in re.split(r";|\n\s*#[^\n]*", text[head.end() : end - 1]) if part.strip()]


def split(text):
    """Parts of a list at its commas, but not inside brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(letter, 0)
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


class Evaluator:
    """Evaluates functions of a shader's text.

    `numbers` gives the kind of number: number(text), binary(operator, a, b), unary(operator, a), and, as far as they
    are needed, call(name, arguments) and choose(condition, a, b). `known` holds functions that are not in the text,
    and uniforms. `numbers.precise` tells whether the operation belongs to a variable that is declared `precise`.
    """

    def __init__(self, text, numbers, **known):
        self.text = text
        self.numbers = numbers
        self.known = {name: numbers.number(value) for name, value in macros(text).items()} | known

    def call(self, name, *arguments):
        """The result of a function for some arguments."""
        names, statements = body(self.text, name)
        outside = self.numbers.precise
        scope = dict(zip(names, arguments, strict=True))
        for statement in statements:
            returns = re.match(r"return\s+(.*)", statement, re.DOTALL)
            declared = _DECLARED.match(statement)
            self.numbers.precise = bool(declared and declared[1])
            if returns:
                self.numbers.precise = outside
                return self.value(parse(returns[1]), scope)
            if statement.startswith("if ("):
                continue  # an early way out for a case that is easier
            for part in split(declared[3] if declared else statement):
                target, value = part.split("=", 1)
                operator = target.strip()[-1] if target.strip()[-1] in "+-*/|&" else ""
                target = target.strip().rstrip("+-*/|&").strip()
                value = parse(value)
                scope[target] = self.value(("binary", operator, ("name", target), value) if operator else value, scope)
        self.numbers.precise = outside
        return scope  # of a function without a result: its variables

    def value(self, tree, scope):
        kind, *parts = tree
        if kind == "number":
            return self.numbers.number(parts[0])
        if kind == "name":
            return scope[parts[0]] if parts[0] in scope else self.known[parts[0]]
        if kind == "field":
            held = self.value(parts[0], scope)
            if isinstance(held, dict):
                return held[parts[1]]
            found = [held["xyzw".index(letter)] for letter in parts[1]]
            return found if len(found) > 1 else found[0]
        if kind == "index":
            return self.value(parts[0], scope)[int(parts[1][1])]
        if kind == "call":
            return self.called(parts[0], [self.value(part, scope) for part in parts[1]])
        if kind == "choose":
            return self.numbers.choose(*(self.value(part, scope) for part in parts))
        if kind == "unary":
            return spread(lambda a: self.numbers.unary(parts[0], a), self.value(parts[1], scope))
        a, b = (self.value(part, scope) for part in parts[1:])
        return spread(lambda a, b: self.numbers.binary(parts[0], a, b), a, b)

    def called(self, name, arguments):
        if name in self.known:
            return self.known[name](*arguments)
        if match := re.fullmatch(r"[iub]?vec(\d)", name):
            flat = [part for a in arguments for part in (a if isinstance(a, list) else [a])]
            return flat * int(match[1]) if len(flat) == 1 else flat
        if name in ("int", "uint", "float"):
            return arguments[0]
        if name == "dot":
            sums = spread(lambda a, b: self.numbers.binary("*", a, b), *arguments)
            total = sums[0]
            for part in sums[1:]:
                total = self.numbers.binary("+", total, part)
            return total
        if re.search(rf"\b\w+ {name}\([^)]*\) {{", self.text):
            return self.call(name, *arguments)
        return spread(lambda *a: self.numbers.call(name, a), *arguments)


def spread(operation, *operands):
    """An operation on numbers, or on each part of vectors."""
    lengths = {len(operand) for operand in operands if isinstance(operand, list)}
    if not lengths:
        return operation(*operands)
    (length,) = lengths
    return [operation(*(o[i] if isinstance(o, list) else o for o in operands)) for i in range(length)]
